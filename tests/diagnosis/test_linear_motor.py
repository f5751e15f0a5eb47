"""A linear motor under a controller: a free axis with cogging and friction.

Its equations, its integrator and its controller are this file's own.
"""

import numpy as np
import pytest

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.diagnose import diagnose

MASS, DAMPING, PUSH, FRICTION = 40.0, 60.0, 90.0, 50.0
AMPLITUDE, PERIOD, PHASE = 35.0, 0.032, 0.8
STEP_S, FINE = 1e-3, 50
NOISE = 2e-6


def cogging(x, phase=PHASE):
    return AMPLITUDE * np.sin(2.0 * np.pi * x / PERIOD + phase)


def controlled(reference, seed):
    """Current of a PID controller, held between samples, and what the encoder reads."""
    rng = np.random.default_rng(seed)
    x = v = total = 0.0
    before = None
    current, read = np.empty(reference.size), np.empty(reference.size)
    step = STEP_S / FINE
    for n, wanted in enumerate(reference):
        read[n] = x + NOISE * rng.standard_normal()
        error = wanted - read[n]
        rate = 0.0 if before is None else (error - before) / STEP_S
        total += error * STEP_S
        before = error
        current[n] = np.clip(1200.0 * error + 9000.0 * total + 45.0 * rate, -12, 12)
        for _ in range(FINE):
            force = PUSH * current[n] - DAMPING * v + cogging(x)
            if v == 0.0 and abs(force) <= FRICTION:
                continue
            way = np.sign(v) if v != 0.0 else np.sign(force)
            faster = v + step * (force - FRICTION * way) / MASS
            # Friction stops, it does not turn round.
            v = 0.0 if way * faster < 0.0 else faster
            x += step * v
    return current, read


def moves():
    time = STEP_S * np.arange(1500)
    ways = {
        "there": 0.15 * np.clip((time - 0.1) / 0.7, 0, 1),
        "back": -0.1 * np.clip((time - 0.1) / 0.4, 0, 1),
        "slow": 0.06 * np.clip((time - 0.1) / 1.2, 0, 1),
        "sine": 0.03 * np.sin(2 * np.pi * 1.5 * np.maximum(time - 0.1, 0)),
        "wave": 0.02 * np.sin(2 * np.pi * 3.0 * np.maximum(time - 0.1, 0)),
        "far": 0.2 * np.clip((time - 0.1) / 0.9, 0, 1),
    }
    return [
        Recording(name, *controlled(way, seed), STEP_S, kind="other", input_unit="A")
        for seed, (name, way) in enumerate(ways.items())
    ]


GIVEN = SimulationOptions(
    mass_kg=MASS,
    damping_N_s_per_m=75.0,
    stiffness_N_per_m=0.0,
    force_constant_N_per_A=95.0,
    hold="zero",
)


@pytest.mark.slow
def test_cogging_and_friction_of_a_free_axis_are_told_as_its_recipe_starts_it():
    options = DiagnoseOptions(
        initial_state="held",
        max_effects=2,
        effects=("cogging", "coulomb_friction"),
    )
    found = diagnose(moves(), GIVEN, options)
    assert found.verdict == "named"
    values = {
        (one.id, parameter.name): parameter.text or parameter.value
        for one in found.effects
        for parameter in one.parameters
    }
    assert values["cogging", "zero_at"] == "mean"
    assert values["cogging", "amplitude_N"] == pytest.approx(AMPLITUDE, rel=0.01)
    assert values["cogging", "period_m"] == pytest.approx(PERIOD, rel=1e-3)
    assert values["cogging", "phase_rad"] == pytest.approx(PHASE, abs=0.02)
    assert values["coulomb_friction", "force_N"] == pytest.approx(FRICTION, rel=0.01)


@pytest.mark.parametrize(
    ("stated", "rest"), [({}, np.sin(PHASE)), ({"zero_at": "mean"}, 0.0)]
)
@pytest.mark.parametrize("second", [0.0, 0.5 * AMPLITUDE])
def test_cogging_is_about_where_the_drive_rests_or_about_its_mean(stated, rest, second):
    more = {"amplitude_N": second, "period_m": PERIOD / 2, "phase_rad": 2.0}
    second_rest = np.sin(2.0) if rest else 0.0
    drive = Drive(
        mass_kg=MASS,
        damping_N_s_per_m=DAMPING,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=PUSH,
        effects={
            "cogging": {
                "amplitude_N": AMPLITUDE,
                "period_m": PERIOD,
                "phase_rad": PHASE,
                **stated,
            },
            **({"cogging:second": more} if second else {}),
        },
    )
    current = np.full(400, 1.0)
    moved = simulate_drive(current, drive, sample_time_s=STEP_S).position
    # By small steps of another integrator.
    x = v = 0.0
    expected = np.zeros(400)
    for n in range(1, 400):
        for _ in range(200):
            force = PUSH - DAMPING * v + cogging(x) - AMPLITUDE * rest
            swing = np.sin(4 * np.pi * x / PERIOD + 2.0) - second_rest
            force += second * swing
            v += STEP_S / 200 * force / MASS
            x += STEP_S / 200 * v
        expected[n] = x
    np.testing.assert_allclose(moved, expected, atol=2e-3 * np.abs(expected).max())
