"""Diagnosis of simulations that cannot be opened, against machines of their own making."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli import Recording
from hwid_cli.diagnosis import foreign
from hwid_cli.diagnosis.beside_stand_in import FoundBeside
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.run_starts import Begun, RunStarts
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator
from hwid_cli.diagnosis.standing import as_given, stand_in_for
from hwid_cli.diagnosis.untold import Untold
from hwid_cli.drive.simulation import NO_FORCE
from hwid_cli.errors import SimulationError
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.diagnosis import BaseParameter
from hwid_cli.records.drive import StandIn
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    RunRequest,
    SimulatorRun,
    StandInChange,
)
from tests.black_boxes.plants import (
    LINEAR,
    MOTOR,
    PENDULUM,
    Hidden,
    hidden_in,
    integrate,
)
from tests.black_boxes.run_boxes import diagnose, runs_of, write_case
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up
from tests.report.diagnosis_examples import named

STEP_S, N = 1e-3, 500
TIME = STEP_S * np.arange(N)
NOISE = 2e-5
TRUE = LINEAR.values
FRICTION = Hidden("coulomb", (), dry=2.0)


def inputs():
    on = TIME > 0.05
    for size in (1.5, -2.5, 3.0):
        yield f"step_{size}", size * (on & (TIME < 0.3))
    for frequency, size in ((4.0, 3.0), (7.0, 2.0), (9.0, 3.0)):
        yield (
            f"sine_{frequency}",
            size * np.sin(2 * np.pi * frequency * (TIME - 0.05)) * on,
        )


def recordings(hidden=None):
    rng = np.random.default_rng(3)
    return [
        Recording(
            name, u,
            integrate(LINEAR, TRUE, u, STEP_S, hidden, finer=4) + NOISE * rng.standard_normal(N),
            STEP_S, kind=name.split("_", maxsplit=1)[0], input_unit="V", output_unit="mm",
        )
        for name, u in inputs()
    ]  # fmt: skip


class Count:
    """Runs what it is handed, and counts the runs of the simulation."""

    def __init__(self):
        self.runs = 0

    def __call__(self, tasks, *, keep):  # noqa: ARG002
        self.runs += sum(one.result_type is SimulatorRun for one in tasks)
        return [one.function(*one.arguments) for one in tasks]


def simulate(request):
    """The user's simulation, by a transfer function."""
    p = request.parameters
    force = p["kt"] * request.input
    if request.force.size:
        force = force + request.force
    output = lsim(([1.0], [p["m"], p["c"], p["k"]]), force, TIME)[1]
    return SimulatorRun(output, np.zeros(0))


GIVEN = {"m": 0.8, "c": 14.0, "k": 2300.0, "kt": 8.0}
FREE = {name: FreeParameter(GIVEN[name], (0.1, 1e4)) for name in ("c", "k", "kt")}


def diagnosis(simulator, hidden=FRICTION, effects=None):
    options = DiagnoseOptions(effects=effects)
    run = Count()
    found = diagnose_foreign(
        recordings(hidden), simulator, options, run, lambda what, total: None
    )
    return found, run.runs


FEW = ("coulomb_friction", "quadratic_drag", "cubic_stiffness", "input_delay")


@pytest.mark.thorough
def test_friction_is_named_and_confirmed_in_the_simulation_with_its_parameters():
    able = Capabilities(run=True, parameters=True, force=True)
    found, runs = diagnosis(Simulator(able, simulate, {}, FREE, GIVEN), effects=FEW)
    assert (found.verdict, found.complete) == ("named", True)
    assert found.confirmed == "simulation"
    (effect,) = found.effects
    (force,) = effect.parameters
    assert effect.id == "coulomb_friction"
    assert force.value == pytest.approx(2.0, rel=0.01)
    assert found.units == MotionUnits("N", "mm", "V")
    # The noise allows a hundredth; the given ones are up to a quarter off.
    for one in found.base:
        assert one.after == pytest.approx(TRUE[one.name], rel=0.01)
    assert found.after.ratio_to_noise < 1.1 < found.before.ratio_to_noise
    assert runs <= 800


