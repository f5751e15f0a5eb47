"""A lag between a simulation's input and where its forces act."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.input_lag import behind_lag, through_input
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.diagnosis.stand_in_fit import fit_stand_in
from hwid_cli.records.drive import HELD, LINE
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, SimulatorRun

STEP_S, N, LAG_S = 1e-3, 1500, 0.012
TIME = STEP_S * np.arange(N)
MASS, DAMPING, GAIN = 0.8, 11.0, 9.0
NOTHING = np.zeros(0)


def commands():
    rng = np.random.default_rng(8)
    swing = np.sin(2 * np.pi * 6 * TIME)
    levels = np.repeat(rng.uniform(-1.0, 1.0, N // 60), 60)
    return [swing, levels, np.clip(TIME - 0.1, 0.0, 0.3)]


def signals(command):
    return Signals("r", "", command, 0 * command, command, 0 * command, STEP_S)


def moved_behind(command, lag_s, stiffness, *, is_held=False, force=0.0):
    """Lag and drive as one state equation of third order; a force acts behind the lag."""
    a = [
        [-1 / lag_s, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [GAIN / MASS, -stiffness / MASS, -DAMPING / MASS],
    ]
    b = [[1 / lag_s, 0.0], [0.0, 0.0], [0.0, 1 / MASS]]
    both = np.column_stack([command, force + 0 * command])
    system = (a, b, [[0.0, 1.0, 0.0]], [[0.0, 0.0]])
    return lsim(system, both, TIME, interp=not is_held)[1]


@pytest.mark.thorough
@pytest.mark.parametrize("stiffness", [0.0, 2100.0])
@pytest.mark.parametrize("hold", [LINE, HELD])
def test_the_lag_and_the_drive_behind_it_are_found(stiffness, hold):
    runs = [
        SimulatorRun(moved_behind(one, LAG_S, stiffness, is_held=hold == HELD), NOTHING)
        for one in commands()
    ]
    given = [signals(one) for one in commands()]
    found = fit_stand_in(given, runs, may_lag=True, hold=hold)
    assert found.lag_s == pytest.approx(LAG_S, rel=0.02)
    assert found.hold == hold
    assert found.mass_kg == pytest.approx(MASS / GAIN, rel=0.02)
    assert found.damping_N_s_per_m == pytest.approx(DAMPING / GAIN, rel=0.05)
    assert found.stiffness_N_per_m == pytest.approx(stiffness / GAIN, rel=0.01)
    assert fit_stand_in(given, runs, hold=hold).lag_s == 0.0


@pytest.mark.thorough
def test_a_drive_without_a_lag_has_none():
    system = ([GAIN], [MASS, DAMPING, 2100.0])
    runs = [SimulatorRun(lsim(system, one, TIME)[1], NOTHING) for one in commands()]
    given = [signals(one) for one in commands()]
    assert fit_stand_in(given, runs, may_lag=True).lag_s == 0.0


@pytest.mark.thorough
def test_what_is_no_lag_stays_as_it_was():
    """A second mass on a spring is none, though a lag would come a little nearer."""
    a = np.zeros((4, 4))
    a[0, 1] = a[2, 3] = 1.0
    a[1] = [-9e3 / 0.4, -15.0 / 0.4, 9e3 / 0.4, 4.0 / 0.4]
    a[3] = [9e3 / 0.4, 4.0 / 0.4, -9.3e3 / 0.4, -4.0 / 0.4]
    system = (a, [[0], [GAIN / 0.4], [0], [0]], [[0, 0, 1, 0]], [[0]])
    runs = [SimulatorRun(lsim(system, one, TIME)[1], NOTHING) for one in commands()]
    found = fit_stand_in([signals(one) for one in commands()], runs, may_lag=True)
    assert found.lag_s == 0.0


@pytest.mark.parametrize("is_held", [False, True])
def test_a_lag_passes_its_input_on_as_its_equation_says(is_held):
    command = commands()[1][:200] + 0.3
    time = TIME[:200]

    def value(t):
        if is_held:
            return command[min(int(t / STEP_S + 1e-9), 199)]
        return np.interp(t, time, command)

    found = solve_ivp(
        lambda t, z: (value(t) - z) / LAG_S, time[[0, -1]], [0.0], t_eval=time,
        max_step=STEP_S / 4, rtol=1e-8,
    )  # fmt: skip
    given = behind_lag(command, LAG_S, STEP_S, is_held=is_held)
    np.testing.assert_allclose(given, found.y[0], atol=2e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("is_held", [False, True])
def test_a_force_through_the_input_does_what_it_does_behind_the_lag(is_held):
    """Friction that turns within a sample, sent through the input and put in behind."""
    force = -2.0 * np.sign(np.sin(2 * np.pi * 3 * TIME + 0.1)) * (TIME > 0.05)
    nothing = np.zeros(N)
    wanted = moved_behind(nothing, LAG_S, 2100.0, force=force)
    size = np.std(wanted)

    def left(lag_s):
        sent = through_input(force, lag_s, STEP_S, is_held=is_held) / GAIN
        answer = moved_behind(sent, LAG_S, 2100.0, is_held=is_held)
        return np.std(answer - wanted) / size

    assert left(LAG_S) < 0.01
    # Late by the lag, and half as early as it has to be.
    assert left(0.0) > 0.2
    assert left(0.5 * LAG_S) > 0.1


def preloaded(command, preload, stiffness=2100.0):
    """The same machine with a preload of its spring, by small steps."""
    finer, found = 20, np.empty(N)
    lagged = way = speed = 0.0
    for row in range(N):
        found[row] = way
        following = command[min(row + 1, N - 1)]
        for part in range(finer):
            at = command[row] + (following - command[row]) * (part + 0.5) / finer
            step = STEP_S / finer
            lagged += step * (at - lagged) / LAG_S
            pull = stiffness * way + preload * np.clip(way / 1e-6, -1.0, 1.0)
            speed += step * (GAIN * lagged - DAMPING * speed - pull) / MASS
            way += step * speed
    return found


@pytest.mark.thorough
def test_outputs_alone_of_a_simulation_with_a_lag_tell_a_preload_behind_it():
    """Its lag, taken for the error of the drive behind it, had left no name."""
    rng = np.random.default_rng(5)
    inputs = {
        f"{n}_{size}": size * one
        for n, one in enumerate(commands())
        for size in (1, -2)
    }
    recordings = [
        Recording(
            name, u, preloaded(u, 1.5) + 2e-6 * rng.standard_normal(N), STEP_S,
            kind="other", input_unit="A", output_unit="m",
        )
        for name, u in inputs.items()
    ]  # fmt: skip
    given = {name: moved_behind(u, LAG_S, 2000.0) for name, u in inputs.items()}
    found = diagnose_foreign(
        recordings, Simulator(Capabilities(run=False), None, given),
        DiagnoseOptions(effects=("spring_preload", "coulomb_friction", "input_delay")),
        lambda tasks, *, keep: [one.function(*one.arguments) for one in tasks],
        lambda what, total: None,
    )  # fmt: skip

    (effect,) = found.effects
    assert (found.verdict, effect.id) == ("named", "spring_preload")
    assert effect.parameters[0].value == pytest.approx(1.5 / GAIN, rel=0.02)
    assert any("passes a lag of 0.012 s" in one for one in found.warnings)
