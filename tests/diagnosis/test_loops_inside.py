"""Simulations with a loop inside that has an integral part: a drive stands for them, too."""

import numpy as np
import pytest

from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    SimulatorRun,
)
from hwid_cli.records.recordings import Recording

STEP_S, N = 4e-3, 1500
TIME = STEP_S * np.arange(N)
INERTIA, WEIGHT = 0.6, 6.0
ABLE = Capabilities(run=True, parameters=True, force=True)


def references():
    """Steps, sines and ramps of a joint, [rad]."""
    knots = np.linspace(0.0, TIME[-1], 9)
    rng = np.random.default_rng(3)
    return [
        0.9 * (TIME > 0.6) - 1.4 * (TIME > 3.3),
        0.9 * np.sin(2 * np.pi * TIME),
        0.8 * np.sin(2 * np.pi * (0.2 + 0.25 * TIME) * TIME),
        np.interp(TIME, knots, np.r_[0.0, rng.uniform(-0.9, 0.9, 8)]),
        np.repeat(np.r_[0.0, rng.uniform(-0.9, 0.9, 5)], N // 6),
        0.35 * np.sin(2 * np.pi * 1.5 * TIME),
    ]


def joint(reference, force, damping, gain, weight):
    """An arm in its PID loop, which has settled against the weight before the start, [rad]."""
    angle, speed, summed = 0.0, 0.0, weight / gain
    found, parts = np.empty(N), 4
    step = STEP_S / parts
    for k in range(N):
        found[k] = angle
        after = min(k + 1, N - 1)
        for part in range(parts):
            share = part / parts
            wanted = reference[k] + share * (reference[after] - reference[k])
            push = force[k] + share * (force[after] - force[k])
            error = wanted - angle
            summed += step * 60.0 * error
            torque = gain * (40.0 * error + summed - 4.0 * speed)
            load = weight * np.cos(angle) + damping * speed
            speed += step * (torque + push - load) / INERTIA
            angle += step * speed
    return found


def without_weight(request):
    force = request.force if request.force.size else np.zeros(N)
    values = request.parameters
    angle = joint(request.input, force, values["b"], values["kt"], 0.0)
    return SimulatorRun(angle, np.zeros(0))


def run_each(tasks, *, keep):
    return [one.function(*one.arguments) for one in tasks]


@pytest.mark.thorough
def test_the_weight_that_a_loop_has_settled_against_is_named():
    rng = np.random.default_rng(5)
    recordings = []
    for n, reference in enumerate(references()):
        angle = joint(reference, np.zeros(N), 2.6, 0.9, WEIGHT)
        angle += 2e-3 * rng.standard_normal(N)
        one = Recording(f"r{n}", reference, angle, STEP_S, output_unit="rad")
        recordings.append(one)
    free = {"b": FreeParameter(2.0, (0.2, 20.0)), "kt": FreeParameter(1.0, (0.3, 3.0))}
    values = {name: one.value for name, one in free.items()}
    simulator = Simulator(ABLE, without_weight, {}, free, values)
    asked = ("gravity", "quadratic_stiffness", "one_sided_stop", "coulomb_friction")
    options = DiagnoseOptions(effects=asked)
    told = diagnose_foreign(recordings, simulator, options, run_each, lambda *_: None)
    assert told.verdict == "named"
    assert [one.id for one in told.effects] == ["gravity"]
    assert told.complete
    assert told.confirmed == "simulation"
    assert told.units.force == "N m"
    torque = told.effects[0].parameters[0]
    assert torque.value == pytest.approx(WEIGHT, rel=0.02)
