"""Shape of an input: parts of steps, sines, sizes."""

import numpy as np
import pytest

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.segments import (
    amplitude,
    find_sine,
    harmonic_columns,
    parabolic_peak,
    step_parts,
)
from tests.diagnosis.diagnosed import SAMPLE_TIME_S, inputs


def signals_of(driven_by):
    return Signals(
        "a", "any", driven_by, driven_by, driven_by, driven_by, SAMPLE_TIME_S
    )


def named(name):
    return signals_of(inputs()[name])


def test_steps_and_only_steps_have_parts():
    for name, driven_by in inputs().items():
        found = step_parts(signals_of(driven_by), 0.1)

        assert (found is not None) == name.startswith("step"), name


def test_sines_and_only_sines_are_found():
    for name, driven_by in inputs().items():
        found = find_sine(signals_of(driven_by))

        if name.startswith("sine") and not name.endswith("_1"):
            assert found is not None, name
            hertz = float(name.split("_")[2])
            # A quarter of a line of the 1.35 s, at the lowest frequencies.
            assert found.frequency_Hz == pytest.approx(hertz, abs=0.2), name
        elif not name.startswith("sine"):
            assert found is None, name


def test_parts_of_a_step_cover_it_once():
    found = step_parts(named("step_5_0.05"), 0.1)

    assert np.all(sum(mask.astype(int) for mask in found.values()) == 1)
    # Ramps of 50 ms at 0.1 s and at 0.7 s, and 0.1 s of settling.
    assert list(np.flatnonzero(np.diff(found["rise"].astype(int)))) == pytest.approx(
        [100, 250], abs=5
    )
    assert list(np.flatnonzero(np.diff(found["fall"].astype(int)))) == pytest.approx(
        [700, 850], abs=5
    )
    assert found["hold"][500]
    assert found["rest"][50]
    assert found["rest"][1400]


def test_a_step_down_rises_away_from_where_it_starts():
    found = step_parts(signals_of(-inputs()["step_3_0.05"]), 0.0)

    assert found["rise"][120]
    assert found["fall"][720]


def test_steady_part_of_a_sine_is_whole_periods_at_the_end():
    found = find_sine(named("sine_5_7"))

    size = found.steady.stop - found.steady.start
    assert found.steady.stop == 1450
    assert size * SAMPLE_TIME_S * 7 == pytest.approx(4, abs=0.05)


def test_inputs_that_never_move_have_no_shape():
    still = signals_of(np.full(200, 2.0))

    assert amplitude(still) == 0
    assert step_parts(still, 0.1) is None
    assert find_sine(still) is None


def test_short_inputs_have_no_shape():
    short = signals_of(np.arange(6.0))

    assert step_parts(short, 0.1) is None
    assert find_sine(short) is None


def test_harmonic_columns_are_orthogonal_over_whole_periods():
    columns = harmonic_columns(200, 0.05, 3)

    assert columns.T @ columns == pytest.approx(
        np.diag([200.0] + [100.0] * 6), abs=1e-9
    )


def test_a_parabola_finds_the_peak_between_samples():
    # Exact for the exponential of a parabola.
    power = np.exp(-((np.arange(11) - 5.3) ** 2))

    assert parabolic_peak(power, 5) == pytest.approx(5.3, abs=1e-9)
    assert parabolic_peak(power, 0) == 0


def test_a_square_wave_is_no_sine():
    t = SAMPLE_TIME_S * np.arange(1450)

    assert find_sine(signals_of(np.sign(np.sin(2 * np.pi * 3.1 * t)))) is None