@pytest.mark.thorough
def test_a_delay_beside_friction_is_told_from_a_lag_with_parameters_far_off():
    able = Capabilities(run=True, parameters=True, force=True)
    late, given = 8, {**GIVEN, "k": 2000.0, "kt": 7.0}
    machine = [
        replace(one, output=np.concatenate([np.zeros(late), of_late.output[:-late]]))
        for one, of_late in zip(recordings(), recordings(FRICTION), strict=True)
    ]
    free = {name: replace(one, value=given[name]) for name, one in FREE.items()}
    run = Count()
    found = diagnose_foreign(
        machine, Simulator(able, simulate, {}, free, given),
        DiagnoseOptions(effects=(*FEW, "actuator_lag")), run, lambda what, total: None,
    )  # fmt: skip

    told = {one.id: one.parameters[0].value for one in found.effects}
    assert set(told) == {"coulomb_friction", "input_delay"}
    assert told["coulomb_friction"] == pytest.approx(2.0, rel=0.01)
    assert told["input_delay"] == pytest.approx(late * STEP_S, rel=0.02)
    assert (found.complete, found.confirmed) == (True, "simulation")


def test_references_of_a_stand_in_are_those_of_the_training_recordings():
    able = Capabilities(run=True, parameters=True, force=True)
    found = recordings()
    held = [one.name for one in found if np.max(np.abs(one.input)) > 2.6]
    begun = as_given(
        found, Simulator(able, simulate, {}, FREE, GIVEN),
        DiagnoseOptions(hold_out=tuple(held)), Count(),
    )  # fmt: skip
    drive = stand_in_for(begun)
    assert len(begun.problem.signals) == len(found) > len(held) > 0
    assert drive.reference_current_A == 2.5


def swings(request):
    """A pendulum of 0.05 kg m^2 that goes far beyond a quarter turn."""
    assert np.isfinite(request.force).all()
    force = request.force if request.force.size else np.zeros(N)
    found = np.zeros(N)
    angle = speed = 0.0
    for row in range(N - 1):
        for _ in range(4):
            push = (
                3.0 * request.input[row]
                + force[row]
                - 1.1 * np.sin(angle)
                - 0.07 * speed
            )
            speed += 2.5 * STEP_S * push / 0.05
            angle += 2.5 * STEP_S * speed
        found[row + 1] = angle
    return SimulatorRun(found, np.zeros(0))


def test_a_spring_that_softens_is_pushed_no_farther_than_it_bears():
    able = Capabilities(run=True, parameters=True, force=True)
    inputs_N = [np.where(TIME > 0.05, size, 0.0) for size in (0.16, -0.26, 0.31)]
    found = [
        Recording(f"r{row}", one, swings(RunRequest("r", STEP_S, one, NO_FORCE, {})).output,
                  10 * STEP_S)
        for row, one in enumerate(inputs_N)
    ]  # fmt: skip
    assert max(np.max(one.output) for one in found) > 1.6
    simulator = Simulator(able, swings, {}, {}, {})
    drive = stand_in_for(as_given(found, simulator, DiagnoseOptions(), Count()))
    # In N m; without an answer to a push it would be 1.
    assert drive.force_constant_N_per_A == pytest.approx(3.0, rel=0.3)


@pytest.mark.parametrize("adds_up", [0.0, 2e4])
def test_of_a_loop_inside_a_simulation_a_push_tells_what_a_force_does(adds_up):
    """A reference moves an axis as if it had no mass, whatever a force does to it."""
    # 2 kg behind a stiff loop that knows the reference's slope, and may add up.
    mass, gain, damping = 2.0, 2000.0, 80.0
    drive = [mass, damping, gain, adds_up]

    def follows(request):
        force = request.force if request.force.size else np.zeros(N)
        pushed = lsim(([1.0, 0.0], drive), force, TIME)[1]
        led = lsim(([damping, gain, adds_up], drive), request.input, TIME)[1]
        return SimulatorRun(led + pushed, np.zeros(0))

    able = Capabilities(run=True, force=True)
    found = [
        Recording(name, u, follows(RunRequest(name, STEP_S, u, NO_FORCE, {})).output, STEP_S)
        for name, u in inputs()
    ]  # fmt: skip
    simulator = Simulator(able, follows, {}, {}, {})
    found = stand_in_for(as_given(found, simulator, DiagnoseOptions(), Count()))
    assert found.mass_kg == pytest.approx(mass, rel=0.03)
    assert found.damping_N_s_per_m == pytest.approx(damping, rel=0.03)
    assert found.stiffness_N_per_m == pytest.approx(gain, rel=0.03)
    # A reference of 1 asks for what the spring of the loop holds there.
    assert found.force_constant_N_per_A == pytest.approx(gain, rel=0.1)


