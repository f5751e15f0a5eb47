"""Filters from a residual to its innovations, where noise of the input moves a drive.

A straight spring has one stationary filter; a curved one is another spring at each place,
and its filter follows the motion. docs/method_diagnosis.md, eq. (D27), (D27a).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy

from hwid_cli.compiled import INNER, compiled
from hwid_cli.diagnosis.innovations import (
    Innovations,
    StationaryFilter,
    Whitening,
    answer,
)
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.drive.linear import has_inner_states, linear_equations
from hwid_cli.drive.springs import stiffness_with_effects
from hwid_cli.records.drive import HELD, Drive

# Springs that differ along a motion by less than this share of their mean are one.
_ONE_SPRING = 0.01
# A curved one is found between so many.
_N_SPRINGS = 32


# a, b and through of several springs.
_Tables = tuple[np.ndarray, np.ndarray, np.ndarray]


class NoisyDrive(Protocol):
    """A drive that noise of its input moves, from sample to sample."""

    def whitening(self, strength: float) -> Whitening | None:
        """From a residual to its innovations; None without a filter.

        Parameters
        ----------
        strength : float
            Variance of the input's noise in units of the output's.
        """

    def moved(self, size: int) -> tuple[float, float]:
        """Mean square of the reading that noise of variance 1 makes from rest.

        Returns
        -------
        float
        float
            How many draws of its size a recording is worth.
        """


@dataclass(frozen=True, eq=False)
class StraightDrive:
    """Linear drive from sample to sample.

    Parameters
    ----------
    a : ndarray, shape (n_states, n_states)
    b : ndarray, shape (n_states,)
        By which a sample of the input moves the following state.
    c : ndarray, shape (1, n_states)
        The reading of a state.
    through : float
        By which a sample of the input moves the reading at once.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    through: float

    def covariance(self, strength: float) -> np.ndarray | None:
        """Of the state before a sample is read, where that has settled; None without one."""
        b, through = self.b, self.through
        # The input's noise moves the reading at once, too.
        both = strength * through * b[:, None]
        read = np.array([[1.0 + strength * through**2]])
        moved = strength * np.outer(b, b)
        try:
            return np.asarray(
                scipy.linalg.solve_discrete_are(self.a.T, self.c.T, moved, read, s=both)
            )
        except (np.linalg.LinAlgError, ValueError):
            return None

    def whitening(self, strength: float) -> StationaryFilter | None:
        """From a residual to its innovations; None without a filter."""
        covariance = self.covariance(strength)
        return None if covariance is None else self.filter_of(covariance, strength)

    def filter_of(self, covariance: np.ndarray, strength: float) -> StationaryFilter:
        """The filter that belongs to the settled covariance of its state.

        Parameters
        ----------
        covariance : ndarray, shape (n_states, n_states)
            As ``covariance`` gives it, in units of the output's noise.
        """
        a, c, through = self.a, self.c, self.through
        both = strength * through * self.b[:, None]
        variance = float((c @ covariance @ c.T)[0, 0]) + 1.0 + strength * through**2
        correct = ((a @ covariance @ c.T + both) / variance).ravel()
        change = np.ascontiguousarray(a - np.outer(correct, c))
        return StationaryFilter(change, correct, np.ascontiguousarray(c[0]), variance)

    def moved(self, size: int) -> tuple[float, float]:
        """Mean square of the reading that noise of variance 1 makes from rest."""
        pulse = np.zeros(size)
        pulse[0] = 1.0
        change, reading = map(np.ascontiguousarray, (self.a, self.c[0]))
        gain = np.ascontiguousarray(self.b)
        impulse = answer(change, gain, reading, self.through, pulse)
        mean_square = float(np.square(impulse) @ (1.0 - np.arange(size) / size))
        both_ways = scipy.signal.fftconvolve(impulse, impulse[::-1])[size - 1 :]
        together = np.square(both_ways / both_ways[0]) @ (1.0 - np.arange(size) / size)
        return mean_square, size / max(2.0 * float(together) - 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class CurvedDrive:
    """A drive with another spring at each place of a motion.

    Parameters
    ----------
    mean : StraightDrive
        With the mean of its springs.
    tables : tuple of three ndarray
        a, b and through of several springs, from soft to stiff.
    at : ndarray, shape (n_samples,)
        Where between them the spring is after each sample that is evaluated.
    """

    mean: StraightDrive
    tables: _Tables
    at: np.ndarray

    def whitening(self, strength: float) -> Whitening | None:
        """From a residual to its innovations; None without a filter."""
        first = self.mean.covariance(strength)
        if first is None:
            return None
        mean = self.mean.filter_of(first, strength)
        reading = int(np.argmax(self.mean.c[0]))
        return CurvedFilter(self.at, self.tables, reading, strength, first, mean)

    def moved(self, size: int) -> tuple[float, float]:
        """Mean square of the reading that noise of variance 1 makes from rest."""
        reading = int(np.argmax(self.mean.c[0]))
        _, draws = self.mean.moved(size)
        return float(_spread(self.at[:size], self.tables, reading)), draws


@dataclass(frozen=True, eq=False)
class CurvedFilter:
    """From a residual to its innovations, along the motion of a curved spring.

    Parameters
    ----------
    at : ndarray, shape (n_samples,)
        Where between the springs of ``tables`` the spring is after each sample.
    tables : tuple of three ndarray
        As ``CurvedDrive`` has them.
    reading : int
        State that is read.
    strength : float
        Variance of the input's noise in units of the output's.
    covariance : ndarray, shape (2, 2)
        Of the state before the first sample.
    elsewhere : StationaryFilter
        With the mean of the springs, for other motions.
    """

    at: np.ndarray
    tables: _Tables
    reading: int
    strength: float
    covariance: np.ndarray
    elsewhere: StationaryFilter

    def __call__(self, residual: np.ndarray) -> Innovations:
        """Innovations of a residual, shape (n_samples,)."""
        values, logs = _along(
            np.ascontiguousarray(residual, dtype=np.float64), self.at, self.tables,
            self.reading, self.strength, self.covariance,
        )  # fmt: skip
        return Innovations(values, float(logs))

    @property
    def numbers(self) -> np.ndarray:
        """What tells it from another one, shape (n,)."""
        a, b, through = self.tables
        of_motion = (self.at, a.ravel(), b.ravel(), through)
        return np.r_[np.concatenate(of_motion), self.strength, self.elsewhere.numbers]


@compiled()
def _along(
    residual: np.ndarray,
    at: np.ndarray,
    tables: _Tables,
    reading: int,
    strength: float,
    covariance: np.ndarray,
) -> tuple[np.ndarray, float]:
    """Kalman filter with the spring of each sample; innovations over their deviations."""
    values = np.empty(residual.size)
    x0 = x1 = logs = 0.0
    p00, p01, p11 = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    for n in range(residual.size):
        a00, a01, a10, a11, b0, b1, through = _step_at(tables, at[n])
        read = x0 if reading == 0 else x1
        c0, c1 = (p00, p01) if reading == 0 else (p01, p11)
        variance = (c0 if reading == 0 else c1) + 1.0 + strength * through * through
        error = residual[n] - read
        values[n] = error / np.sqrt(variance)
        logs += np.log(variance)
        # The input's noise moves the reading at once, too.
        gain0 = (a00 * c0 + a01 * c1 + strength * through * b0) / variance
        gain1 = (a10 * c0 + a11 * c1 + strength * through * b1) / variance
        x0, x1 = (
            a00 * x0 + a01 * x1 + gain0 * error,
            a10 * x0 + a11 * x1 + gain1 * error,
        )
        p00, p01, p11 = _carried(tables, at[n], (p00, p01, p11), strength)
        p00 -= variance * gain0 * gain0
        p01 -= variance * gain0 * gain1
        p11 -= variance * gain1 * gain1
    return values, logs


@compiled()
def _spread(at: np.ndarray, tables: _Tables, reading: int) -> float:
    """Mean variance of the reading that input noise of variance 1 makes from rest."""
    p = (0.0, 0.0, 0.0)
    total = 0.0
    for n in range(at.size):
        through = _step_at(tables, at[n])[6]
        total += (p[0] if reading == 0 else p[2]) + through * through
        p = _carried(tables, at[n], p, 1.0)
    return total / at.size


@compiled(**INNER)
def _step_at(tables: _Tables, place: float) -> tuple[float, ...]:
    """The step of a spring between two: a by rows, b, through."""
    a, b, through = tables
    j = min(int(place), through.size - 2)
    w = place - j
    return (
        a[j, 0, 0] + w * (a[j + 1, 0, 0] - a[j, 0, 0]),
        a[j, 0, 1] + w * (a[j + 1, 0, 1] - a[j, 0, 1]),
        a[j, 1, 0] + w * (a[j + 1, 1, 0] - a[j, 1, 0]),
        a[j, 1, 1] + w * (a[j + 1, 1, 1] - a[j, 1, 1]),
        b[j, 0] + w * (b[j + 1, 0] - b[j, 0]),
        b[j, 1] + w * (b[j + 1, 1] - b[j, 1]),
        through[j] + w * (through[j + 1] - through[j]),
    )


@compiled(**INNER)
def _carried(
    tables: _Tables, place: float, p: tuple[float, float, float], strength: float
) -> tuple[float, float, float]:
    """Covariance of the state a sample later: upper row, and the last element."""
    a00, a01, a10, a11, b0, b1, _ = _step_at(tables, place)
    p00, p01, p11 = p
    q00, q01 = a00 * p00 + a01 * p01, a00 * p01 + a01 * p11
    q10, q11 = a10 * p00 + a11 * p01, a10 * p01 + a11 * p11
    return (
        q00 * a00 + q01 * a01 + strength * b0 * b0,
        q00 * a10 + q01 * a11 + strength * b0 * b1,
        q10 * a10 + q11 * a11 + strength * b1 * b1,
    )


def noisy_drives(
    drives: Sequence[Drive], signals: Sequence[Signals], *, are_whole: bool = False
) -> list[NoisyDrive]:
    """What noise of the input moves, for each recording.

    Parameters
    ----------
    drives : sequence of Drive
        Of each recording, with the fitted base.
    are_whole : bool
        Whether they go along all samples, not only those that are evaluated.
    """
    straight: dict[tuple[int, float, float], StraightDrive] = {}
    found: list[NoisyDrive] = []
    for drive, one in zip(drives, signals, strict=True):
        position = one.position if are_whole else one.position[one.evaluated]
        stiffness = stiffness_with_effects(drive, position)
        mean = float(np.mean(stiffness))
        is_curved = np.ptp(stiffness) > _ONE_SPRING * abs(mean)
        if is_curved and not has_inner_states(drive):
            found.append(_curved(drive, one.sample_time_s, stiffness))
            continue
        spring = mean if is_curved else drive.stiffness_N_per_m
        kind = id(drive), one.sample_time_s, spring
        if kind not in straight:
            straight[kind] = straight_drive(drive, one.sample_time_s, spring)
        found.append(straight[kind])
    return found


def _curved(drive: Drive, sample_time_s: float, stiffness: np.ndarray) -> CurvedDrive:
    """A drive with the stiffness of each sample."""
    low, high = float(stiffness.min()), float(stiffness.max())
    at = (stiffness - low) / (high - low) * (_N_SPRINGS - 1)
    mean = straight_drive(drive, sample_time_s, float(np.mean(stiffness)))
    # The equations are straight in the stiffness: those of two springs tell the others.
    softest, push, reading = linear_equations(drive, low)
    stiffest, *_ = linear_equations(drive, high)
    share = np.linspace(0.0, 1.0, _N_SPRINGS)[:, None, None]
    changes = softest + share * (stiffest - softest)
    tables = _steps(changes, push, reading, sample_time_s, is_held=drive.hold == HELD)
    return CurvedDrive(mean, tables, at)


def straight_drive(
    drive: Drive, sample_time_s: float, stiffness: float | None = None
) -> StraightDrive:
    """Linear drive from sample to sample, its input held or a straight line between them.

    Parameters
    ----------
    stiffness : float or None, [N/m]
        In place of the drive's own; below 0 where a spring gives way, as a pendulum's
        beyond a quarter turn.
    """
    change, push, reading = linear_equations(drive, stiffness)
    a, b, through = (
        one[0]
        for one in _steps(
            change[None], push, reading, sample_time_s, is_held=drive.hold == HELD
        )
    )
    c = reading[None, :]
    is_told = np.any(change != 0.0, axis=0) | (reading != 0.0)
    if not is_told[0]:
        # Nothing tells where it is.
        return StraightDrive(a[1:, 1:], b[1:], c[:, 1:], float(through))
    return StraightDrive(a, b, c, float(through))


def _steps(
    changes: np.ndarray,
    push: np.ndarray,
    reading: np.ndarray,
    sample_time_s: float,
    *,
    is_held: bool,
) -> _Tables:
    """From sample to sample, the input held or a straight line between them.

    Parameters
    ----------
    changes : ndarray, shape (n_springs, n_states, n_states)
        Of the state equations, one for each spring.
    push, reading : ndarray, shape (n_states,)

    Returns
    -------
    a : ndarray, shape (n_springs, n_states, n_states)
    b : ndarray, shape (n_springs, n_states)
    through : ndarray, shape (n_springs,)
    """
    n = push.size
    # State, input, and its slope.
    blocks = np.zeros((len(changes), n + 2, n + 2))
    blocks[:, :n, :n], blocks[:, :n, n] = changes, push
    blocks[:, n, n + 1] = 1.0 / sample_time_s
    steps = scipy.linalg.expm(blocks * sample_time_s)
    a = np.ascontiguousarray(steps[:, :n, :n])
    rising = np.zeros((len(changes), n)) if is_held else steps[:, :n, n + 1]
    falling = steps[:, :n, n] - rising
    b = np.einsum("sij,sj->si", a, rising) + falling
    return a, b, rising @ reading
