"""Fit of one candidate: the base with a set of effects, and how it does.

The training recordings decide the parameters; held-out recordings are only simulated.
What belongs to one recording alone (a phase, a start) is found from that recording.
docs/method_diagnosis.md, eq. (D18) and (D19).

Below it, what a fit stands for: its drive, its effects, its point of a search.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.causes import left_over
from hwid_cli.diagnosis.few_samples import fewer_recordings
from hwid_cli.diagnosis.input_noise import fit_with_input_noise, may_be_input_noise
from hwid_cli.diagnosis.parameters import (
    BASE,
    START,
    ParameterLayout,
    ParameterPoint,
    compare_at,
    drive_at,
    drives_at,
    each_sum_of_squares,
    effects_at,
    first_point,
    parameter_layout,
    residuals_at,
    sum_of_squares,
)
from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem
from hwid_cli.diagnosis.search import (
    SearchResult,
    cross_fitted,
    fit_own,
    fit_point,
    with_own_trials,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.diagnosis import STILL_LARGE, NoiseFloor
from hwid_cli.records.drive import BASE_AND_MASS, Drive

Start = Mapping[str, Mapping[str, float]]

# Samples that the screening of starts looks at.
SCREENING_SAMPLES = 6000
# Iterations from every start, then from the two best. A second start is worth further
# time only where its sum of squares is within the factor.
SCREENING = ((2, 2.0), (3, 1.2))
SCREENED_STARTS = 2
SAME_PLACE = 0.02
MOST_ITERATIONS = 20
# Of several starts, each has so many of these; those that are within the factor then go on.
FIRST_ITERATIONS = 5
WITHIN_BEST = 1.1

# A base parameter that the re-fit changes by this factor or more is bent.
BENT = 2.0
# From so many times the samples of a screening on, some of them are asked first.
_MANY_TIMES = 4
# What is left of an effect of the simulation in a start, at least, of what it states.
_LEAST_LEFT = 0.1


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
    resonances : mapping of str to tuple of SearchStart
        Where spectra say that effects which resonate begin, by their ids.
    """

    drive: Drive
    scales: Scales
    noise: NoiseFloor
    given: Drive | None = None
    resonances: Mapping[str, tuple["SearchStart", ...]] = field(default_factory=dict)

    def with_resonances(
        self, effects: tuple[str, ...], starts: Sequence["SearchStart"]
    ) -> list["SearchStart"]:
        """Add starts of a set, each with one resonance as spectra show it.

        All else is as in the first start.
        """
        seen = [
            replace(
                starts[0],
                base={**starts[0].base, **one.base},
                effects={**starts[0].effects, **one.effects},
            )
            for effect in effects
            for one in self.resonances.get(effect, ())
        ]
        return [*starts, *seen]

    @property
    def is_bent(self) -> bool:
        """Whether the re-fit has moved a parameter of the base far away."""
        if self.given is None:
            return False
        pairs = [
            (getattr(self.given, one), getattr(self.drive, one))
            for one in BASE_AND_MASS
        ]
        return any(_is_far(one, other) for one, other in pairs)


def _is_far(one: float, other: float) -> bool:
    return abs(one) > BENT * abs(other) or abs(other) > BENT * abs(one)


