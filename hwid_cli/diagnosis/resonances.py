"""Starts of a part that swings along or of a coupling, from spectra of the recordings.

In time a resonance has to be known to a cycle in the longest ringing before a search finds
it, and a base with one resonance in the place of two is damped beyond recognition. In
spectra a search from many frequencies costs next to nothing. docs/method_diagnosis.md,
eq. (D19b).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import SearchStart, base_of
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.tasks import DiagnosisTask, RunTasks
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Scales, Values
from hwid_cli.drive.linear import equations_with_force
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.drive import Drive

# Lines of each recording that are looked at: those of most energy but the first, which
# holds what is constant. Recordings that are looked at.
_MOST_LINES, _FIRST_LINE, _MOST_RECORDINGS = 300, 1, 3
# Each line counts by its share at first, but those below this one of all, [-]: else the
# height of one resonance hides all that lies beside it.
_LEAST_LINE = 0.02
# Frequencies to begin with: from this share of the lowest resonance to where this share of
# the energy lies above, and at most to this one of the sample rate.
_N_FREQUENCIES, _LOWEST, _LEAST_ENERGY, _HIGHEST = 16, 0.4, 1e-4, 0.3
# Evaluations from each, of the best few by their shares, and of these as they are.
_FIRST_STEPS, _NEXT_STEPS, _LAST_STEPS = 8, 20, 12
# How many go on, and how many are handed on. Those that agree to this are one.
_N_GO_ON, _N_STARTS, _SAME = 6, 2, 0.05
# Step of a derivative, in a logarithm: what is left rests on a basis of nearly parallel
# columns.
_DIFFERENCE = 1e-4
# Parameters move within e^+-9 of where they begin; the input comes so many samples late.
_REACH, _LATE = 9.0, (-1.0, 3.0)


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of the spectra of some recordings, filled up with lines that count 0.

    Parameters
    ----------
    angular : ndarray, shape (n_recordings, n_lines), [rad/s]
    given : ndarray of complex, shape (n_recordings, n_lines, 2), [A s] or [V s], and [N s]
        The input, and the force beside it.
    measured : ndarray of complex, shape (n_recordings, n_lines), [m s]
    counted : ndarray, shape (n_recordings, n_lines), [-]
        1, or 0 where there is no line.
    weights : ndarray, shape (n_recordings, n_lines), [1/(m s)]
        What makes shares of what is left.
    sample_time_s : float, [s]
    """

    angular: np.ndarray
    given: np.ndarray
    measured: np.ndarray
    counted: np.ndarray
    weights: np.ndarray
    sample_time_s: float


def resonances(
    problem: DiagnosisProblem,
    drive: Drive,
    allowed: Sequence[str],
    scales: Scales,
    run_tasks: RunTasks,
) -> dict[str, tuple[SearchStart, ...]]:
    """Where spectra of the training recordings say that effects which resonate begin.

    Parameters
    ----------
    drive : Drive
        With the re-fitted base.
    allowed : sequence of str
        Ids of the effects that may be tried.

    Returns
    -------
    dict of str to tuple of SearchStart
        By effect; empty where the axis is free or a loop is closed.
    """
    resonant = [one for one in allowed if CATALOGUE[one].resonant is not None]
    if drive.controller is not None or drive.stiffness_N_per_m <= 0:
        return {}
    base = {"base": base_of(drive), "effects": drive_effects(drive), "hold": drive.hold}
    tasks = [
        DiagnosisTask(
            f"{one} in spectra", resonance_starts, (problem, drive, one, scales),
            ResonanceStarts, {"spectra": one, **base},
        )
        for one in resonant
    ]  # fmt: skip
    found = run_tasks(tasks, keep=True) if tasks else []
    return {one: each.starts for one, each in zip(resonant, found, strict=True)}


@dataclass(frozen=True, eq=False)
class ResonanceStarts:
    """Where spectra say that one effect begins, the best first; empty where nowhere."""

    starts: tuple[SearchStart, ...]


def resonance_starts(
    problem: DiagnosisProblem, drive: Drive, effect: str, scales: Scales
) -> ResonanceStarts:
    """Where spectra of the training recordings say that one effect begins.

    Parameters
    ----------
    drive : Drive
        On a spring, with the re-fitted base.
    effect : str
        Id in the catalogue, of one that resonates.
    """
    train = problem.part(held_out=False).signals
    lines = _lines_of(_moving_most(train))
    resonant = CATALOGUE[effect].resonant
    low, highest = _LOWEST * scales.natural_Hz, _highest(lines)
    if resonant is None or not low < highest:
        return ResonanceStarts(())
    search = _Search(drive, effect, scales, lines)
    begun = [
        search.go_on(search.begin(values), _FIRST_STEPS, by_shares=True)
        for frequency in np.geomspace(low, highest, _N_FREQUENCIES)
        for values in resonant(float(frequency), scales)
    ]
    nearest = _different(begun)[:_N_GO_ON]
    found = [search.go_on(at, _NEXT_STEPS, by_shares=True)[1] for at in nearest]
    ended = [search.go_on(at, _LAST_STEPS, by_shares=False) for at in found]
    starts = tuple(search.start_of_all(at) for at in _different(ended)[:_N_STARTS])
    return ResonanceStarts(starts)


