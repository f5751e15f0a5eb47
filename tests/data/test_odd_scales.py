"""Files of another unit among the others."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.data.odd_scales import odd_scales
from hwid_cli.records.recordings import RawRecording

RNG = np.random.default_rng(3)


def recordings(*gains):
    """Noise of several sizes, each with what a sensor of a gain reads."""
    found = []
    for number, gain in enumerate(gains):
        u = (1 + number) * RNG.standard_normal(300)
        found.append(RawRecording(f"run_{number}", u, gain * u + 5.0, 1e-3))
    return found


@pytest.mark.parametrize(
    ("odd", "said"), [(1e3, "1000 times as large"), (1e-3, "1000 times as small")]
)
def test_a_file_in_another_unit_is_named(odd, said):
    found = odd_scales(recordings(1.0, 1.0, odd, 1.0))
    assert list(found) == ["run_2"]
    assert said in found["run_2"]


def test_what_a_drive_itself_may_do_is_not():
    """Slow inputs reach far, fast ones do not."""
    assert odd_scales(recordings(1.0, 0.1, 8.0, 60.0)) == {}


def test_of_two_files_nobody_can_tell_which_is_odd():
    assert odd_scales(recordings(1.0, 1e3)) == {}


def test_gaps_and_signals_that_stand_still_are_no_matter():
    given = recordings(1.0, 1.0, 1e3, 1.0)
    gap = np.where(np.arange(300) < 20, np.nan, given[0].output)
    given[0] = replace(given[0], output=gap)
    given[1] = replace(given[1], input=np.zeros(300))
    assert list(odd_scales(given)) == ["run_2"]
