"""Starts of a set of effects where related sets have ended, and what they have to reach.

docs/method_diagnosis.md.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from hwid_cli.diagnosis.candidate import (
    Screened,
    SearchStart,
    base_start,
    start_from,
    start_values,
)
from hwid_cli.diagnosis.choice import LEAST_ADDED
from hwid_cli.diagnosis.effect_sets import (
    Effects,
    includes_one_of,
    may_stand,
    moved_up,
    relatives,
    second_of,
    translated,
    with_effect,
    without_effect,
)
from hwid_cli.diagnosis.fit_facts import has_own_values
from hwid_cli.diagnosis.set_fits import (
    FAR_BEHIND,
    LEAST_LEFT,
    LEAST_TURN,
    WORTH_MORE,
    SetFits,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit

_Starts = TypeVar("_Starts")
# A set leads further than the preferred one where it leaves less than this share of that.
_LEADS_FURTHER = 0.5


def from_related(fits: SetFits, size: int) -> dict[Effects, list[SearchStart]]:
    """Starts from related fits that have come further than a set's own fit."""
    best = fits.best_of_size(size)
    if best is None or not np.isfinite(fits.train_sse(best)):
        return {}
    sets = _from_best(fits, best)
    lowest, excess = fits.lowest_of_size(size), fits.rounds.criteria.excess
    if excess(lowest) < _LEADS_FURTHER * excess(best):
        # A wider law that brings too little of the whole to be preferred.
        sets = {**_from_best(fits, lowest), **sets}
    if has_own_values(best):
        # Values of each recording make up for much: the truth may be a relative of what
        # comes next.
        shared = fits.best_of_size(size, are_shared=True)
        if shared is not None:
            sets = {**_from_best(fits, shared), **sets}
    if not fits.rounds.criteria.is_complete(best):
        for ids, start in _from_parts(fits, size):
            sets.setdefault(ids, []).extend(fits.unless_tried(ids, [start]))
    return {ids: starts for ids, starts in sets.items() if starts}


def _from_best(fits: SetFits, best: CandidateFit) -> dict[Effects, list[SearchStart]]:
    """Starts where the best set ended, with a relative in the place of an effect.

    Where the best set is complete, simpler relatives only, or one that it has already:
    the same kind twice.
    """
    rounds, present = fits.rounds, drive_effects(fits.rounds.problem.drive)
    is_complete = rounds.criteria.is_complete(best)
    values, base = start_values(best, present), _base_values(fits, best)
    sets: dict[Effects, list[SearchStart]] = {}
    for effect in best.effects:
        others = tuple(one for one in best.effects if one != effect)
        for one in _to_try(effect, others, is_complete):
            relative = second_of(one) if one in others else one
            ids = with_effect(others, relative)
            if relative not in rounds.allowed or not may_stand(ids, present):
                continue
            here = fits.found.get(ids)
            if here is not None and not fits.is_behind(here, best):
                continue
            given = translated(relative, values[effect], rounds.baseline.scales)
            starts = [
                SearchStart(base, {**without_effect(values, effect), relative: one})
                for one in given
            ]
            if here is not None:
                starts.append(SearchStart(base, start_values(here, present)))
            sets[ids] = fits.unless_tried(ids, starts)
    return sets


def _to_try(effect: str, others: Effects, is_complete: bool) -> list[str]:
    """Relatives that may take the place of an effect beside others."""
    kin = relatives(effect)
    if not is_complete:
        return kin
    simpler = CATALOGUE[effect].contains
    return [one for one in kin if one in simpler or one in others]


def _from_parts(fits: SetFits, size: int) -> Iterable[tuple[Effects, SearchStart]]:
    """Starts at a smaller set, the further effect faint: none ends up worse."""
    rounds, present = fits.rounds, drive_effects(fits.rounds.problem.drive)
    for one in fits.of_size(size):
        smaller = fits.largest_part(one.effects)
        if smaller is None or not fits.is_behind(one, smaller):
            continue
        added = set(one.effects) - set(smaller.effects)
        if len(added) != 1:
            continue
        (effect,) = added
        values = start_values(smaller, present)
        faint = CATALOGUE[effect].faint(
            start_values(one, present)[effect], rounds.baseline.scales
        )
        yield (
            one.effects,
            SearchStart(_base_values(fits, smaller), {**values, effect: faint}),
        )


def parts_of(
    fits: SetFits, sets: Iterable[Effects]
) -> dict[Effects, list[SearchStart]]:
    """The best set in each set, from where it ended."""
    parts = [fits.largest_part(ids) for ids in sets]
    drive = fits.rounds.problem.drive
    return {one.effects: [start_from(drive, one)] for one in parts if one is not None}


