"""Fit of one candidate: the base with a set of effects, and how it does.

The training recordings decide the parameters; held-out recordings are only simulated.
What belongs to one recording alone (a phase, a start) is found from that recording.
docs/method_diagnosis.md, eq. (D18) and (D19).

What a stored fit stands for: its drive, its effects, its place in a search.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.noise import whiteness
from hwid_cli.diagnosis.parameters import (
    Layout,
    Point,
    drive_at,
    effects_at,
    first_point,
    layout,
    residuals,
    total,
)
from hwid_cli.diagnosis.problem import Problem
from hwid_cli.diagnosis.search import Fitted, fit, fit_own, with_own_trials
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import BASE_PARAMETERS, Drive

Start = Mapping[str, Mapping[str, float]]

# Samples that a race between starts looks at.
RACE_SAMPLES = 9000
RACE_ITERATIONS = 5
FINALISTS = 2
# A second start is worth its time only where the race was this close.
CLOSE_RACE = 1.5
SAME_PLACE = 0.02
MOST_ITERATIONS = 25
# A base parameter that the re-fit changes by this factor or more is bent.
BENT = 2.0


@dataclass(frozen=True, eq=False)
class Footing:
    """What all candidate fits of one diagnosis stand on.

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
class _Begin:
    """Where a fit begins: a drive with its base, and the values of all effects."""

    drive: Drive
    start: Start


def thinned(problem: Problem, most_samples: int) -> Problem:
    """Problem with so few recordings that they have about ``most_samples``.

    Takes the recordings in turn from each kind, the largest outputs first.
    """
    if problem.n_judged <= most_samples:
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
                n_samples += problem.signals[queue[turn]].n_judged
    signals = tuple(problem.signals[row] for row in sorted(chosen))
    return replace(problem, signals=signals)


def fit_candidate(
    problem: Problem,
    effects: tuple[str, ...],
    starts: Sequence[Start],
    footing: Footing,
    *,
    hopeless: float = float("inf"),
) -> CandidateFit:
    """Fit the base with effects from several starts, keep the best.

    Parameters
    ----------
    problem : Problem
        Training and held-out recordings.
    effects : tuple of str
        Ids in the catalogue, without those that the simulation has.
    starts : sequence of mapping
        Values of the effects to start from; the effects that the simulation has start
        from their own values. At least one.
    hopeless : float
        Sum of squares on the recordings of a race beyond which the fit is not finished.
    """
    present = drive_effects(problem.drive)
    train = problem.part(held_out=False)
    everything = (*present, *effects)
    begins = [
        _Begin(drive, {**present, **start})
        for drive in footing.drives
        for start in starts
    ]
    most_iterations = MOST_ITERATIONS
    if effects:
        race = thinned(train, RACE_SAMPLES)
        begins, best_sse = _race(race, everything, begins, footing.scales)
        if best_sse > hopeless:
            begins, most_iterations = begins[:1], 1
    found = [
        _fit_from(train, everything, begin, footing.scales, most_iterations)
        for begin in begins
    ]
    best = min(found, key=lambda one: one.sse)
    return _judged(problem, effects, best, footing.noise)


def _race(
    problem: Problem, effects: tuple[str, ...], begins: list[_Begin], scales: Scales
) -> tuple[list[_Begin], float]:
    """Run the first iterations on few recordings.

    Returns where the best came to, with a second one where the race was close, and the
    sum of squares of the best.
    """
    found = [
        _fit_from(problem, effects, begin, scales, RACE_ITERATIONS) for begin in begins
    ]
    found.sort(key=lambda one: one.sse)
    if not np.isfinite(found[0].sse):
        return begins[:1], float("inf")
    close = [one for one in found[:FINALISTS] if one.sse <= CLOSE_RACE * found[0].sse]
    finalists = [
        _Begin(
            drive_at(problem, one.layout, one.point), effects_at(one.layout, one.point)
        )
        for one in close
    ]
    if len(finalists) > 1 and _is_same(finalists[0].start, finalists[1].start):
        finalists.pop()
    return finalists, found[0].sse


