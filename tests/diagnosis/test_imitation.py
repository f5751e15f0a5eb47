"""A free axis whose base imitates what holds it in place: an arm under gravity."""

from itertools import pairwise

import numpy as np
import pytest

from hwid_cli import DiagnoseOptions, Recording, SimulationOptions
from hwid_cli.diagnosis.diagnose import diagnose

STEP_S, NOISE = 5e-3, 1e-3
INERTIA, DAMPING, CONSTANT, WEIGHT = 0.14, 0.17, 0.95, 1.8
# Angle [rad], stiffness [N m/rad], damping [N m s/rad].
BUFFER = (0.7, 75.0, 0.12)


def against_buffer(angle, speed):
    """Of a spring with a dashpot beside it, [N m]; never pulling."""
    edge, stiffness, damping = BUFFER
    pushed = stiffness * (angle - edge) + damping * speed
    return -max(pushed, 0.0) if angle > edge else 0.0


def arm(current, buffer=lambda angle, speed: 0.0):
    """Angle of an arm that hangs, by Runge-Kutta steps of a fifth of a sample."""
    h, state = STEP_S / 5, np.zeros(2)

    def rate(z, input_):
        force = CONSTANT * input_ - DAMPING * z[1] - WEIGHT * np.sin(z[0])
        return np.array([z[1], (force + buffer(*z)) / INERTIA])

    angles = [0.0]
    for first, last in pairwise(current):
        for n in range(5):
            a, b, c = (first + (last - first) * (n + s) / 5 for s in (0.0, 0.5, 1.0))
            k1 = rate(state, a)
            k2 = rate(state + 0.5 * h * k1, b)
            k3 = rate(state + 0.5 * h * k2, b)
            k4 = rate(state + h * k3, c)
            state = state + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        angles.append(state[0])
    return np.array(angles)


def recordings(*buffer):
    rng = np.random.default_rng(5)
    found = []
    for number, size in enumerate((1.6, -1.0, 2.2, 0.7, -1.9, 1.3), 1):
        current = np.zeros(700)
        current[40:] = size
        if number % 2:
            current[40:] *= np.repeat(rng.uniform(-1.0, 1.0, 11), 60)
        angle = arm(current, *buffer) + NOISE * rng.standard_normal(current.size)
        found.append(Recording(f"step_{number}", current, angle, STEP_S, kind="step"))
    return found


def run_tasks(tasks, *, keep):
    return [one.function(*one.arguments) for one in tasks]


GIVEN = SimulationOptions(
    mass_kg=INERTIA,
    damping_N_s_per_m=1.25 * DAMPING,
    stiffness_N_per_m=0.0,
    force_constant_N_per_A=1.2 * CONSTANT,
)


@pytest.fixture(scope="module")
def found():
    """The diagnosis, and what it did in turn."""
    options = DiagnoseOptions(
        effects=("gravity", "coulomb_friction", "quadratic_drag"),
        max_effects=2,
        laws="never",
    )
    done = []
    diagnosis = diagnose(
        recordings(), GIVEN, options, run_tasks, lambda name, _: done.append(name)
    )
    return diagnosis, done


@pytest.mark.thorough
def test_gravity_is_found_where_the_base_keeps_still_by_damping_alone(found):
    (effect,) = found[0].effects
    of = {one.name: one for one in effect.parameters}

    assert (found[0].verdict, effect.id, found[0].complete) == (
        "named",
        "gravity",
        True,
    )
    # A thousandth of the angle is noise.
    assert of["torque_N_m"].value == pytest.approx(WEIGHT, rel=0.01)


@pytest.mark.thorough
def test_what_pieces_lead_to_is_not_looked_for_on_whole_recordings(found):
    # From the overdamped base of whole recordings this took twenty times as long.
    done = found[1]

    assert done[done.index("sets that pieces have led to") :] == [
        "sets that pieces have led to",
        # Of the best of them alone.
        "the command held",
        "verdict",
        "the other command",
    ]


@pytest.mark.thorough
def test_a_damped_buffer_of_an_arm_under_gravity_has_its_damper():
    # In pieces the plain one is nearly all; on whole recordings its bounces drift away.
    options = DiagnoseOptions(
        effects=("gravity", "one_sided_stop", "one_sided_stop:dashpot"),
        max_effects=2,
        laws="never",
    )
    diagnosis = diagnose(
        recordings(against_buffer), GIVEN, options, run_tasks, lambda *_: None
    )
    found = {one.id: one.parameters for one in diagnosis.effects}

    assert (diagnosis.verdict, diagnosis.complete) == ("named", True)
    assert set(found) == {"gravity", "one_sided_stop"}
    values = [one.value for one in found["one_sided_stop"]]
    assert values == pytest.approx(BUFFER, rel=0.03)
