"""Simulations that hold their inputs between samples."""

import math

import numpy as np
import pytest
from scipy.signal import cont2discrete, lsim

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.held_force import is_held, mean_over_steps
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator
from hwid_cli.drive.simulation import NO_FORCE
from hwid_cli.errors import SimulationError
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    RunRequest,
    SimulatorRun,
)
from tests.diagnosis.test_foreign import Count

STEP_S, N, MASS = 0.006, 600, 2.0
TRUE = {"c": 21.0, "k": 4200.0, "kt": 11.0}
GIVEN = {"c": 17.0, "k": 4600.0, "kt": 10.0}
FREE = {name: FreeParameter(one, (one / 5, 5 * one)) for name, one in GIVEN.items()}
DRY, HARDENING = 2.0, 2.2e6


def of(force, current=0.0, **more):
    current = np.broadcast_to(current, N).astype(float)
    return RunRequest("run", STEP_S, current, force, {**TRUE, **more})


def held(request):
    """A stage whose program takes one value for each step."""
    values = request.parameters
    a = np.array([[0.0, 1.0], [-values["k"] / MASS, -values["c"] / MASS]])
    b = np.array([[0.0, 0.0], [values["kt"] / MASS, 1.0 / MASS]])
    step, push, *_ = cont2discrete((a, b, np.eye(2), np.zeros((2, 2))), STEP_S)
    force = request.force if request.force.size else np.zeros(request.input.size)
    state, found = np.zeros(2), []
    for given in np.column_stack([request.input, force]):
        found.append(state)
        state = step @ state + push @ given
    way, speed = np.array(found).T
    return SimulatorRun(way, speed)


def in_lines(request):
    """The same stage with what it is given in straight lines."""
    values = request.parameters
    force = request.force if request.force.size else 0.0
    given = values["kt"] * request.input + force
    time = STEP_S * np.arange(request.input.size)
    system = ([1.0], [MASS, values["c"], values["k"]])
    return SimulatorRun(lsim(system, given, time)[1], np.zeros(0))


@pytest.mark.parametrize("at_force", [True, False])
@pytest.mark.parametrize(("simulate", "expected"), [(held, True), (in_lines, False)])
def test_a_step_tells_whether_a_simulation_holds_what_it_is_given(
    simulate, expected, at_force
):
    wave = np.sin(0.05 * np.arange(N))
    request = of(NO_FORCE, wave)
    assert is_held(simulate, request, at_force=at_force) is expected


def test_a_force_that_is_borne_or_too_much_is_made_larger_or_smaller():
    tried = []

    def simulate(request):
        size = float(np.max(request.force, initial=0.0))
        tried.append(size)
        if size > 500.0:
            return None
        # A force below dry friction moves nothing.
        return held(of(np.where(request.force > 1e-4, request.force, 0.0)))

    assert is_held(simulate, of(NO_FORCE), at_force=True)
    assert tried == [0.0, 1.0]
    tried.clear()

    def stuck(request):
        simulate(request)
        return held(of(np.zeros(N)))

    assert not is_held(stuck, of(NO_FORCE), at_force=True)
    assert tried[1:] == [1.0, 1e-3, 1e3, 1e-6, 1e6]
    assert not is_held(lambda _: None, of(NO_FORCE), at_force=True)
    short = RunRequest("run", STEP_S, np.zeros(20), NO_FORCE, TRUE)
    assert not is_held(held, short, at_force=True)


def test_a_held_mean_moves_a_stage_as_the_line_does():
    time = STEP_S * np.arange(N)
    force = 30.0 * np.sin(2 * np.pi * 4.0 * time)
    line = in_lines(of(force)).output
    size = float(np.std(line))
    late = float(np.std(held(of(force)).output - line))
    mean = float(np.std(held(of(mean_over_steps(force))).output - line))
    assert late > 0.05 * size
    assert mean < 0.02 * size


def measured(levels, rng):
    """The machine: held currents, dry friction and a hardening spring, in fine steps."""
    fine = 40
    dt, x, v, found = STEP_S / fine, 0.0, 0.0, []
    for current in levels.tolist():
        found.append(x)
        for _ in range(fine):
            pull = TRUE["kt"] * current - TRUE["c"] * v - TRUE["k"] * x
            pull -= HARDENING * x**3
            speed = v + dt * pull / MASS
            drag = DRY * dt / MASS
            v = math.copysign(max(abs(speed) - drag, 0.0), speed)
            x += dt * v
    return np.array(found) + 1e-5 * rng.standard_normal(levels.size)


@pytest.mark.thorough
def test_two_forces_are_named_in_a_simulation_that_holds_its_inputs():
    """Held for lines, half a sample of steps of 60 N was 14 times the noise."""
    rng = np.random.default_rng(3)
    time = STEP_S * np.arange(N)
    inputs = (
        np.repeat(rng.uniform(-6.0, 6.0, 12), N // 12),
        np.repeat(rng.uniform(-4.0, 4.0, 24), N // 24),
        6.0 * np.sin(2 * np.pi * 3.0 * time),
        5.0 * np.sin(2 * np.pi * (0.5 + 0.5 * time) * time),
    )
    given = [
        Recording(f"r{row}", one, measured(one, rng), STEP_S)
        for row, one in enumerate(inputs)
    ]
    able = Capabilities(run=True, parameters=True, force=True)
    options = DiagnoseOptions(
        hold_out=("r1",), effects=("coulomb_friction", "cubic_stiffness"), laws="never"
    )
    found = diagnose_foreign(
        given, Simulator(able, held, {}, FREE, GIVEN), options, Count(),
        lambda what, n: None,
    )  # fmt: skip
    assert (found.verdict, found.confirmed) == ("named", "simulation")
    values = {one.id: one.parameters[0].value for one in found.effects}
    assert values == pytest.approx(
        {"coulomb_friction": DRY, "cubic_stiffness": HARDENING}, rel=0.02
    )
    assert found.after.ratio_to_noise < 2.0
    for one in found.base:
        assert one.after == pytest.approx(TRUE[one.name], rel=0.01)


def test_a_run_that_gives_no_answer_is_none():
    def failing(_):
        raise SimulationError("gave nan")

    able = Capabilities(run=True)
    runs = Runs(Simulator(able, failing), CountedRuns(Count()))
    assert runs.once(of(NO_FORCE)) is None
    assert Runs(Simulator(able, None), CountedRuns(Count())).once(of(NO_FORCE)) is None
