"""Diagnosis of simulations whose output is a velocity, against a machine of its own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.stand_in import derived
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    OutputsSimulation,
    SimulatorRun,
)
from hwid_cli.stages.foreign_simulation import simulator_of
from tests.black_boxes.plants import LINEAR, Hidden, integrate, with_tachometer

STEP_S, N, NOISE = 1e-3, 600, 2e-4
TIME = STEP_S * np.arange(N)
TRUE = {**LINEAR.values, "k": 0.0}
GIVEN = {**TRUE, "c": 13.0, "kt": 8.2}
FREE = {name: FreeParameter(GIVEN[name], (0.1, 1e4)) for name in ("c", "kt")}
AXIS = with_tachometer(LINEAR)
EFFECTS = ("coulomb_friction", "quadratic_drag", "spring_preload", "input_delay")
NOTHING = np.zeros(0)


def inputs():
    on = TIME > 0.05
    for size in (0.6, -1.0, 1.5):
        yield f"step_{size}", size * (on & (TIME < 0.4))
    for frequency, size in ((3.0, 1.5), (6.0, 1.0), (8.0, 1.5)):
        wave = np.sin(2 * np.pi * frequency * (TIME - 0.05))
        yield f"sine_{frequency}", size * wave * on


def recordings(dry):
    rng = np.random.default_rng(4)
    found = []
    for name, u in inputs():
        speed = integrate(AXIS, TRUE, u, STEP_S, Hidden("dry", (), dry=dry), finer=4)
        y = speed + NOISE * rng.standard_normal(N)
        kind = name.split("_", maxsplit=1)[0]
        found.append(Recording(name, u, y, STEP_S, kind=kind, output_unit="m/s"))
    return found


def speed_of(values, force):
    """Of the user's simulation: mass and damper, exact for straight lines."""
    return lsim(([1.0], [values["m"], values["c"]]), force, TIME)[1]


def simulate(request):
    force = request.parameters["kt"] * request.input
    if request.force.size:
        force = force + request.force
    return SimulatorRun(speed_of(request.parameters, force), NOTHING)


def diagnosed(simulator, dry=2.0):
    def in_turn(tasks, *, keep):
        return [one.function(*one.arguments) for one in tasks]

    return diagnose_foreign(
        recordings(dry), replace(simulator, output="velocity"),
        DiagnoseOptions(effects=EFFECTS), in_turn, lambda what, total: None,
    )  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("has_force", [True, False])
def test_friction_is_told_from_the_speed_alone(has_force):
    able = Capabilities(run=True, parameters=True, force=has_force)
    found = diagnosed(Simulator(able, simulate, {}, FREE, GIVEN))
    (effect,) = found.effects
    assert (found.verdict, effect.id) == ("named", "coulomb_friction")
    assert (found.confirmed, found.complete) == ("simulation", True)
    (force,) = effect.parameters
    # Without a force input it counts in amperes.
    expected = 2.0 if has_force else 2.0 / TRUE["kt"]
    assert force.value == pytest.approx(expected, rel=0.01)
    assert found.units == MotionUnits("N" if has_force else "A", "m", "A")
    for one in found.base:
        assert one.after == pytest.approx(TRUE[one.name], rel=0.01)


@pytest.mark.thorough
def test_friction_is_told_from_speeds_beside_outputs_alone():
    given = {name: speed_of(GIVEN, GIVEN["kt"] * u) for name, u in inputs()}
    found = diagnosed(Simulator(Capabilities(run=False), None, given))
    assert (found.verdict, found.effects[0].id) == ("named", "coulomb_friction")
    assert found.confirmed == "surrogate"


@pytest.mark.thorough
def test_where_nothing_is_hidden_the_parameters_are_all():
    able = Capabilities(run=True, parameters=True, force=True)
    found = diagnosed(Simulator(able, simulate, {}, FREE, GIVEN), dry=0.0)
    assert (found.verdict, found.effects) == ("parameters", ())


def test_the_motion_of_a_speed_has_its_way_and_its_acceleration():
    # A cart that is pushed from the first sample on, against its damper: m = d = F = 1.
    time = 0.05 * np.arange(60)
    run = SimulatorRun(1 - np.exp(-time), NOTHING)
    moved = derived(run, 0.05, is_velocity=True)
    np.testing.assert_array_equal(moved.velocity, run.output)
    np.testing.assert_allclose(moved.position, time + np.exp(-time) - 1, atol=2e-4)
    np.testing.assert_allclose(moved.acceleration[4:], np.exp(-time[4:]), atol=0.04)


def test_a_speed_that_is_there_at_first_is_not_taken_for_a_start_from_rest():
    moved = derived(SimulatorRun(np.cos(20 * TIME), NOTHING), STEP_S, is_velocity=True)
    np.testing.assert_allclose(moved.position, np.sin(20 * TIME) / 20, atol=1e-9)
    np.testing.assert_allclose(moved.acceleration, -20 * np.sin(20 * TIME), atol=1e-4)


@pytest.mark.parametrize(
    ("unit", "output"),
    [("m/s", "velocity"), ("rad/s", "velocity"), ("rad", "position"), ("", "position")],
)
def test_the_unit_of_the_recordings_says_that_a_velocity_is_compared(unit, output):
    found = [replace(one, output_unit=unit) for one in recordings(0.0)[:1]]
    assert simulator_of(OutputsSimulation(), found, ()).output == output