def _moving_most(signals: Sequence[Signals]) -> list[Signals]:
    ranked = sorted(signals, key=lambda one: -float(np.ptp(one.compared)))
    return ranked[:_MOST_RECORDINGS]


def _lines_of(recordings: Sequence[Signals]) -> Lines:
    """Strongest lines of each recording."""
    shape = (len(recordings), _MOST_LINES)
    angular, counted, weights = np.ones(shape), np.zeros(shape), np.zeros(shape)
    measured, given = np.zeros(shape, complex), np.zeros((*shape, 2), complex)
    for row, one in enumerate(recordings):
        spectra, at = _spectra(one)
        strongest = np.argsort(-np.abs(spectra[0]))[:_MOST_LINES]
        chosen = np.sort(strongest)
        n = slice(chosen.size)
        angular[row, n], measured[row, n] = at[chosen], spectra[0, chosen]
        given[row, n], counted[row, n] = spectra[1:, chosen].T, 1.0
        sizes = np.abs(measured[row, n])
        usual = _LEAST_LINE * np.sqrt(np.mean(sizes**2))
        weights[row, n] = 1.0 / (sizes + usual)
    sample_time_s = recordings[0].sample_time_s
    return Lines(angular, given, measured, counted, weights, sample_time_s)


def _spectra(signals: Signals) -> tuple[np.ndarray, np.ndarray]:
    """Spectra of output, input and force, and the angular frequencies of their lines.

    Returns
    -------
    ndarray of complex, shape (3, n_lines), [m s], [A s] or [V s], [N s]
    ndarray, shape (n_lines,), [rad/s]
    """
    output = signals.compared
    if signals.offset is not None:
        output = output - signals.offset
    finite = np.where(np.isfinite(output), output, 0.0)
    force = signals.force if signals.force.size else np.zeros(finite.size)
    spectra = np.fft.rfft([finite, signals.driven_by, force])
    angular = 2 * np.pi * np.fft.rfftfreq(finite.size, signals.sample_time_s)
    usable = np.arange(angular.size) >= _FIRST_LINE
    usable &= angular < 2 * np.pi * _HIGHEST / signals.sample_time_s
    return spectra[:, usable], angular[usable]


def _highest(lines: Lines) -> float:
    """Frequency beyond which recordings hold next to no energy, [Hz]."""
    energy = np.abs(lines.measured) ** 2
    above = np.cumsum(energy[:, ::-1], axis=1)[:, ::-1]
    strong = above > _LEAST_ENERGY * energy.sum(axis=1, keepdims=True)
    return float(np.max(lines.angular, where=strong, initial=0.0)) / (2 * np.pi)


def _different(found: Sequence[tuple[float, np.ndarray]]) -> list[np.ndarray]:
    """Places that differ, the one that leaves least first."""
    kept: list[np.ndarray] = []
    for _, one in sorted(found, key=lambda pair: pair[0]):
        if all(np.abs(one - other).max() > _SAME for other in kept):
            kept.append(one)
    return kept


