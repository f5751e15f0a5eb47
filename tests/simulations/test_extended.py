from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli.errors import SimulationError
from hwid_cli.records.drive import Drive, StandIn
from hwid_cli.records.programs import PythonSimulation, RunRequest, SimulatorRun
from hwid_cli.simulations import fmu
from hwid_cli.simulations.extended import (
    ExtendedSimulation,
    run_extended,
    simulate_extended,
)
from tests.simulations.fmu_examples import make_fmu, needs_compiler
from tests.simulations.test_fmu import section

STEP_S, FRICTION_N = 1e-3, 0.8
TIMES = STEP_S * np.arange(1000)
CURRENTS = {
    "slow": 2 * np.sin(2 * np.pi * 4 * TIMES),
    "fast": 4 * np.sin(2 * np.pi * 11 * TIMES),
    "to and fro": np.interp(TIMES, [0.05, 0.08, 0.5, 0.55], [0, 2, 2, 0]),
    "mostly stuck": 0.3 * np.sin(2 * np.pi * 4 * TIMES),
}
EXACT = Drive(0.3, 15.0, 1184.0, 5.0)
# A stand-in may be this wrong.
ROUGH = Drive(0.33, 12.0, 1000.0, 5.0)
FRICTION = {"coulomb_friction": {"force_N": FRICTION_N}}


@pytest.fixture(scope="module")
def plants(tmp_path_factory):
    """The plant, and the same with friction inside its own C code, in steps of 1 us."""
    folder = tmp_path_factory.mktemp("plants")
    rubbing = make_fmu(folder, name="rub", coulomb_N=FRICTION_N, internal_step_s=1e-6)
    yield section(make_fmu(folder)), section(rubbing)
    fmu._PROCESS.end()


def request_of(current):
    return RunRequest("a", STEP_S, current, np.zeros(0), {})


@needs_compiler
@pytest.mark.parametrize("name", CURRENTS)
@pytest.mark.parametrize("plain", [EXACT, ROUGH])
@pytest.mark.parametrize("has_force", [True, False])
def test_friction_is_inside_within_one_percent(plants, name, plain, has_force):
    given, rubbing = plants
    request = request_of(CURRENTS[name])
    truth = fmu.KIND.run(rubbing, request).output
    before = fmu.KIND.run(given, request).output

    found = run_extended(
        partial(fmu.KIND.run, given),
        request,
        (plain, replace(plain, effects=FRICTION)),
        has_force=has_force,
    )

    assert np.std(found.output - truth) < 0.01 * np.std(before - truth)


@needs_compiler
def test_a_force_of_the_users_own_acts_beside_the_effects(plants):
    given, rubbing = plants
    request = replace(request_of(CURRENTS["slow"]), force=3 * np.sin(40 * TIMES))
    truth = fmu.KIND.run(rubbing, request).output
    before = fmu.KIND.run(given, request).output

    found = run_extended(
        partial(fmu.KIND.run, given),
        request,
        (EXACT, replace(EXACT, effects=FRICTION)),
        has_force=True,
    )

    assert np.std(found.output - truth) < 0.01 * np.std(before - truth)


def noisy_current():
    """Off from the first sample on, to and fro, with pauses in which friction holds."""
    rng = np.random.default_rng(4)
    pushes = np.interp(TIMES, [0.1, 0.13, 0.4, 0.45, 0.7, 0.72], [1, 3, 3, -1, -1, 2])
    return pushes + 0.02 * rng.standard_normal(TIMES.size)


def frictionless(request, is_in_balance):
    """The plant as a user may write it: it starts at 0, or where its first input rests."""
    pushed = 5.0 * request.input + (request.force if request.force.size else 0.0)
    system = ([[0, 1], [-1184 / 0.3, -50]], [[0], [1 / 0.3]], np.eye(2), [[0], [0]])
    first = [pushed[0] / 1184 if is_in_balance else 0.0, 0.0]
    moved = lsim(system, pushed, request.sample_time_s * np.arange(pushed.size), first)
    return SimulatorRun(moved[1][:, 0], moved[1][:, 1])


def with_friction(current, start_m, n_steps=100):
    """Position of the plant with dry friction, in small steps that know no stand-in."""
    x, v, step = start_m, 0.0, STEP_S / n_steps
    found = [x]
    for before, after in pairwise(5.0 * current):
        for share in (np.arange(n_steps) + 0.5) / n_steps:
            push = before + (after - before) * share - 15 * v - 1184 * x
            if v == 0 and abs(push) <= FRICTION_N:
                continue
            way = np.sign(v) or np.sign(push)
            faster = v + step / 0.3 * (push - FRICTION_N * way)
            # It comes to rest before it turns.
            faster = 0.0 if v * faster < 0 else faster
            x, v = x + step * (v + faster) / 2, faster
        found.append(x)
    return np.array(found)


