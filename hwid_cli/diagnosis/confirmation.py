"""What was found, put into the simulation itself.

An effect becomes a force along the simulation's motion; the run with it corrects the
stand-in, until both agree, while effects and the simulation's own parameters are fitted
together. Only that run confirms. docs/method_diagnosis.md, eq. (D32), (D33).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import at_point, fitted_drive, rebuilt
from hwid_cli.diagnosis.causes import left_over
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.noise import measured_input_rms
from hwid_cli.diagnosis.parameters import (
    BASE,
    ParameterLayout,
    ParameterPoint,
    each_sum_of_squares,
    residuals_at,
    simulate_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.search import fit_own, fit_point
from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED,
    WITHIN_REACH,
    count,
    is_part_of,
    select_best,
)
from hwid_cli.diagnosis.simulator import DIFFERENCE, Runs
from hwid_cli.diagnosis.stand_in import (
    Moved,
    corrected,
    derived,
    force_of_change,
    force_of_motion,
)
from hwid_cli.diagnosis.verdict import DiagnosisVerdict, decide
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import Motion
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.drive import BASE_PARAMETERS
from hwid_cli.records.programs import SimulatorRun

# Runs with the effect, and the share of what remains (or of the noise) by which loop and
# simulation may differ.
_MOST_TURNS = 8
_AGREEMENT = 0.1
# Turns in a row that leave more than the stand-in said, and more than this share of the best
# run before: there it does not settle.
_MOST_IN_VAIN = 3
_WORTH_A_TURN = 0.95
_TURN_ITERATIONS = 10
# Over the noise, what a run may leave because its effect is a little late at corners.
_LATE_AT_CORNERS = 1.1
# Derivatives by the simulation's parameters are found again where one of these has moved by
# more than this share.
_SAME_SLOPES = 0.02
# Derivatives by parameters of effects, in their coordinates: across corners of thresholds.
_EFFECT_DIFFERENCE = 3e-4
# What is confirmed leaves at most so many times the squares that the stand-in left.
_NO_WORSE = 1.2
# The simulation's own parameters rather than further forces, if no more squares are left.
_PREFERRED = 2.0
# An effect through the input that leaves more than this share of what the base leaves is
# tried at the force input as well.
_CUT_OFF = 0.9
# Single effects that the simulation is run with: at most so many, of those that leave at
# most so many times what the best one leaves beside the stand-in, which counts as at least
# this share of what the base leaves.
_MOST_SINGLES = 4
_LIKELY = 4.0
_LEAST_LEFT = 0.01


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
    said : float
        Sum of squares that the stand-in alone left.
    at_force : bool
        Whether forces act at the simulation's force input, not through its input.
    tried : tuple of CandidateFit and dict of str to float, or None
        What the simulation itself was run with.
    slopes : tuple of ndarray, shape (n_samples, n_free)
        Derivatives of each recording's output by the simulation's parameters.
    slopes_at : dict of str to float
        Parameters that they were found at.
    left : tuple of ndarray, shape (n_evaluated,), [output unit]
        What that run left of each recording.
    disagreement : float, [output unit]
        RMS between that run and what the stand-in had said.
    """

    problem: DiagnosisProblem
    fit: CandidateFit
    values: dict[str, float]
    said: float
    at_force: bool
    tried: tuple[CandidateFit, dict[str, float]] | None = None
    slopes: tuple[np.ndarray, ...] = ()
    slopes_at: dict[str, float] = field(default_factory=dict)
    left: tuple[np.ndarray, ...] = ()
    disagreement: float = np.inf

    @property
    def sse(self) -> np.ndarray:
        """Sum of squares of each recording that the run left; infinite without one."""
        return each_sum_of_squares(self.left) if self.left else np.array([np.inf])

    @property
    def values_of_run(self) -> dict[str, float]:
        """Parameters of the simulation's run."""
        return self.values if self.tried is None else self.tried[1]


