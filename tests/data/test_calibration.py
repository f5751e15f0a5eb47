import numpy as np
import pytest

from hwid_cli.data.signal_features import (
    find_onset,
    find_period,
    mean_over_period,
    whole_periods,
)
from hwid_cli.model.damaged_samples import find_damaged, replace_damaged


def with_lead_in(excitation, lead_in, *, offset=0.0, noise=0.0, seed=1):
    rng = np.random.default_rng(seed)
    values = offset + np.concatenate([np.zeros(lead_in), excitation])
    return values + noise * rng.standard_normal(values.size)


def ramp_step(n_ramp, n, amplitude=4.0):
    return amplitude * np.minimum(1.0, np.arange(1, n + 1) / max(n_ramp, 1))


def held_levels(n_levels, hold, seed):
    return np.repeat(np.random.default_rng(seed).uniform(-2, 2, n_levels), hold)


# Damaged samples


def test_a_single_damaged_sample_is_found_and_replaced():
    values = np.sin(0.05 * np.arange(500))
    damaged = values.copy()
    damaged[200] += 0.7

    found = find_damaged(damaged)

    assert found.tolist() == [200]
    # The cubic's error on this sine is (0.05)^4 / 4 of its amplitude.
    np.testing.assert_allclose(replace_damaged(damaged, found), values, atol=2e-6)


@pytest.mark.parametrize("rad_per_sample", [0.005, 0.11, 0.34, 0.5])
def test_damage_is_found_in_sines_of_any_frequency_and_nothing_else(rad_per_sample):
    rng = np.random.default_rng(3)
    values = 5.0 * np.sin(rad_per_sample * np.arange(3000))
    values += 0.004 * rng.standard_normal(values.size)
    assert find_damaged(values).size == 0
    values[[700, 1501, 2222]] += [4.0, -5.0, 6.0]

    assert find_damaged(values).tolist() == [700, 1501, 2222]


def test_damage_is_found_at_every_phase_of_a_fast_sine():
    values = 5.0 * np.sin(0.5 * np.arange(3000))
    for place in range(700, 713):
        damaged = values.copy()
        damaged[place] += 4.0

        assert find_damaged(damaged).tolist() == [place]


@pytest.mark.parametrize("n_ramp", [0, 1, 2, 3, 10, 100])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_edge_of_a_step_is_never_damage(n_ramp, noise):
    values = with_lead_in(ramp_step(n_ramp, 2000), 200, noise=noise)

    assert find_damaged(values, may_hold=False).size == 0


@pytest.mark.parametrize("width", [4, 10, 20])
@pytest.mark.parametrize("late", range(10))
def test_the_corner_of_a_ramp_that_was_averaged_is_not_damage(width, late):
    # Ten times as many samples as are kept: each one is the mean over up to two of these.
    fine = np.clip((np.arange(6000) - 2000 - late) / 25.0, 0.0, 1.0)
    means = np.convolve(fine, np.ones(width) / width, mode="same")
    for values in (means[::10], -means[::10], 3.0 * means[::-10]):
        assert find_damaged(values, may_hold=False).size == 0


def test_damage_beside_the_corner_of_a_ramp_is_found():
    values = np.clip((np.arange(600) - 200) / 2.5, 0.0, 1.0)
    for place, error in ((195, 0.05), (210, -0.05), (200, 1.0), (200, -0.5)):
        damaged = values.copy()
        damaged[place] += error
        assert find_damaged(damaged).tolist() == [place]