def test_a_usual_run_is_pushed_and_not_one_that_has_left_its_valley():
    able = Capabilities(run=True, force=True)
    inputs_N = [np.where(TIME > 0.05, size, 0.0) for size in (0.05, -0.09, 0.07, 0.45)]
    found = [
        Recording(f"r{row}", one, swings(RunRequest("r", STEP_S, one, NO_FORCE, {})).output,
                  10 * STEP_S)
        for row, one in enumerate(inputs_N)
    ]  # fmt: skip
    assert max(np.max(one.output) for one in found) > 6.3
    simulator = Simulator(able, swings, {}, {}, {})
    drive = stand_in_for(as_given(found, simulator, DiagnoseOptions(), Count()))
    assert drive.mass_kg == pytest.approx(0.05, rel=0.1)
    assert drive.stiffness_N_per_m == pytest.approx(1.1, rel=0.2)
    assert drive.force_constant_N_per_A == pytest.approx(3.0, rel=0.2)


def test_a_push_that_a_simulation_does_not_bear_is_made_weaker():
    able = Capabilities(run=True, parameters=True, force=True)

    def frail(request):
        if request.force.size and np.max(np.abs(request.force)) > 0.2:
            raise SimulationError("the joint has left its range")
        return simulate(request)

    simulator = Simulator(able, frail, {}, FREE, GIVEN)
    drive = stand_in_for(as_given(recordings(), simulator, DiagnoseOptions(), Count()))
    # 8 N for each V.
    assert drive.force_constant_N_per_A == pytest.approx(8.0, rel=0.1)


def test_a_simulation_is_not_run_with_a_force_that_is_not_finite():
    able = Capabilities(run=True, force=True)
    found = recordings()
    begun = as_given(
        found, Simulator(able, simulate, {}, FREE, GIVEN), DiagnoseOptions(), Count()
    )
    runs, signals = (
        Runs(begun.runs.simulator, CountedRuns(Count())),
        begun.problem.signals,
    )
    force = [np.full(N, np.nan)] * len(signals)
    assert runs.tried(signals, GIVEN, force) is None
    with pytest.raises(
        SimulationError, match=r"force for recording 'step_1\.5' is not"
    ):
        runs.of(signals, GIVEN, force)
    assert runs.run_tasks.count == 0


@pytest.mark.thorough
def test_without_a_force_input_a_force_acts_through_the_input():
    able = Capabilities(run=True, parameters=True)
    found, _ = diagnosis(Simulator(able, simulate, {}, FREE, GIVEN), effects=FEW)
    assert (found.verdict, found.confirmed) == ("named", "simulation")
    # In the unit of the input: 9 N a volt.
    assert found.units == MotionUnits("V", "mm", "V")
    assert found.effects[0].parameters[0].name == "force_N"
    assert found.effects[0].parameters[0].value == pytest.approx(2.0 / 9.0, rel=0.02)


@pytest.mark.thorough
def test_of_outputs_alone_the_name_is_found_and_not_confirmed():
    given = {
        name: lsim(([GIVEN["kt"]], [0.8, GIVEN["c"], GIVEN["k"]]), u, TIME)[1]
        for name, u in inputs()
    }
    simulator = Simulator(Capabilities(run=False), None, given)
    found, runs = diagnosis(simulator, effects=FEW)
    assert (found.verdict, found.effects[0].id) == ("named", "coulomb_friction")
    assert (found.confirmed, runs) == ("surrogate", 0)


def amplified(values, command):
    """The stage behind an amplifier that gives less of large commands."""
    plant = ([values["kt"]], [values["m"], values["c"], values["k"]])
    return lsim(plant, 1.5 * np.tanh(command / 1.5), TIME)[1]


