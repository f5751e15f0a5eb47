import numpy as np
import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.selection import select_recordings

RECORDINGS = tuple(
    Recording(name, np.arange(3.0), np.arange(3.0), 1e-3)
    for name in ("step_01", "step_02", "sine_01")
)


def names(chosen):
    return [recording.name for recording in chosen]


def test_no_names_mean_all_that_are_not_held_out():
    assert names(select_recordings(RECORDINGS, None, key="identify.recordings")) == [
        "step_01",
        "step_02",
        "sine_01",
    ]
    chosen = select_recordings(RECORDINGS, None, key="k", held_out=("step_02",))
    assert names(chosen) == ["step_01", "sine_01"]


def test_names_choose_in_the_order_of_the_recordings():
    chosen = select_recordings(RECORDINGS, ("sine_01", "step_01"), key="k")

    assert names(chosen) == ["step_01", "sine_01"]


def test_an_unknown_name_is_refused_with_a_suggestion():
    with pytest.raises(
        ConfigError,
        match=r"identify\.recordings: no recording 'stpe_01'; did you mean 'step_01'\?",
    ):
        select_recordings(RECORDINGS, ("stpe_01",), key="identify.recordings")
    with pytest.raises(ConfigError, match=r"test\.recordings: no recording 'x'; expec"):
        select_recordings(RECORDINGS, None, key="identify.recordings", held_out=("x",))


def test_nothing_left_is_refused():
    everything = names(RECORDINGS)
    with pytest.raises(ConfigError, match="no recording is left"):
        select_recordings(RECORDINGS, None, key="k", held_out=everything)