def test_held_random_levels_are_not_damage():
    for hold in (1, 2, 3, 5, 30):
        assert find_damaged(held_levels(2000 // hold, hold, seed=hold)).size == 0


@pytest.mark.parametrize("length", [2, 3, 4, 8])
def test_a_short_level_between_others_is_not_damage(length):
    rng = np.random.default_rng(6)
    levels = np.tile([-2.6, -1.7, -2.5, 2.4], 40) + 0.01 * rng.standard_normal(160)
    lengths = np.full(160, 25)
    lengths[1::4] = length
    assert find_damaged(np.repeat(levels, lengths)).size == 0


def test_a_binary_signal_that_may_switch_at_every_sample_is_not_damage():
    values = np.where(np.random.default_rng(2).random(3000) < 0.5, -1.0, 1.0)

    assert find_damaged(values, may_hold=False).size == 0


def test_normal_noise_after_a_long_quiet_start_is_not_damage():
    rng = np.random.default_rng(4)
    values = np.concatenate([np.zeros(5000), rng.standard_normal(2000)])

    assert find_damaged(values, may_hold=False).size == 0


def test_flicker_of_the_last_digit_is_not_damage():
    values = with_lead_in(ramp_step(100, 2000), 500)
    values[50:450:7] += 0.01

    assert find_damaged(values, may_hold=False).size == 0


def test_records_too_short_to_judge_hold_no_damage():
    assert find_damaged(np.array([0.0, 9.0, 0.0, 0.0])).size == 0


@pytest.mark.parametrize("may_hold", [True, False])
@pytest.mark.parametrize("errors", [(0.7, 0.4), (0.7, -0.9), (-3.0, -1.2)])
def test_two_damaged_samples_side_by_side_are_found_and_replaced(may_hold, errors):
    values = np.sin(0.05 * np.arange(500))
    for place in (2, 200, 231, 496):
        damaged = values.copy()
        damaged[place : place + 2] += errors

        found = find_damaged(damaged, may_hold=may_hold)

        assert found.tolist() == [place, place + 1]
        # The cubic over the wider gap errs by (0.05)^4 / 2 of the amplitude.
        repaired = replace_damaged(damaged, found)
        np.testing.assert_allclose(repaired, values, atol=5e-6)


def test_a_message_that_was_dropped_is_damage_in_an_output_and_a_level_in_an_input():
    values = 3.0 + np.sin(0.05 * np.arange(500))
    values[[200, 201]] = 0.0

    assert find_damaged(values, may_hold=False).tolist() == [200, 201]
    assert find_damaged(values, may_hold=True).size == 0
    levels = np.repeat(values[::10], 10)
    levels[[205, 206]] = 0.0
    assert find_damaged(levels, may_hold=False).size == 0


@pytest.mark.parametrize("rad_per_sample", [0.005, 0.11, 0.34, 0.5])
def test_single_and_paired_damage_in_sines_of_any_frequency(rad_per_sample):
    rng = np.random.default_rng(3)
    values = 5.0 * np.sin(rad_per_sample * np.arange(3000))
    values += 0.004 * rng.standard_normal(values.size)
    assert find_damaged(values, may_hold=False).size == 0
    values[[700, 701, 1501, 2222, 2223]] += [9.0, 4.0, -5.0, 7.0, -9.0]

    assert find_damaged(values).tolist() == [700, 701, 1501, 2222, 2223]


def test_three_damaged_samples_side_by_side_stay():
    values = np.sin(0.05 * np.arange(500))
    values[200:203] += (2.0, 3.0, 2.5)
    assert find_damaged(values, may_hold=False).size == 0


def test_noise_of_an_output_is_no_pair_of_damaged_samples():
    rng = np.random.default_rng(5)
    for made in (rng.standard_normal(50_000), rng.laplace(size=5000)):
        assert find_damaged(made, may_hold=False).size <= find_damaged(made).size
    # A lightly damped ringing after each of many steps.
    time = np.arange(400)
    ring = 1.0 - np.exp(-time / 60.0) * np.cos(0.6 * time)
    assert find_damaged(np.tile(ring, 5), may_hold=False).size == 0


# Onset


@pytest.mark.parametrize("lead_in", [20, 57, 400])
@pytest.mark.parametrize("offset", [-3.0, 0.0, 0.2])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
def test_the_onset_of_a_jump_is_exact(lead_in, offset, noise):
    values = with_lead_in(ramp_step(0, 1000), lead_in, offset=offset, noise=noise)

    assert find_onset(values, quiet_is_rest=True) == lead_in


@pytest.mark.parametrize("n_ramp", [100, 300])
def test_the_onset_of_a_ramp_is_late_by_its_rise_through_the_noise_only(n_ramp):
    values = with_lead_in(ramp_step(n_ramp, 1000), 250, offset=0.1, noise=0.004)

    onset = find_onset(values, quiet_is_rest=True)

    # 6 robust sigma of 0.004 in 4, and the robust sigma may be off by a third.
    assert 250 <= onset <= 250 + 0.01 * n_ramp


def test_a_signal_without_lead_in_starts_at_its_first_sample():
    n = np.arange(3000)
    for values in (
        np.sin(0.5 * n),
        np.sin(0.005 * n),
        np.cos(0.005 * n),
        ramp_step(300, 1000),
        np.random.default_rng(5).standard_normal(3000),
        held_levels(60, 50, seed=6),
    ):
        assert find_onset(values, quiet_is_rest=False) == 0


def test_a_lead_in_before_held_levels_is_found_by_its_length():
    levels = held_levels(60, 50, seed=6)

    assert find_onset(with_lead_in(levels, 200), quiet_is_rest=False) == 200


def test_a_signal_that_never_moves_has_no_onset():
    assert find_onset(np.full(500, 2.0), quiet_is_rest=True) is None
    noise = np.random.default_rng(7).standard_normal(500)
    assert find_onset(noise, quiet_is_rest=True) in (0, None)


def test_one_damaged_sample_in_the_lead_in_is_no_onset():
    values = with_lead_in(ramp_step(0, 1000), 300)
    values[100] = 9.0

    assert find_onset(values, quiet_is_rest=True) == 300


# Period


@pytest.mark.parametrize("period", [12.566, 18.48, 57.1, 1256.6])
@pytest.mark.parametrize("phase", [0.0, 1.0, 4.0])
def test_the_period_of_a_noisy_sine_is_found(period, phase):
    rng = np.random.default_rng(8)
    n = np.arange(7500)
    values = 0.3 + 2.0 * np.sin(2 * np.pi * n / period + phase)
    values += 0.004 * rng.standard_normal(n.size)

    # The two ends of k periods are each known to noise / slope; k >= 4 here.
    noise_in_time = 0.002 * period / (2 * np.pi)
    assert find_period(values) == pytest.approx(
        period, abs=4 * noise_in_time / 2 + 1e-6
    )


def test_one_and_a_half_periods_are_enough():
    values = np.sin(2 * np.pi * np.arange(150) / 100)

    # Half a period between an up and a down crossing, each interpolated linearly.
    assert find_period(values) == pytest.approx(100, abs=0.1)


def test_less_than_a_period_and_irregular_swings_have_none():
    assert find_period(np.sin(2 * np.pi * np.arange(60) / 100)) is None
    assert find_period(held_levels(60, 50, seed=9)) is None
    assert find_period(np.ones(100)) is None
    assert find_period(np.ones(2)) is None


def test_the_mean_over_a_period_is_the_offset():
    n = np.arange(400)
    values = 0.7 + np.sin(2 * np.pi * n / 50)
    assert mean_over_period(values, 50.0) == pytest.approx(0.7, abs=1e-14)

    # A fractional period: the chord of its last part is off by the square of a step.
    for period in (12.566, 50.4):
        values = 0.7 + np.sin(2 * np.pi * n / period + 1.0)
        error = (2 * np.pi / period) ** 2 / period
        assert mean_over_period(values, period) == pytest.approx(0.7, abs=error)


def test_whole_periods_stay_when_counted_again():
    for period in (12.566, 50.0, 57.11):
        kept = whole_periods(7500, period)

        assert 7500 - period < kept <= 7500
        assert whole_periods(kept, period) == kept