class _Search:
    """Search in spectra, over the logarithms of all positive parameters."""

    def __init__(self, drive: Drive, effect: str, scales: Scales, lines: Lines) -> None:
        self._drive, self._effect, self._lines = drive, effect, lines
        self._base = [one for one in drive.fitted_base if getattr(drive, one) != 0.0]
        # What spectra hardly show is none here, and goes on from where its search begins.
        parameters = [one for one in CATALOGUE[effect].parameters if one.is_positive]
        self._names = [one.name for one in parameters]
        self._others = {
            one.name: one.starts(scales)[0]
            for one in CATALOGUE[effect].parameters
            if not one.is_positive
        }
        sizes = [abs(getattr(drive, one)) for one in self._base]
        ends = [(one * np.exp(-_REACH), one * np.exp(_REACH)) for one in sizes]
        ends += [one.bounds(scales) for one in parameters]
        # How late the input comes, in samples, is found beside them: how it is held
        # between samples turns the phase by more than a light part does.
        self._bounds = np.vstack([np.log(np.array(ends)), _LATE]).T

    def begin(self, values: Values) -> np.ndarray:
        """Coordinates with the base as it is."""
        base = [abs(getattr(self._drive, one)) for one in self._base]
        own = [values[one] for one in self._names]
        return np.r_[np.log([*base, *own]), 0.0]

    def start(self, coordinates: np.ndarray) -> SearchStart:
        """The parameters at some coordinates."""
        sizes = np.exp(coordinates[:-1]).tolist()
        base = {
            name: float(np.copysign(size, getattr(self._drive, name)))
            for name, size in zip(self._base, sizes, strict=False)
        }
        own = dict(zip(self._names, sizes[len(self._base) :], strict=True))
        return SearchStart(base, {self._effect: own})

    def start_of_all(self, coordinates: np.ndarray) -> SearchStart:
        """The same with what spectra hardly show."""
        seen = self.start(coordinates)
        own = {**seen.effects[self._effect], **self._others}
        return replace(seen, effects={self._effect: own})

    def go_on(
        self, coordinates: np.ndarray, steps: int, *, by_shares: bool
    ) -> tuple[float, np.ndarray]:
        """What is left, and where, after so many steps."""
        left = partial(self._left, by_shares=by_shares)
        found = scipy.optimize.least_squares(
            left, np.clip(coordinates, *self._bounds), partial(_slopes, left),
            max_nfev=steps, bounds=self._bounds,
        )  # fmt: skip
        return float(found.cost), found.x

    def _left(self, coordinates: np.ndarray, *, by_shares: bool) -> np.ndarray:
        """Measured less linear drive, real and imaginary parts of all lines."""
        at = self.start(coordinates)
        effects = {**self._drive.effects, **at.effects}
        base: Mapping[str, Any] = at.base
        equations = equations_with_force(replace(self._drive, **base, effects=effects))
        weights = self._lines.weights if by_shares else self._lines.counted
        return _left_of(self._lines, equations, float(coordinates[-1]), weights)


def _slopes(
    left: Callable[[np.ndarray], np.ndarray], coordinates: np.ndarray
) -> np.ndarray:
    """Derivatives of what is left."""
    here = left(coordinates)
    moved = coordinates + _DIFFERENCE * np.eye(coordinates.size)
    return np.column_stack([left(one) - here for one in moved]) / _DIFFERENCE


def _left_of(
    lines: Lines,
    equations: tuple[np.ndarray, np.ndarray, np.ndarray],
    late: float,
    weights: np.ndarray,
) -> np.ndarray:
    """What no motion at the start and at the end of a recording explains either.

    Of a recording from 0 to T the spectrum is c (jw - A)^-1 (B U + z(0) - z(T)) at its own
    lines, where e^-jwT is 1.

    Parameters
    ----------
    late : float
        Of the input, in samples.
    weights : ndarray, shape (n_recordings, n_lines), [-] or [1/(m s)]

    Returns
    -------
    ndarray, shape (2 n_recordings n_lines,), [m s] or [-]
    """
    a, b, c = equations
    reading = _reading(lines.angular, a, c)
    delay = np.exp(-1j * late * lines.sample_time_s * lines.angular)
    moved = (reading * (lines.given @ b.T)).sum(axis=2)
    left = weights * (lines.measured - delay * moved)
    reading *= weights[:, :, None]
    columns = np.concatenate([reading.real, reading.imag], axis=1)
    columns /= np.sqrt(np.einsum("rlc,rlc->rc", columns, columns))[:, None, :]
    basis, _ = np.linalg.qr(columns)
    whole = np.concatenate([left.real, left.imag], axis=1)
    along = np.einsum("rlc,rl->rc", basis, whole)
    return np.asarray(whole - np.einsum("rlc,rc->rl", basis, along)).ravel()


def _reading(angular: np.ndarray, a: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Row c (jw - A)^-1 at many frequencies, by one triangular form of A.

    Parameters
    ----------
    angular : ndarray, shape (n_recordings, n_lines), [rad/s]
    a : ndarray, shape (n_states, n_states), [1/s]
    c : ndarray, shape (n_states,)

    Returns
    -------
    ndarray of complex, shape (n_recordings, n_lines, n_states)

    References
    ----------
    Laub, Efficient multivariable frequency response computations, IEEE TAC 26 (1981).
    """
    triangle, unitary = scipy.linalg.schur(a, output="complex")
    at = 1j * angular.ravel()
    solved = np.empty((c.size, at.size), complex)
    for n, one in enumerate(c @ unitary):
        above = one + triangle[:n, n] @ solved[:n]
        solved[n] = above / (at - triangle[n, n])
    return np.asarray(solved.T @ unitary.conj().T).reshape(*angular.shape, c.size)
