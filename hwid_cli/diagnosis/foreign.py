"""Diagnosis of a simulation that cannot be opened, by a drive that stands for it.

Its parameters are fitted again where there are some; a plain drive then stands for it
(``stand_in``), and what that lacks is looked for as for any drive. What is found is put
into the simulation itself as a force along its motion, and that run corrects the stand-in,
until both agree: only then is it confirmed. docs/method_diagnosis.md, eq. (D30) to (D33).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy

from hwid_cli.diagnosis.causes import without_repeats
from hwid_cli.diagnosis.confirmation import confirm
from hwid_cli.diagnosis.diagnose import find, held_out_of
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.laws import MOST_OF_NAMED
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals, prepare
from hwid_cli.diagnosis.selection import LEAST_GAIN
from hwid_cli.diagnosis.simulator import DIFFERENCE, Runs, Simulator
from hwid_cli.diagnosis.single_effects import single_in_simulation
from hwid_cli.diagnosis.stand_in import (
    derived,
    error_of,
    fit_stand_in,
    force_along,
    in_newtons,
    moved_plainly,
    standing_for,
)
from hwid_cli.diagnosis.tasks import OnRound, RunTasks
from hwid_cli.diagnosis.turns import have_moved
from hwid_cli.diagnosis.untold import (
    law_without_forces_told,
    untold_parameters,
    without_forces_told,
)
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.diagnosis import BaseParameter, Diagnosis
from hwid_cli.records.drive import LINE, StandIn
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.programs import SimulatorRun
from hwid_cli.records.recordings import Recording

_MOST_EVALUATIONS = 8
# Recordings that its parameters are fitted to.
_MOST_FITTED = 6
# The force of the test push moves the simulation by this share of its motion.
_PUSH = 0.05
_PUSH_LIMITS = (0.005, 0.3)
_MOST_PUSHES = 4
# Of the force along its motion, for the first guess; and of a push that it did not bear.
_SMALL_PUSH = 1e-3
_WEAKER = 0.1
# Searches, each from where the last one has moved the parameters by more than this.
_MOST_SEARCHES = 3
_MOVED = 0.01
# How a command goes on between samples is the matter of the simulation itself.
_ITS_OWN = SimulationOptions(hold=LINE)


def diagnose_foreign(
    recordings: Sequence[Recording],
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
) -> Diagnosis:
    """Find what a simulation of any kind lacks.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    run_tasks : callable
        Computes tasks, runs of the simulation among them, or takes their results from
        where it kept them.
    """
    held_out = held_out_of(recordings, options)
    problem = prepare(recordings, _ITS_OWN, options, held_out)
    problem = without_repeats(problem)
    runs = Runs(simulator, run_tasks)
    on_round("the simulation as given", len(problem.signals))
    given = runs.of(problem.signals, simulator.values)
    # With effects of its own the stand-in says what the whole simulation leaves, and the
    # parameters are fitted with them.
    given_sse = None if simulator.effects else _sse(problem.signals, given)
    values = dict(simulator.values)
    if simulator.free and not simulator.effects:
        on_round("its parameters", 0)
        values = _fit_parameters(runs, problem, values)
        given = runs.of(problem.signals, values)
    refitted = values
    kept: tuple[Findings, bool, dict[str, float]] | None = None
    for search in range(_MOST_SEARCHES):
        standing = _beside(runs, problem, given, values)
        found, moved, is_confirmed = _found(
            standing, options, (runs, values), on_round, given_sse, is_first=search == 0
        )
        chosen, criteria = found.verdict.chosen, found.criteria
        is_done = is_confirmed and criteria.is_nearly_all(chosen, found.base)
        if is_confirmed or search < _MOST_SEARCHES - 1:
            kept = found, is_confirmed, moved if is_confirmed else values
        if is_done:
            break
        # Parameters that imitated what is missing have led elsewhere; or to where nothing
        # holds in the simulation: the given ones have imitated nothing yet.
        is_in_vain = search == _MOST_SEARCHES - 2 and not is_confirmed
        following = dict(simulator.values) if is_in_vain else moved
        if not have_moved(values, following, _MOVED):
            break
        values = following
        given = runs.of(problem.signals, values)
    if kept is None:
        raise ValueError("no search was made")
    found, is_confirmed, values = kept
    if is_confirmed:
        law = _law_instead(runs, problem, found.verdict, refitted, options, on_round)
        found, values = law or (found, values)
    told = _told(found, simulator, (refitted, values))
    if not is_confirmed:
        return replace(told, confirmed="surrogate")
    return _confirmed(told, found, (runs, values), on_round)


def _beside(
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
    if simulator.run is not None:
        return standing
    error = error_of(drive, problem.signals, given)
    return replace(standing, stand_in_error=error)


def _found(
    standing: DiagnosisProblem,
    options: DiagnoseOptions,
    simulation: tuple[Runs, dict[str, float]],
    on_round: OnRound,
    given_sse: np.ndarray | None,
    *,
    is_first: bool,
) -> tuple[Findings, dict[str, float], bool]:
    """What the stand-in lacks, single effects first, put into the simulation.

    Where one that explains most has moved the parameters, these had imitated it: no set is
    looked for beside a stand-in of the old ones.

    Parameters
    ----------
    simulation : tuple of Runs and dict of str to float
        That it stands for, with these parameters.
    """
    runs, values = simulation
    singles = replace(options, max_effects=1, laws="never")
    if options.laws != "only" and runs.simulator.run is not None:
        found = find(standing, singles, runs.run_tasks, on_round, given_sse)
        on_round("single effects in the simulation", 0)
        alone, moved = single_in_simulation(found, runs, values)
        if alone is not None:
            return alone, moved, True
        if is_first and have_moved(values, moved, _MOVED):
            return found, moved, False
        # Nothing more to look for: no gap, or parameters.
        if found.verdict.word in ("none", "parameters"):
            return confirm(found, runs, values)
    if runs.simulator.run is None:
        standing = _with_nearer_spring(standing, singles, runs.run_tasks, on_round)
    found = find(standing, options, runs.run_tasks, on_round, given_sse)
    on_round("the effect in the simulation", 0)
    return confirm(found, runs, values)


def _law_instead(
    runs: Runs,
    problem: DiagnosisProblem,
    verdict: DiagnosisVerdict,
    values: dict[str, float],
    options: DiagnoseOptions,
    on_round: OnRound,
) -> tuple[Findings, dict[str, float]] | None:
    """A law as short as what is named that leaves far less, if there is one.

    A stand-in that is late at a step may take what is left for its own error; only the
    simulation's run with the effect shows it.

    Parameters
    ----------
    verdict : DiagnosisVerdict
        On the simulation's run.
    values : dict of str to float
        Parameters of the simulation that no effect has moved.
    """
    is_open = options.laws == "auto" and options.effects is None
    if not is_open or verdict.word != "named" or verdict.is_complete:
        return None
    on_round("a law instead", 0)
    standing = _beside(runs, problem, runs.of(problem.signals, values), values)
    only = replace(options, laws="only")
    found = find(standing, only, runs.run_tasks, on_round)
    if found.law is None or len(found.law.terms) > len(verdict.chosen.effects):
        return None
    told, moved, is_confirmed = confirm(found, runs, values)
    criteria, law = told.criteria, told.verdict.chosen
    is_better = criteria.gain(law, verdict.chosen) >= LEAST_GAIN
    least = MOST_OF_NAMED * criteria.excess(verdict.chosen)
    is_clear = told.verdict.is_complete or criteria.excess(law) <= least
    return (told, moved) if is_confirmed and is_better and is_clear else None


def _with_nearer_spring(
    standing: DiagnosisProblem,
    singles: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
) -> DiagnosisProblem:
    """The stand-in whose curved spring changes as the recordings say.

    Outputs do not tell whether a parameter that is off belongs to the straight part of a
    spring alone, as beside a hardening one, or to all of it, as the weight of a pendulum.

    Parameters
    ----------
    singles : DiagnoseOptions
        For single effects alone.
    """
    drive = standing.drive
    if not isinstance(drive, StandIn) or drive.bends == (0.0, 0.0):
        return standing
    whole = replace(drive, one_curve_N_per_m=drive.stiffness_N_per_m)
    problems = (standing, replace(standing, drive=whole))
    found = [find(one, singles, run_tasks, on_round) for one in problems]
    criteria, base = found[0].criteria, found[0].base

    def worth(row: int) -> tuple[bool, float]:
        # Where one of them lacks nothing, the other one's effects make up for its curve.
        one = found[row]
        fits = (one.base, *one.found.fits.values())
        best = max(criteria.gain(fit, base) for fit in fits)
        return criteria.needs_nothing(one.base), best

    return problems[max(range(len(problems)), key=worth)]


def _standing(
    problem: DiagnosisProblem, given: Sequence[SimulatorRun], *, may_curve: bool = True
) -> StandIn:
    """The stand-in, with where laws count from."""
    return replace(
        fit_stand_in(problem.signals, given, may_curve=may_curve),
        reference_current_A=problem.drive.reference_current_A,
        reference_displacement_m=problem.drive.reference_displacement_m,
    )


def _sse(signals: Sequence[Signals], runs: Sequence[SimulatorRun]) -> np.ndarray:
    left = [
        (one.compared - found.output)[one.evaluated]
        for one, found in zip(signals, runs, strict=True)
    ]
    return np.array([float(one @ one) for one in left])


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


def _fit_parameters(
    runs: Runs, problem: DiagnosisProblem, values: dict[str, float]
) -> dict[str, float]:
    """Parameters of the simulation, fitted to training recordings within their bounds."""
    free = runs.simulator.free
    train = [one for one in problem.signals if not one.is_held_out]
    train = sorted(train, key=lambda one: -float(np.ptp(one.compared)))
    # Large and small ones.
    chosen = train[:: max(1, len(train) // _MOST_FITTED)][:_MOST_FITTED]
    sizes = np.array([abs(one.value) or 1.0 for one in free.values()])
    limits = [one.limits for one in free.values()]
    low, high = (np.array(ends) / sizes for ends in zip(*limits, strict=True))
    n_errors = sum(one.n_evaluated for one in chosen)

    def at(coordinates: np.ndarray) -> dict[str, float]:
        new = (coordinates * sizes).tolist()
        return {**values, **dict(zip(free, new, strict=True))}

    def errors(coordinates: np.ndarray) -> np.ndarray:
        found = runs.tried(chosen, at(coordinates))
        # From there the search takes a shorter step.
        return np.full(n_errors, np.inf) if found is None else _errors(chosen, found)

    def slopes(coordinates: np.ndarray) -> np.ndarray:
        here = errors(coordinates)
        columns = []
        for column in range(len(sizes)):
            step = (
                DIFFERENCE
                if coordinates[column] + DIFFERENCE <= high[column]
                else (-DIFFERENCE)
            )
            moved = coordinates.copy()
            moved[column] += step
            slope = (errors(moved) - here) / step
            # At the edge of what it can be run with, a parameter stays.
            columns.append(slope if np.isfinite(slope).all() else np.zeros(n_errors))
        return np.column_stack(columns)

    start = np.array([values[name] for name in free]) / sizes
    found = scipy.optimize.least_squares(
        errors, np.clip(start, low, high), slopes, (low, high), x_scale=1.0,
        max_nfev=_MOST_EVALUATIONS, ftol=1e-6, xtol=1e-5,
    )  # fmt: skip
    return at(found.x)


def _errors(signals: Sequence[Signals], found: Sequence[SimulatorRun]) -> np.ndarray:
    return np.concatenate(
        [
            (one.compared - run.output)[one.evaluated]
            for one, run in zip(signals, found, strict=True)
        ]
    )


def _in_newtons(
    runs: Runs,
    signals: Sequence[Signals],
    given: Sequence[SimulatorRun],
    values: Mapping[str, float],
    drive: StandIn,
) -> StandIn:
    """The stand-in with forces in N, where a force can be put into the simulation."""
    if not runs.simulator.capabilities.force:
        return drive
    row = int(np.argmax([np.ptp(one.output) for one in given]))
    one, before = signals[row], given[row]
    size = float(np.std(before.output))
    moved = derived(before, one.sample_time_s)
    force = force_along(drive, moved, one.driven_by)
    plain = moved_plainly(drive, one, force, moved).position
    # A spring that softens gives way to a large push for good.
    push = _test_push(one) * _SMALL_PUSH * max(float(np.std(force)), 1e-300)
    pushed = moved_plainly(drive, one, force + push, moved).position - plain
    push = push * (_PUSH * size / max(float(np.std(pushed)), 1e-300))
    answered = _answered(runs, one, values, before, push)
    if answered is None:
        return drive
    push, answer = answered
    expected = moved_plainly(drive, one, force + push, moved).position - plain
    gain = float(expected @ answer) / max(float(expected @ expected), 1e-300)
    return in_newtons(drive, gain) if gain > 0 else drive


def _answered(
    runs: Runs,
    signals: Signals,
    values: Mapping[str, float],
    before: SimulatorRun,
    push: np.ndarray,
) -> tuple[np.ndarray, np.ndarray] | None:
    """A push that moves the simulation enough, and by how much; None where none does.

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
        answer = there[0].output - before.output
        found = push * factor, answer
        share = float(np.std(answer)) / size
        if _PUSH_LIMITS[0] <= share <= _PUSH_LIMITS[1]:
            break
        factor *= min(max(_PUSH / max(share, 1e-6), 1e-4), 1e4)
        if factor >= too_much:
            break
    return found


