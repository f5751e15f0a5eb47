"""Noise of the measured input, seen through the drive.

It moves the simulation where the drive did not; its share of the output has the colour of
the drive itself, and on a free axis it adds up to far more than the sensor's noise. Behind
a whitening filter it is told from what is missing, and fits have no bias from it.
docs/method_diagnosis.md, eq. (D27).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hwid_cli.diagnosis.innovations import Innovations, Whitening
from hwid_cli.diagnosis.noise import input_levels, noise_levels, quiet_input_rms
from hwid_cli.diagnosis.parameters import (
    ParameterLayout,
    ParameterPoint,
    drives_at,
    residuals_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.search import within_bounds
from hwid_cli.diagnosis.whiteness import WHITE_BY_TWO_ROUTES, portmanteau
from hwid_cli.diagnosis.whitening_filters import noisy_drives
from hwid_cli.records.diagnosis import LEAST_SURE, SMALL_REMAINDER, NoiseFloor
from hwid_cli.records.drive import Drive

# The input's noise may be so many times what its differences show.
LESS_NOISE, _MORE_NOISE = 0.7, 1.3
# The quietest of several stretches reads up to a quarter too low.
_MORE_THAN_QUIET = 1.6
# Times that the filter follows the drive that was fitted with it.
_REWEIGHTINGS = 2
# A size found above this share of the largest one asked for is at that limit.
_AT_THE_LIMIT = 0.99
# Of a size without a filter: the search subtracts, so that it is finite.
_IMPOSSIBLE = 1e100
# Sizes are looked for over so many powers of e, to this fineness.
_WIDEST, _FINE_ENOUGH = 7.0, 0.02
# Coordinates of that search go no farther, as powers of e, and it takes no more steps.
_FARTHEST = 30.0
_MOST_STEPS = 30
# Of a coordinate, for a derivative by differences.
_STEP = 1.5e-8
# Noise may move the fitted drive so many times less than the true one: with the noise
# left out of mind it is fitted too sluggish.
_TOO_SLUGGISH = 4.0


def whiteness_with_input_noise(
    parts: Sequence[np.ndarray],
    problem: DiagnosisProblem,
    drives: Sequence[Drive],
    noise: NoiseFloor,
) -> float:
    """Whether residuals hold more than noise of the input and of the output.

    The noise of the input drives the linear part of the drive; its size follows from
    the residuals, and is at most a little more than the input shows. The innovations of
    the stationary Kalman filter are white if nothing else is there.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n_evaluated,)
        Residuals of all recordings.

    Returns
    -------
    float, [-]
        As ``noise.whiteness`` gives it; infinite where the input cannot be the cause.

    References
    ----------
    docs/method_diagnosis.md, eq. (D27).
    """
    input_rms = noise.input_rms
    if input_rms <= 0 or noise.rms <= 0 or problem.compares_command:
        return float("inf")
    filters = _Filters(problem, drives, noise.rms, _Levels.of(problem, noise))
    most = _MORE_NOISE * input_rms / noise.rms
    share = filters.likeliest(parts, most)
    white = filters.innovations(parts, share)
    if white is None or not _are_alike(white):
        return float("inf")
    output_rms = filters.output_rms(parts, share)
    if output_rms > SMALL_REMAINDER * noise.rms:
        return float("inf")
    statistic = portmanteau(white, (1.0,), n_lags=30)
    if share >= _AT_THE_LIMIT * most:
        # Where friction lets go, noise of the input decides when: it moves such a drive a
        # little more than its linear part says.
        is_enough = statistic <= 1.0 and filters.is_as_large(parts, share)
        return statistic if is_enough else float("inf")
    # The same size by further routes is evidence of its own: the innovations of a missing
    # effect are neither of that size nor nearly white.
    if 1.0 < statistic <= WHITE_BY_TWO_ROUTES:
        found = share * output_rms
        is_same = found >= LESS_NOISE * input_rms or _is_that_of_rests(found, problem)
        if is_same and filters.is_as_large(parts, share):
            return statistic / WHITE_BY_TWO_ROUTES
    return statistic


def told_input_rms(
    parts: Sequence[np.ndarray],
    problem: DiagnosisProblem,
    drives: Sequence[Drive],
    noise: NoiseFloor,
) -> float:
    """Most probable noise of the input, as residuals tell it.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n_evaluated,)
        Residuals of all recordings.

    Returns
    -------
    float, [input unit]
        At most 1.3 times what differences of the input show.
    """
    filters = _Filters(problem, drives, noise.rms, _Levels.of(problem, noise))
    most = _MORE_NOISE * noise.input_rms / noise.rms
    return filters.likeliest(parts, most) * noise.rms


def _is_that_of_rests(input_rms: float, problem: DiagnosisProblem) -> bool:
    """Whether noise of the input is of the size that its quietest stretches show."""
    quiet = quiet_input_rms(problem)
    return LESS_NOISE * quiet <= input_rms <= _MORE_THAN_QUIET * quiet


def _are_alike(white: Sequence[np.ndarray]) -> bool:
    """Whether no recording leaves clearly more than all of them together."""
    usual = np.sqrt(_mean_square(white))
    return all(
        np.sqrt(_mean_square([one]))
        <= (SMALL_REMAINDER + LEAST_SURE * np.sqrt(0.5 / one.size)) * usual
        for one in white
    )


def fit_with_input_noise(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    noise: NoiseFloor,
) -> ParameterPoint:
    """Fit again with the noise of the input taken into account.

    A fit to the output alone makes the drive too sluggish, because a smaller answer to
    the input's noise leaves less. Innovations in units of their own deviation, with the
    size of both noises held, have no such bias.

    Parameters
    ----------
    point : ParameterPoint
        Where the fit to the output ended.

    References
    ----------
    docs/method_diagnosis.md, eq. (D27).
    """
    most, levels = _MORE_NOISE * noise.input_rms / noise.rms, _Levels.of(problem, noise)
    for _ in range(_REWEIGHTINGS):
        drives = drives_at(problem, fit_layout, point)
        parts = residuals_at(problem, fit_layout, point)
        filters = _Filters(problem, drives, noise.rms, levels)
        share = filters.likeliest(parts, most)
        search = _Search(problem, fit_layout, point, noise.rms, share, levels)
        start = np.concatenate([point.shared, point.own.ravel()])
        if search.deviations(start).size < start.size:
            return point
        # "lm" counts the simulations for derivatives among its calls in some versions of
        # SciPy only, "trf" in none.
        found = scipy.optimize.least_squares(
            search.deviations, start, jac=search.jacobian, method="trf", x_scale=1.0,
            max_nfev=_MOST_STEPS,
        )  # fmt: skip
        point = search.point(found.x)
    return point


def may_be_input_noise(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    noise: NoiseFloor,
) -> bool:
    """Whether what a fit leaves is no larger than noise of the input can make it.

    Below this a fit with that noise in mind is worth its time: such a fit never leaves
    less of the output than the one before.
    """
    parts = residuals_at(problem, fit_layout, point)
    drives = drives_at(problem, fit_layout, point)
    filters = _Filters(problem, drives, noise.rms, _Levels.of(problem, noise))
    return filters.may_be_as_large(parts, _MORE_NOISE * noise.input_rms / noise.rms)


@dataclass(frozen=True, eq=False)
class _Search:
    """Deviations behind the filter as a function of all coordinates.

    Parameters
    ----------
    problem : DiagnosisProblem
    fit_layout : ParameterLayout
    first : ParameterPoint
        Where the search begins.
    output_rms : float, [output unit]
    share : float, [input unit/output unit]
        Noise of the input over that of the output.
    levels : _Levels
        How much of both noises each recording holds.
    """

    problem: DiagnosisProblem
    fit_layout: ParameterLayout
    first: ParameterPoint
    output_rms: float
    share: float
    levels: "_Levels"

    def point(self, coordinates: np.ndarray) -> ParameterPoint:
        """Parameters at coordinates: those of all recordings, then those of each."""
        # The search knows no bounds, and far beyond them a simulation has no end.
        near = np.clip(coordinates, -_FARTHEST, _FARTHEST)
        n_shared = self.first.shared.size
        own = near[n_shared:].reshape(self.first.own.shape)
        return within_bounds(self.fit_layout, ParameterPoint(near[:n_shared], own))

    def deviations(self, coordinates: np.ndarray) -> np.ndarray:
        """Deviations of all recordings in a row."""
        return np.concatenate(self._parts(coordinates))

    def jacobian(self, coordinates: np.ndarray) -> np.ndarray:
        """Derivatives of the deviations by differences, shape (n_samples, n_coordinates).

        What belongs to one recording moves no other one: all recordings take such a
        step in one simulation.
        """
        n_recordings, n_own = self.first.own.shape
        n_shared = self.first.shared.size
        here = self._parts(coordinates)
        ends = np.cumsum([0, *(one.size for one in here)])
        slopes = np.zeros((ends[-1], coordinates.size))
        for index in range(n_shared + n_own):
            is_own = index >= n_shared
            columns = (
                index + n_own * np.arange(n_recordings) if is_own else np.array([index])
            )
            moved = coordinates.copy()
            moved[columns] += _STEP * np.maximum(np.abs(coordinates[columns]), 1.0)
            by = (moved - coordinates)[columns]
            there = self._parts(moved)
            for row, (before, after) in enumerate(zip(here, there, strict=True)):
                which = row if is_own else 0
                slopes[ends[row] : ends[row + 1], columns[which]] = (
                    after - before
                ) / by[which]
        return slopes

    def _parts(self, coordinates: np.ndarray) -> list[np.ndarray]:
        there = self.point(coordinates)
        drives = drives_at(self.problem, self.fit_layout, there)
        filters = _Filters(self.problem, drives, self.output_rms, self.levels)
        parts = residuals_at(self.problem, self.fit_layout, there)
        return filters.in_deviations(parts, self.share)


def _mean_square(parts: Sequence[np.ndarray]) -> float:
    return sum(float(one @ one) for one in parts) / max(_count(parts), 1)


def _count(parts: Sequence[np.ndarray]) -> int:
    return sum(one.size for one in parts)


@dataclass(frozen=True, eq=False)
class _Levels:
    """How much noise each recording holds, beside all of them together.

    Sensors have ranges: what moves farther is read with more noise.

    Parameters
    ----------
    output : ndarray, shape (n_recordings,), [-]
        Of the output.
    ratio : ndarray, shape (n_recordings,), [-]
        Of the input over that of the output.
    """

    output: np.ndarray
    ratio: np.ndarray

    @classmethod
    def of(cls, problem: DiagnosisProblem, noise: NoiseFloor) -> "_Levels":
        """From differences of both signals."""
        output = noise_levels(problem, noise)
        return cls(output, input_levels(problem) / output)


class _Filters:
    """Whitening filters of the noise of the input and of the output.

    Parameters
    ----------
    problem : DiagnosisProblem
        Whose recordings the residuals belong to.
    drives : sequence of Drive
        Of each recording, with the fitted base.
    output_rms : float, [output unit]
        Noise of the output, in whose unit deviations are given.
    levels : _Levels
        How much of both noises each recording holds.
    """

    def __init__(
        self,
        problem: DiagnosisProblem,
        drives: Sequence[Drive],
        output_rms: float,
        levels: "_Levels",
    ) -> None:
        self._drives = noisy_drives(drives, problem.signals)
        self._levels = levels
        self._output_rms = output_rms

    def likeliest(self, parts: Sequence[np.ndarray], most: float) -> float:
        """Noise of the input over that of the output that makes residuals most probable.

        A free axis adds up its noise: a recording is about one draw of the size of that,
        but its innovations are as many as its samples.

        Parameters
        ----------
        parts : sequence of ndarray, shape (n_evaluated,)
            Residuals of all recordings.
        most : float, [input unit/output unit]
        """

        def unlikely(power: float) -> float:
            found = self._filtered(parts, most * np.exp(power))
            if found is None:
                return _IMPOSSIBLE
            values = [one.values for one in found]
            logs = sum(one.log_variances for one in found)
            mean = max(_mean_square(values), np.finfo(float).tiny)
            size = float(_count(values) * np.log(mean) + logs)
            return size if np.isfinite(size) else _IMPOSSIBLE

        found = scipy.optimize.minimize_scalar(
            unlikely,
            bounds=(-_WIDEST, 0.0),
            method="bounded",
            options={"xatol": _FINE_ENOUGH},
        )
        return float(most * np.exp(found.x))

    def output_rms(self, parts: Sequence[np.ndarray], share: float) -> float:
        """Noise of the output that goes with this share of the input's."""
        found = self.innovations(parts, share)
        return np.inf if found is None else float(np.sqrt(_mean_square(found)))

    def innovations(
        self, parts: Sequence[np.ndarray], share: float
    ) -> list[np.ndarray] | None:
        """What the samples before do not tell of each residual, all of one deviation.

        None without a filter.
        """
        found = self._filtered(parts, share)
        return None if found is None else [one.values for one in found]

    def is_as_large(self, parts: Sequence[np.ndarray], share: float) -> bool:
        """Whether residuals are as large as noise of this size would make them.

        Innovations tell the size from what is fast; a missing effect is slower, and
        leaves more or less than they say.
        """
        output = self.output_rms(parts, share) ** 2
        expected, chance = self._expected(parts, share, output)
        excess = self._sum_of_squares(parts) - output * _count(parts)
        most = max((_MORE_NOISE**2 - 1.0) * expected, chance)
        least = max((1.0 - LESS_NOISE**2) * expected, chance)
        return bool(-least <= excess - expected <= most)

    def may_be_as_large(self, parts: Sequence[np.ndarray], share: float) -> bool:
        """Whether noise of this size, or of less, may make residuals this large."""
        output = self._output_rms**2
        expected, chance = self._expected(parts, share, output)
        excess = self._sum_of_squares(parts) - output * _count(parts)
        return bool(excess <= _TOO_SLUGGISH * (expected + chance))

    def _sum_of_squares(self, parts: Sequence[np.ndarray]) -> float:
        """Of residuals over the level of noise of their recordings."""
        pairs = zip(parts, self._levels.output, strict=True)
        return sum(float(one @ one) / level**2 for one, level in pairs)

    def _expected(
        self, parts: Sequence[np.ndarray], share: float, output: float
    ) -> tuple[float, float]:
        """Sum of squares that the input's noise adds, and how far chance moves it.

        ``output`` is the variance of the output's noise.
        """
        expected, spread = 0.0, 2.0 * output**2 * _count(parts)
        for part, drive, ratio in zip(
            parts, self._drives, self._levels.ratio, strict=True
        ):
            moved, n_free = drive.moved(part.size)
            moved *= (ratio * share) ** 2 * output * part.size
            expected += moved
            spread += 2.0 * moved**2 / n_free
        return expected, LEAST_SURE * np.sqrt(spread)

    def in_deviations(
        self, parts: Sequence[np.ndarray], share: float
    ) -> list[np.ndarray]:
        """Innovations in units of their deviation; residuals where there is no filter."""
        found = self.innovations(parts, share)
        if found is None:
            return list(parts)
        return [one / self._output_rms for one in found]

    def _filtered(
        self, parts: Sequence[np.ndarray], share: float
    ) -> list[Innovations] | None:
        """Innovations over the recording's level of noise; None without a filter."""
        filters: dict[tuple[int, float], Whitening | None] = {}
        found = []
        levels = zip(self._levels.output, self._levels.ratio, strict=True)
        for part, drive, (level, ratio) in zip(
            parts, self._drives, levels, strict=True
        ):
            if (id(drive), ratio) not in filters:
                strength = float(ratio * share) ** 2
                filters[id(drive), ratio] = drive.whitening(strength)
            one = filters[id(drive), ratio]
            if one is None:
                return None
            found.append(one(part / level))
        return found