def beside_amplified_outputs(options):
    """Diagnosis of that stage's outputs, of which the parameters alone are off."""
    rng = np.random.default_rng(3)
    measured = [
        Recording(
            name, u, amplified(TRUE, u) + NOISE * rng.standard_normal(N), STEP_S,
            kind=name.split("_", maxsplit=1)[0],
        )
        for name, u in inputs()
    ]  # fmt: skip
    given = {name: amplified(GIVEN, u) for name, u in inputs()}
    return diagnose_foreign(
        measured, Simulator(Capabilities(run=False), None, given), options, Count(),
        lambda what, total: None,
    )  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("tempting", ["parameter_change", "supply_sag"])
def test_of_outputs_alone_no_name_rests_on_the_error_of_the_stand_in(tempting):
    # No plain drive has such an amplifier, and either effect takes nearly all that it leaves.
    options = DiagnoseOptions(effects=(tempting, "coulomb_friction"))
    found = beside_amplified_outputs(options)
    assert found.before.ratio_to_noise > 5
    assert found.candidates[0].effects[0].startswith(tempting)
    assert found.candidates[0].explained_share > 0.8
    assert (found.verdict, found.effects) == ("unknown", ())


@pytest.mark.thorough
def test_of_outputs_alone_no_law_rests_on_the_error_of_the_stand_in():
    options = DiagnoseOptions(effects=("coulomb_friction",), laws="only")
    found = beside_amplified_outputs(options)
    assert (found.verdict, found.effects, found.law) == ("unknown", (), None)


@pytest.mark.thorough
def test_where_nothing_is_hidden_the_parameters_are_all():
    able = Capabilities(run=True, parameters=True, force=True)
    simulator = Simulator(able, simulate, {}, FREE, GIVEN)
    found, _ = diagnosis(simulator, hidden=None, effects=FEW)
    assert (found.verdict, found.effects) == ("parameters", ())
    for one in found.base:
        assert one.after == pytest.approx(TRUE[one.name], rel=0.01)


@pytest.mark.thorough
def test_bounds_of_parameters_are_kept():
    able = Capabilities(run=True, parameters=True, force=True)
    seen = []

    def watched(request):
        seen.append(request.parameters["c"])
        return simulate(request)

    free = {**FREE, "c": FreeParameter(14.0, (13.0, 15.0))}
    diagnosis(Simulator(able, watched, {}, free, GIVEN), effects=FEW)
    assert min(seen) >= 13.0
    assert max(seen) <= 15.0 + 1e-9


@pytest.mark.thorough
def test_what_the_simulation_does_not_bear_out_is_no_fact():
    able = Capabilities(run=True, parameters=True, force=True)

    def deaf(request):
        # It is said to have a force input, and takes no notice of it.
        return simulate(replace(request, force=np.zeros(0)))

    found, _ = diagnosis(Simulator(able, deaf, {}, FREE, GIVEN), effects=FEW)
    assert (found.verdict, found.effects, found.confirmed) == (
        "unknown",
        (),
        "surrogate",
    )
    assert any(one.effects == ("coulomb_friction",) for one in found.candidates)


def cylinder(values, command):
    """A valve that lets little pass: no spring, and a lag that no sample shows."""
    flow = values["gain"] * np.sign(command) * np.maximum(np.abs(command) - 0.35, 0.0)
    return cylinder_run(values, flow / values["gain"])


def cylinder_run(values, command):
    """Exact for a command that is held, as a valve's is."""
    speed, position, found = 0.0, 0.0, np.empty(command.size)
    decay = np.exp(-STEP_S / values["lag"])
    for row, one in enumerate(values["gain"] * command):
        found[row] = position
        position += one * STEP_S + (speed - one) * values["lag"] * (1.0 - decay)
        speed = one + (speed - one) * decay
    return found


@pytest.mark.thorough
def test_a_spring_of_rounding_does_not_keep_an_effect_from_the_simulation():
    """It grew a thousandfold beside every effect, and none was tried in a cylinder."""
    true = {"gain": 9.5, "lag": 5e-4}
    rng = np.random.default_rng(5)
    found = [
        Recording(
            name, u, cylinder(true, u) + 2e-3 * rng.standard_normal(N),
            STEP_S, kind=name.split("_", maxsplit=1)[0], input_unit="V", output_unit="mm",
        )
        for name, u in inputs()
    ]  # fmt: skip
    simulator = Simulator(
        Capabilities(run=True, parameters=True),
        lambda request: SimulatorRun(
            cylinder_run(request.parameters, request.input), np.zeros(0)
        ),
        {},
        {name: FreeParameter(1.1 * value) for name, value in true.items()},
        {name: 1.1 * value for name, value in true.items()},
    )
    told = diagnose_foreign(
        found, simulator, DiagnoseOptions(), Count(), lambda what, total: None
    )
    assert told.confirmed == "simulation"
    # Without inertia friction does the same.
    assert told.verdict in ("named", "ambiguous")
    (effect,) = told.effects
    names = {effect.id, *told.ambiguous_with}
    assert "input_dead_zone" in names <= {"input_dead_zone", "coulomb_friction"}
    assert effect.parameters[0].value == pytest.approx(0.35, rel=0.02)