def _is_same(one: Start, other: Start) -> bool:
    """Whether two starts came to the same place."""
    return all(
        abs(value - other[owner][name]) <= SAME_PLACE * abs(value)
        for owner, values in one.items()
        for name, value in values.items()
    )


def _fit_from(
    problem: Problem,
    effects: tuple[str, ...],
    begin: _Begin,
    scales: Scales,
    max_iterations: int,
) -> Fitted:
    fit_layout = layout(problem, effects, begin.start, scales)
    point = first_point(problem, fit_layout, begin.drive, begin.start)
    point = with_own_trials(problem, fit_layout, point)
    return fit(problem, fit_layout, point, max_iterations=max_iterations)


def _judged(
    problem: Problem, effects: tuple[str, ...], best: Fitted, noise: NoiseFloor
) -> CandidateFit:
    """Simulate all recordings with what was fitted."""
    rows = [row for row, one in enumerate(problem.signals) if not one.is_held_out]
    held = [row for row, one in enumerate(problem.signals) if one.is_held_out]
    own = np.zeros((len(problem.signals), len(best.layout.own)))
    own[rows] = best.point.own
    if held:
        part = problem.part(held_out=True)
        own[held] = fit_own(part, best.layout, best.point.shared).own
    parts = residuals(problem, best.layout, Point(best.point.shared, own))
    sse = np.array([float(part @ part) for part in parts])
    sse[~np.isfinite(sse)] = np.inf
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
        names=tuple(f"{one.owner}/{one.name}" for one in best.layout.shared),
        values=np.array([one.value(q) for one, q in shared]),
        own_names=tuple(f"{one.owner}/{one.name}" for one in best.layout.own),
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
    size = total(parts)
    return together / size if size > 0 else 0.0


def rebuilt(
    problem: Problem, found: CandidateFit, scales: Scales
) -> tuple[Layout, Point]:
    """Layout and point of a stored fit.

    Parameters
    ----------
    problem : Problem
        The recordings that it was judged on, in their order.
    """
    ids = (*drive_effects(problem.drive), *found.effects)
    start: dict[str, dict[str, float]] = {one: {} for one in ids}
    base: dict[str, float] = {}
    for name, value in zip(found.names, found.values, strict=True):
        owner, _, parameter = name.partition("/")
        (base if owner == "base" else start[owner])[parameter] = float(value)
    fit_layout = layout(problem, ids, start, scales)
    shared = [
        one.coordinate(
            base[one.name] if one.owner == "base" else start[one.owner][one.name]
        )
        for one in fit_layout.shared
    ]
    own = np.array(
        [
            [one.coordinate(v) for one, v in zip(fit_layout.own, row, strict=True)]
            for row in found.own
        ]
    ).reshape(found.own.shape)
    return fit_layout, Point(np.array(shared), own)


def fitted_start(
    found: CandidateFit, present: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    """Effects that the simulation has, with their fitted values.

    Parameters
    ----------
    present : dict of str to dict of str to float
        Effects of the simulation with the values that it gives.
    """
    start = {name: dict(values) for name, values in present.items()}
    for name, value in zip(found.names, found.values, strict=True):
        owner, _, parameter = name.partition("/")
        if owner in start:
            start[owner][parameter] = float(value)
    return start


def fitted_effects(found: CandidateFit) -> dict[str, dict[str, float]]:
    """Shared parameters of every effect of a fit.

    Returns
    -------
    dict of str to dict of str to float
        By the ids in the catalogue.
    """
    effects: dict[str, dict[str, float]] = {}
    for name, value in zip(found.names, found.values, strict=True):
        owner, _, parameter = name.partition("/")
        if owner != "base":
            effects.setdefault(owner, {})[parameter] = float(value)
    for name in found.own_names:
        owner, _, parameter = name.partition("/")
        if owner != "start":
            effects.setdefault(owner, {})[parameter] = 0.0
    return effects


def fitted_drive(drive: Drive, found: CandidateFit) -> Drive:
    """Drive with the base of a fit."""
    base: dict[str, Any] = {
        name.partition("/")[2]: float(value)
        for name, value in zip(found.names, found.values, strict=True)
        if name.startswith("base/")
    }
    return replace(drive, **base)
