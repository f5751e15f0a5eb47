"""Starts that the last recording has left: machines by equations of their own."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli import Recording, diagnose
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.stages.diagnose import extended_options

STEP_S, FINE, N, NOISE_M = 1e-3, 40, 1500, 1e-5
GAP_M, MOTOR_KG, LOAD_KG = 1e-3, 0.8, 1.6
SIMULATION = SimulationOptions(
    mass_kg=MOTOR_KG + LOAD_KG,
    damping_N_s_per_m=17.0,
    stiffness_N_per_m=0.0,
    force_constant_N_per_A=18.0,
)
OPTIONS = DiagnoseOptions(
    effects=("gear_backlash", "coulomb_friction", "input_delay"),
    laws=False,
    max_effects=1,
)


def commands():
    """Jogs to and fro, and sines of several frequencies, after a rest."""
    time_s = STEP_S * np.arange(N)
    moving = time_s > 0.1
    for number in range(4):
        turns = np.sin(2 * np.pi * (1.1 + 0.6 * number) * (time_s - 0.1))
        yield f"jog_{number}", (1.0 - 0.15 * number) * np.sign(turns) * moving
        sine = np.sin(2 * np.pi * (1.4 + 0.7 * number) * (time_s - 0.1))
        yield f"sine_{number}", (0.6 + 0.2 * number) * sine * moving


def through_teeth(command, start_m):
    """Load of a motor behind teeth that start somewhere in the gap, explicit Euler."""
    motor, motor_speed, load, load_speed = start_m, 0.0, 0.0, 0.0
    step, ways = STEP_S / FINE, []
    for now, later in zip(command, np.append(command[1:], command[-1]), strict=True):
        ways.append(load)
        for part in range(FINE):
            into = abs(motor - load) - GAP_M
            side, push = np.sign(motor - load), 0.0
            if into > 0:
                push = 3e5 * into + 250.0 * side * (motor_speed - load_speed)
            teeth = side * max(push, 0.0)
            driving = 20.0 * (now + (later - now) * part / FINE)
            motor_speed += step * (driving - 6.0 * motor_speed - teeth) / MOTOR_KG
            load_speed += step * (teeth - 14.0 * load_speed) / LOAD_KG
            motor, load = motor + step * motor_speed, load + step * load_speed
    return np.array(ways)


@pytest.mark.thorough
def test_gear_play_is_named_wherever_the_last_motion_left_the_teeth():
    rng = np.random.default_rng(11)
    recordings = []
    for name, command in commands():
        start_m = GAP_M * rng.choice([-0.98, 0.98, rng.uniform(-0.9, 0.9)])
        output = through_teeth(command, start_m) + NOISE_M * rng.standard_normal(N)
        recordings.append(Recording(name, command, output, STEP_S))
    found = diagnose(recordings, SIMULATION, OPTIONS)
    assert found.verdict == "named"
    assert [one.id for one in found.effects] == ["gear_backlash"]
    assert found.after.ratio_to_noise < 1.1
    values = {one.name: one.value for one in found.effects[0].parameters}
    assert values["half_gap_m"] == pytest.approx(GAP_M, rel=0.02)
    assert values["start_share"] == 0.0
    # What was found says that each recording starts elsewhere: nothing is missing then.
    again = diagnose(recordings, extended_options(found, SIMULATION), OPTIONS)
    assert again.verdict in ("none", "parameters")


def heated(command, warmth):
    """A mass on a spring whose motor warms up and cools down, and its warmth at the end."""
    way, speed, ways = 0.0, 0.0, []
    step = STEP_S / FINE
    for now, later in zip(command, np.append(command[1:], command[-1]), strict=True):
        ways.append(way)
        for part in range(FINE):
            current = now + (later - now) * (part + 0.5) / FINE
            warmth += step * ((current / 1.7) ** 2 - warmth) / 6.0
            push = 22.0 * (1.0 - 0.25 * warmth) * current
            speed += step * (push - 9.0 * speed - 700.0 * way) / 1.2
            way += step * speed
    return np.array(ways), warmth


@pytest.mark.thorough
def test_a_motor_that_is_warm_from_the_recording_before_is_told():
    rng, warmth, recordings = np.random.default_rng(4), 0.0, []
    for name, command in commands():
        ways, warmth = heated(2.5 * command, warmth)
        output = ways + NOISE_M * rng.standard_normal(N)
        recordings.append(Recording(name, 2.5 * command, output, STEP_S))
    given = SimulationOptions(
        mass_kg=1.2,
        damping_N_s_per_m=10.0,
        stiffness_N_per_m=750.0,
        force_constant_N_per_A=20.0,
        reference_current_A=1.7,
    )
    effects = ("thermal_gain_loss", "parameter_change", "supply_sag")
    found = diagnose(recordings, given, replace(OPTIONS, effects=effects))
    assert [one.id for one in found.effects] == ["thermal_gain_loss"]
    values = {one.name: one.value for one in found.effects[0].parameters}
    assert values["time_constant_s"] == pytest.approx(6.0, rel=0.1)
    assert values["loss_at_reference"] == pytest.approx(0.25, rel=0.1)
