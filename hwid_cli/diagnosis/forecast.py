"""Ranking of candidates before any of them is fitted.

Every candidate is simulated from the re-fitted base at a few values of its parameters.
What the simulation changes is regressed on the base's error, together with the
derivatives by the base's parameters, which absorb part of every effect. That gives the
share of the error that the candidate should explain, and where to start its fit; pairs
of candidates follow from the same columns. docs/method_diagnosis.md, eq. (D19).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf

import numpy as np
import scipy

from hwid_cli.diagnosis.candidate import Start
from hwid_cli.diagnosis.parameters import (
    START,
    first_point,
    parameter_layout,
    residuals_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.search import derivatives, fit_own, with_own_trials
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import ParameterRef
from hwid_cli.records.drive import Drive

# A column may be taken between these multiples of what was simulated; beyond, the
# effect is not proportional to it any more.
_LEAST_MULTIPLE, _MOST_MULTIPLE = 0.0, 4.0
# What is left of a column must exceed this share of it, or it is rounding.
_VISIBLE = 1e-9
# Starts that are kept for the fit of one candidate.
KEPT_STARTS = 3
# Of the best start's share.
PROMISING_START = 0.3


@dataclass(frozen=True, eq=False)
class Forecast:
    """What is expected of one candidate.

    Parameters
    ----------
    share : float, [-]
        Of the sum of squares that the base leaves, that it should explain.
    starts : tuple of mapping
        Parameter values to start from, the best first.
    column : ndarray, shape (n_samples,)
        What the best start changes, without what the base can absorb, of unit length.
    """

    effect: str
    share: float
    starts: tuple[dict[str, float], ...]
    column: np.ndarray


@dataclass(frozen=True, eq=False)
class Linearisation:
    """The re-fitted base and what its parameters absorb; candidates are tried there.

    Parameters
    ----------
    problem : DiagnosisProblem
        Training recordings, or some of them.
    drive : Drive
        With the re-fitted base.
    present : mapping
        Effects that the base has already, as fitted.
    own : mapping of ParameterRef to ndarray, shape (n_recordings,)
        Coordinates of what each recording has for itself: of these effects, its start.
    parts : list of ndarray
        Error of the base in each recording.
    absorbed : ndarray, shape (n_samples, n_absorbed)
        Orthonormal directions that the base's parameters can absorb, and what each
        recording has for itself.
    error : ndarray, shape (n_samples,)
        Error of the base without what they absorb.
    """

    problem: DiagnosisProblem
    drive: Drive
    present: Start
    scales: Scales
    own: Mapping[ParameterRef, np.ndarray]
    parts: list[np.ndarray]
    absorbed: np.ndarray
    error: np.ndarray

    def unabsorbed(self, changed: np.ndarray) -> np.ndarray:
        """What is left of a change beside what the base's parameters absorb.

        Parameters
        ----------
        changed : ndarray, shape (n_samples,), [output unit]

        Returns
        -------
        ndarray, shape (n_samples,), [output unit]
            Zero where only rounding is left.
        """
        column = changed - self.absorbed @ (self.absorbed.T @ changed)
        if np.sqrt(column @ column) <= _VISIBLE * np.sqrt(changed @ changed):
            return np.zeros_like(column)
        return np.asarray(column)


def linearise(
    problem: DiagnosisProblem, drive: Drive, present: Start, scales: Scales
) -> Linearisation:
    """Simulate the base and its derivatives."""
    fit_layout = parameter_layout(problem, tuple(present), present, scales)
    point = first_point(problem, fit_layout, drive, present)
    if any(one.owner != START for one in fit_layout.own):
        point = fit_own(problem, fit_layout, point.shared)
    parts = residuals_at(problem, fit_layout, point)
    jacobians = derivatives(problem, fit_layout, point, parts)
    absorbed = _orthonormal(_whole(jacobians, len(fit_layout.shared)))
    error = np.concatenate(parts)
    error = error - absorbed @ (absorbed.T @ error)
    own = {one.ref: point.own[:, j] for j, one in enumerate(fit_layout.own)}
    return Linearisation(problem, drive, present, scales, own, parts, absorbed, error)


def _whole(jacobians: Sequence[np.ndarray], n_shared: int) -> np.ndarray:
    """Derivatives of all recordings one below the other, own columns side by side."""
    shared = np.vstack([one[:, :n_shared] for one in jacobians])
    own = scipy.linalg.block_diag(*(one[:, n_shared:] for one in jacobians))
    return np.column_stack([shared, own])


def forecast(at_base: Linearisation, identifier: str) -> Forecast:
    """Try the start values of one candidate.

    Parameters
    ----------
    identifier : str
        Id in the catalogue.
    """
    effect, error = CATALOGUE[identifier], at_base.error
    size = float(error @ error)
    tried: list[tuple[float, dict[str, float], np.ndarray]] = []
    for start in effect.starts(at_base.scales):
        changed = changed_by(at_base, identifier, start)
        if changed is None:
            continue
        column = at_base.unabsorbed(changed)
        length = float(np.sqrt(column @ column))
        if length == 0 or size == 0:
            continue
        along = float(column @ error) / length
        multiple = min(max(along / length, _LEAST_MULTIPLE), _MOST_MULTIPLE) * length
        gain = 2 * multiple * along - multiple**2
        tried.append((gain / size, start, column / length))
    if not tried:
        starts = tuple(effect.starts(at_base.scales)[:1])
        return Forecast(identifier, 0.0, starts, np.zeros_like(error))
    tried.sort(key=lambda one: -one[0])
    least = PROMISING_START * tried[0][0]
    kept = [start for share, start, _ in tried[:KEPT_STARTS] if share >= least]
    if effect.strongest.off == inf:
        # What a limit cuts is not in proportion to it, least of all in a loop.
        kept += [start for _, start, _ in tried if start not in kept]
    starts = tuple(kept)
    return Forecast(identifier, tried[0][0], starts, tried[0][2])


def changed_by(
    at_base: Linearisation, identifier: str, start: dict[str, float]
) -> np.ndarray | None:
    """What a candidate adds to the simulation; None where it ran away.

    Parameters
    ----------
    start : dict of str to float
        Its parameters.

    Returns
    -------
    ndarray, shape (n_samples,), or None, [output unit]
        Of all recordings.
    """
    full = {**at_base.present, identifier: start}
    fit_layout = parameter_layout(at_base.problem, tuple(full), full, at_base.scales)
    point = first_point(at_base.problem, fit_layout, at_base.drive, full)
    for column, one in enumerate(fit_layout.own):
        if one.ref in at_base.own:
            point.own[:, column] = at_base.own[one.ref]
    point = with_own_trials(at_base.problem, fit_layout, point, at_base.own)
    with_effect = residuals_at(at_base.problem, fit_layout, point)
    changed = np.concatenate(at_base.parts) - np.concatenate(with_effect)
    return changed if np.isfinite(changed).all() else None


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    if columns.shape[1] == 0:
        return columns
    lengths = np.sqrt(np.sum(columns**2, axis=0))
    usable = columns[:, lengths > 0] / lengths[lengths > 0]
    return np.linalg.qr(usable)[0]


def pair_shares(
    forecasts: Sequence[Forecast], error: np.ndarray
) -> list[tuple[float, str, str]]:
    """Rank pairs of candidates by the columns of their best starts.

    Parameters
    ----------
    error : ndarray, shape (n_samples,)
        Of the base, without what its parameters absorb.

    Returns
    -------
    list of (share, effect, effect)
        The best first.
    """
    size = float(error @ error) or 1.0
    columns = np.column_stack([one.column for one in forecasts])
    gram, along = columns.T @ columns, columns.T @ error
    ranked = []
    for i, j in combinations(range(len(forecasts)), 2):
        common = gram[i, j]
        left = max(1 - common**2, 1e-6)
        gain = (along[i] ** 2 + along[j] ** 2 - 2 * common * along[i] * along[j]) / left
        ranked.append((gain / size, forecasts[i].effect, forecasts[j].effect))
    return sorted(ranked, key=lambda one: -one[0])
