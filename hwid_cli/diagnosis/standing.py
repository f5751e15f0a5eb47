"""The drive that stands for a simulation with given parameters, and moves as it does.

Where a force can be put into the simulation, a test push says what one N of the stand-in
is. docs/method_diagnosis.md, eq. (D30), (D31).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.diagnose import held_out_of
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals, prepare
from hwid_cli.diagnosis.run_starts import Begun, begin
from hwid_cli.diagnosis.simulator import Runs, Simulator
from hwid_cli.diagnosis.stand_in import (
    Moved,
    derived,
    error_of,
    fit_beside_integral,
    fit_stand_in,
    fit_to_push,
    force_along,
    gain_beside_friction,
    in_newtons,
    moved_plainly,
    standing_for,
    with_change,
    with_input_of,
)
from hwid_cli.diagnosis.tasks import RunTasks
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.drive import LINE, StandIn
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.programs import SimulatorRun
from hwid_cli.records.recordings import Recording

# The force of the test push moves the simulation by this share of its motion.
_PUSH = 0.05
_PUSH_LIMITS = (0.005, 0.3)
_MOST_PUSHES = 4
# Of the force along its motion, for the first guess; and of a push that it did not bear.
_SMALL_PUSH = 1e-3
_WEAKER = 0.1
# A drive that misses a larger share of the answer to a push is no model of what a force
# does, [-].
_MOST_MISSED = 0.05
# Of the push itself a drive beside an integral part leaves a smaller share.
_MOST_UNBALANCED = 0.01
# How a command goes on between samples is the matter of the simulation itself.
ITS_OWN = SimulationOptions(hold=LINE)


def as_given(
    recordings: Sequence[Recording],
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
) -> Begun:
    """Recordings and what a simulation gives by itself, from where they start.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    options : DiagnoseOptions
        Which of them are held out: laws that need a reference count from the others.
    """
    problem = prepare(recordings, ITS_OWN, options, held_out_of(recordings, options))
    return begin(problem, simulator, options, run_tasks)


def stand_in_for(begun: Begun, *, may_curve: bool = True) -> StandIn:
    """Plain drive that stands for a simulation that can be run.

    Parameters
    ----------
    may_curve : bool
        Whether its spring may be curved.
    """
    problem, runs, given = begun.problem, begun.runs, begun.given
    drive = _standing(problem, given, may_curve=may_curve)
    return _in_newtons(runs, problem.signals, given, runs.simulator.values, drive)


def outputs_of_stand_in(begun: Begun) -> dict[str, np.ndarray]:
    """What the drive that stands for a simulation says with what was added to it.

    All that can be said of one that cannot be run.

    Returns
    -------
    dict of str to ndarray, shape (n_samples,)
        By the names of the recordings.
    """
    values = begun.runs.simulator.values
    standing = standing_beside(begun.runs, begun.problem, begun.given, values)
    return begun.beside_recordings(
        [one.simulated for one in compared_as_given(standing)]
    )


def standing_beside(
    runs: Runs,
    problem: DiagnosisProblem,
    given: Sequence[SimulatorRun],
    values: Mapping[str, float],
) -> DiagnosisProblem:
    """The problem of the drive that stands for the simulation with these parameters.

    Parameters
    ----------
    given : sequence of SimulatorRun
        What the simulation gives with them.
    """
    simulator = runs.simulator
    drive = _standing(problem, given)
    drive = _in_newtons(runs, problem.signals, given, values, drive)
    has_force = simulator.capabilities.force
    drive = replace(
        drive,
        effects={k: dict(v) for k, v in simulator.effects.items()},
        own_units=MotionUnits(
            "N" if has_force else problem.input_unit, problem.unit, problem.input_unit
        ),
    )
    standing = _with_stand_in(problem, drive, given)
    standing = replace(standing, drive=with_change(drive, simulator.change))
    if simulator.run is not None:
        return standing
    error = error_of(drive, problem.signals, given)
    return replace(standing, stand_in_error=error)


def _standing(
    problem: DiagnosisProblem, given: Sequence[SimulatorRun], *, may_curve: bool = True
) -> StandIn:
    """The stand-in, with where laws count from."""
    return replace(
        fit_stand_in(problem.signals, given, may_curve=may_curve),
        reference_current_A=problem.drive.reference_current_A,
        reference_displacement_m=problem.drive.reference_displacement_m,
    )


def _with_stand_in(
    problem: DiagnosisProblem, drive: StandIn, given: Sequence[SimulatorRun]
) -> DiagnosisProblem:
    """The problem of a drive that moves as the simulation did."""
    signals = []
    for one, found in zip(problem.signals, given, strict=True):
        moved = derived(found, one.sample_time_s)
        force = force_along(drive, moved, one.driven_by)
        signals.append(standing_for(one, found, replace(drive, effects={}), force))
    return replace(problem, signals=tuple(signals), drive=drive)


def _in_newtons(
    runs: Runs,
    signals: Sequence[Signals],
    given: Sequence[SimulatorRun],
    values: Mapping[str, float],
    drive: StandIn,
) -> StandIn:
    """The stand-in with forces in N, where a force can be put into the simulation.

    One that is fitted to inputs may say nothing of forces: behind a loop that the
    simulation closes, an input is none. Then one that is fitted to the push takes its
    place, if that answers rightly.
    """
    if not runs.simulator.capabilities.force:
        return drive
    first = drive
    for count, row in enumerate(_pushed_rows(given)):
        moved = derived(given[row], signals[row].sample_time_s)
        along = signals[row], moved
        guess = _first_push(drive, *along)
        answered = _answered(runs, signals[row], values, given[row], guess)
        if answered is None:
            continue
        push, there = answered
        answer = there.output - given[row].output
        if not answer.any():
            continue
        gain, missed = _told_by(drive, *along, push, answer)
        in_force = in_newtons(drive, gain) if gain > 0 else drive
        if gain > 0 and missed <= _MOST_MISSED:
            return in_force
        other = _fitted_to_push(signals, given, row, push, there)
        if other is not None:
            return other
        gain, error = gain_beside_friction(signals[row], push, there)
        if gain > 0 and error <= _MOST_MISSED:
            return in_newtons(drive, gain)
        first = first if count else in_force
    return first


def _fitted_to_push(
    signals: Sequence[Signals],
    given: Sequence[SimulatorRun],
    row: int,
    push: np.ndarray,
    there: SimulatorRun,
) -> StandIn | None:
    """A drive that answers a push as a simulation does; None where none does.

    Parameters
    ----------
    row : int
        Of the recording whose run was pushed.
    push : ndarray, shape (n_samples,), [N]
    there : SimulatorRun
        With the push.
    """
    one, runs = signals[row], (given[row], there)
    moved = derived(given[row], one.sample_time_s)
    answer = there.output - given[row].output
    beside, missed = fit_beside_integral(one, push, runs)
    if missed <= _MOST_UNBALANCED:
        return with_input_of(beside, signals, given)
    plain = with_input_of(fit_to_push(one, push, runs), signals, given)
    is_near = plain and _told_by(plain, one, moved, push, answer)[1] <= _MOST_MISSED
    return plain if is_near else None


def _pushed_rows(given: Sequence[SimulatorRun]) -> list[int]:
    """A usual run, and the one that moves most: that may leave a valley for good."""
    order = np.argsort([-float(np.ptp(one.output)) for one in given])
    return list(dict.fromkeys([int(order[order.size // 2]), int(order[0])]))


def _first_push(drive: StandIn, signals: Signals, moved: Moved) -> np.ndarray:
    """A push that moves a drive by a small share of its motion."""
    force = force_along(drive, moved, signals.driven_by)
    plain = moved_plainly(drive, signals, force, moved).position
    # A spring that softens gives way to a large push for good.
    push = _test_push(signals) * _SMALL_PUSH * max(float(np.std(force)), 1e-300)
    pushed = moved_plainly(drive, signals, force + push, moved).position - plain
    size = float(np.std(moved.position))
    return np.asarray(push * (_PUSH * size / max(float(np.std(pushed)), 1e-300)))


def _told_by(
    drive: StandIn, signals: Signals, moved: Moved, push: np.ndarray, answer: np.ndarray
) -> tuple[float, float]:
    """How a simulation's answer to a push goes with that of a drive along its motion.

    Returns
    -------
    float
        Factor between them.
    float, [-]
        Share of the answer's squares that differs.
    """
    force = force_along(drive, moved, signals.driven_by)
    plain = moved_plainly(drive, signals, force, moved).position
    expected = moved_plainly(drive, signals, force + push, moved).position - plain
    gain = float(expected @ answer) / max(float(expected @ expected), 1e-300)
    left = answer - gain * expected
    return gain, float(left @ left) / max(float(answer @ answer), 1e-300)


def _answered(
    runs: Runs,
    signals: Signals,
    values: Mapping[str, float],
    before: SimulatorRun,
    push: np.ndarray,
) -> tuple[np.ndarray, SimulatorRun] | None:
    """A push that moves the simulation enough, and that run; None where none does.

    Parameters
    ----------
    before : SimulatorRun
        Without it.
    push : ndarray, shape (n_samples,), [N]
        The first guess.
    """
    size = float(np.std(before.output))
    found, factor, too_much = None, 1.0, np.inf
    for _ in range(_MOST_PUSHES):
        there = runs.tried([signals], values, [push * factor])
        if there is None:
            too_much = factor
            # The last one that it bore, or a weaker one.
            if found is not None:
                break
            factor *= _WEAKER
            continue
        found = push * factor, there[0]
        share = float(np.std(there[0].output - before.output)) / size
        if _PUSH_LIMITS[0] <= share <= _PUSH_LIMITS[1]:
            break
        factor *= min(max(_PUSH / max(share, 1e-6), 1e-4), 1e4)
        if factor >= too_much:
            break
    return found


def _test_push(signals: Signals) -> np.ndarray:
    """A force that goes to and fro, slowly and fast, from rest to rest."""
    n = signals.driven_by.size
    share = np.arange(n) / max(n - 1, 1)
    waves = sum(np.sin(2 * np.pi * count * share) / count for count in (2, 5, 13))
    return np.asarray(waves * np.sin(np.pi * share))