@pytest.mark.parametrize(
    ("gain", "left", "imitates"),
    [
        # At its bound; far from what is stated; near it; or where next to nothing is left.
        (0.5, 30.0, True),
        (1.5, 30.0, True),
        (2.0, 30.0, False),
        (0.5, 2.0, False),
    ],
)
def test_a_refit_that_is_led_far_away_in_vain_has_imitated_something(
    monkeypatch, gain, left, imitates
):
    n, noise = 100, 1e-3
    signals = [
        SimpleNamespace(compared=left * noise * np.ones(n), evaluated=slice(None))
    ]
    monkeypatch.setattr(foreign, "noise_floor", lambda _: SimpleNamespace(rms=noise))
    free = {
        "gain": FreeParameter(8.0, (0.5, 100.0)),
        "rubs": FreeParameter(1.0),
        "offset": FreeParameter(0.0),
    }
    begun = SimpleNamespace(
        problem=SimpleNamespace(signals=signals, n_evaluated=n),
        runs=SimpleNamespace(simulator=SimpleNamespace(free=free)),
    )
    given = [SimulatorRun(np.zeros(n), np.zeros(0))]
    values = {"gain": gain, "rubs": 1.1, "offset": 0.3}
    assert foreign._has_imitated(begun, given, values) is imitates


SWING_S, SWUNG = 2e-3, 600
PENDULUM_TIME = SWING_S * np.arange(SWUNG)


def pendulum_inputs():
    on = PENDULUM_TIME > 0.1
    for size in (0.8, -1.4, 2.0):
        yield f"step_{size}", size * (on & (PENDULUM_TIME < 0.65))
    for frequency, size in ((1.5, 1.8), (3.0, 1.0), (4.0, 2.0)):
        yield (
            f"sine_{frequency}",
            size * np.sin(2 * np.pi * frequency * (PENDULUM_TIME - 0.1)) * on,
        )


def swing(request):
    """The user's pendulum, without the spring."""
    angle = pendulum_run(request.parameters, request.input, request.force)
    return SimulatorRun(angle, np.zeros(0))


def pendulum_run(values, current, force, spring=0.0):
    rates = PENDULUM.function()
    force = force if force.size else np.zeros(SWUNG)

    def change(state, u, push):
        return np.array(rates(state, u, push - spring * state[0] ** 3, values))

    state, found = np.zeros(2), np.empty(SWUNG)
    for n in range(SWUNG):
        found[n] = state[0]
        if n + 1 == SWUNG:
            break
        for part in range(2):
            ends = [
                (given[n] + at * (given[n + 1] - given[n])) for given in (current, force)
                for at in (part / 2, part / 2 + 0.25, part / 2 + 0.5)
            ]  # fmt: skip
            u, push, h = ends[:3], ends[3:], SWING_S / 2
            one = change(state, u[0], push[0])
            two = change(state + h / 2 * one, u[1], push[1])
            three = change(state + h / 2 * two, u[1], push[1])
            four = change(state + h * three, u[2], push[2])
            state = state + h / 6 * (one + 2 * two + 2 * three + four)
    return found