def near_the_best(
    fits: SetFits,
    sets: Iterable[Effects],
    screened: Sequence[Screened],
    best: CandidateFit | None,
) -> dict[Effects, Sequence[SearchStart]]:
    """Sets that come close to the best one, from where it ended, in the screening.

    Not those that there bring hardly more than the best set in them. A simpler law may be
    further away: few steps do not lead it where the wider one has been led by many.
    """
    if best is None:
        return {}
    found = {one.effects: one for one in screened}
    floor, reached = fits.floor(), fits.few_sse(best)
    excess = max(reached - floor, LEAST_LEFT * reached)
    near: dict[Effects, Sequence[SearchStart]] = {}
    for ids in sets:
        part = fits.largest_part(ids)
        left = np.inf if part is None else found[part.effects].sse - floor
        is_simpler = includes_one_of(best.effects, [ids])
        most = (FAR_BEHIND if is_simpler else WORTH_MORE) * excess
        if found[ids].sse - floor <= min(most, LEAST_TURN * left):
            near[ids] = found[ids].starts
    return near


def that_add(
    fits: SetFits, sets: Mapping[Effects, Sequence[SearchStart]]
) -> dict[Effects, Sequence[SearchStart]]:
    """Sets without those that bring hardly more than a finished one they include.

    Few samples tell, from where that one ended. Where there are no more, the fit
    itself costs as little. The wider of two comes after the narrower one, and only
    where that has brought something.
    """
    if not fits.has_many:
        return dict(sets)
    found: dict[Effects, Sequence[SearchStart]] = {}
    dropped: list[Effects] = []
    for level in by_width(sets):
        asked = {ids: level[ids] for ids in level if not includes_one_of(ids, dropped)}
        adding = _that_add_here(fits, asked)
        dropped += [ids for ids in level if ids not in adding]
        found.update(adding)
    return found


def _that_add_here(
    fits: SetFits, sets: Mapping[Effects, Sequence[SearchStart]]
) -> dict[Effects, Sequence[SearchStart]]:
    """Of sets none of which includes another, those that add to a finished one."""
    narrow = {
        ids: [one for one in fits.found if includes_one_of(ids, [one])] for ids in sets
    }
    tried = {
        one: [start_from(fits.rounds.problem.drive, fits.found[one])]
        for several in narrow.values()
        for one in several
    }
    for ids, several in narrow.items():
        if several:
            tried[ids] = [*sets[ids], *_widened(fits, ids, several)]
    screened = {
        one.effects: one for one in fits.screen("sets and what they include", tried)
    }
    whole = fits.few_sse(fits.rounds.base)
    found: dict[Effects, Sequence[SearchStart]] = {}
    for ids, starts in sets.items():
        wide = screened.get(ids)
        least = min((screened[one].sse for one in narrow[ids]), default=np.inf)
        if wide is None:
            found[ids] = starts
        elif least - wide.sse >= LEAST_ADDED * (whole - wide.sse):
            found[ids] = wide.starts
    return found


def _widened(
    fits: SetFits, ids: Effects, narrow: Sequence[Effects]
) -> Iterable[SearchStart]:
    """Starts of a set where narrower ones have ended."""
    rounds, present = fits.rounds, drive_effects(fits.rounds.problem.drive)
    for one in narrow:
        fit = fits.found[one]
        values, base = start_values(fit, present), _base_values(fits, fit)
        (more,), (less,) = set(ids) - set(one), set(one) - set(ids)
        given = translated(more, values[less], rounds.baseline.scales)
        for start in given:
            yield SearchStart(base, {**without_effect(values, less), more: start})


def without_each(
    fits: SetFits, whole: CandidateFit
) -> dict[Effects, list[SearchStart]]:
    """A set without each of its effects, from where the whole set ended."""
    present = drive_effects(fits.rounds.problem.drive)
    values = start_values(whole, present)
    base = _base_values(fits, whole)
    sets: dict[Effects, list[SearchStart]] = {}
    for effect in whole.effects:
        left = tuple(one for one in whole.effects if one != effect)
        ids, start = moved_up(left, without_effect(values, effect), present)
        sets.setdefault(ids, []).append(SearchStart(base, start))
    return sets


def by_width(sets: Mapping[Effects, _Starts]) -> list[dict[Effects, _Starts]]:
    """Sets in turns: none includes another one of its own turn or of a later one."""
    left, turns = dict(sets), []
    while left:
        now = {ids: left[ids] for ids in left if not includes_one_of(ids, left)}
        left = {ids: left[ids] for ids in left if ids not in now}
        turns.append(now)
    return turns


def _base_values(fits: SetFits, found: CandidateFit) -> dict[str, float]:
    return base_start(fits.rounds.problem.drive, found)