@pytest.mark.thorough
@pytest.mark.parametrize("is_in_balance", [False, True])
@pytest.mark.parametrize("plain", [EXACT, ROUGH])
def test_friction_holds_where_the_simulation_starts(plain, is_in_balance):
    request = request_of(noisy_current())
    simulate = partial(frictionless, is_in_balance=is_in_balance)
    before = simulate(request).output
    truth = with_friction(request.input, before[0])

    drives = plain, replace(plain, effects=FRICTION)
    found = run_extended(simulate, request, drives, has_force=True)

    size = np.ptp(before - truth)
    assert found.output[0] == pytest.approx(before[0], abs=0.01 * size)
    assert rms(found.output - truth) < 0.01 * rms(before - truth)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def behind_a_valve(request, friction=0.0, n_steps=20):
    """The plant behind a lag of 10 ms; friction holds as in small steps."""
    x = v = z = 0.0
    step, found = STEP_S / n_steps, [0.0]
    for before, after in pairwise(5.0 * request.input):
        for share in (np.arange(n_steps) + 0.5) / n_steps:
            z += step * (before + (after - before) * share - z) / 0.01
            free = v + step * (z - 15 * v - 1184 * x) / 0.3
            most = step * friction / 0.3
            v = 0.0 if abs(free) <= most else free - np.sign(free) * most
            x += step * v
        found.append(x)
    return SimulatorRun(np.array(found), np.zeros(0))


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["slow", "fast", "to and fro"])
def test_friction_behind_a_lag_comes_through_the_input_in_time(name):
    request = request_of(CURRENTS[name])
    truth = behind_a_valve(request, FRICTION_N).output
    before = behind_a_valve(request).output

    def left(lag_s):
        plain = StandIn(0.33, 12.0, 1100.0, 5.0, lag_s=lag_s)
        drives = (plain, replace(plain, effects=FRICTION))
        found = run_extended(behind_a_valve, request, drives, has_force=False)
        return np.std(found.output - truth) / np.std(before - truth)

    assert left(0.01) < 0.02
    assert left(0.0) > 0.25


def test_an_effect_that_does_nothing_in_a_recording_is_no_fault():
    """The simulation's own integrator is no more exact than what is left then."""
    rng, request = np.random.default_rng(3), request_of(CURRENTS["slow"])

    def inexact(asked):
        run = frictionless(asked, is_in_balance=False)
        size = 3e-5 * np.std(run.output)
        return replace(run, output=run.output + size * rng.standard_normal(TIMES.size))

    limit = {"input_saturation": {"limit_A": 3.0}}
    drives = EXACT, replace(EXACT, effects=limit)
    found = run_extended(inexact, request, drives, has_force=False)
    given = inexact(request).output
    assert rms(found.output - given) < 1e-3 * np.std(given)


FUNCTION = """\
from scipy.signal import lsim
import numpy as np

def simulate(time_s, inputs, parameters):
    d, k = parameters["damping"], 1184.0
    system = ([[0, 1], [-k / 0.3, -d / 0.3]], [[0], [5 / 0.3]], np.eye(2), [[0], [0]])
    y = lsim(system, inputs["u"], time_s)[1]
    return {"x": y[:, 0], "v": y[:, 1]}
"""


@pytest.fixture
def extended(tmp_path):
    (tmp_path / "plant.py").write_text(FUNCTION)
    base = PythonSimulation(
        file=str(tmp_path / "plant.py"),
        input="u",
        output="x",
        velocity="v",
        parameters={"damping": 12.0},
    )
    drag = {"quadratic_drag": {"drag_N_s2_per_m2": 40.0}}
    plain = replace(EXACT, damping_N_s_per_m=12.0)
    return ExtendedSimulation(base, plain, replace(plain, effects=drag))


@pytest.mark.thorough
def test_a_function_with_drag(extended):
    from scipy.integrate import solve_ivp

    current = CURRENTS["slow"]

    found = simulate_extended(extended, TIMES, {"u": current}, {"damping": 15.0})

    def motion(t, state):
        x, v = state
        push = 5 * np.interp(t, TIMES, current) - 15 * v - 1184 * x - 40 * v * abs(v)
        return [v, push / 0.3]

    truth = solve_ivp(
        motion,
        (0, TIMES[-1]),
        [0, 0],
        t_eval=TIMES,
        rtol=1e-9,
        atol=1e-12,
        max_step=1e-3,
    ).y
    bare = simulate_extended(
        replace(extended, stand_in=extended.plain),
        TIMES,
        {"u": current},
        {"damping": 15.0},
    )
    assert np.std(found["x"] - truth[0]) < 0.01 * np.std(bare["x"] - truth[0])
    assert np.std(found["v"] - truth[1]) < 0.01 * np.std(bare["v"] - truth[1])


@pytest.mark.thorough
def test_one_that_does_not_settle_is_no_answer(extended):
    # A stand-in far too heavy: what it takes for its friction is none of the function's.
    wrong = replace(extended.plain, mass_kg=3000.0)
    strange = {"coulomb_friction": {"force_N": 3.0}}
    extended = replace(extended, plain=wrong, stand_in=replace(wrong, effects=strange))

    with pytest.raises(SimulationError, match="does not settle"):
        simulate_extended(extended, TIMES, {"u": CURRENTS["slow"]}, {})


@pytest.mark.parametrize("time_s", [[0.0], [0.0, 0.1, 0.3], [0.0, 0.0, 0.0]])
def test_times_in_unequal_steps(extended, time_s):
    with pytest.raises(SimulationError, match="steps that are not equal"):
        simulate_extended(extended, np.array(time_s), {"u": np.zeros(len(time_s))}, {})