@pytest.mark.thorough
def test_what_a_linear_stand_in_leaves_of_a_pendulum_becomes_no_second_effect():
    # Angles of more than a radian: beside the sine of gravity the stand-in is wrong.
    rng, noise, spring = np.random.default_rng(5), 4e-3, 0.4
    measured = [
        Recording(
            name, u,
            pendulum_run(PENDULUM.values, u, np.zeros(0), spring)
            + noise * rng.standard_normal(SWUNG),
            SWING_S, kind=name.split("_", maxsplit=1)[0],
        )
        for name, u in pendulum_inputs()
    ]  # fmt: skip
    given = {**PENDULUM.values, "c": 0.0575, "g": 0.77, "kt": 0.4}
    free = {name: FreeParameter(given[name]) for name in PENDULUM.free}
    able = Capabilities(run=True, parameters=True, force=True)
    options = DiagnoseOptions(effects=("cubic_stiffness", "second_mode", "end_stop"))
    run = Count()
    found = diagnose_foreign(
        measured, Simulator(able, swing, {}, free, given), options, run,
        lambda what, total: None,
    )  # fmt: skip
    assert [one.id for one in found.effects] == ["cubic_stiffness"]
    assert (found.verdict, found.complete) == ("named", True)
    assert found.confirmed == "simulation"
    assert found.effects[0].parameters[0].value == pytest.approx(spring, rel=0.02)
    for one in found.base:
        assert one.after == pytest.approx(PENDULUM.values[one.name], rel=0.02)
    assert found.after.ratio_to_noise < 1.1
    assert run.runs <= 800


@pytest.mark.thorough
def test_of_outputs_of_a_pendulum_the_stop_is_named_and_no_changed_parameter():
    # Half a turn to either side; weight and gain of the simulation are off.
    rng = np.random.default_rng(5)
    stop = Hidden("stop", (), force=lambda x, v, t: -30 * max(x - 0.6, 0.0))
    measured = [
        Recording(
            name, u,
            integrate(PENDULUM, PENDULUM.values, u, SWING_S, stop, finer=4)
            + 4e-3 * rng.standard_normal(SWUNG),
            SWING_S, kind=name.split("_", maxsplit=1)[0],
        )
        for name, u in pendulum_inputs()
    ]  # fmt: skip
    off = {**PENDULUM.values, "c": 0.0575, "g": 0.77, "kt": 0.4}
    given = {name: pendulum_run(off, u, np.zeros(0)) for name, u in pendulum_inputs()}
    options = DiagnoseOptions(effects=("one_sided_stop", "parameter_change", "cogging"))
    found = diagnose_foreign(
        measured, Simulator(Capabilities(run=False), None, given), options, Count(),
        lambda what, total: None,
    )  # fmt: skip
    assert found.verdict == "named", found.summary
    assert [one.id for one in found.effects] == ["one_sided_stop"]
    assert found.after.ratio_to_noise < 1.5 < 40 < found.before.ratio_to_noise


# Of the motor the stand-in takes a contact with four parameters for nearer than the spring;
# of the pendulum the first runs go to a wrong place, and a set makes up for that.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("plant", "effect", "seed", "tempting"),
    [(MOTOR, "cubic", 1, "end_stop"), (PENDULUM, "stop", 2, "cubic_stiffness")],
)
def test_the_simulation_decides_between_an_effect_and_what_makes_up_for_it(
    tmp_path, plant, effect, seed, tempting
):
    ((true,),) = hidden_in(plant, 1.0, 1.0)[effect].accepted
    write_case(
        tmp_path, plant, effect, access="python", noise=0.005, seed=seed,
        most=f"effects: [{true}, {tempting}], laws: never",
    )  # fmt: skip
    found, _ = diagnose(tmp_path, 1)
    assert (found["verdict"], found["confirmed"]) == ("named", "simulation")
    assert [one["id"] for one in found["effects"]] == [true]
    assert found["complete"]
    assert runs_of(tmp_path) <= 800


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("confirmed", "left", "searched", "told"),
    [
        # Parameters that are fitted, where the search has moved them, and the given ones.
        ((False, False, False), (3, 2, 1), [20.0, 21.0, 14.0], (False, 21.0)),
        ((False, False, True), (3, 2, 1), [20.0, 21.0, 14.0], (True, 15.0)),
        ((False, True, False), (3, 2, 1), [20.0, 21.0, 22.0], (True, 22.0)),
        # What is borne out stays, unless a further search is as well and leaves less.
        ((True, False, False), (3, 2, 1), [20.0, 21.0], (True, 21.0)),
        ((True, True, True), (2, 3, 1), [20.0, 21.0], (True, 21.0)),
        ((True, True, True), (3, 2, 1), [20.0, 21.0, 22.0], (True, 23.0)),
    ],
)
def test_the_given_parameters_come_last_where_nothing_was_confirmed(
    monkeypatch, confirmed, left, searched, told
):
    def stub(is_confirmed):
        chosen = SimpleNamespace(sse=np.array([float(left[len(begun) - 1])]))
        verdict = SimpleNamespace(chosen=chosen, word="unknown")
        no = {
            "is_nearly_all": lambda *_: False,
            "leaves_next_to_nothing": lambda *_: False,
        }
        criteria = SimpleNamespace(**no)
        return SimpleNamespace(
            verdict=verdict,
            criteria=criteria,
            base=None,
            own_base=None,
            is_confirmed=is_confirmed,
        )

    begun, results = [], iter(confirmed)

    def found(beside, *, is_first):
        assert is_first is (not begun)
        begun.append(beside.values["c"])
        is_confirmed = next(results)
        moved = {**beside.values, "c": beside.values["c"] + 1.0}
        return FoundBeside(stub(is_confirmed), moved, is_confirmed)

    @dataclass(frozen=True)
    class Told:
        findings: object
        values: float
        confirmed: str = ""

    monkeypatch.setattr(foreign, "searched_beside", found)
    monkeypatch.setattr(
        foreign,
        "fit_parameters",
        lambda ask, signals, free, values, noise: {**values, "c": 20.0},
    )
    monkeypatch.setattr(
        foreign, "_told", lambda found, simulator, values: Told(found, values[1]["c"])
    )
    monkeypatch.setattr(
        foreign, "_confirmed", lambda told, *_: replace(told, confirmed="simulation")
    )
    able = Capabilities(run=True, parameters=True, force=True)
    seen, _ = diagnosis(Simulator(able, simulate, {}, FREE, GIVEN))

    assert begun == searched
    is_confirmed, value = told
    assert seen.values == value
    assert seen.confirmed == ("simulation" if is_confirmed else "surrogate")


