"""Diagnosis of a simulation that cannot be opened, by a drive that stands for it.

Its parameters are fitted again where there are some; a linear drive then stands for it
(``stand_in``), and what that lacks is looked for as for any drive. What is found is put
into the simulation itself as a force along its motion, and that run corrects the stand-in,
until both agree: only then is it confirmed. docs/method_diagnosis.md, eq. (D30) to (D33).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hwid_cli.diagnosis.candidate import at_point, fitted_drive, rebuilt
from hwid_cli.diagnosis.causes import left_over, without_repeats
from hwid_cli.diagnosis.diagnose import find, held_out_of
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.parameters import (
    BASE,
    ParameterLayout,
    ParameterPoint,
    each_sum_of_squares,
    residuals_at,
    simulate_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals, prepare
from hwid_cli.diagnosis.rounds import DiagnosisTask, OnRound, RunTasks
from hwid_cli.diagnosis.search import fit_own, fit_point
from hwid_cli.diagnosis.stand_in import (
    Moved,
    corrected,
    derived,
    fit_stand_in,
    force_along,
    force_of_motion,
    in_newtons,
    moved_plainly,
    standing_for,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import NO_FORCE, Motion
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.diagnosis import BaseParameter, Diagnosis
from hwid_cli.records.drive import BASE_PARAMETERS, Drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    RunRequest,
    SimulatorRun,
)
from hwid_cli.records.recordings import Recording

# Derivatives by parameters of the simulation, as a share of their size: its integrator
# may be no more exact than a millionth.
_DIFFERENCE = 1e-3
_MOST_EVALUATIONS = 8
# The same by parameters of effects, in their coordinates: across corners of thresholds.
_EFFECT_DIFFERENCE = 3e-4
# Recordings that its parameters are fitted to.
_MOST_FITTED = 6
# The force of the test push moves the simulation by this share of its motion.
_PUSH = 0.05
_PUSH_LIMITS = (0.005, 0.3)
_MOST_PUSHES = 4
# Runs with the effect, and the share of what remains (or of the noise) by which loop and
# simulation may differ.
_MOST_TURNS = 8
_AGREEMENT = 0.1
_TURN_ITERATIONS = 10
# Searches, each from where the last one has moved the parameters by more than this.
_MOST_SEARCHES = 3
_MOVED = 0.01
# What is confirmed leaves at most so many times the squares that the stand-in left.
_NO_WORSE = 1.2
# The simulation's own parameters rather than further forces, if no more squares are left.
_PREFERRED = 2.0


@dataclass(frozen=True, eq=False)
class Simulator:
    """A simulation as the diagnosis sees it.

    Parameters
    ----------
    run : callable or None
        One run; a function at module level or a partial of one. None where only outputs
        are at hand.
    given : mapping of str to ndarray
        What the simulation gave, by the names of the recordings, where it cannot be run.
    free : mapping of str to FreeParameter
        Parameters that may be fitted again.
    values : mapping of str to float
        All parameters.
    effects : mapping
        Effects that were added to it before.
    """

    capabilities: Capabilities
    run: Callable[[RunRequest], SimulatorRun] | None = None
    given: Mapping[str, np.ndarray] = field(default_factory=dict)
    free: Mapping[str, FreeParameter] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Runs:
    """Runs of a simulation on recordings, by whoever runs tasks."""

    simulator: Simulator
    run_tasks: RunTasks

    def of(
        self,
        signals: Sequence[Signals],
        values: Mapping[str, float],
        forces: Sequence[np.ndarray] = (),
        inputs: Sequence[np.ndarray] = (),
    ) -> list[SimulatorRun]:
        """Run the simulation on every recording.

        Parameters
        ----------
        forces : sequence of ndarray, [N]
            At its force input; empty for none.
        inputs : sequence of ndarray
            In place of the recordings' own; empty for these.
        """
        run = self.simulator.run
        if run is None:
            return [
                SimulatorRun(self.simulator.given[one.name], np.zeros(0))
                for one in signals
            ]
        tasks = []
        for row, one in enumerate(signals):
            force = forces[row] if forces else NO_FORCE
            driven_by = inputs[row] if inputs else one.driven_by
            request = RunRequest(
                one.name, one.sample_time_s, driven_by, force, dict(values)
            )
            content = {"run": one.name, "parameters": dict(values)}
            tasks.append(
                DiagnosisTask(
                    f"run {one.name}", run, (request,), SimulatorRun, content,
                    (driven_by, force),
                )
            )  # fmt: skip
        return list(self.run_tasks(tasks, keep=True))


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
    problem = prepare(recordings, SimulationOptions(), options, held_out)
    problem = without_repeats(problem)
    runs = _Runs(simulator, run_tasks)
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
    for _ in range(_MOST_SEARCHES):
        drive = replace(problem.drive, **_base(fit_stand_in(problem.signals, given)))
        drive = _in_newtons(runs, problem.signals, given, values, drive)
        drive = replace(
            drive, effects={k: dict(v) for k, v in simulator.effects.items()}
        )
        standing = _with_stand_in(problem, drive, given)
        found = find(standing, options, run_tasks, on_round, given_sse)
        on_round("the effect in the simulation", 0)
        found, moved, is_confirmed = _confirmed(found, runs, values)
        is_done = is_confirmed and found.verdict.is_complete
        has_moved = any(
            abs(moved[one] - values[one]) > _MOVED * abs(values[one])
            for one in simulator.free
        )
        values = moved
        if is_done or not has_moved:
            break
        # Parameters that imitated what is missing have led elsewhere.
        given = runs.of(problem.signals, values)
    told = _told(found, simulator, (refitted, values))
    confirmed = "simulation" if is_confirmed else "surrogate"
    return replace(told, confirmed=confirmed)


def _base(drive: Drive) -> dict[str, Any]:
    names = ("mass_kg", "damping_N_s_per_m", "stiffness_N_per_m")
    return {name: getattr(drive, name) for name in (*names, "force_constant_N_per_A")}


def _sse(signals: Sequence[Signals], runs: Sequence[SimulatorRun]) -> np.ndarray:
    left = [
        (one.compared - found.output)[one.evaluated]
        for one, found in zip(signals, runs, strict=True)
    ]
    return np.array([float(one @ one) for one in left])


def _with_stand_in(
    problem: DiagnosisProblem, drive: Drive, given: Sequence[SimulatorRun]
) -> DiagnosisProblem:
    """The problem of a drive that moves as the simulation did."""
    signals = []
    for one, found in zip(problem.signals, given, strict=True):
        moved = derived(found, one.sample_time_s)
        force = force_along(drive, moved, one.driven_by)
        signals.append(standing_for(one, found, replace(drive, effects={}), force))
    return replace(problem, signals=tuple(signals), drive=drive)


def _fit_parameters(
    runs: _Runs, problem: DiagnosisProblem, values: dict[str, float]
) -> dict[str, float]:
    """Parameters of the simulation, fitted to training recordings within their bounds."""
    free = runs.simulator.free
    train = [one for one in problem.signals if not one.is_held_out]
    train = sorted(train, key=lambda one: -float(np.ptp(one.compared)))
    # Large and small ones.
    chosen = train[:: max(1, len(train) // _MOST_FITTED)][:_MOST_FITTED]
    sizes = np.array([abs(one.value) or 1.0 for one in free.values()])
    limits = [one.bounds or (-np.inf, np.inf) for one in free.values()]
    low, high = (np.array(ends) / sizes for ends in zip(*limits, strict=True))

    def at(coordinates: np.ndarray) -> dict[str, float]:
        new = (coordinates * sizes).tolist()
        return {**values, **dict(zip(free, new, strict=True))}

    def errors(coordinates: np.ndarray) -> np.ndarray:
        found = runs.of(chosen, at(coordinates))
        return _errors(chosen, found)

    def slopes(coordinates: np.ndarray) -> np.ndarray:
        here = errors(coordinates)
        columns = []
        for column in range(len(sizes)):
            step = (
                _DIFFERENCE
                if coordinates[column] + _DIFFERENCE <= high[column]
                else (-_DIFFERENCE)
            )
            moved = coordinates.copy()
            moved[column] += step
            columns.append((errors(moved) - here) / step)
        return np.column_stack(columns)

    start = np.array([values[name] for name in free]) / sizes
    found = least_squares(
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
    runs: _Runs,
    signals: Sequence[Signals],
    given: Sequence[SimulatorRun],
    values: Mapping[str, float],
    drive: Drive,
) -> Drive:
    """The stand-in with forces in N, where a force can be put into the simulation."""
    if not runs.simulator.capabilities.force:
        return drive
    row = int(np.argmax([np.ptp(one.output) for one in given]))
    one, before = signals[row], given[row]
    size = float(np.std(before.output))
    push = _test_push(one)
    moved = derived(before, one.sample_time_s)
    force = force_along(drive, moved, one.driven_by)
    plain = moved_plainly(drive, one, force, moved).position
    pushed = moved_plainly(drive, one, force + push, moved).position - plain
    push = push * (_PUSH * size / max(float(np.std(pushed)), 1e-300))
    for _ in range(_MOST_PUSHES):
        (after,) = runs.of([one], values, [push])
        answer = after.output - before.output
        share = float(np.std(answer)) / size
        if _PUSH_LIMITS[0] <= share <= _PUSH_LIMITS[1]:
            break
        push = push * min(max(_PUSH / max(share, 1e-6), 1e-4), 1e4)
    expected = moved_plainly(drive, one, force + push, moved).position - plain
    gain = float(expected @ answer) / max(float(expected @ expected), 1e-300)
    return in_newtons(drive, gain) if gain > 0 else drive


def stand_in_for(
    recordings: Sequence[Recording],
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
) -> tuple[Drive, tuple[Signals, ...]]:
    """Linear drive that stands for a simulation that can be run, and what it was fitted to.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    options : DiagnoseOptions
        Which of them are held out: laws that need a reference count from the others.
    """
    held_out = held_out_of(recordings, options)
    problem = prepare(recordings, SimulationOptions(), options, held_out)
    runs = _Runs(simulator, run_tasks)
    given = runs.of(problem.signals, simulator.values)
    drive = replace(problem.drive, **_base(fit_stand_in(problem.signals, given)))
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


@dataclass(frozen=True, eq=False)
class _Turn:
    """A fit of the chosen set, and how the simulation's own run with it differs.

    Parameters
    ----------
    problem : DiagnosisProblem
        Of the stand-in as it was corrected last.
    fit : CandidateFit
        To it.
    values : dict of str to float
        Parameters of the simulation that go with it.
    tried : tuple of CandidateFit and dict of str to float, or None
        What the simulation itself was run with.
    left : tuple of ndarray, shape (n_evaluated,), [output unit]
        What that run left of each recording.
    disagreement : float, [output unit]
        RMS between that run and what the stand-in had said.
    """

    problem: DiagnosisProblem
    fit: CandidateFit
    values: dict[str, float]
    tried: tuple[CandidateFit, dict[str, float]] | None = None
    left: tuple[np.ndarray, ...] = ()
    disagreement: float = np.inf

    @property
    def sse(self) -> np.ndarray:
        """Sum of squares of each recording that the run left; infinite without one."""
        return each_sum_of_squares(self.left) if self.left else np.array([np.inf])


def _confirmed(
    findings: Findings, runs: _Runs, values: dict[str, float]
) -> tuple[Findings, dict[str, float], bool]:
    """Put what was found into the simulation, and fit it again to what that gives."""
    chosen, verdict = findings.verdict.chosen, findings.verdict
    if runs.simulator.run is None:
        return findings, values, False
    if not chosen.effects and verdict.word in ("none", "unknown"):
        return findings, values, True
    # The simulation's own parameters do what the stand-in's base did; where they cannot,
    # forces that go with displacement, velocity and input do it.
    turn = _Turn(findings.problem, chosen, values)
    best = None
    if runs.simulator.free:
        held = replace(turn, problem=_held(findings.problem))
        best = _best_turn(findings, held, runs)
    if best is None or not _is_as_good(findings, best):
        other = _best_turn(findings, turn, runs)
        if best is None or other.sse.sum() * _PREFERRED < best.sse.sum():
            best = other
    # A run that is worse than without the effect says nothing of it: a map of the
    # simulation may cut off what should come through its input.
    is_worse = float(best.sse.sum()) >= float(findings.base.sse.sum())
    if best.tried is None or is_worse:
        return findings, values, False
    return _with_run(findings, best), best.tried[1], _is_as_good(findings, best)


def _held(problem: DiagnosisProblem) -> DiagnosisProblem:
    """The same with a base that no fit moves."""
    return replace(problem, known=dict.fromkeys(BASE_PARAMETERS, 0.0))


def _best_turn(findings: Findings, turn: _Turn, runs: _Runs) -> _Turn:
    """Turn after turn until stand-in and simulation agree; the best of the runs."""
    best = turn
    for _ in range(_MOST_TURNS):
        following = _next_turn(findings, turn, runs)
        if following is None:
            break
        turn = following
        if turn.sse.sum() < best.sse.sum():
            best = turn
        if _agrees(findings, turn) and _is_as_good(findings, turn):
            break
    return best


def _agrees(findings: Findings, turn: _Turn) -> bool:
    """Whether the run is what the stand-in had said, but for a part of what remains."""
    n = sum(one.n_evaluated for one in turn.problem.signals)
    remains = float(np.sqrt(turn.sse.sum() / n))
    return turn.disagreement <= _AGREEMENT * max(remains, findings.criteria.noise.rms)


def _is_as_good(findings: Findings, turn: _Turn) -> bool:
    """Whether the run leaves no more than the stand-in alone did."""
    return float(turn.sse.sum()) <= _NO_WORSE * float(findings.verdict.chosen.sse.sum())


def _next_turn(findings: Findings, turn: _Turn, runs: _Runs) -> _Turn | None:
    """Run the simulation with the effect's force; correct the stand-in; fit again."""
    problem = turn.problem
    motions = simulate_at(problem, *rebuilt(problem, turn.fit, findings.scales))
    drive = replace(problem.drive, effects={})
    forces = [
        force_of_motion(drive, one, motion)
        for one, motion in zip(problem.signals, motions, strict=True)
    ]
    if not all(np.isfinite(one).all() for one in forces):
        return None
    push = partial(_pushed, runs, problem, turn.fit, forces)
    found = push(turn.values)
    late = [
        run.output - motion.position - (0.0 if one.offset is None else one.offset)
        for one, motion, run in zip(problem.signals, motions, found, strict=True)
    ]
    corrected = _corrected(problem, late, [run.output for run in found], forces)
    following = _Turn(
        problem=corrected,
        fit=turn.fit,
        values=turn.values,
        tried=(turn.fit, turn.values),
        left=_left(problem, motions, found),
        disagreement=_rms_of(problem, late),
    )
    if not problem.known:
        return replace(following, fit=_fitted_again(corrected, turn.fit, findings))
    slopes = _slopes(runs, push, turn.values, found)
    return _with_values(following, slopes, (found, forces), runs, findings)


