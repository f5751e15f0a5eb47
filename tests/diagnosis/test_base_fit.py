"""The base, fitted again: what measuring alone explains."""

import pytest

from hwid_cli.diagnosis import base_fit
from hwid_cli.records.diagnosis import NoiseFloor
from tests.diagnosis.small_drive import NOISE, problem, recordings, white


@pytest.mark.parametrize(("times", "kept"), [(1.5, 1.5), (5.0, 1.0)])
def test_noise_that_a_fit_leaves_a_fifth_of_is_read_from_the_motion(
    monkeypatch, times, kept
):
    # What settles before the input moves, such as a load when its brake opens, is
    # motion: the drive follows it.
    of_rest = NoiseFloor(times * NOISE, "rest", 0.0, True, (1.0,), "")
    monkeypatch.setattr(
        base_fit, "noise_floor", lambda _, rests=True: of_rest if rests else white()
    )
    found = base_fit.fitted_base(problem(recordings()))
    assert found.noise.rms == pytest.approx(kept * NOISE)
