"""Controllers whose sum holds a weight when a recording begins: a machine by Euler's rule."""

import numpy as np
import pytest

from hwid_cli import Recording, diagnose
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions

STEP_S, FINE, N, NOISE_A, NOISE_M = 1e-3, 40, 1500, 5e-3, 1e-5
LOOP = Controller(
    proportional_gain=60.0, integral_gain=300.0, derivative_gain=1.5, limit=20.0
)
WEIGHT_N, MASS_KG, DAMPING, CONSTANT = 90.0, 12.0, 80.0, 50.0
SIMULATION = SimulationOptions(
    mass_kg=MASS_KG,
    damping_N_s_per_m=95.0,
    force_constant_N_per_A=44.0,
    controller=LOOP,
    effects={"constant_load": {"force_N": -80.0}},
)
OPTIONS = DiagnoseOptions(laws=False, max_effects=1)


def commands_and_ways(reference, preset):
    """PID loop around a mass with a weight, its sum preset or empty."""
    total, last, x, v = preset / LOOP.integral_gain, None, reference[0], 0.0
    sent, ways = [], []
    for wanted in reference:
        error = wanted - x
        total += STEP_S * error
        rate = 0.0 if last is None else (error - last) / STEP_S
        last = error
        command = LOOP.proportional_gain * error + LOOP.integral_gain * total
        command += LOOP.derivative_gain * rate
        sent.append(command)
        ways.append(x)
        for _ in range(FINE):
            force = CONSTANT * command - WEIGHT_N - DAMPING * v
            v += STEP_S / FINE * force / MASS_KG
            x += STEP_S / FINE * v
    return np.array(sent), np.array(ways)


def moves(*, preset):
    """Moves from several places, the loop closed long before."""
    rng, time_s, found = np.random.default_rng(7), STEP_S * np.arange(N), []
    for number in range(6):
        turns = 2 * np.pi * (0.8 + 0.5 * number) * np.maximum(time_s - 0.1, 0.0)
        reference = 0.1 * number + 0.03 * (1.0 - np.cos(turns))
        command, way = commands_and_ways(reference, preset)
        command = command + NOISE_A * rng.standard_normal(N)
        way = way + NOISE_M * rng.standard_normal(N)
        found.append(
            Recording(
                f"move_{number}",
                command,
                way,
                STEP_S,
                kind="other",
                reference=reference,
            )
        )
    return found


def test_a_command_at_the_start_says_that_the_loop_holds_a_weight():
    for preset, holds in ((WEIGHT_N / CONSTANT, True), (0.0, False)):
        problem = prepare(moves(preset=preset), SIMULATION, OPTIONS, ())
        assert problem.loop_holds is holds


@pytest.mark.parametrize("preset", [WEIGHT_N / CONSTANT, 0.0])
def test_a_loop_that_holds_a_weight_lacks_nothing(preset):
    found = diagnose(moves(preset=preset), SIMULATION, OPTIONS)
    assert found.verdict == "parameters"
    assert found.after.ratio_to_noise < 1.05
    base = {one.name: one.after for one in found.base}
    assert base["force_constant_N_per_A"] == pytest.approx(50.0, rel=0.01)
