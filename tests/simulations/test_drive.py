"""A drive's simulation beside recordings, with the parameters as given."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.simulations.drive import simulate_recordings
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    STEP_S,
    recordings,
    simulation,
)
from tests.stages.diagnosed_drive import FRICTION


def simulated(given, model=None, **options):
    return simulate_recordings(given, model or simulation(), DiagnoseOptions(**options))


def test_each_recording_stands_beside_its_simulation():
    given = recordings()
    found = simulated(given)
    assert [one.name for one in found] == [one.name for one in given]
    for one, recording in zip(found, given, strict=True):
        np.testing.assert_array_equal(one.input, recording.input)
        np.testing.assert_array_equal(one.measured, recording.output)
        np.testing.assert_allclose(one.time_s, STEP_S * np.arange(400))
        motion = simulate_drive(recording.input, DRIVE, sample_time_s=STEP_S)
        np.testing.assert_array_equal(one.simulated, motion.output)
        # 400 samples: 3.5 %, four times.
        assert one.rms == pytest.approx(NOISE, rel=0.14)


def test_parameters_are_taken_as_given():
    right, wrong = (
        simulated(recordings(), simulation(stiffness_N_per_m=k))[1].rms
        for k in (1184.0, 1250.0)
    )
    assert wrong > 20 * right


def test_effects_of_the_configuration_act():
    found = simulated(recordings(FRICTION), simulation(effects=FRICTION))
    assert all(one.rms == pytest.approx(NOISE, rel=0.14) for one in found)


def test_skipped_samples_do_not_count():
    spoilt = [
        replace(one, output=np.r_[one.output[:50] + 1.0, one.output[50:]])
        for one in recordings()
    ]
    assert simulated(spoilt)[0].rms > 0.1
    assert simulated(spoilt, skip_samples=50)[0].rms < 2 * NOISE


@pytest.mark.parametrize("rule", ["rest", "estimated"])
def test_a_start_in_motion_is_found_from_the_recording(rule):
    cut = [
        replace(one, input=one.input[60:], output=one.output[60:])
        for one in recordings()[5:]
    ]
    found = simulated(cut, initial_state=rule)
    assert max(one.rms for one in found) < 1.2 * NOISE


def test_under_a_controller_the_command_is_simulated():
    controller = Controller(30.0, 40.0)
    free = replace(DRIVE, stiffness_N_per_m=0.0, controller=controller)
    (first,) = recordings()[:1]
    # A command is free of noise: a drive rests under it exactly until it steps.
    command = np.where(np.arange(first.input.size) < 40, 0.0, 1e-3)
    motion = simulate_drive(command, free, sample_time_s=STEP_S)
    led = replace(first, input=motion.command, output=motion.output, reference=command)
    (one,) = simulated([led], simulation(stiffness_N_per_m=0.0, controller=controller))
    np.testing.assert_array_equal(one.input, led.reference)
    np.testing.assert_array_equal(one.measured, led.input)
    # A free axis starts where the output rested, which rounds once.
    np.testing.assert_allclose(one.simulated, led.input, atol=1e-9)


def test_a_simulation_that_runs_away_is_nan():
    away = simulation(effects={"cubic_stiffness": {"stiffness_N_per_m3": -1e9}})
    found = simulated(recordings()[1:2], away)
    assert np.isnan(found[0].simulated[-1])
    assert np.isnan(found[0].rms)
