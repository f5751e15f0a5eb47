"""Intervals of what a fit has found, and which of its effects they leave open.

docs/method_diagnosis.md, eq. (D20).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from hwid_cli.diagnosis.candidate import belongs_to, rebuilt
from hwid_cli.diagnosis.parameters import (
    BASE,
    ParameterLayout,
    ParameterPoint,
    Unknown,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.search import local_matrix, matrix_beside_pushes
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit, ParameterRef

# Normal quantile of a 95 % interval.
QUANTILE = 1.96
# What swings all the time, and how near frequencies are to multiples of one, [-].
_SWINGS, _OF_ONE_FREQUENCY = ("periodic_force", "sensor_hum"), 0.005
# Stops, what bends a spring as well, and the stiffness over that of the spring below which a
# stop is no more than that; residuals that go together so much are no noise, [-].
_STOPS = ("end_stop", "one_sided_stop")
_BEND = ("cubic_stiffness", "quadratic_stiffness", "spring_gap", *_STOPS)
_SOFT, _GO_TOGETHER = 2.0, 0.5
# Share of the best determined direction below which one counts as undetermined.
_DETERMINED = 1e-12
# A strength that is so near its bound would go farther, [-].
_AT_BOUND = 0.999
# Difference for derivatives of an effect's size, in coordinates.
_STEP = 1e-4
# A logarithm that may be off by more, a factor of a million, tells nothing of its value.
_NOT_TOLD = 14.0


def unclear_effects(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales
) -> tuple[str, ...]:
    """Effects of a fit that may as well not be there, or be a simpler one.

    The interval of an effect's strength reaches zero, or that of the parameter that tells
    it from what it contains; or its strength went as far as it may: it imitates. What the
    simulation has of the latter shares the strength in any way, and is held for that; the
    effect's own share of it may be none.

    Returns
    -------
    tuple of str
        Ids in the catalogue. What each recording has for itself has no interval.
    """
    # A fit beside a stand-in without a spring has starts that one with a spring has not.
    if not found.is_usable or not belongs_to(problem, found, scales):
        return found.effects
    fit_layout, point = rebuilt(problem, found, scales)
    of_all = _spread(problem, found, fit_layout, point)

    def is_clear(ref: ParameterRef) -> bool:
        spread = of_all.beside(_contained(ref.owner, found.effects, fit_layout))
        column = found.names.index(ref)
        unknown, q = fit_layout.shared[column], point.shared[column]
        if _is_at_bound(unknown, q):
            return False
        reach = spread.reach(_direction_of_size(ref, fit_layout, point, scales))
        # Of a logarithm linearised: a relative deviation of the value itself.
        return reach < 1.0 if unknown.is_log else bool(abs(q) > reach)

    def telling(effect: str) -> tuple[ParameterRef, ...]:
        refs = _telling(effect, found.names)
        is_shared = bool(_contained(effect, found.effects, fit_layout))
        own = CATALOGUE[effect].told_by
        return tuple(one for one in refs if not is_shared or one.parameter == own)

    imitating = (*harmonics(found), *soft_stops(problem, found))
    return tuple(
        effect
        for effect in found.effects
        if effect in imitating or not all(map(is_clear, telling(effect)))
    )


def harmonics(found: CandidateFit) -> tuple[str, ...]:
    """The faster one of a force and a hum that swing at multiples of one frequency.

    A force that is no pure sine has harmonics, which such a hum would be as well.
    """
    frequencies = {
        one.owner: value
        for one, value in zip(found.names, found.values, strict=True)
        if one.owner in _SWINGS and one.parameter == "frequency_Hz"
    }
    if len(frequencies) < len(_SWINGS):
        return ()
    slow, fast = sorted(frequencies, key=lambda one: frequencies[one])
    ratio = frequencies[fast] / frequencies[slow]
    is_multiple = ratio > 1.5 and abs(ratio / round(ratio) - 1.0) < _OF_ONE_FREQUENCY
    return (fast,) if is_multiple else ()


def soft_stops(problem: DiagnosisProblem, found: CandidateFit) -> tuple[str, ...]:
    """Stops that bend the spring in place of a smooth law.

    Softer than twice the spring, a stop is a corner in it. Beside another law of the spring,
    or where what is left is no noise, that corner stands for a curve.
    """
    values = dict(zip(found.names, found.values, strict=True))
    own = ParameterRef(BASE, "stiffness_N_per_m")
    spring = values.get(own, problem.drive.stiffness_N_per_m)
    bent = [one for one in found.effects if public_id(one) in _BEND]
    if spring <= 0 or not (len(bent) > 1 or found.neighbour > _GO_TOGETHER):
        return ()
    return tuple(
        one
        for one in bent
        if public_id(one) in _STOPS
        and values.get(ParameterRef(one, "exponent"), 1.0) <= 1.0
        and values[ParameterRef(one, "stiffness_N_per_m")] < _SOFT * spring
    )


def _contained(
    effect: str, found: Sequence[str], fit_layout: ParameterLayout
) -> list[int]:
    """Strengths of effects of the simulation that an effect contains, by column."""
    limits = set(CATALOGUE[effect].contains) - set(found)
    return [
        column
        for column, one in enumerate(fit_layout.shared)
        if one.owner in limits and one.name == CATALOGUE[one.owner].strongest.name
    ]


def runs_to_bound(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales
) -> bool:
    """Whether the strength of an effect went as far as it may: it imitates something."""
    telling = {ref for one in found.effects for ref in _telling(one, found.names)}
    if not telling or not found.is_usable:
        return False
    fit_layout, point = rebuilt(problem, found, scales)
    return any(
        one.ref in telling and _is_at_bound(one, q)
        for one, q in zip(fit_layout.shared, point.shared, strict=True)
    )


def _is_at_bound(unknown: Unknown, coordinate: float) -> bool:
    farthest = max(abs(unknown.low), abs(unknown.high))
    return abs(unknown.value(coordinate)) >= _AT_BOUND * farthest


def _direction_of_size(
    ref: ParameterRef,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    scales: Scales,
) -> np.ndarray:
    """How the logarithm of an effect's size changes with the shared coordinates.

    Returns
    -------
    ndarray, shape (n_shared,)
        Of the parameter itself where that alone says how large the effect is.
    """
    effect = CATALOGUE[ref.owner]
    size = effect.size if ref.parameter == effect.strongest.name else None
    if size is None:
        return np.array([float(one.ref == ref) for one in fit_layout.shared])
    columns = [
        column for column, one in enumerate(fit_layout.shared) if one.owner == ref.owner
    ]

    def log_size(shared: np.ndarray) -> float:
        values = {
            fit_layout.shared[column].name: fit_layout.shared[column].value(
                shared[column]
            )
            for column in columns
        }
        return float(np.log(size(values, scales)))

    direction = np.zeros(len(fit_layout.shared))
    for column in columns:
        away = np.zeros(direction.size)
        away[column] = _STEP
        both = log_size(point.shared + away), log_size(point.shared - away)
        direction[column] = (both[0] - both[1]) / (2 * _STEP)
    return direction


def _telling(effect: str, names: tuple[ParameterRef, ...]) -> tuple[ParameterRef, ...]:
    """Fitted parameters without which an effect is not there, or is a simpler one."""
    entry = CATALOGUE[effect]
    # A limit shows in every sample that it cuts: the criterion decides.
    told = [] if entry.strongest.off == inf else [entry.strongest.name]
    refs = [ParameterRef(effect, one) for one in (*told, entry.told_by) if one]
    return tuple(one for one in refs if one in names)


def intervals(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales
) -> tuple[np.ndarray, np.ndarray]:
    """95 % intervals of what all recordings share.

    Parameters
    ----------
    problem : DiagnosisProblem
        Training and held-out recordings; the training ones decide.

    Returns
    -------
    low, high : ndarray, shape (n_names,)
        NaN where a recording cannot be simulated, or a value may be anything.
    """
    if not found.is_usable:
        nothing = np.full(found.values.size, np.nan)
        return nothing, nothing
    fit_layout, point = rebuilt(problem, found, scales)
    reaches = _spread(problem, found, fit_layout, point).reaches()
    of_logs = np.array([one.is_log for one in fit_layout.shared], dtype=bool)
    reaches[of_logs & (reaches > _NOT_TOLD)] = np.nan
    with np.errstate(over="ignore"):
        ends = np.array(
            [
                [
                    one.value(q + sign * reach)
                    for one, q, reach in zip(
                        fit_layout.shared, point.shared, reaches, strict=True
                    )
                ]
                for sign in (-1.0, 1.0)
            ]
        )
    return ends.min(axis=0), ends.max(axis=0)


@dataclass(frozen=True, eq=False)
class _Spread:
    """How far the shared coordinates may be off.

    Where the error has many valleys its shape in one of them says nothing of the others:
    an interval reaches twice as far as the farthest of all that are as likely.

    Parameters
    ----------
    covariance : ndarray, shape (n_shared, n_shared)
        Of the coordinates times their scales.
    scale : ndarray, shape (n_shared,)
        Next to nothing where nothing determines a coordinate.
    away : ndarray, shape (n_valleys, n_shared)
        Of other valleys.
    """

    covariance: np.ndarray
    scale: np.ndarray
    away: np.ndarray

    def reach(self, direction: np.ndarray) -> float:
        """Half of the 95 % interval of a sum of coordinates, with these weights."""
        # Divided here: what is not determined must not touch the others.
        weights = direction / self.scale
        with np.errstate(over="ignore"):
            variance = max(float(weights @ self.covariance @ weights), 0.0)
        farthest = np.max(np.abs(self.away @ direction), initial=0.0)
        return float(np.hypot(QUANTILE * np.sqrt(variance), 2 * farthest))

    def beside(self, held: Sequence[int]) -> "_Spread":
        """The same where some coordinates are what they are."""
        if not held:
            return self
        across = self.covariance[:, held]
        among = np.linalg.pinv(self.covariance[np.ix_(held, held)])
        return replace(self, covariance=self.covariance - across @ among @ across.T)

    def reaches(self) -> np.ndarray:
        """Of each coordinate alone."""
        return np.array([self.reach(one) for one in np.eye(len(self.covariance))])


def _spread(
    problem: DiagnosisProblem,
    found: CandidateFit,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
) -> _Spread:
    covariance, scale = shared_covariance(
        problem, found, fit_layout, point, beside_pushes=True
    )
    away = [
        [
            one.coordinate(value) - q
            for one, value, q in zip(
                fit_layout.shared, valley, point.shared, strict=True
            )
        ]
        for valley in found.valleys
    ]
    return _Spread(
        covariance,
        scale,
        np.reshape(np.array(away), (len(away), scale.size)),
    )


def shared_covariance(
    problem: DiagnosisProblem,
    found: CandidateFit,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    *,
    beside_pushes: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the shared coordinates, scaled; the training recordings decide.

    Parameters
    ----------
    point : ParameterPoint
        Of the fit, with own values of all recordings.
    beside_pushes : bool
        Whether the parameters of the simulation that the drive stands for are open, where
        there are any, and not the drive's own.

    Returns
    -------
    covariance : ndarray, shape (n_shared, n_shared)
        Of the coordinates times their scales; recordings' own values vary with them.
    scale : ndarray, shape (n_shared,)
        Next to nothing where nothing determines a coordinate.
    """
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    train = problem.part(held_out=False)
    at = ParameterPoint(point.shared, point.own[rows])
    matrix = (
        matrix_beside_pushes(train, fit_layout, at)
        if beside_pushes and all(one.pushes.size for one in train.signals)
        else local_matrix(train, fit_layout, at)
    )
    if not matrix.size:
        return matrix, np.zeros(0)
    sse = sum_of_squares(residuals_at(train, fit_layout, at))
    freedom = max(train.n_evaluated - matrix.shape[0], 1)
    # Residuals that go together count as fewer samples.
    together = max(found.neighbour, 0.0)
    inflation = (1 + together) / max(1 - together, 1e-3)
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = _inverse(matrix / scale[:, None] / scale)
    shared = slice(len(fit_layout.shared))
    size = sse / freedom * inflation
    return np.asarray(size * inverse[shared, shared]), scale[shared]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse in which what nothing determines is large, not infinite."""
    sizes, turned = np.linalg.eigh(matrix)
    if not sizes[-1] > 0:
        return np.full(matrix.shape, np.nan)
    sizes = np.maximum(sizes, _DETERMINED * sizes[-1])
    return np.asarray((turned / sizes) @ turned.T)
