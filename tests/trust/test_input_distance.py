import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hwid_cli.trust.input_distance import (
    N_OCTAVES,
    input_distance,
    input_distances,
    input_signature,
)

INPUTS = hnp.arrays(
    np.float64, st.integers(1, 200), elements=st.floats(-1e3, 1e3, width=32)
)


def sine(cycles_per_sample, amplitude=1.0, n=4096):
    return amplitude * np.sin(2 * np.pi * cycles_per_sample * np.arange(n))


def distance(one, other):
    return input_distance(input_signature(one), input_signature(other))


@given(INPUTS)
def test_the_norm_of_a_signature_is_the_root_mean_square_of_the_input(values):
    # Parseval's theorem; rounding of a sum of 200 squares.
    np.testing.assert_allclose(
        np.linalg.norm(input_signature(values)),
        np.sqrt(np.mean(values**2)),
        rtol=1e-9,
        atol=1e-9,
    )


@pytest.mark.parametrize("octave", range(N_OCTAVES))
def test_a_sine_lies_in_the_band_of_its_octave(octave):
    # Half an octave of Nyquist's frequency, down to 4 whole periods in the record; the
    # top one is Nyquist's frequency itself, all of it in cosine phase.
    cycles = 0.5 / 2**octave
    wave = np.cos(2 * np.pi * cycles * np.arange(4096))
    bands = input_signature(wave)[1:]

    # RMS of a cosine; at Nyquist's frequency it is 1 and -1 in turn.
    assert bands[octave] == pytest.approx(1.0 if octave == 0 else np.sqrt(0.5))
    # Whole periods leak nothing but rounding.
    assert np.delete(bands, octave).max() < 1e-9


def test_slower_than_the_slowest_octave_is_one_band():
    n = 2**14
    slow, slower = sine(2 / n, n=n), sine(1 / n, n=n)

    # Rounding of the transform; both lie wholly in the last band.
    assert distance(slow, slower) < 1e-9


@given(INPUTS, INPUTS)
def test_the_distance_is_symmetric_and_has_its_bounds(one, other):
    there, back = distance(one, other), distance(other, one)

    assert there == back
    # Rounding beyond the largest value, 2.
    assert 0.0 <= there <= 2.0 + 1e-12


@given(INPUTS)
def test_equal_inputs_have_no_distance(values):
    assert distance(values, values.copy()) == 0.0


def test_amplitude_and_sign_of_a_step_count():
    step = np.ones(100)

    # Rounding only.
    assert distance(step, 0.5 * step) == pytest.approx(0.5, abs=1e-12)
    assert distance(step, -step) == pytest.approx(2.0, abs=1e-12)
    assert distance(step, 0.0 * step) == 1.0


def test_inputs_without_anything_in_common_are_about_one_apart():
    assert distance(sine(0.25), sine(0.25 / 64)) == pytest.approx(np.sqrt(2), rel=1e-3)
    assert distance(sine(0.25), np.full(4096, 0.1)) == pytest.approx(1.0, abs=0.02)


def test_the_length_of_a_record_hardly_matters():
    # 300 periods and a half against 90 and a half: of the power, the half period leaks
    # about 1 / (pi^2 d) more than d lines away, here a third of 90 lines.
    assert distance(sine(0.1, n=3005), sine(0.1, n=905)) < np.sqrt(1 / (np.pi**2 * 30))
    assert distance(np.ones(100), np.ones(777)) < 1e-12


@pytest.mark.parametrize("edge", [0.25, 0.25 / np.sqrt(2), 0.125, 0.1])
def test_no_frequency_falls_off_the_edge_of_a_band(edge):
    # One percent in frequency is a small step in the signature wherever it lies: the
    # amplitude in a neighbouring band grows like the root of the share, sqrt(0.015).
    assert distance(sine(edge * 0.995), sine(edge * 1.005)) < 0.15


def test_more_distant_frequencies_are_farther_apart():
    distances = [distance(sine(0.1), sine(0.1 / ratio)) for ratio in (1.1, 1.3, 1.6, 2)]

    assert distances == sorted(distances)


def test_the_table_holds_every_pair():
    inputs = [np.ones(10), np.zeros(5), -np.ones(7)]

    np.testing.assert_array_equal(
        input_distances(inputs), [[0, 1, 2], [1, 0, 1], [2, 1, 0]]
    )
    assert input_distances([]).shape == (0, 0)


@pytest.mark.parametrize("values", [np.zeros(0), np.zeros((2, 2))])
def test_a_signature_needs_a_row_of_samples(values):
    with pytest.raises(ValueError, match="1-D array with samples"):
        input_signature(values)
