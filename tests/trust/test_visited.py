import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.model.input_range import SAME_LEVEL, outside_share
from hwid_cli.trust.visited import (
    N_BANDS,
    band_amplitudes,
    inside,
    visited_by,
    visited_plane,
)

N = 2000


def sine(size, period, n=N):
    return size * np.sin(2 * np.pi * np.arange(n) / period)


def seen(values):
    return visited_by([values], [values])


def test_what_a_recording_visited_is_inside():
    values = sine(1.0, 100) + 0.3 * sine(1.0, 17)

    assert inside(seen(values), values, values).all.all()


def test_larger_values_are_outside_by_value():
    where = inside(seen(sine(1.0, 100)), sine(2.0, 100), sine(0.5, 100))

    # Beyond one cell (a sixteenth) above the largest value: two thirds of the time.
    expected = np.abs(sine(2.0, 100)) > 1.0 + 2.0 / 32
    assert np.array_equal(~where.amplitude, expected)


@pytest.mark.parametrize("beyond", [0.0, 0.05, 0.07])
def test_a_sentence_on_the_range_and_the_trust_agree(beyond):
    # Both judge a level that a fit has not quite seen, of a range that is 2 wide.
    signal = np.full(N, 1.0 + beyond)
    where = inside(seen(sine(1.0, 100)), signal, sine(0.5, 100))
    share, *_ = outside_share(signal, (-1.0, 1.0), same=SAME_LEVEL)
    assert share == 1.0 - where.amplitude.mean() == float(beyond > 2.0 / 32)


def test_the_same_values_faster_are_outside_by_rate_and_frequency():
    where = inside(seen(sine(1.0, 200)), sine(1.0, 25), sine(1.0, 200))

    assert where.amplitude.all()
    # Near its turning points a fast sine is as slow as a slow one in its middle.
    assert where.rate.mean() < 0.5
    assert not where.frequency.any()


def test_a_slower_smaller_input_is_inside_by_rate():
    where = inside(seen(sine(1.0, 50)), sine(0.5, 100), sine(0.5, 100))

    assert where.rate.mean() > 0.95


def test_a_gap_between_two_levels_is_outside():
    levels = np.repeat([0.0, 1.0], 100)
    plane = visited_plane([levels])

    where = inside(
        visited_by([levels], [levels]), np.array([0.0, 0.5, 1.0]), np.zeros(3)
    )

    assert where.amplitude.tolist() == [True, False, True]
    assert np.isnan(plane.lowest_rate[1:-1]).all()


def test_octaves_hold_a_sine_where_its_period_is():
    # A mean over half a period passes most of it, one over two periods nothing.
    strongest = [
        int(np.argmax(band_amplitudes(sine(1.0, period)).mean(axis=1)))
        for period in (4, 16, 64)
    ]

    assert strongest == sorted(strongest)
    assert len(set(strongest)) == 3


@given(st.integers(0, 2**31), st.floats(0.1, 10.0))
def test_octaves_grow_with_the_input_and_ignore_its_constant(seed, factor):
    values = np.random.default_rng(seed).standard_normal(300)
    once, larger = band_amplitudes(values), band_amplitudes(factor * values + 3.0)

    assert once.shape == (N_BANDS, 300)
    # Sums of a few hundred numbers of size one, and a square root near zero.
    assert np.allclose(larger, factor * once, rtol=1e-6, atol=1e-6)


def test_constant_recordings_have_a_plane_too():
    assert visited_plane([np.ones(5)]).edges[0] < 1.0


@pytest.mark.parametrize("n", [1, 2, 3])
def test_short_inputs_are_told_too(n):
    values = np.arange(n, dtype=float)

    assert inside(seen(values), values, values).all.all()