def _left(
    problem: DiagnosisProblem, motions: Sequence[Motion], found: Sequence[SimulatorRun]
) -> tuple[np.ndarray, ...]:
    """What runs leave of the recordings; a sensor's effect is on top of a run."""
    return tuple(
        (one.compared - run.output - (motion.output - motion.position))[one.evaluated]
        for one, motion, run in zip(problem.signals, motions, found, strict=True)
    )


def _rms_of(problem: DiagnosisProblem, late: Sequence[np.ndarray]) -> float:
    parts = [
        error[one.evaluated] for one, error in zip(problem.signals, late, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def _with_values(
    turn: _Turn,
    slopes: Sequence[np.ndarray],
    run_with: tuple[Sequence[SimulatorRun], Sequence[np.ndarray]],
    runs: _Runs,
    findings: Findings,
) -> _Turn:
    """Fit effects and the simulation's parameters together; move both.

    Parameters
    ----------
    slopes : sequence of ndarray, shape (n_samples, n_free)
    run_with : tuple
        The last runs, and the forces that they were made with.
    """
    found, forces = run_with
    fit, change = _fitted_together(turn.problem, turn.fit, slopes, findings)
    values = dict(turn.values)
    for column, (name, one) in enumerate(runs.simulator.free.items()):
        low, high = one.bounds or (-np.inf, np.inf)
        values[name] = float(np.clip(values[name] + change[column], low, high))
    # What the change of the parameters should do, until the next run shows it.
    more = [one @ change for one in slopes]
    targets = [run.output + add for run, add in zip(found, more, strict=True)]
    problem = _corrected(turn.problem, more, targets, forces)
    return replace(turn, problem=problem, fit=fit, values=values)


def _corrected(
    problem: DiagnosisProblem,
    late: Sequence[np.ndarray],
    targets: Sequence[np.ndarray],
    forces: Sequence[np.ndarray],
) -> DiagnosisProblem:
    """The stand-in with a further force that moves it by what it was late.

    Parameters
    ----------
    late, targets : sequence of ndarray, shape (n_samples,), [output unit]
        What is added to its motion, and where that has to lead.
    forces : sequence of ndarray, [N]
        Of the effect, with which it has to lead there.
    """
    drive = replace(problem.drive, effects={})
    signals = []
    for one, change, target, force in zip(
        problem.signals, late, targets, forces, strict=True
    ):
        signals.append(corrected(one, drive, change, target, force))
    return replace(problem, signals=tuple(signals))


def _slopes(
    runs: _Runs,
    push: Callable[[dict[str, float]], list[SimulatorRun]],
    values: dict[str, float],
    found: Sequence[SimulatorRun],
) -> list[np.ndarray]:
    """Derivatives of each recording's output by the simulation's free parameters.

    Returns
    -------
    list of ndarray, shape (n_samples, n_free)
    """
    columns: list[list[np.ndarray]] = [[] for _ in found]
    for name, one in runs.simulator.free.items():
        step = _DIFFERENCE * (abs(values[name]) or abs(one.value) or 1.0)
        if one.bounds and values[name] + step > one.bounds[1]:
            step = -step
        there = push({**values, name: values[name] + step})
        for row, (after, before) in enumerate(zip(there, found, strict=True)):
            columns[row].append((after.output - before.output) / step)
    return [np.column_stack(one) for one in columns]


def _fitted_together(
    problem: DiagnosisProblem,
    before: CandidateFit,
    slopes: Sequence[np.ndarray],
    findings: Findings,
) -> tuple[CandidateFit, np.ndarray]:
    """Fit of effects and of the simulation's parameters.

    Returns
    -------
    CandidateFit
        As if the parameters had been changed.
    change : ndarray, shape (n_free,)
    """
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    fit_layout, point = rebuilt(problem, before, findings.scales)
    sizes = _sizes(problem, slopes, findings.criteria.noise.rms)
    pushes = _pushes(problem, slopes)
    n_free, n_shared = sizes.size, len(fit_layout.shared)

    def changed(coordinates: np.ndarray) -> DiagnosisProblem:
        change = coordinates[:n_free] * sizes
        signals = tuple(
            replace(one, force=one.force + push @ change)
            for one, push in zip(problem.signals, pushes, strict=True)
        )
        return replace(problem, signals=signals)

    def at(coordinates: np.ndarray) -> ParameterPoint:
        shared = coordinates[n_free : n_free + n_shared]
        own = coordinates[n_free + n_shared :].reshape(len(rows), -1)
        inside = [
            one.coordinate(one.value(q))
            for one, q in zip(fit_layout.shared, shared, strict=True)
        ]
        return ParameterPoint(np.array(inside), own)

    def errors(coordinates: np.ndarray) -> np.ndarray:
        train = changed(coordinates).part(held_out=False)
        return np.concatenate(residuals_at(train, fit_layout, at(coordinates)))

    start = np.r_[np.zeros(n_free), point.shared, point.own[rows].ravel()]
    found = least_squares(errors, start, partial(_derivatives, errors), method="lm")
    fit = _evaluated(changed(found.x), before, fit_layout, at(found.x), findings)
    return fit, found.x[:n_free] * sizes


def _sizes(
    problem: DiagnosisProblem, slopes: Sequence[np.ndarray], noise_rms: float
) -> np.ndarray:
    """Changes of the simulation's parameters that move it by about the noise."""
    lengths = np.sqrt(sum(np.sum(one**2, axis=0) for one in slopes))
    n = sum(one.n_evaluated for one in problem.signals)
    return np.asarray(noise_rms * np.sqrt(n) / np.where(lengths > 0, lengths, 1.0))


def _pushes(
    problem: DiagnosisProblem, slopes: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """Forces that move the stand-in as the simulation's parameters do.

    A change of the output is taken for one of the force, to which the effect reacts.
    """
    drive = replace(problem.drive, effects={})
    return [
        np.column_stack(
            [
                force_along(drive, _moved_by(column, one), np.zeros(column.size))
                for column in slope.T
            ]
        )
        for one, slope in zip(problem.signals, slopes, strict=True)
    ]


def _moved_by(change: np.ndarray, signals: Signals) -> Moved:
    return derived(SimulatorRun(change, np.zeros(0)), signals.sample_time_s)


def _derivatives(
    errors: Callable[[np.ndarray], np.ndarray], point: np.ndarray
) -> np.ndarray:
    """Derivatives by coordinates, by differences that look across corners."""
    before = errors(point)
    columns = []
    for column in range(point.size):
        moved = point.copy()
        moved[column] += _EFFECT_DIFFERENCE
        columns.append((errors(moved) - before) / _EFFECT_DIFFERENCE)
    return np.column_stack(columns)


def _pushed(
    runs: _Runs,
    problem: DiagnosisProblem,
    fit: CandidateFit,
    forces: Sequence[np.ndarray],
    values: Mapping[str, float],
) -> list[SimulatorRun]:
    """Run the simulation with forces, at its force input or through its input's gain."""
    enters = {CATALOGUE[one].enters for one in fit.effects}
    if runs.simulator.capabilities.force and enters - {"command", "output"}:
        return runs.of(problem.signals, values, forces)
    gain = problem.drive.force_constant_N_per_A
    inputs = [
        one.driven_by + force / gain
        for one, force in zip(problem.signals, forces, strict=True)
    ]
    return runs.of(problem.signals, values, (), inputs)


def _fitted_again(
    problem: DiagnosisProblem, before: CandidateFit, findings: Findings
) -> CandidateFit:
    """The same set, from where it was."""
    fit_layout, point = rebuilt(problem, before, findings.scales)
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    found = fit_point(
        problem.part(held_out=False),
        fit_layout,
        ParameterPoint(point.shared, point.own[rows]),
        max_iterations=_TURN_ITERATIONS,
    )
    return _evaluated(problem, before, fit_layout, found.point, findings)


def _evaluated(
    problem: DiagnosisProblem,
    before: CandidateFit,
    fit_layout: ParameterLayout,
    of_train: ParameterPoint,
    findings: Findings,
) -> CandidateFit:
    """The fit with what belongs to each held-out recording alone found from it."""
    own = np.zeros((len(problem.signals), of_train.own.shape[1]))
    held = np.array([one.is_held_out for one in problem.signals])
    own[~held] = of_train.own
    if held.any():
        part = problem.part(held_out=True)
        own[held] = fit_own(part, fit_layout, of_train.shared).own
    point = ParameterPoint(of_train.shared, own)
    return at_point(problem, before, fit_layout, point, findings.criteria.noise)


def _with_run(findings: Findings, turn: _Turn) -> Findings:
    """Findings with what the simulation itself has left with the effect in it.

    The base is free again, so that intervals count what it could take over.
    """
    if turn.tried is None:
        raise ValueError("nothing was run")
    problem, fit, criteria = (
        replace(turn.problem, known={}),
        turn.tried[0],
        findings.criteria,
    )
    drive = problem.drive
    if BASE not in {one.owner for one in fit.names}:
        names = [name for name in BASE_PARAMETERS if getattr(drive, name) != 0]
        fit = replace(
            fit,
            names=(*(ParameterRef(BASE, name) for name in names), *fit.names),
            values=np.r_[[getattr(drive, name) for name in names], fit.values],
        )
    white, cause = left_over(
        turn.left, problem, fitted_drive(drive, fit), criteria.noise
    )
    fit = replace(fit, sse=turn.sse, whiteness=white, cause=cause)
    is_complete = findings.verdict.is_complete or criteria.is_complete(fit)
    verdict = replace(findings.verdict, chosen=fit, is_complete=is_complete)
    return replace(findings, problem=problem, verdict=verdict)


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
