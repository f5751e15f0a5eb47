"""Fit of a drive's base and effects to recordings by its simulation error.

Levenberg-Marquardt on the residuals of all recordings together. Parameters that belong
to one recording only (a phase, a factor, a start) change that recording alone, so one
simulation of all recordings gives the derivatives by all of them; for given shared
values they are found from that recording.

Derivatives by differences cost one simulation for each parameter. Between two sets of
them further steps use what the last steps have shown of the change (secant steps).

References
----------
Marquardt (1963); damping rule of Nielsen (1999), IMM-REP-1999-05; Broyden (1965).
docs/method_diagnosis.md, eq. (D16) to (D18b).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.parameters import (
    BASE,
    START,
    ParameterLayout,
    ParameterPoint,
    Unknown,
    first_point,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import ParameterRef

# Difference for derivatives, in coordinates; large enough to look across the corners of
# thresholds, small enough for a straight line.
_DIFFERENCE = 3e-4
LEAST_GAIN = 2e-5
# What is far from the noise is fitted so far only: other effects are missing, and sets of
# effects differ by much more.
LEAST_GAIN_FAR = 5e-4
# A step that promises less than this is not tried shorter.
LEAST_PROMISE = 2e-6
_FIRST_DAMPING = 1e-3
_LARGEST_DAMPING = 1e8
_LARGEST_STEP = 1.5
# Share of the largest below which a push is like others.
_SAME_PUSH = 1e-10
_LEAST_DIAGONAL = 1e-14
OWN_ITERATIONS = 12
# A further secant step is tried while the last step gained this share of what it promised,
# and as much for each simulation as the step before them did.
_LEAST_RATIO = 0.1
# Blocks of a recording whose own values are evaluated on other blocks; an even number.
_BLOCKS = 10


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Where a search ended.

    Parameters
    ----------
    sse : float
        Sum of squared residuals; infinite where nothing could be simulated.
    """

    layout: ParameterLayout
    point: ParameterPoint
    sse: float
    iterations: int
    has_converged: bool


@dataclass(frozen=True, eq=False)
class _Iterate:
    """Where a search is."""

    point: ParameterPoint
    parts: list[np.ndarray]
    sse: float


@dataclass(frozen=True, eq=False)
class _Taken:
    """A step that lowered the sum of squares.

    Parameters
    ----------
    step : ndarray, shape (n_unknowns,)
        In coordinates, as taken within the bounds.
    ratio : float
        Gain over what was promised.
    """

    place: _Iterate
    step: np.ndarray
    ratio: float


def fit_point(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    *,
    max_iterations: int,
    own_columns: Sequence[int] | None = None,
    near: float = np.inf,
) -> SearchResult:
    """Lower the sum of squared residuals until it stands still.

    Parameters
    ----------
    point : ParameterPoint
        Where to start.
    max_iterations : int
        Limit on sets of derivatives.
    own_columns : sequence of int or None
        Hold what is shared, and find these of each recording's own values; None finds
        everything.
    near : float
        Sum of squares below which it is followed to the end.
    """
    parts = residuals_at(problem, fit_layout, point)
    place = _Iterate(point, parts, sum_of_squares(parts))
    free = _free(fit_layout, len(problem.signals), own_columns)
    if not np.isfinite(place.sse) or not free.any():
        return SearchResult(fit_layout, point, place.sse, 0, False)
    descent = _Descent(problem, fit_layout, free, own_columns, near)
    small = 0
    for iteration in range(max_iterations):
        better = descent.advance(place)
        if better is None:
            return SearchResult(fit_layout, place.point, place.sse, iteration, True)
        gain = (place.sse - better.sse) / max(place.sse, 1e-300)
        place = better
        small = small + 1 if gain < descent.least_gain(place) else 0
        if small == 2 or place.sse == 0.0:
            return SearchResult(fit_layout, place.point, place.sse, iteration + 1, True)
    return SearchResult(fit_layout, place.point, place.sse, max_iterations, False)


