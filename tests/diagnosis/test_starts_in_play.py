"""Play that recordings start anywhere in: machines by equations of their own."""

import numpy as np
import pytest

from hwid_cli import Recording, diagnose
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions

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