@dataclass(frozen=True)
class SearchStart:
    """Where a search starts.

    Parameters
    ----------
    base : mapping of str to float
        Parameters of the base.
    effects : mapping of str to mapping of str to float
        Parameters of all effects, those of the simulation included.

    Examples
    --------
    >>> start = SearchStart({"mass_kg": 2.0}, {"coulomb_friction": {"force_N": 5.0}})
    >>> SearchStart.of_text(str(start)).effects
    {'coulomb_friction': {'force_N': 5.0}}
    """

    base: Mapping[str, float]
    effects: Start

    def __str__(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def of_text(cls, text: str) -> "SearchStart":
        """Read what ``str`` gives, to the last digit."""
        return cls(**json.loads(text))


@dataclass(frozen=True, eq=False)
class Screened:
    """Where the first iterations on few recordings have brought a set of effects.

    Parameters
    ----------
    effects : tuple of str
        Ids in the catalogue, without those that the simulation has.
    sse : float
        Sum of squares on these few recordings; infinite where none could be simulated.
    starts : tuple of SearchStart
        Where to go on, the best first; at most two.
    """

    effects: tuple[str, ...]
    sse: float
    starts: tuple[SearchStart, ...]


def screen(
    few: DiagnosisProblem,
    effects: tuple[str, ...],
    starts: Sequence[SearchStart],
    scales: Scales,
) -> Screened:
    """Fit a set of effects cheaply: a few iterations from each start.

    Parameters
    ----------
    few : DiagnosisProblem
        Some of the training recordings.
    effects : tuple of str
        Ids in the catalogue, without those that the simulation has.
    starts : sequence of SearchStart
        At least one.
    """
    everything = (*drive_effects(few.drive), *effects)
    reached = list(starts)
    for iterations, close in SCREENING:
        found = [
            fit_from(few, everything, start, scales, iterations) for start in reached
        ]
        found.sort(key=lambda one: one.sse)
        if not np.isfinite(found[0].sse):
            return Screened(effects, float("inf"), (starts[0],))
        reached = [
            reached_by(few, one)
            for one in found[:SCREENED_STARTS]
            if one.sse <= close * found[0].sse
        ]
    kept = reached
    if len(kept) > 1 and _is_same(kept[0].effects, kept[1].effects):
        kept.pop()
    return Screened(effects, found[0].sse, tuple(kept))


def reached_by(problem: DiagnosisProblem, found: SearchResult) -> SearchStart:
    """Where a search came to, for another one to go on."""
    drive = drive_at(problem, found.layout, found.point)
    return SearchStart(base_of(drive), effects_at(found.layout, found.point))


def base_of(drive: Drive) -> dict[str, float]:
    """Parameters of a drive's base, by name."""
    names = dict.fromkeys((*BASE_AND_MASS, *drive.fitted_base))
    return {one: float(getattr(drive, one)) for one in names}


def fit_candidate(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    starts: Sequence[SearchStart],
    scales: Scales,
    noise: NoiseFloor,
    most_samples: int | None = None,
) -> CandidateFit:
    """Fit the base with effects from several starts, keep the best.

    Parameters
    ----------
    problem : DiagnosisProblem
        Training and held-out recordings.
    effects : tuple of str
        Ids in the catalogue, without those that the simulation has.
    starts : sequence of SearchStart
        At least one.
    most_samples : int or None
        Fit to so many samples of the training recordings; None fits to all of them.
    """
    train = problem.part(held_out=False)
    if most_samples is not None:
        train = fewer_recordings(train, most_samples)
    everything = (*drive_effects(problem.drive), *effects)
    near = train.n_evaluated * (STILL_LARGE * noise.rms) ** 2
    best = _best_from(train, everything, starts, scales, near)
    return evaluated(problem, effects, best, train, noise)


def _best_from(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    starts: Sequence[SearchStart],
    scales: Scales,
    near: float,
) -> SearchResult:
    """Search from several starts; those that fall behind stop early."""
    first = MOST_ITERATIONS if len(starts) == 1 else FIRST_ITERATIONS
    found = [fit_from(problem, effects, start, scales, first, near) for start in starts]
    if len(starts) > 1:
        least = min(one.sse for one in found)
        first_ones = [one for one in found if one.sse <= WITHIN_BEST * least]
        found = [_gone_on(problem, one, near) for one in first_ones]
    return min(found, key=lambda one: one.sse)


def _gone_on(
    problem: DiagnosisProblem, found: SearchResult, near: float
) -> SearchResult:
    """Search that has gone on from where it stopped at its limit of iterations."""
    if found.has_converged:
        return found
    left = MOST_ITERATIONS - found.iterations
    further = fit_point(
        problem, found.layout, found.point, max_iterations=left, near=near
    )
    return replace(further, iterations=found.iterations + further.iterations)


def _is_same(one: Start, other: Start) -> bool:
    """Whether two starts came to the same place."""
    return all(
        abs(value - other[owner][name]) <= SAME_PLACE * abs(value)
        for owner, values in one.items()
        for name, value in values.items()
    )


def fit_from(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    start: SearchStart,
    scales: Scales,
    max_iterations: int,
    near: float = np.inf,
) -> SearchResult:
    """Search from one start.

    Parameters
    ----------
    effects : tuple of str
        Ids in the catalogue, those of the simulation included.
    near : float
        Sum of squares below which it is followed to the end.
    """
    base: dict[str, Any] = dict(start.base)
    drive = replace(problem.drive, **base)
    fit_layout = parameter_layout(problem, effects, start.effects, scales)
    point = first_point(problem, fit_layout, drive, start.effects)
    point = with_own_trials(problem, fit_layout, point)
    return fit_point(
        problem, fit_layout, point, max_iterations=max_iterations, near=near
    )


def evaluated(
    problem: DiagnosisProblem,
    effects: tuple[str, ...],
    best: SearchResult,
    fitted_to: DiagnosisProblem,
    noise: NoiseFloor,
) -> CandidateFit:
    """Simulate all recordings with what was fitted to some.

    Parameters
    ----------
    effects : tuple of str
        Ids in the catalogue, without those that the simulation has.
    fitted_to : DiagnosisProblem
        The recordings, or parts of them, that the search has ended on.
    """
    names = [one.name for one in fitted_to.signals]
    numbered = list(enumerate(problem.signals))
    rows = [row for row, one in numbered if one.name in names]
    held = [row for row, one in numbered if one.is_held_out]
    rest = [row for row, _ in numbered if row not in rows and row not in held]
    own = np.zeros((len(problem.signals), len(best.layout.own)))
    own[rows] = best.point.own
    usual = np.median(best.point.own, axis=0)
    if rest and best.layout.own:
        part = replace(problem, signals=tuple(problem.signals[row] for row in rest))
        own[rest] = fit_own(part, best.layout, best.point.shared, usual).own
    held_parts: list[np.ndarray] = []
    if held:
        part = problem.part(held_out=True)
        own[held] = fit_own(part, best.layout, best.point.shared, usual).own
        held_parts = cross_fitted(
            part, best.layout, ParameterPoint(best.point.shared, own[held])
        )
    parts = residuals_at(problem, best.layout, ParameterPoint(best.point.shared, own))
    for row, part_of_row in zip(held, held_parts, strict=True):
        parts[row] = part_of_row
    sse = each_sum_of_squares(parts)
    is_usable = bool(np.isfinite(sse).all())
    neighbour = neighbour_of(parts) if is_usable else 0.0
    drives = drives_at(problem, best.layout, ParameterPoint(best.point.shared, own))
    white, cause = left_over(parts, problem, drives, noise)
    shared = zip(best.layout.shared, best.point.shared, strict=True)
    return CandidateFit(
        effects=effects,
        names=tuple(one.ref for one in best.layout.shared),
        values=np.array([one.value(q) for one, q in shared]),
        own_names=tuple(one.ref for one in best.layout.own),
        own=_own_values(best.layout, own),
        sse=sse,
        whiteness=white,
        neighbour=neighbour,
        iterations=best.iterations,
        has_converged=best.has_converged,
        cause=cause,
    )


def _own_values(fit_layout: ParameterLayout, own: np.ndarray) -> np.ndarray:
    """Values of what belongs to each recording, from its coordinates."""
    values = [
        [one.value(q) for one, q in zip(fit_layout.own, row, strict=True)]
        for row in own
    ]
    return np.array(values).reshape(own.shape)


def neighbour_of(parts: Sequence[np.ndarray]) -> float:
    """Correlation of neighbouring residuals.

    Parameters
    ----------
    parts : sequence of ndarray, shape (n_evaluated,), [output unit]
        Of each recording.
    """
    together = sum(float(part[1:] @ part[:-1]) for part in parts)
    size = sum_of_squares(list(parts))
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


def belongs_to(problem: DiagnosisProblem, found: CandidateFit, scales: Scales) -> bool:
    """Whether a fit has the values that the recordings of a problem have for themselves.

    How these start may be known in one problem and found in another.
    """
    ids = (*drive_effects(problem.drive), *found.effects)
    start: dict[str, dict[str, float]] = {one: {} for one in ids}
    fit_layout = parameter_layout(problem, ids, start, scales)
    return tuple(one.ref for one in fit_layout.own) == tuple(found.own_names)


def compared_with_fit(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales
) -> list[Compared]:
    """Simulate all recordings with a fit, beside the measurements."""
    return compare_at(problem, *rebuilt(problem, found, scales))


def residuals_of_few(
    few: DiagnosisProblem,
    problem: DiagnosisProblem,
    found: CandidateFit,
    scales: Scales,
) -> list[np.ndarray]:
    """What a fit leaves of some of the recordings, or of parts of them.

    Parameters
    ----------
    few : DiagnosisProblem
        From ``fewer_recordings``.
    problem : DiagnosisProblem
        The recordings that the fit was evaluated on, in their order.
    """
    fit_layout, point = rebuilt(problem, found, scales)
    names = {one.name for one in few.signals}
    rows = [row for row, one in enumerate(problem.signals) if one.name in names]
    return residuals_at(few, fit_layout, ParameterPoint(point.shared, point.own[rows]))


def at_point(
    problem: DiagnosisProblem,
    found: CandidateFit,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    noise: NoiseFloor,
) -> CandidateFit:
    """The same candidate with other values.

    Parameters
    ----------
    fit_layout : ParameterLayout
        May have fewer parameters of the base.
    point : ParameterPoint
        With own values of all recordings.
    """
    parts = residuals_at(problem, fit_layout, point)
    sse = each_sum_of_squares(parts)
    if not np.isfinite(sse).all():
        return found
    white, cause = left_over(
        parts, problem, drives_at(problem, fit_layout, point), noise
    )
    shared = zip(fit_layout.shared, point.shared, strict=True)
    own = [
        [one.value(q) for one, q in zip(fit_layout.own, row, strict=True)]
        for row in point.own
    ]
    return replace(
        found,
        names=tuple(one.ref for one in fit_layout.shared),
        values=np.array([one.value(q) for one, q in shared]),
        own=np.array(own).reshape(point.own.shape),
        sse=sse,
        whiteness=white,
        neighbour=neighbour_of(parts),
        cause=cause,
        valleys=np.zeros((0, 0)),
    )


def needs_input_noise(
    problem: DiagnosisProblem, fit: CandidateFit, noise: NoiseFloor
) -> bool:
    """Whether a fit leaves what noise of the input, if there is some, might explain."""
    is_open = 1.0 < fit.whiteness < np.inf
    return is_open and noise.input_rms > 0 and not problem.compares_command


def with_input_noise(
    problem: DiagnosisProblem, fit: CandidateFit, scales: Scales, noise: NoiseFloor
) -> CandidateFit:
    """A fit with the input's noise in mind, if nothing else remains then."""
    if not needs_input_noise(problem, fit, noise):
        return fit
    fit_layout, point = rebuilt(problem, fit, scales)
    if not may_be_input_noise(problem, fit_layout, point, noise):
        return fit
    if not _is_noise_of_few(problem, fit_layout, point, noise):
        return fit
    point = fit_with_input_noise(problem, fit_layout, point, noise)
    found = at_point(problem, fit, fit_layout, point, noise)
    return found if found.cause == "input_noise" else fit


def _is_noise_of_few(
    problem: DiagnosisProblem,
    fit_layout: ParameterLayout,
    point: ParameterPoint,
    noise: NoiseFloor,
) -> bool:
    """Whether noise of the input may be all, by a fit to some of many samples.

    What is more than noise there is so in all of them.
    """
    if problem.n_evaluated <= _MANY_TIMES * SCREENING_SAMPLES:
        return True
    few = fewer_recordings(problem.part(held_out=False), SCREENING_SAMPLES)
    names = {one.name for one in few.signals}
    rows = [row for row, one in enumerate(problem.signals) if one.name in names]
    own = ParameterPoint(point.shared, point.own[rows])
    found = fit_with_input_noise(few, fit_layout, own, noise)
    drives = drives_at(few, fit_layout, found)
    _, cause = left_over(residuals_at(few, fit_layout, found), few, drives, noise)
    return cause == "input_noise"


def present_start(
    found: CandidateFit, present: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    """Effects that the simulation has, as a fit has left them, as a start.

    One that has vanished beside what was missing comes back: where it is nothing, no
    search sees what it would do.

    Parameters
    ----------
    present : dict of str to dict of str to float
        Effects of the simulation with the values that it gives.
    """
    values = _values_by_owner(found)
    return {
        name: {
            parameter: _seen(values.get(name, {}).get(parameter, stated), stated)
            for parameter, stated in given.items()
        }
        for name, given in present.items()
    }


def _seen(value: float, stated: float) -> float:
    """A value, or a share of the stated one where hardly anything is left of that."""
    least = _LEAST_LEFT * stated
    return least if 0.0 <= value / (least or 1.0) < 1.0 else value


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


def fitted_values(
    found: CandidateFit, present: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    """Shared parameters of all effects of a fit, those of the simulation included."""
    values = _values_by_owner(found)
    given = {name: {**one, **values.get(name, {})} for name, one in present.items()}
    return {**given, **fitted_effects(found)}


def start_values(
    found: CandidateFit, present: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    """The same as a start, with what the simulation has and the fit has lost."""
    return {**fitted_effects(found), **present_start(found, present)}


def start_from(drive: Drive, found: CandidateFit) -> SearchStart:
    """Where a fit has ended, as the start of another one.

    Parameters
    ----------
    drive : Drive
        That was fitted, with the effects that the simulation has.
    """
    values = start_values(found, drive_effects(drive))
    return SearchStart(base_start(drive, found), values)


def base_start(drive: Drive, found: CandidateFit) -> dict[str, float]:
    """Base of a fit as a start, with what it has lost of what the drive states."""
    stated = base_of(drive)
    fitted = base_of(fitted_drive(drive, found))
    return {name: _seen(value, stated[name]) for name, value in fitted.items()}


def bends_effects(drive: Drive, found: CandidateFit) -> bool:
    """Whether a fit has moved the strength of an effect of the simulation far away.

    A winding may imitate a delay, friction a load: what is missing is better looked for
    beside what is stated.
    """
    present = drive_effects(drive)
    values = _values_by_owner(found)
    strengths = [
        (given.get(name), values.get(one, {}).get(name))
        for one, given in present.items()
        for name in [CATALOGUE[one].strongest.name]
    ]
    return any(
        stated is not None and value is not None and _is_far(stated, value)
        for stated, value in strengths
    )


def without_base(found: CandidateFit) -> CandidateFit:
    """The fit of the effects alone; the base stays as the drive has it."""
    return without_owner(found, BASE)


def without_owner(found: CandidateFit, owner: str) -> CandidateFit:
    """The fit without an effect, its base or its starts; the values of the others stay."""
    kept = np.array([one.owner != owner for one in found.names], dtype=bool)
    own = np.array([one.owner != owner for one in found.own_names], dtype=bool)
    return replace(
        found,
        effects=tuple(one for one in found.effects if one != owner),
        names=tuple(one for one in found.names if one.owner != owner),
        values=found.values[kept],
        own_names=tuple(one for one in found.own_names if one.owner != owner),
        own=found.own[:, own],
        valleys=found.valleys[:, kept] if found.valleys.size else found.valleys,
    )


def with_values(
    found: CandidateFit, values: Mapping[ParameterRef, float]
) -> CandidateFit:
    """The fit with other values of some of its shared parameters."""
    pairs = zip(found.names, found.values.tolist(), strict=True)
    return replace(found, values=np.array([values.get(*pair) for pair in pairs]))


def without_starts(found: CandidateFit) -> CandidateFit:
    """The fit without where its recordings start, beside starts that are known."""
    return without_owner(found, START)


def fitted_drive(drive: Drive, found: CandidateFit) -> Drive:
    """Drive with the base of a fit."""
    base: dict[str, Any] = _values_by_owner(found).get(BASE, {})
    return replace(drive, **base)