class _Descent:
    """Damped steps of one search; keeps the damping from one to the next."""

    def __init__(
        self,
        problem: DiagnosisProblem,
        fit_layout: ParameterLayout,
        free: np.ndarray,
        own_columns: Sequence[int] | None,
        near: float,
    ) -> None:
        self.problem = problem
        self.layout = fit_layout
        self.free = free
        self.own_columns = own_columns
        self.near = near
        self.damping = _FIRST_DAMPING

    @property
    def n_simulations(self) -> int:
        """Simulations of all recordings that fresh derivatives take."""
        if self.own_columns is not None:
            return len(self.own_columns)
        return len(self.layout.shared) + len(self.layout.own)

    def least_gain(self, place: _Iterate) -> float:
        """Share of the sum of squares that a step has to gain."""
        return LEAST_GAIN if place.sse < self.near else LEAST_GAIN_FAR

    def advance(self, place: _Iterate) -> _Iterate | None:
        """Take a step from fresh derivatives, and secant steps while they pay.

        None where not even a short step lowers the sum of squares.
        """
        jacobians = derivatives(
            self.problem, self.layout, place.point, place.parts, self.own_columns
        )
        taken = self._damped(place, jacobians)
        if taken is None:
            return None
        worth = (place.sse - taken.place.sse) / (self.n_simulations + 1)
        for _ in range(self.n_simulations):
            gain = place.sse - taken.place.sse
            is_poor = (
                taken.ratio < _LEAST_RATIO or gain < self.least_gain(place) * place.sse
            )
            if is_poor or gain < worth:
                break
            jacobians = self._secant(jacobians, place, taken)
            place = taken.place
            further = self._once(place, jacobians)
            if further is None:
                return place
            taken = further
        return taken.place

    def _damped(self, place: _Iterate, jacobians: list[np.ndarray]) -> _Taken | None:
        """Take a step, shorter and shorter until it lowers the sum of squares."""
        matrix, vector = self._normal_equations(place, jacobians)
        growth = 2.0
        while self.damping < _LARGEST_DAMPING:
            taken, predicted = self._tried(place, matrix, vector)
            if taken is not None:
                return taken
            if predicted < LEAST_PROMISE * place.sse:
                break
            self.damping, growth = self.damping * growth, growth * 2
        return None

    def _once(self, place: _Iterate, jacobians: list[np.ndarray]) -> _Taken | None:
        """Take a step if it lowers the sum of squares at once."""
        before = self.damping
        taken, _ = self._tried(place, *self._normal_equations(place, jacobians))
        if taken is None:
            self.damping = before
        return taken

    def _tried(
        self, place: _Iterate, matrix: np.ndarray, vector: np.ndarray
    ) -> tuple[_Taken | None, float]:
        """Step with the present damping, and the gain that was promised."""
        step, predicted = _step(matrix, vector, self.damping, self.free)
        proposed = _moved(self.layout, place.point, step)
        parts = residuals_at(self.problem, self.layout, proposed)
        sse = sum_of_squares(parts)
        if not sse < place.sse:
            return None, predicted
        ratio = (place.sse - sse) / max(predicted, 1e-300)
        self.damping *= max(1 / 3, 1 - (2 * min(ratio, 1.0) - 1) ** 3)
        step = _difference(proposed, place.point)
        return _Taken(_Iterate(proposed, parts, sse), step, ratio), predicted

    def _secant(
        self, jacobians: list[np.ndarray], place: _Iterate, taken: _Taken
    ) -> list[np.ndarray]:
        """Derivatives that agree with what a step has changed (Broyden)."""
        updated = []
        for jacobian, before, after, at in zip(
            jacobians, place.parts, taken.place.parts,
            _columns(self.layout, len(jacobians)), strict=True,
        ):  # fmt: skip
            step = taken.step[at]
            # In units in which every coordinate changes the output alike.
            weight = np.einsum("ij,ij->j", jacobian, jacobian)
            length = float(step @ (weight * step))
            if length > 0.0:
                missed = (before - after) - jacobian @ step
                jacobian = jacobian + np.outer(missed, weight * step / length)
            updated.append(jacobian)
        return updated

    def _normal_equations(
        self, place: _Iterate, jacobians: list[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        return _normal_equations(self.layout, self.free.size, jacobians, place.parts)


def _columns(fit_layout: ParameterLayout, recordings: int) -> list[np.ndarray]:
    """Which coordinates each recording's simulation depends on."""
    n_shared, n_own = len(fit_layout.shared), len(fit_layout.own)
    return [
        np.r_[0:n_shared, n_shared + row * n_own : n_shared + (row + 1) * n_own]
        for row in range(recordings)
    ]


def _difference(one: ParameterPoint, other: ParameterPoint) -> np.ndarray:
    """Step from another point to this one, in coordinates, shared ones first."""
    return np.concatenate([one.shared - other.shared, (one.own - other.own).ravel()])


def derivatives(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    parts: list[np.ndarray],
    own_columns: Sequence[int] | None = None,
) -> list[np.ndarray]:
    """Derivatives of each recording's simulation by all coordinates that touch it.

    Parameters
    ----------
    parts : list of ndarray
        Residuals at the point.
    own_columns : sequence of int or None
        By these of each recording's own coordinates alone; None derives by all.

    Returns
    -------
    list of ndarray, shape (n_samples, n_shared + n_own)
        0 where a simulation ran away, and by what is not asked for.
    """
    n_shared = len(fit_layout.shared)
    size = n_shared + len(fit_layout.own)
    found = [np.zeros((part.size, size)) for part in parts]
    unknowns: list[tuple[Unknown, int, bool]] = [
        (one, j, True)
        for j, one in enumerate(fit_layout.own)
        if own_columns is None or j in own_columns
    ]
    if own_columns is None:
        unknowns += [(one, j, False) for j, one in enumerate(fit_layout.shared)]
    for unknown, column, is_own in unknowns:
        shared, own = point.shared.copy(), point.own.copy()
        # Look inwards at a bound.
        width = _DIFFERENCE
        place = own[0, column] if is_own else shared[column]
        if unknown.value(place + width) > unknown.high:
            width = -width
        if is_own:
            own[:, column] += width
        else:
            shared[column] += width
        shifted = residuals_at(problem, fit_layout, ParameterPoint(shared, own))
        at = n_shared + column if is_own else column
        for jacobian, before, after in zip(found, parts, shifted, strict=True):
            jacobian[:, at] = np.nan_to_num((before - after) / width)
    return found


def local_matrix(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> np.ndarray:
    """Normal equations of a search at a point.

    Returns
    -------
    ndarray, shape (n_unknowns, n_unknowns)
    """
    parts = residuals_at(problem, fit_layout, point)
    jacobians = derivatives(problem, fit_layout, point, parts)
    size = fit_layout.size(len(problem.signals))
    return _normal_equations(fit_layout, size, jacobians, parts)[0]


def matrix_beside_pushes(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> np.ndarray:
    """The same where a simulation's own parameters take what they can.

    The base of the drive that stands for it stays as it is: these parameters move it.

    Parameters
    ----------
    problem : DiagnosisProblem
        With the pushes of these parameters.

    Returns
    -------
    ndarray, shape (n_unknowns, n_unknowns)

    References
    ----------
    docs/method_diagnosis.md, eq. (D33a).
    """
    parts = residuals_at(problem, fit_layout, point)
    jacobians = derivatives(problem, fit_layout, point, parts)
    pushed = _derivatives_by_pushes(problem, fit_layout, point, parts)
    n_free = pushed[0].shape[1]
    size = fit_layout.size(len(parts))
    matrix, by_push = np.zeros((size, size)), np.zeros((size, n_free))
    of_pushes = np.zeros((n_free, n_free))
    columns = _columns(fit_layout, len(parts))
    held = [j for j, one in enumerate(fit_layout.shared) if one.owner == BASE]
    for jacobian, push, at in zip(jacobians, pushed, columns, strict=True):
        jacobian[:, held] = 0.0
        matrix[np.ix_(at, at)] += jacobian.T @ jacobian
        by_push[at] += jacobian.T @ push
        of_pushes += push.T @ push
    matrix -= by_push @ np.linalg.pinv(of_pushes, _SAME_PUSH, True) @ by_push.T
    return matrix


def _derivatives_by_pushes(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    parts: list[np.ndarray],
) -> list[np.ndarray]:
    """Derivatives of each recording's simulation by the pushes' sizes."""
    found = [
        np.zeros((part.size, one.pushes.shape[1]))
        for part, one in zip(parts, problem.signals, strict=True)
    ]
    for column in range(found[0].shape[1]):
        signals = tuple(
            replace(one, force=one.force + _DIFFERENCE * one.pushes[:, column])
            for one in problem.signals
        )
        shifted = residuals_at(replace(problem, signals=signals), fit_layout, point)
        for jacobian, before, after in zip(found, parts, shifted, strict=True):
            jacobian[:, column] = np.nan_to_num((before - after) / _DIFFERENCE)
    return found


def _normal_equations(
    fit_layout: ParameterLayout,
    size: int,
    jacobians: list[np.ndarray],
    parts: list[np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    columns = _columns(fit_layout, len(parts))
    for jacobian, part, at in zip(jacobians, parts, columns, strict=True):
        matrix[np.ix_(at, at)] += jacobian.T @ jacobian
        vector[at] += jacobian.T @ part
    return matrix, vector


def _free(
    fit_layout: ParameterLayout, recordings: int, own_columns: Sequence[int] | None
) -> np.ndarray:
    if own_columns is None:
        return np.ones(fit_layout.size(recordings), dtype=bool)
    each = np.zeros((recordings, len(fit_layout.own)), dtype=bool)
    each[:, list(own_columns)] = True
    return np.concatenate([np.zeros(len(fit_layout.shared), dtype=bool), each.ravel()])


def _step(
    matrix: np.ndarray, vector: np.ndarray, damping: float, free: np.ndarray
) -> tuple[np.ndarray, float]:
    """Damped step and the gain that the straight line promises."""
    diagonal = np.diag(matrix)
    usable = free & (diagonal > _LEAST_DIAGONAL * max(diagonal[free].max(), 1e-300))
    step = np.zeros(vector.size)
    if not usable.any():
        return step, 0.0
    scale = 1 / np.sqrt(diagonal[usable])
    scaled = matrix[np.ix_(usable, usable)] * scale[:, None] * scale
    scaled[np.diag_indices_from(scaled)] += damping
    right = vector[usable] * scale
    inner = np.linalg.lstsq(scaled, right, rcond=None)[0]
    step[usable] = scale * inner
    # No coordinate leaps: far away the straight line says nothing.
    longest = float(np.max(np.abs(step)))
    if longest > _LARGEST_STEP:
        step *= _LARGEST_STEP / longest
    gain = float(step @ (2 * vector - matrix @ step))
    return step, gain


def _moved(
    fit_layout: ParameterLayout, point: ParameterPoint, step: np.ndarray
) -> ParameterPoint:
    """Point that a step in coordinates, shared ones first, leads to within the bounds."""
    n_shared = len(fit_layout.shared)
    shared = point.shared + step[:n_shared]
    own = point.own + step[n_shared:].reshape(point.own.shape)
    return within_bounds(fit_layout, ParameterPoint(shared, own))


def within_bounds(fit_layout: ParameterLayout, point: ParameterPoint) -> ParameterPoint:
    """The point, every value of it moved into its bounds."""
    shared, own = point.shared.copy(), point.own.copy()
    for column, one in enumerate(fit_layout.shared):
        shared[column] = _inside(one, shared[column])
    for column, one in enumerate(fit_layout.own):
        own[:, column] = [_inside(one, q) for q in own[:, column]]
    return ParameterPoint(shared, own)


def _inside(unknown: Unknown, coordinate: float) -> float:
    value = unknown.value(coordinate)
    if unknown.low <= value <= unknown.high:
        return float(coordinate)
    return unknown.coordinate(value)


def with_own_trials(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    known: Collection[ParameterRef] = (),
    usual: np.ndarray | None = None,
) -> ParameterPoint:
    """Set each recording's own parameters to the best of a few values.

    Parameters
    ----------
    known : collection of ParameterRef
        What stays as it is.
    usual : ndarray, shape (n_own,), or None
        Coordinates of other recordings, around which the values are tried as well.
    """
    for column, unknown in enumerate(fit_layout.own):
        if unknown.owner == START or unknown.ref in known:
            continue
        best = np.full(len(problem.signals), np.inf)
        chosen = point.own[:, column].copy()
        values = CATALOGUE[unknown.owner].parameter(unknown.name).trials
        tried = [unknown.coordinate(value) for value in values]
        if usual is not None:
            # One that all of them share may be far from none: a drive that sticks there
            # says nothing of the way.
            around = usual[column] - unknown.coordinate(0.0)
            tried += [around + one for one in tried]
        for coordinate in tried:
            own = point.own.copy()
            own[:, column] = coordinate
            parts = residuals_at(problem, fit_layout, ParameterPoint(point.shared, own))
            sse = np.array([float(part @ part) for part in parts])
            better = sse < best
            chosen[better] = own[better, column]
            best[better] = sse[better]
        own = point.own.copy()
        own[:, column] = chosen
        point = ParameterPoint(point.shared, own)
    return point


def fit_own(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    shared: np.ndarray,
    usual: np.ndarray | None = None,
) -> ParameterPoint:
    """Find each recording's own parameters for given shared ones.

    Parameters
    ----------
    shared : ndarray, shape (n_shared,)
        Coordinates.
    usual : ndarray, shape (n_own,), or None
        Of the recordings that the shared ones were fitted with.
    """
    point = ParameterPoint(
        shared, np.zeros((len(problem.signals), len(fit_layout.own)))
    )
    if not fit_layout.own:
        return point
    start = {one: dict[str, float]() for one in fit_layout.effects}
    first = first_point(problem, _only_own(fit_layout), problem.drive, start)
    point = ParameterPoint(shared, first.own)
    point = with_own_trials(problem, fit_layout, point, usual=usual)
    return _fit_each(problem, fit_layout, point, range(len(fit_layout.own)))


def _fit_each(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    own_columns: Sequence[int],
) -> ParameterPoint:
    """Find own values of every recording by a search of its own, which ends by itself."""
    own = point.own.copy()
    for row, one in enumerate(problem.signals):
        own[row] = fit_point(
            replace(problem, signals=(one,)),
            fit_layout,
            ParameterPoint(point.shared, point.own[[row]]),
            max_iterations=OWN_ITERATIONS,
            own_columns=own_columns,
        ).point.own[0]
    return ParameterPoint(point.shared, own)


def cross_fitted(
    problem: DiagnosisProblem, fit_layout: ParameterLayout, point: ParameterPoint
) -> list[np.ndarray]:
    """Residuals of each recording with own values from its other samples.

    A recording is cut into blocks. What belongs to it alone (a phase, a factor) is found
    from every second block and evaluated on the others, and the other way round: no
    value is evaluated on the samples that it was fitted to. How a recording starts is
    kept, because later samples do not show it.

    Parameters
    ----------
    point : ParameterPoint
        Own values that were found from all samples.

    Returns
    -------
    list of ndarray, shape (n_evaluated,)
    """
    parts = residuals_at(problem, fit_layout, point)
    columns = [j for j, one in enumerate(fit_layout.own) if one.owner != START]
    if not columns:
        return parts
    turns = [_blocks(one.driven_by.size) for one in problem.signals]
    for is_first in (True, False):
        signals = tuple(
            one.only(turn == is_first)
            for one, turn in zip(problem.signals, turns, strict=True)
        )
        found = _fit_each(replace(problem, signals=signals), fit_layout, point, columns)
        others = residuals_at(problem, fit_layout, found)
        for row, (one, turn) in enumerate(zip(problem.signals, turns, strict=True)):
            judged = (turn != is_first)[one.evaluated]
            parts[row] = np.where(judged, others[row], parts[row])
    return parts


def _blocks(n_samples: int) -> np.ndarray:
    """Which samples belong to every second block."""
    return (np.arange(n_samples) * _BLOCKS // n_samples) % 2 == 0


def _only_own(fit_layout: ParameterLayout) -> ParameterLayout:
    return ParameterLayout((), fit_layout.own, fit_layout.effects)