@pytest.mark.parametrize(
    ("count", "is_complete", "left", "is_said"),
    [
        (900, False, 400.0, True),
        # Runs are left, nothing is, or next to nothing.
        (700, False, 400.0, False),
        (900, True, 400.0, False),
        (900, False, 100.5, False),
    ],
)
def test_a_search_that_its_runs_have_ended_says_so(count, is_complete, left, is_said):
    counted = CountedRuns(None, 800)
    counted.count = count
    chosen = made_up(("end_stop",), left)
    verdict = SimpleNamespace(is_complete=is_complete, chosen=chosen)
    found = SimpleNamespace(verdict=verdict, base=base(2000.0), criteria=CRITERIA)
    said = foreign._said_of_runs(counted, found)
    assert [("900 runs" in one, "max_runs: 1800" in one) for one in said] == (
        [(True, True)] if is_said else []
    )


@pytest.mark.thorough
def test_a_trial_without_an_answer_ends_no_search_for_the_parameters():
    refused = []

    def fragile(request):
        # Beyond this it gives no numbers, as with a capacity below 0; 9 would fit best.
        if request.parameters["kt"] > 8.3:
            refused.append(request.parameters["kt"])
            raise SimulationError("gave nan")
        return simulate(request)

    of = foreign.prepare(
        recordings(), SimulationOptions(hold="linear"), DiagnoseOptions(), ()
    )
    able = Capabilities(run=True, parameters=True)
    runs = Runs(Simulator(able, fragile, {}, FREE, GIVEN), CountedRuns(Count()))
    found = foreign.fit_parameters(runs.tried, of.signals, FREE, GIVEN)
    assert refused
    assert 8.0 <= found["kt"] <= 8.3
    before, after = (
        foreign._sse(of.signals, runs.of(of.signals, one)).sum()
        for one in (GIVEN, found)
    )
    assert after < before


@pytest.mark.thorough
def test_an_effect_that_the_simulation_cannot_be_run_with_is_not_confirmed():
    own = {one.input.tobytes() for one in recordings()}

    def fragile(request):
        if request.input.tobytes() not in own:
            raise SimulationError("gave nan")
        return simulate(request)

    able = Capabilities(run=True, parameters=True)
    found, _ = diagnosis(
        Simulator(able, fragile, {}, FREE, GIVEN), effects=("coulomb_friction",)
    )
    assert (found.verdict, found.confirmed) == ("unknown", "surrogate")