def confirm(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> tuple[Findings, dict[str, float], bool]:
    """Put what was found into the simulation, and fit it again to what that gives.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation that the stand-in was fitted beside.

    Returns
    -------
    Findings
        Of the simulation's own run; without the effects, which stay a lead, where that
        run leaves clearly more than the stand-in said.
    dict of str to float
        Parameters of the simulation at that run.
    bool
        Whether that run bears the effects out.
    """
    chosen, verdict = findings.verdict.chosen, findings.verdict
    if runs.simulator.run is None:
        return findings, values, False
    if not chosen.effects and verdict.word in ("none", "unknown"):
        return findings, values, True
    best = _settled(findings, chosen, runs, values)
    if best is None:
        return _unconfirmed(findings), values, False
    found, criteria = _with_run(findings, best), findings.criteria
    run = found.verdict.chosen
    is_enough = _is_as_good(best) or criteria.is_nearly_all(run, findings.base)
    if is_enough and not criteria.replaces(run):
        return found, best.values_of_run, True
    return _unconfirmed(findings), best.values_of_run, False


def _unconfirmed(findings: Findings) -> Findings:
    """Findings whose effects the simulation itself, with them in it, does not bear out.

    What a stand-in says is no fact where the simulation says otherwise; it stays a lead.
    """
    if not findings.verdict.chosen.effects:
        return findings
    verdict = DiagnosisVerdict("unknown", False, findings.base, ())
    return replace(findings, verdict=verdict, law=None)


def single_in_simulation(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> tuple[Findings | None, dict[str, float]]:
    """Put the likely single effects into the simulation, and let its runs decide.

    Where the simulation is not linear, what the stand-in leaves of a large effect is its
    own error as well: sets of effects would be found that make up for it.

    Parameters
    ----------
    findings : Findings
        Of single effects.

    Returns
    -------
    Findings or None
        None where no single effect leaves so little in the simulation that a further
        one could not be named.
    dict of str to float
        Parameters of the simulation at the run that decides; without one, at the best run
        of an effect that explains most, which the parameters may have imitated.
    """
    if not findings.base.is_usable:
        return None, values
    alone = _base_in_simulation(findings, runs, values)
    if alone is not None:
        return alone
    tried: dict[tuple[str, ...], _Turn] = {}
    fits: dict[tuple[str, ...], CandidateFit] = {}
    for one in _likely(findings):
        if _is_settled_by(findings, one, list(fits.values())):
            continue
        turn = _settled(findings, one, runs, values)
        if turn is not None:
            tried[one.effects], fits[one.effects] = turn, _fit_of_run(findings, turn)
    decided = _decided(findings, tried, fits)
    if decided is not None:
        return decided
    return None, _moved_by_best(findings, tried, fits, values)


def _moved_by_best(
    findings: Findings,
    tried: Mapping[tuple[str, ...], _Turn],
    fits: Mapping[tuple[str, ...], CandidateFit],
    values: dict[str, float],
) -> dict[str, float]:
    """Parameters at the best run, where its effect explains most; the given ones else."""
    best = select_best(findings.criteria, list(fits.values()), findings.base)
    if best is None:
        return values
    explained = findings.criteria.evidence(best, findings.base).explained
    return tried[best.effects].values_of_run if explained >= LEAST_EXPLAINED else values


def _base_in_simulation(
    findings: Findings, runs: Runs, values: dict[str, float]
) -> tuple[Findings, dict[str, float]] | None:
    """The changed base of the stand-in, put into a simulation without parameters.

    The simulation answers in its own way to a gain that has changed: what the stand-in
    leaves then is its own error.
    """
    if runs.simulator.free:
        return None
    turn = _settled(findings, findings.base, runs, values)
    base = None if turn is None else _fit_of_run(findings, turn)
    if turn is None or base is None or not findings.criteria.is_complete(base):
        return None
    criteria = findings.criteria
    verdict = decide(criteria, findings.given_sse, base, {}, (), lambda _: ())
    problem = replace(turn.problem, known={})
    told = replace(findings, problem=problem, base=base, verdict=verdict)
    return told, turn.values_of_run


def _likely(findings: Findings) -> list[CandidateFit]:
    """Single effects that leave least beside the stand-in, limit cases first."""
    criteria = findings.criteria
    usable = [one for one in findings.found.fits.values()
              if one.is_usable and len(one.effects) == 1
              and not criteria.replaces(one)]  # fmt: skip
    usable.sort(key=criteria.excess)
    if not usable:
        return []
    least = max(
        criteria.excess(usable[0]), _LEAST_LEFT * criteria.excess(findings.base)
    )
    near = [one for one in usable if criteria.excess(one) <= _LIKELY * least]
    first = near[:_MOST_SINGLES]
    # What leaves little more with fewer parameters may be all of it.
    limits = [one for one in near if one not in first
              and any(is_part_of(one, wide) for wide in first)]  # fmt: skip
    return sorted([*first, *limits], key=lambda one: -_n_including(one, near))


def _n_including(one: CandidateFit, others: Sequence[CandidateFit]) -> int:
    """Of how many others an effect is a limit case."""
    return sum(is_part_of(one, other) for other in others if other is not one)


def _is_settled_by(
    findings: Findings, one: CandidateFit, fits: Sequence[CandidateFit]
) -> bool:
    """Whether runs with other effects leave nothing that an effect could explain.

    Of effects with fewer parameters the simulation itself decides: what the stand-in leaves
    of them more than of others may be its own error.
    """
    criteria = findings.criteria
    if any(criteria.is_complete(fit) and is_part_of(fit, one) for fit in fits):
        return True
    done = [fit for fit in fits if criteria.is_nearly_all(fit, findings.base)]
    is_simpler = any(is_part_of(one, fit) or count(one) < count(fit) for fit in done)
    return bool(done) and not is_simpler and not _is_near(findings, one, done)


def _settled(
    findings: Findings, fit: CandidateFit, runs: Runs, values: dict[str, float]
) -> _Turn | None:
    """Best run of the simulation with a set of effects; None if it is no better."""
    has_force = runs.simulator.capabilities.force
    enters = {CATALOGUE[one].enters for one in fit.effects}
    at_force = has_force and bool(enters - {"command", "output"})
    said = float(fit.sse.sum())
    turn = _Turn(findings.problem, fit, values, said, at_force)
    best = _best_of(findings, turn, runs)
    without = float(findings.base.sse.sum())
    if (
        fit.effects
        and has_force
        and not at_force
        and best.sse.sum() > _CUT_OFF * without
    ):
        # A map of the simulation may cut off what should come through its input.
        other = _best_of(findings, replace(turn, at_force=True), runs)
        best = min(best, other, key=lambda one: float(one.sse.sum()))
    # A run that is worse than without the effect says nothing of it.
    is_worse = bool(fit.effects) and float(best.sse.sum()) >= without
    return None if best.tried is None or is_worse else best


def _best_of(findings: Findings, turn: _Turn, runs: Runs) -> _Turn:
    """Best turn, of those in which the simulation's own parameters may do enough.

    They do what the stand-in's base did; where they cannot, forces that go with
    displacement, velocity and input do it.
    """
    best = None
    if runs.simulator.free:
        held = replace(turn, problem=_held(findings.problem))
        best = _best_turn(findings, held, runs)
    if best is None or not _is_as_good(best):
        other = _best_turn(findings, turn, runs)
        if best is None or other.sse.sum() * _PREFERRED < best.sse.sum():
            best = other
    return best


def _is_near(
    findings: Findings, one: CandidateFit, done: Sequence[CandidateFit]
) -> bool:
    """Whether the stand-in takes an effect for about as good as one that is enough."""
    said = findings.found.fits
    least = min(findings.criteria.excess(said[fit.effects]) for fit in done)
    return findings.criteria.excess(one) <= WITHIN_REACH * least


def _decided(
    findings: Findings,
    tried: Mapping[tuple[str, ...], _Turn],
    fits: Mapping[tuple[str, ...], CandidateFit],
) -> tuple[Findings, dict[str, float]] | None:
    """The verdict by runs of the simulation, if one of its effects is all."""
    criteria, base = findings.criteria, findings.base
    best = select_best(criteria, list(fits.values()), base)
    if best is None:
        return None

    def unclear(one: CandidateFit) -> tuple[str, ...]:
        problem = replace(tried[one.effects].problem, known={})
        return unclear_effects(problem, one, findings.scales)

    verdict = decide(criteria, findings.given_sse, base, fits, (best,), unclear)
    if not verdict.chosen.effects or not criteria.is_nearly_all(verdict.chosen, base):
        return None
    turn = tried[verdict.chosen.effects]
    found = replace(findings.found, fits={**findings.found.fits, **fits})
    problem = replace(turn.problem, known={})
    told = replace(findings, problem=problem, verdict=verdict, found=found)
    return told, turn.values_of_run


def _held(problem: DiagnosisProblem) -> DiagnosisProblem:
    """The same with a base that no fit moves."""
    return replace(problem, known=dict.fromkeys(BASE_PARAMETERS, 0.0))


def _best_turn(findings: Findings, turn: _Turn, runs: Runs) -> _Turn:
    """Turn after turn until stand-in and simulation agree; the best of the runs.

    Agreement within a part of the noise still shows beside many samples: while something
    remains, one more turn follows.
    """
    best, agreed, in_vain = turn, 0, 0
    for _ in range(_MOST_TURNS):
        following = _next_turn(findings, turn, runs)
        if following is None:
            break
        turn = following
        is_worth_it = turn.sse.sum() < _WORTH_A_TURN * best.sse.sum()
        in_vain = 0 if is_worth_it or _is_as_good(turn) else in_vain + 1
        if turn.sse.sum() < best.sse.sum():
            best = turn
        agreed = agreed + 1 if _agrees(findings, turn) and _is_as_good(turn) else 0
        is_enough = agreed > 0 and findings.criteria.is_complete(
            _fit_of_run(findings, turn)
        )
        if is_enough or agreed > 1 or in_vain == _MOST_IN_VAIN:
            break
    return best


def _agrees(findings: Findings, turn: _Turn) -> bool:
    """Whether the run is what the stand-in had said, but for a part of what remains."""
    n = sum(one.n_evaluated for one in turn.problem.signals)
    remains = float(np.sqrt(turn.sse.sum() / n))
    return turn.disagreement <= _AGREEMENT * max(remains, findings.criteria.noise.rms)


def _is_as_good(turn: _Turn) -> bool:
    """Whether the run leaves no more than the stand-in alone did."""
    return float(turn.sse.sum()) <= _NO_WORSE * turn.said


def _next_turn(findings: Findings, turn: _Turn, runs: Runs) -> _Turn | None:
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
    push = partial(_pushed, runs, problem, forces, turn.at_force)
    found = push(turn.values)
    if found is None:
        return None
    late = [
        run.output - motion.position - (0.0 if one.offset is None else one.offset)
        for one, motion, run in zip(problem.signals, motions, found, strict=True)
    ]
    corrected = _corrected(problem, late, [run.output for run in found], forces)
    following = _Turn(
        problem=corrected,
        fit=turn.fit,
        values=turn.values,
        said=turn.said,
        at_force=turn.at_force,
        slopes=turn.slopes,
        slopes_at=turn.slopes_at,
        tried=(turn.fit, turn.values),
        left=_left(problem, motions, found),
        disagreement=_rms_of(problem, late),
    )
    if not problem.known:
        return replace(following, fit=_fitted_again(corrected, turn.fit, findings))
    if not turn.slopes or have_moved(turn.slopes_at, turn.values, _SAME_SLOPES):
        slopes = tuple(_slopes(runs, push, turn.values, found))
        following = replace(following, slopes=slopes, slopes_at=turn.values)
    return _with_values(following, (found, forces), runs, findings)


def have_moved(
    before: Mapping[str, float], now: Mapping[str, float], share: float
) -> bool:
    """Whether a parameter of a simulation is elsewhere.

    Parameters
    ----------
    share : float, [-]
        Of its value before, by which it may have changed.
    """
    return any(abs(now[one] - before[one]) > share * abs(before[one]) for one in before)


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
    run_with: tuple[Sequence[SimulatorRun], Sequence[np.ndarray]],
    runs: Runs,
    findings: Findings,
) -> _Turn:
    """Fit effects and the simulation's parameters together; move both.

    Parameters
    ----------
    run_with : tuple
        The last runs, and the forces that they were made with.
    """
    (found, forces), slopes = run_with, turn.slopes
    pushes = _pushes(turn.problem, slopes, found)
    fit, change = _fitted_together(turn.problem, turn.fit, (slopes, pushes), findings)
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
    runs: Runs,
    push: Callable[[dict[str, float]], list[SimulatorRun] | None],
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
        step = DIFFERENCE * (abs(values[name]) or abs(one.value) or 1.0)
        if one.bounds and values[name] + step > one.bounds[1]:
            step = -step
        # Where it cannot be run with more of a parameter, that one stays.
        there = push({**values, name: values[name] + step}) or found
        for row, (after, before) in enumerate(zip(there, found, strict=True)):
            columns[row].append((after.output - before.output) / step)
    return [np.column_stack(one) for one in columns]


def _fitted_together(
    problem: DiagnosisProblem,
    before: CandidateFit,
    moved_by: tuple[Sequence[np.ndarray], Sequence[np.ndarray]],
    findings: Findings,
) -> tuple[CandidateFit, np.ndarray]:
    """Fit of effects and of the simulation's parameters.

    Parameters
    ----------
    moved_by : tuple of two sequences of ndarray, shape (n_samples, n_free)
        What these parameters change: the output, and the force of the stand-in.

    Returns
    -------
    CandidateFit
        As if the parameters had been changed.
    change : ndarray, shape (n_free,)
    """
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    fit_layout, point = rebuilt(problem, before, findings.scales)
    slopes, pushes = moved_by
    sizes = _sizes(problem, slopes, findings.criteria.noise.rms)
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
    found = scipy.optimize.least_squares(
        errors, start, partial(_derivatives, errors), method="lm"
    )
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
    problem: DiagnosisProblem,
    slopes: Sequence[np.ndarray],
    found: Sequence[SimulatorRun],
) -> list[np.ndarray]:
    """Forces that move the stand-in as the simulation's parameters do.

    A change of the output is taken for one of the force, to which the effect reacts.
    """
    drive = replace(problem.drive, effects={})
    return [
        np.column_stack(
            [
                force_of_change(drive, _moved_by(column, one), run.output)
                for column in slope.T
            ]
        )
        for one, slope, run in zip(problem.signals, slopes, found, strict=True)
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
    runs: Runs,
    problem: DiagnosisProblem,
    forces: Sequence[np.ndarray],
    at_force: bool,
    values: Mapping[str, float],
) -> list[SimulatorRun] | None:
    """Run the simulation with forces, at its force input or through its input's gain.

    None where a run gives no answer: the force may lead where the simulation ends.
    """
    if at_force:
        return runs.tried(problem.signals, values, forces)
    gain = problem.drive.force_constant_N_per_A
    inputs = [
        one.driven_by + force / gain
        for one, force in zip(problem.signals, forces, strict=True)
    ]
    return runs.tried(problem.signals, values, (), inputs)


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
    """Findings with what the simulation itself has left with the effect in it."""
    fit = _fit_of_run(findings, turn)
    is_complete = findings.criteria.is_complete(fit)
    verdict = replace(findings.verdict, chosen=fit, is_complete=is_complete)
    problem = replace(turn.problem, known={})
    return replace(findings, problem=problem, verdict=verdict)


def _fit_of_run(findings: Findings, turn: _Turn) -> CandidateFit:
    """What the simulation was run with, and how that does.

    The base is free again, so that intervals count what it could take over.
    """
    if turn.tried is None:
        raise ValueError("nothing was run")
    fit, drive = turn.tried[0], turn.problem.drive
    if BASE not in {one.owner for one in fit.names}:
        names = [name for name in BASE_PARAMETERS if getattr(drive, name) != 0]
        fit = replace(
            fit,
            names=(*(ParameterRef(BASE, name) for name in names), *fit.names),
            values=np.r_[[getattr(drive, name) for name in names], fit.values],
        )
    fit = replace(fit, sse=turn.sse)
    # At corners a force between samples is late as an input is, by a little.
    is_late = findings.criteria.ratio(fit) <= _LATE_AT_CORNERS
    noise = findings.criteria.noise
    if not is_late:
        noise = replace(noise, input_rms=measured_input_rms(turn.problem))
    problem = replace(turn.problem, known={})
    white, cause = left_over(turn.left, problem, fitted_drive(drive, fit), noise)
    return replace(fit, whiteness=white, cause=cause)
