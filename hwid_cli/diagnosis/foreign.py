"""Diagnosis of a simulation that cannot be opened, by a drive that stands for it.

Its parameters are fitted again where there are some; a linear drive then stands for it
(``stand_in``), and what that lacks is looked for as for any drive. What is found is put
into the simulation itself as a force along its motion, and that run corrects the stand-in,
until both agree: only then is it confirmed. docs/method_diagnosis.md, eq. (D30) to (D33).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hwid_cli.diagnosis.candidate import at_point, rebuilt
from hwid_cli.diagnosis.causes import without_repeats
from hwid_cli.diagnosis.diagnose import find, held_out_of
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.parameters import ParameterPoint, simulate_at
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals, prepare
from hwid_cli.diagnosis.rounds import DiagnosisTask, OnRound, RunTasks
from hwid_cli.diagnosis.search import fit_own, fit_point
from hwid_cli.diagnosis.stand_in import (
    derived,
    fit_stand_in,
    force_along,
    force_of_motion,
    in_newtons,
    moved_plainly,
    standing_for,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import NO_FORCE
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import BaseParameter, Diagnosis
from hwid_cli.records.drive import Drive
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
# Recordings that its parameters are fitted to.
_MOST_FITTED = 6
# The force of the test push moves the simulation by this share of its motion.
_PUSH = 0.05
_PUSH_LIMITS = (0.005, 0.3)
_MOST_PUSHES = 4
# Runs with the effect, and the share of what remains (or of the noise) by which loop and
# simulation may differ.
_MOST_TURNS = 6
_AGREEMENT = 0.1
_TURN_ITERATIONS = 10


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
    given_sse = _sse(problem.signals, given)
    values = dict(simulator.values)
    if simulator.free:
        on_round("its parameters", 0)
        values = _fit_parameters(runs, problem, values)
        given = runs.of(problem.signals, values)
    drive = replace(problem.drive, **_base(fit_stand_in(problem.signals, given)))
    drive = _in_newtons(runs, problem.signals, given, values, drive)
    drive = replace(drive, effects={k: dict(v) for k, v in simulator.effects.items()})
    problem = _with_stand_in(problem, drive, given)
    found = find(problem, options, run_tasks, on_round, given_sse)
    on_round("the effect in the simulation", 0)
    after, is_confirmed = _confirmed(found, runs, values)
    return _told(after, simulator, values, is_confirmed=is_confirmed)


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


def _test_push(signals: Signals) -> np.ndarray:
    """A force that goes to and fro, slowly and fast, from rest to rest."""
    n = signals.driven_by.size
    share = np.arange(n) / max(n - 1, 1)
    waves = sum(np.sin(2 * np.pi * count * share) / count for count in (2, 5, 13))
    return np.asarray(waves * np.sin(np.pi * share))


@dataclass(frozen=True, eq=False)
class _Turn:
    """A fit of the chosen set, and the simulation's own run with it."""

    problem: DiagnosisProblem
    fit: CandidateFit
    outputs: tuple[np.ndarray, ...]
    disagreement: float


def _confirmed(
    findings: Findings, runs: _Runs, values: Mapping[str, float]
) -> tuple[Findings, bool]:
    """Put what was found into the simulation, and fit it again to what that gives."""
    chosen, verdict = findings.verdict.chosen, findings.verdict
    if runs.simulator.run is None:
        return findings, False
    if not chosen.effects and verdict.word in ("none", "unknown"):
        return findings, True
    turn = _Turn(findings.problem, chosen, (), np.inf)
    best = None
    for _ in range(_MOST_TURNS):
        following = _next_turn(findings, turn, runs, values)
        if following is None:
            break
        if best is None or following.disagreement < best.disagreement:
            best = following
        if _agrees(findings, following):
            break
        turn = following
    if best is None or not _agrees(findings, best):
        return findings, False
    return _with_outputs(findings, best), True


def _agrees(findings: Findings, turn: _Turn) -> bool:
    noise = findings.criteria.noise.rms
    n = sum(one.n_evaluated for one in turn.problem.signals)
    remains = float(np.sqrt(turn.fit.sse.sum() / n))
    return turn.disagreement <= _AGREEMENT * max(remains, noise)


def _next_turn(
    findings: Findings, turn: _Turn, runs: _Runs, values: Mapping[str, float]
) -> _Turn | None:
    """Run the simulation with the effect's force; correct the stand-in; fit again."""
    problem, scales = turn.problem, findings.scales
    fit_layout, point = rebuilt(problem, turn.fit, scales)
    motions = simulate_at(problem, fit_layout, point)
    drive = replace(problem.drive, effects={})
    forces = [
        force_of_motion(drive, one, motion)
        for one, motion in zip(problem.signals, motions, strict=True)
    ]
    if not all(np.isfinite(one).all() for one in forces):
        return None
    found = _pushed(runs, problem, turn.fit, forces, values)
    signals, outputs, errors = [], [], []
    for one, motion, force, run in zip(
        problem.signals, motions, forces, found, strict=True
    ):
        offset = np.zeros(1) if one.offset is None else one.offset
        late = run.output - (motion.position + offset)
        errors.append(late[one.evaluated])
        outputs.append(motion.output + offset + late)
        change = SimulatorRun(late, np.zeros(0))
        more = force_along(drive, derived(change, one.sample_time_s), 0 * late)
        better = replace(one, force=one.force + more)
        moved = derived(run, one.sample_time_s)
        plain = moved_plainly(drive, better, better.force + force, moved)
        signals.append(replace(better, offset=run.output - plain.position))
    whole = np.concatenate(errors)
    disagreement = float(np.sqrt(np.mean(whole**2)))
    corrected = replace(problem, signals=tuple(signals))
    fit = _fitted_again(corrected, turn.fit, findings)
    return _Turn(corrected, fit, tuple(outputs), disagreement)


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
    train = problem.part(held_out=False)
    fit_layout, point = rebuilt(problem, before, findings.scales)
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    held = [row for row, one in enumerate(problem.signals) if one.is_held_out]
    start = ParameterPoint(point.shared, point.own[rows])
    found = fit_point(train, fit_layout, start, max_iterations=_TURN_ITERATIONS)
    own = point.own.copy()
    own[rows] = found.point.own
    if held:
        part = problem.part(held_out=True)
        own[held] = fit_own(part, fit_layout, found.point.shared).own
    return at_point(
        problem, before, fit_layout, ParameterPoint(found.point.shared, own),
        findings.criteria.noise,
    )  # fmt: skip


def _with_outputs(findings: Findings, turn: _Turn) -> Findings:
    """Findings with the fit that the simulation itself has confirmed."""
    verdict = replace(findings.verdict, chosen=turn.fit)
    return replace(findings, problem=turn.problem, verdict=verdict)


def _told(
    after: Findings,
    simulator: Simulator,
    values: Mapping[str, float],
    *,
    is_confirmed: bool,
) -> Diagnosis:
    """The diagnosis in the simulation's own words."""
    told = describe(after)
    base = tuple(
        BaseParameter(name, one.value, values[name], values[name])
        for name, one in simulator.free.items()
    )
    return replace(
        told,
        base=base or told.base,
        confirmed="simulation" if is_confirmed else "surrogate",
        capabilities=simulator.capabilities,
    )
