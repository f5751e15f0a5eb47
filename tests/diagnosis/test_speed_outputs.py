"""Diagnosis of simulations whose output is a velocity, against a machine of its own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli import Recording
from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.stand_in import derived
from hwid_cli.diagnosis.standing import as_given, standing_beside
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


def in_turn(tasks, *, keep):
    return [one.function(*one.arguments) for one in tasks]


def diagnosed(simulator, dry=2.0):
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


# A rig that a motor keeps turning at 20 rad/s, and that a brake slows down: the speed falls
# as the input rises, and is there before a recording begins.
BRAKED = {"inertia": 0.4, "slip": 3.0, "brake": 2.0}
BRAKED_GIVEN = {**BRAKED, "slip": 3.4, "brake": 2.3}
IDLE = 20.0
# What hides: magnets along the way, or a brake that is late.
MAGNETS, PERIOD, LATE = 4.0, 3.0, 12


def braked(values, brake, force, magnets=0.0):
    """Speed of the rig by small steps, [rad/s]."""
    finer, speed, way, found = 20, IDLE, 0.0, np.empty(N)
    for row in range(N):
        found[row] = speed
        for part in range(finer):
            at = TIME[row] + STEP_S * (part + 0.5) / finer
            push, pull = np.interp(at, TIME, force), np.interp(at, TIME, brake)
            torque = values["slip"] * (IDLE - speed) - values["brake"] * pull + push
            torque -= magnets * np.sin(2 * np.pi * way / PERIOD)
            speed += STEP_S / finer * torque / values["inertia"]
            way += STEP_S / finer * speed
    return found


def simulate_braked(request):
    force = request.force if request.force.size else np.zeros(N)
    return SimulatorRun(braked(request.parameters, request.input, force), NOTHING)


def brakings(magnets=0.0, late=0):
    rng = np.random.default_rng(6)
    at = TIME > 0.05
    shapes = [size * (at & (TIME < 0.4)) for size in (4.0, 9.0, 14.0)]
    shapes += [7 * (1 - np.cos(2 * np.pi * f * (TIME - 0.05))) * at for f in (4, 7, 10)]
    found = []
    for number, u in enumerate(shapes):
        brake = np.concatenate([np.zeros(late), u[: N - late]])
        speed = braked(
            BRAKED, brake, np.zeros(N), magnets
        ) + 0.01 * rng.standard_normal(N)
        units = {"input_unit": "bar", "output_unit": "rad/s"}
        found.append(Recording(f"r{number}", u, speed, STEP_S, kind="step", **units))
    return found


def test_a_stand_in_of_a_brake_is_pushed_back_and_runs_before_a_recording_begins():
    able = Capabilities(run=True, parameters=True)
    simulator = Simulator(able, simulate_braked, {}, {}, BRAKED, output="velocity")
    begun = as_given(brakings(), simulator, DiagnoseOptions(), in_turn)
    standing = standing_beside(begun.runs, begun.problem, begun.given, BRAKED)

    drive = standing.drive
    assert drive.force_constant_N_per_A == -1.0
    of_brake = BRAKED["inertia"] / BRAKED["brake"], BRAKED["slip"] / BRAKED["brake"]
    found = drive.mass_kg, drive.damping_N_s_per_m
    assert found == pytest.approx(of_brake, rel=0.02)
    assert [one.start for one in standing.signals] == [(0.0, IDLE)] * 6
    for one, run in zip(compared_as_given(standing), begun.given, strict=True):
        np.testing.assert_allclose(one.simulated, run.output, atol=1e-6)


@pytest.mark.thorough
@pytest.mark.parametrize("has_force", [True, False])
@pytest.mark.parametrize(
    ("effect", "magnets", "late", "values"),
    [
        ("cogging", MAGNETS, 0, {"period_m": PERIOD, "amplitude_N": MAGNETS}),
        ("input_delay", 0.0, LATE, {"delay_s": LATE * STEP_S}),
    ],
)
def test_what_a_rig_that_runs_lacks_is_told(has_force, effect, magnets, late, values):
    able = Capabilities(run=True, parameters=True, force=has_force)
    free = {
        name: FreeParameter(BRAKED_GIVEN[name], (0.1, 100.0))
        for name in ("slip", "brake")
    }
    simulator = Simulator(
        able, simulate_braked, {}, free, BRAKED_GIVEN, output="velocity"
    )
    found = diagnose_foreign(
        brakings(magnets, late), simulator,
        DiagnoseOptions(effects=("cogging", "quadratic_drag", "input_delay")),
        in_turn, lambda what, total: None,
    )  # fmt: skip

    (named,) = found.effects
    assert (found.verdict, named.id) == ("named", effect)
    assert (found.confirmed, found.complete) == ("simulation", True)
    told = {one.name: one.value for one in named.parameters}
    if not has_force and "amplitude_N" in values:
        # It counts in the unit of the input, and pushes where that would.
        values = {**values, "amplitude_N": MAGNETS / BRAKED["brake"]}
    for name, value in values.items():
        assert abs(told[name]) == pytest.approx(value, rel=0.02)
