"""Effects and the simulation's own parameters, fitted together beside the stand-in.

docs/method_diagnosis.md, eq. (D32).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import at_point, rebuilt
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.parameters import ParameterLayout, ParameterPoint, residuals_at
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.search import fit_own, fit_point, within_bounds
from hwid_cli.diagnosis.stand_in import Moved, force_of_change, moved_as
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.programs import SimulatorRun

_TURN_ITERATIONS = 10
# Of a search in one turn: beside corners it would go on hundreds of times, and the next
# turn begins there anyway.
_MOST_EVALUATIONS = 30
# Derivatives by parameters of effects, in their coordinates: across corners of thresholds.
_EFFECT_DIFFERENCE = 3e-4
# What a stand-in leaves that runs away, over the largest output: no search goes there.
_FAR = 1e3


def fitted_together(
    problem: DiagnosisProblem,
    before: CandidateFit,
    moved_by: tuple[Sequence[np.ndarray], Sequence[np.ndarray]],
    holds: np.ndarray,
    findings: Findings,
) -> tuple[CandidateFit, np.ndarray] | None:
    """Fit of effects and of the simulation's parameters.

    None where the stand-in has run away, as one whose spring softens may.

    Parameters
    ----------
    moved_by : tuple of two sequences of ndarray, shape (n_samples, n_free)
        What these parameters change: the output, and the force of the stand-in.
    holds : ndarray, shape (n_free,), [output unit/parameter]
        What a change of a parameter counts for beside what is left of the samples, so
        that one which these do not tell apart from others stays where it is.

    Returns
    -------
    CandidateFit
        As if the parameters had been changed.
    change : ndarray, shape (n_free,)
    """
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    fit_layout, point = rebuilt(problem, before, findings.scales)
    slopes, pushes = moved_by
    sizes = noise_sizes(problem, slopes, findings.criteria.noise.rms)
    n_free, n_shared = sizes.size, len(fit_layout.shared)
    far = _FAR * max(float(np.abs(one.compared).max()) for one in problem.signals)

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
        return within_bounds(fit_layout, ParameterPoint(shared, own))

    def errors(coordinates: np.ndarray) -> np.ndarray:
        train = changed(coordinates).part(held_out=False)
        off = residuals_at(train, fit_layout, at(coordinates))
        left = np.concatenate([*off, holds * sizes * coordinates[:n_free]])
        # No search goes where the stand-in runs away.
        return left if np.isfinite(left).all() else np.full(left.size, far)

    start = np.r_[np.zeros(n_free), point.shared, point.own[rows].ravel()]
    if (errors(start) == far).all():
        return None
    found = scipy.optimize.least_squares(
        errors, start, partial(_derivatives, errors), method="lm",
        max_nfev=_MOST_EVALUATIONS,
    )  # fmt: skip
    fit = _evaluated(changed(found.x), before, fit_layout, at(found.x), findings)
    return fit, found.x[:n_free] * sizes


def noise_sizes(
    problem: DiagnosisProblem, slopes: Sequence[np.ndarray], noise_rms: float
) -> np.ndarray:
    """Changes of the simulation's parameters that move it by about the noise.

    Parameters
    ----------
    slopes : sequence of ndarray, shape (n_samples, n_free)
    noise_rms : float, [output unit]

    Returns
    -------
    ndarray, shape (n_free,)
    """
    lengths = np.sqrt(sum(np.sum(one**2, axis=0) for one in slopes))
    n = sum(one.n_evaluated for one in problem.signals)
    return np.asarray(noise_rms * np.sqrt(n) / np.where(lengths > 0, lengths, 1.0))


def pushes_of(
    problem: DiagnosisProblem,
    slopes: Sequence[np.ndarray],
    found: Sequence[SimulatorRun],
) -> list[np.ndarray]:
    """Forces that move the stand-in as the simulation's parameters do.

    A change of the output is taken for one of the force, to which the effect reacts.
    """
    drive = replace(problem.drive, effects={})
    pushes = []
    for one, slope, run in zip(problem.signals, slopes, found, strict=True):
        position = moved_as(one, run).position
        each = [
            force_of_change(drive, _moved_by(column, one), position, one.sample_time_s)
            for column in slope.T
        ]
        pushes.append(np.array(each).reshape(-1, slope.shape[0]).T)
    return pushes


def _moved_by(change: np.ndarray, signals: Signals) -> Moved:
    return moved_as(signals, SimulatorRun(change, np.zeros(0)))


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


def fitted_again(
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
        usual = np.median(of_train.own, axis=0)
        own[held] = fit_own(part, fit_layout, of_train.shared, usual).own
    point = ParameterPoint(of_train.shared, own)
    return at_point(problem, before, fit_layout, point, findings.criteria.noise)
