"""Where signals rest; a noisy first sample of the input moves no drive that does."""

import numpy as np
import pytest

from hwid_cli.diagnosis.problem import Signals, prepare
from hwid_cli.diagnosis.rests import rest_length, with_level_of_rest
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording

N, STEP, NOISE = 2000, 1e-3, 0.01


def noise_of(seed):
    return NOISE * np.random.default_rng(seed).normal(size=N)


def step_after(rest, height=1.0):
    return np.where(np.arange(N) < rest, 0.2, 0.2 + height)


def test_the_rest_ends_where_the_input_has_moved():
    assert rest_length(np.array([2.0, 2.0, 2.0, 3.0, 2.0])) == 3


def test_a_change_below_a_thousandth_of_the_input_is_rest():
    assert rest_length(np.array([0.0, 0.0009, 0.0, 1.0])) == 3
    assert rest_length(np.array([0.0, 0.0011, 0.0, 1.0])) == 1


def test_a_constant_input_rests_all_the_time():
    assert rest_length(np.full(7, 2.0)) == 7


def test_the_level_of_a_rest_is_its_mean():
    errors = [
        with_level_of_rest(step_after(400) + noise_of(seed))[0] - 0.2
        for seed in range(400)
    ]
    # Of 320 samples; one in twenty ends sooner, because halves differ by chance.
    assert np.median(np.abs(errors)) < NOISE / 15
    assert np.quantile(np.abs(errors), 0.9) < NOISE / 4


def test_only_the_first_sample_changes_and_none_without_noise():
    noisy = step_after(400) + noise_of(1)
    assert np.array_equal(with_level_of_rest(noisy)[1:], noisy[1:])
    for clean in (step_after(400), np.sin(np.arange(N) / 50.0), np.arange(N) / N):
        assert np.array_equal(with_level_of_rest(clean), clean)


@pytest.mark.parametrize("slope", [1e-5, 1e-4, 1e-3, 1e-2])
def test_a_slow_rise_is_met_better_than_by_its_first_sample(slope):
    errors = [
        with_level_of_rest(slope * np.arange(N) + noise_of(seed))[0]
        for seed in range(60)
    ]
    assert np.sqrt(np.mean(np.square(errors))) < 1.02 * NOISE


def resting_at(output, input_A=None):
    command = np.full(N, 2.0) if input_A is None else input_A
    signals = Signals("r", "step", command, output, command, output, STEP)
    return signals.rest_position_m


def test_a_free_axis_under_an_input_that_is_there_at_once_rests_at_its_first_samples():
    way = 0.3 + 4.0 * (STEP * np.arange(N)) ** 2
    errors = [
        resting_at(way + 1e-4 * noise_of(seed) / NOISE) - 0.3 for seed in range(9)
    ]
    assert np.max(np.abs(errors)) < 4e-4


def test_an_axis_that_rests_does_so_at_the_mean_of_its_rest():
    way, command = 0.3 + 0.0 * np.arange(N), step_after(N // 2)
    errors = [resting_at(way + noise_of(seed), command) - 0.3 for seed in range(200)]
    assert np.median(np.abs(errors)) < NOISE / 15


def test_friction_keeps_no_displacement_that_is_noise():
    hysteresis = {"hysteresis": {"force_N": 2.0, "yield_m": 1e-4}}
    drive = Drive(1.0, 40.0, 5000.0, 10.0, effects=hysteresis)
    measured = step_after(1500, 0.0) + noise_of(3)
    measured[0] = 0.2 + 3 * NOISE
    true = 0.2 * 10.0 / 5000.0

    def error(input_A):
        found = simulate_drive(input_A, drive, sample_time_s=STEP).output
        return abs(found[-1] - true)

    assert error(with_level_of_rest(measured)) < error(measured) / 4


def test_a_diagnosis_starts_with_the_level_of_the_rest():
    measured = step_after(400) + noise_of(5)
    recording = Recording("a", measured, np.cumsum(measured), STEP)
    simulation = SimulationOptions(
        mass_kg=1.0, damping_N_s_per_m=2.0, force_constant_N_per_A=3.0
    )
    (of,) = prepare([recording], simulation, DiagnoseOptions(), ()).signals

    assert abs(of.driven_by[0] - 0.2) < NOISE / 5
    np.testing.assert_array_equal(of.driven_by[1:], measured[1:])
    np.testing.assert_array_equal(of.input, measured)
