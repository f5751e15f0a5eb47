"""Fit of one candidate: the base with a set of effects, and how it does.

The training recordings decide the parameters; held-out recordings are only simulated.
What belongs to one recording alone (a phase, a start) is found from that recording.
docs/method_diagnosis.md, eq. (D18) and (D19).

Below it, what a fit stands for: its drive, its effects, its point of a search.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.noise import whiteness
from hwid_cli.diagnosis.parameters import (
    BASE,
    START,
    ParameterLayout,
    ParameterPoint,
    compare_at,
    drive_at,
    each_sum_of_squares,
    effects_at,
    first_point,
    parameter_layout,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem
from hwid_cli.diagnosis.search import SearchResult, fit_own, fit_point, with_own_trials
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import BASE_PARAMETERS, Drive

Start = Mapping[str, Mapping[str, float]]

# Samples that the screening of starts looks at.
SCREENING_SAMPLES = 9000
SCREENING_ITERATIONS = 5
SCREENED_STARTS = 2
# A second start is worth its time only where the screening was this close.
CLOSE_SCREENING = 1.5
SAME_PLACE = 0.02
MOST_ITERATIONS = 25
# A base parameter that the re-fit changes by this factor or more is bent.
BENT = 2.0


@dataclass(frozen=True, eq=False)
class Baseline:
    """What all candidate fits of one diagnosis start from.

    Parameters
    ----------
    drive : Drive
        With the re-fitted base.
    given : Drive or None
        With the base as given. Where the re-fit has bent it to imitate what is
        missing, that is the better start.
    """

    drive: Drive
    scales: Scales
    noise: NoiseFloor
    given: Drive | None = None

    @property
    def drives(self) -> list[Drive]:
        """Drives whose bases a fit is started from."""
        if self.given is None:
            return [self.drive]
        pairs = [
            (getattr(self.given, one), getattr(self.drive, one))
            for one in BASE_PARAMETERS
        ]
        is_bent = any(
            abs(one) > BENT * abs(other) or abs(other) > BENT * abs(one)
            for one, other in pairs
        )
        return [self.drive, self.given] if is_bent else [self.drive]


@dataclass(frozen=True, eq=False)
class _SearchStart:
    """Where a search starts: a drive with its base, and the values of all effects."""

    drive: Drive
    start: Start


def fewer_recordings(problem: DiagnosisProblem, most_samples: int) -> DiagnosisProblem:
    """Problem with so few recordings that they have about ``most_samples``.

    Takes the recordings in turn from each kind, the largest outputs first.
    """
    if problem.n_evaluated <= most_samples:
        return problem
    kinds: dict[str, list[int]] = {}
    sizes = [float(np.max(np.abs(one.output))) for one in problem.signals]
    for row in np.argsort(sizes)[::-1]:
        kinds.setdefault(problem.signals[row].kind, []).append(int(row))
    # Every second one first, so that small and large ones are both there.
    queues = [rows[::2] + rows[1::2] for rows in kinds.values()]
    chosen: list[int] = []
    n_samples = 0
    for turn in range(max(len(queue) for queue in queues)):
        for queue in queues:
            if turn < len(queue) and n_samples < most_samples:
                chosen.append(queue[turn])
                n_samples += problem.signals[queue[turn]].n_evaluated
    signals = tuple(problem.signals[row] for row in sorted(chosen))
    return replace(problem, signals=signals)


def fit_candidate(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    starts: Sequence[Start],
    baseline: Baseline,
    pruning_limit: float = float("inf"),
) -> CandidateFit:
    """Fit the base with effects from several starts, keep the best.

    Parameters
    ----------
    problem : DiagnosisProblem
        Training and held-out recordings.
    effects : tuple of str
        Ids in the catalogue, without those that the simulation has.
    starts : sequence of mapping
        Values of the effects to start from; the effects that the simulation has start
        from their own values. At least one.
    pruning_limit : float
        Sum of squares in the screening beyond which the fit is not finished.
    """
    present = drive_effects(problem.drive)
    train = problem.part(held_out=False)
    everything = (*present, *effects)
    search_starts = [
        _SearchStart(drive, {**present, **start})
        for drive in baseline.drives
        for start in starts
    ]
    most_iterations = MOST_ITERATIONS
    if effects:
        few = fewer_recordings(train, SCREENING_SAMPLES)
        search_starts, best_sse = _screened(
            few, everything, search_starts, baseline.scales
        )
        if best_sse > pruning_limit:
            search_starts, most_iterations = search_starts[:1], 1
    found = [
        _fit_from(train, everything, search_start, baseline.scales, most_iterations)
        for search_start in search_starts
    ]
    best = min(found, key=lambda one: one.sse)
    return _evaluated(problem, effects, best, baseline.noise)


def _screened(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    search_starts: list[_SearchStart],
    scales: Scales,
) -> tuple[list[_SearchStart], float]:
    """Run the first iterations on few recordings.

    Returns where the best came to, with a second one where the screening was close, and
    the sum of squares of the best.
    """
    found = [
        _fit_from(problem, effects, search_start, scales, SCREENING_ITERATIONS)
        for search_start in search_starts
    ]
    found.sort(key=lambda one: one.sse)
    if not np.isfinite(found[0].sse):
        return search_starts[:1], float("inf")
    close = [
        one
        for one in found[:SCREENED_STARTS]
        if one.sse <= CLOSE_SCREENING * found[0].sse
    ]
    kept = [
        _SearchStart(
            drive_at(problem, one.layout, one.point), effects_at(one.layout, one.point)
        )
        for one in close
    ]
    if len(kept) > 1 and _is_same(kept[0].start, kept[1].start):
        kept.pop()
    return kept, found[0].sse


def _is_same(one: Start, other: Start) -> bool:
    """Whether two starts came to the same place."""
    return all(
        abs(value - other[owner][name]) <= SAME_PLACE * abs(value)
        for owner, values in one.items()
        for name, value in values.items()
    )


def _fit_from(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    search_start: _SearchStart,
    scales: Scales,
    max_iterations: int,
) -> SearchResult:
    fit_layout = parameter_layout(problem, effects, search_start.start, scales)
    point = first_point(problem, fit_layout, search_start.drive, search_start.start)
    point = with_own_trials(problem, fit_layout, point)
    return fit_point(problem, fit_layout, point, max_iterations=max_iterations)


def _evaluated(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    best: SearchResult,
    noise: NoiseFloor,
) -> CandidateFit:
    """Simulate all recordings with what was fitted."""
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    held = [row for row, one in enumerate(problem.signals) if one.is_held_out]
    own = np.zeros((len(problem.signals), len(best.layout.own)))
    own[rows] = best.point.own
    if held:
        part = problem.part(held_out=True)
        own[held] = fit_own(part, best.layout, best.point.shared).own
    parts = residuals_at(problem, best.layout, ParameterPoint(best.point.shared, own))
    sse = each_sum_of_squares(parts)
    is_usable = bool(np.isfinite(sse).all())
    neighbour = _neighbour(parts) if is_usable else 0.0
    shared = zip(best.layout.shared, best.point.shared, strict=True)
    own_values = np.array(
        [
            [one.value(q) for one, q in zip(best.layout.own, row, strict=True)]
            for row in own
        ]
    ).reshape(own.shape)
    return CandidateFit(
        effects=effects,
        names=tuple(one.ref for one in best.layout.shared),
        values=np.array([one.value(q) for one, q in shared]),
        own_names=tuple(one.ref for one in best.layout.own),
        own=own_values,
        sse=sse,
        whiteness=whiteness(parts, noise) if is_usable else float("inf"),
        neighbour=neighbour,
        iterations=best.iterations,
        has_converged=best.has_converged,
    )


def _neighbour(parts: list[np.ndarray]) -> float:
    """Correlation of neighbouring residuals."""
    together = sum(float(part[1:] @ part[:-1]) for part in parts)
    size = sum_of_squares(parts)
    return together / size if size > 0 else 0.0


def _values_by_owner(found: CandidateFit) -> dict[str, dict[str, float]]:
    """Shared values of a fit: those of the base, and of each effect."""
    values: dict[str, dict[str, float]] = {}
    for one, value in zip(found.names, found.values, strict=True):
        values.setdefault(one.owner, {})[one.parameter] = float(value)
    return values


def rebuilt(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales
) -> tuple[ParameterLayout, ParameterPoint]:
    """Layout and point of a fit that was computed or kept before.

    Parameters
    ----------
    problem : DiagnosisProblem
        The recordings that it was evaluated on, in their order.
    """
    ids = (*drive_effects(problem.drive), *found.effects)
    values = _values_by_owner(found)
    start = {one: values.get(one, {}) for one in ids}
    fit_layout = parameter_layout(problem, ids, start, scales)
    shared = [one.coordinate(values[one.owner][one.name]) for one in fit_layout.shared]
    own = np.array(
        [
            [one.coordinate(v) for one, v in zip(fit_layout.own, row, strict=True)]
            for row in found.own
        ]
    ).reshape(found.own.shape)
    return fit_layout, ParameterPoint(np.array(shared), own)


def compared_with_fit(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales
) -> list[Compared]:
    """Simulate all recordings with a fit, beside the measurements."""
    return compare_at(problem, *rebuilt(problem, found, scales))


def fitted_start(
    found: CandidateFit, present: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    """Effects that the simulation has, with their fitted values.

    Parameters
    ----------
    present : dict of str to dict of str to float
        Effects of the simulation with the values that it gives.
    """
    values = _values_by_owner(found)
    return {name: {**given, **values.get(name, {})} for name, given in present.items()}


def fitted_effects(found: CandidateFit) -> dict[str, dict[str, float]]:
    """Shared parameters of every effect of a fit; 0 for what each recording has.

    Returns
    -------
    dict of str to dict of str to float
        By the ids in the catalogue.
    """
    effects = _values_by_owner(found)
    effects.pop(BASE, None)
    for one in found.own_names:
        if one.owner != START:
            effects.setdefault(one.owner, {})[one.parameter] = 0.0
    return effects


def fitted_drive(drive: Drive, found: CandidateFit) -> Drive:
    """Drive with the base of a fit."""
    base: dict[str, Any] = _values_by_owner(found).get(BASE, {})
    return replace(drive, **base)
