import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.drive import excitation


def test_step_without_ramp_stands_at_its_level_from_the_first_sample():
    np.testing.assert_array_equal(excitation.step(3, 2.5), [2.5, 2.5, 2.5])


def test_ramp_starts_at_zero_and_reaches_its_level_after_the_ramp():
    rise = excitation.step(400, 6.0, ramp_samples=300)
    assert rise[0] == 0.0
    # One rounding in the quotient, one in the product.
    assert rise[100] == pytest.approx(2.0, rel=1e-15)
    np.testing.assert_array_equal(rise[300:], 6.0)


def test_sine_repeats_after_two_pi_over_its_frequency():
    wave = excitation.sine(200, 3.0, 2 * np.pi / 40)
    # The argument reaches 31 rad, whose rounding is 4e-15.
    np.testing.assert_allclose(wave[40:], wave[:-40], atol=3e-14)
    assert wave[0] == 0.0
    assert wave[10] == pytest.approx(3.0)


def test_sine_with_fade_in_grows_and_then_has_its_full_amplitude():
    faded = excitation.sine(300, 3.0, 0.2, fade_in_samples=100)
    full = excitation.sine(300, 3.0, 0.2)
    np.testing.assert_array_equal(faded[100:], full[100:])
    assert faded[50] == pytest.approx(0.5 * full[50])


def make_levels(seed: int, n: int = 2000, amplitude: float = 4.0) -> np.ndarray:
    return excitation.random_levels(
        n,
        amplitude,
        shortest_samples=20,
        longest_samples=80,
        rng=np.random.default_rng(seed),
    )


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 500))
def test_random_levels_start_at_zero_and_stay_within_their_amplitude(seed, n):
    levels = make_levels(seed, n)
    assert levels.size == n
    assert levels[0] == 0.0
    assert np.max(np.abs(levels)) <= 4.0


def test_random_levels_are_joined_by_lines_of_the_asked_length():
    levels = make_levels(3)
    corners = np.flatnonzero(np.abs(np.diff(levels, 2)) > 1e-12) + 1
    distances = np.diff(corners)
    assert distances.min() >= 20
    assert distances.max() <= 80


def test_random_levels_go_on_to_the_last_sample():
    for seed in range(50):
        # Two levels, so a corner, lie within any stretch of twice the longest distance.
        assert np.ptp(np.diff(make_levels(seed)[-160:])) > 0


def test_random_levels_use_the_whole_range():
    levels = make_levels(5, n=100_000)
    corners = np.flatnonzero(np.abs(np.diff(levels, 2)) > 1e-12) + 1
    # 2000 uniform levels: standard error of the mean 4 / sqrt(3 * 2000) = 0.05 A.
    assert abs(np.mean(levels[corners])) < 0.2
    assert np.ptp(levels[corners]) > 7.9


def test_random_levels_lie_mostly_below_the_frequency_of_their_shortest_distance():
    power = np.abs(np.fft.rfft(make_levels(7, n=50_000))) ** 2
    frequency = np.linspace(0, np.pi, power.size)
    # Straight lines between levels fall off with the fourth power of the frequency.
    assert power[frequency > np.pi / 20].sum() < 0.02 * power[1:].sum()