@pytest.mark.parametrize(
    ("is_free", "is_named", "change", "n_said"),
    [
        (True, True, StandInChange(damping=0.7), 1),
        # All that is said comes from the simulation's own parameters; or there are none,
        # and the factors are in the table of parameters; or nothing is said of an effect.
        (True, True, StandInChange(), 0),
        (False, True, StandInChange(damping=0.7), 0),
        (True, False, StandInChange(damping=0.7), 0),
    ],
)
def test_forces_in_the_place_of_parameters_are_told(
    monkeypatch, is_free, is_named, change, n_said
):
    said = named() if is_named else replace(named(), effects=())
    monkeypatch.setattr(foreign, "describe", lambda _: said)
    monkeypatch.setattr(foreign, "_change_of", lambda *_: change)
    able = Capabilities(run=True, parameters=True)
    simulator = Simulator(able, simulate, {}, FREE if is_free else {}, GIVEN)
    begun = Begun(
        SimpleNamespace(unit="mm"),
        Runs(simulator, CountedRuns(Count())),
        (),
        RunStarts({"step": 1.5}),
    )
    findings = SimpleNamespace(
        problem=SimpleNamespace(drive=None),
        verdict=SimpleNamespace(chosen=SimpleNamespace(effects=())),
    )
    told = foreign._told(findings, begun, (GIVEN, GIVEN))
    assert "start 1.5 to 1.5 mm from where the simulation does" in told.warnings[-1]
    texts = [one for one in told.warnings if "simulation.stand_in" in one]
    assert len(texts) == n_said
    assert told.stand_in == change


@pytest.mark.parametrize(
    ("change", "effects", "is_told"),
    [
        (StandInChange(), (), True),
        # As little as the recordings leave open.
        (StandInChange(damping=1.005), (), True),
        (StandInChange(damping=0.7), (), False),
        (StandInChange(), named().effects, False),
    ],
)
def test_parameters_have_intervals_where_nothing_acts_beside_them(
    monkeypatch, change, effects, is_told
):
    untold = Untold(deviations={"c": 0.01, "kt": 2.0})
    monkeypatch.setattr(foreign, "untold_parameters", lambda *_: untold)
    base = tuple(BaseParameter(one, 9.0, 10.0, 10.0) for one in ("c", "kt", "gone"))
    told = replace(named(), base=base, stand_in=change, effects=effects)
    found = foreign._confirmed(told, None, (None, {}), lambda what, n: None)
    assert [np.isfinite(one.low) for one in found.base] == [is_told, False, False]
    if is_told:
        ends = found.base[0].low, found.base[0].high
        assert ends == pytest.approx((10 * np.exp(-0.0196), 10 * np.exp(0.0196)))


@pytest.mark.thorough
def test_after_the_runs_that_are_allowed_the_answer_is_the_best_until_then():
    able = Capabilities(run=True, parameters=True, force=True)
    hidden = Hidden("both", (), dry=2.0, force=lambda x, v, t: -1.5e6 * x**3)
    counts, named = [], []
    for most in (1, 2000):
        run = Count()
        found = diagnose_foreign(
            recordings(hidden), Simulator(able, simulate, {}, FREE, GIVEN),
            DiagnoseOptions(effects=FEW, max_runs=most), run, lambda what, total: None,
        )  # fmt: skip
        counts.append(run.runs)
        named.append([one.id for one in found.effects])
    # The effect that has begun is tried to its end; a second one is not looked for.
    assert counts[0] < counts[1]
    assert len(named[0]) < len(named[1]) == 2


@pytest.mark.parametrize(
    ("lag_s", "effects", "is_said"),
    [
        (0.03, ("coulomb_friction",), True),
        (0.0, ("coulomb_friction",), False),
        # What changes the input acts before the lag.
        (0.03, ("input_dead_zone", "coulomb_friction"), False),
        (0.03, (), False),
    ],
)
def test_a_lag_that_effects_act_behind_is_said(lag_s, effects, is_said):
    findings = SimpleNamespace(
        problem=SimpleNamespace(drive=StandIn(lag_s=lag_s)),
        verdict=SimpleNamespace(chosen=SimpleNamespace(effects=effects)),
    )
    assert (
        "a lag of 0.03 s" in foreign._lag_sentence(findings, can_run=True)
    ) == is_said