def stand_in_for(
    recordings: Sequence[Recording],
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    *,
    may_curve: bool = True,
) -> tuple[StandIn, tuple[Signals, ...]]:
    """Plain drive that stands for a simulation that can be run, and what it was fitted to.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    options : DiagnoseOptions
        Which of them are held out: laws that need a reference count from the others.
    may_curve : bool
        Whether its spring may be curved.
    """
    held_out = held_out_of(recordings, options)
    problem = prepare(recordings, _ITS_OWN, options, held_out)
    runs = Runs(simulator, run_tasks)
    given = runs.of(problem.signals, simulator.values)
    drive = _standing(problem, given, may_curve=may_curve)
    return (
        _in_newtons(runs, problem.signals, given, simulator.values, drive),
        problem.signals,
    )


def _test_push(signals: Signals) -> np.ndarray:
    """A force that goes to and fro, slowly and fast, from rest to rest."""
    n = signals.driven_by.size
    share = np.arange(n) / max(n - 1, 1)
    waves = sum(np.sin(2 * np.pi * count * share) / count for count in (2, 5, 13))
    return np.asarray(waves * np.sin(np.pi * share))


def _told(
    findings: Findings,
    simulator: Simulator,
    values: tuple[Mapping[str, float], Mapping[str, float]],
) -> Diagnosis:
    """The diagnosis with the simulation's own parameters, re-fitted and at last."""
    told = describe(findings)
    base = tuple(
        BaseParameter(name, one.value, *(of[name] for of in values))
        for name, one in simulator.free.items()
    )
    return replace(told, base=base or told.base, capabilities=simulator.capabilities)


def _confirmed(
    told: Diagnosis,
    findings: Findings,
    simulation: tuple[Runs, Mapping[str, float]],
    on_round: OnRound,
) -> Diagnosis:
    """The diagnosis that the simulation bears out, with what the recordings leave open."""
    on_round("what the recordings leave open", 0)
    untold = untold_parameters(simulation[0], findings, simulation[1])
    effects, law = told.effects, told.law
    if untold.with_forces:
        effects = tuple(without_forces_told(one) for one in effects)
        law = None if law is None else law_without_forces_told(law)
    warnings = (*untold.sentences, *told.warnings)
    return replace(
        told, confirmed="simulation", effects=effects, law=law, warnings=warnings
    )
