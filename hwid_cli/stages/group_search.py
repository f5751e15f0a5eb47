"""The greedy search for groups as decisions about coverage, whoever counts it.

Level by level, every group that goes on is joined with every candidate that it does not
hold. Which groups go on, when to stop and who wins depends on the coverage alone (and
on the validation RMSD where it is equal), so the same rules run on models and on tables.

References
----------
docs/method.md, section "Groups"; section 3.3 of the thesis.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.records.experiment import GroupOptions
from hwid_cli.records.groups import Group, Join

# From the recordings of groups to the groups with their coverage, in the same order.
Score = Callable[[Sequence[tuple[str, ...]]], Sequence[Group]]


@dataclass(frozen=True)
class Level:
    """How wide the groups of one level are.

    Parameters
    ----------
    best : int, [-]
        Widest coverage.
    at_best : int, [-]
        Groups that reach it.
    """

    best: int
    at_best: int


@dataclass(frozen=True)
class Found:
    """What a search tried and what it chose.

    Parameters
    ----------
    groups : tuple of Group
        Level by level.
    chain : tuple of str
        Names of what the winner grew from, and of the winner; empty if no group covers
        anything.
    reason : str
        Why it stopped.
    """

    groups: tuple[Group, ...]
    joins: tuple[Join, ...]
    chain: tuple[str, ...]
    reason: str


def search_groups(
    start: Sequence[str] | None,
    candidates: Sequence[str],
    options: GroupOptions,
    score: Score,
    *,
    n_validate: int,
    is_ordered: bool,
) -> Found:
    """Search for groups of recordings whose models cover much.

    Parameters
    ----------
    start : sequence of str or None
        Recordings that groups start from, all of which go on; None means every
        candidate, of which ``options.keep`` chooses.
    candidates : sequence of str
        Recordings that may join, in the order of the experiment.
    options : GroupOptions
        Its ``keep`` and ``max_level``.
    score : callable
        Called once for each level.
    n_validate : int, [-]
        Validation recordings.
    is_ordered : bool
        Whether 6-8 and 8-6 are two groups.
    """
    first = tuple(candidates if start is None else start)
    if not is_ordered:
        # Recordings outside the candidates keep their own order, in front.
        first = tuple(sorted(first, key=lambda name: _place(name, candidates)))
    joins = [Join(1, name, "", name) for name in first]
    groups: list[Group] = []
    levels: list[Level] = []
    tried: list[tuple[str, ...]] = [(name,) for name in first]
    turn = 0 if start is None else -1
    while True:
        level = list(score(tried))
        best = max(one.coverage for one in level)
        levels.append(Level(best, sum(one.coverage == best for one in level)))
        flags = kept(level, options.keep, turn) if turn >= 0 else [True] * len(level)
        reason = reason_to_stop(levels, options.max_level, n_validate)
        new = (
            []
            if reason
            else _joined_groups(level, flags, candidates, is_ordered=is_ordered)
        )
        if not reason and not new:
            reason = "no group that goes on can grow" if any(flags) else _none(best)
        groups += [
            replace(one, is_kept=bool(flag) and not reason)
            for one, flag in zip(level, flags, strict=True)
        ]
        if reason:
            chain = _chain(groups, joins, _best_first)
            return Found(tuple(groups), tuple(joins), chain, reason)
        joins += [join for join, _ in new]
        tried = list(dict.fromkeys(recordings for _, recordings in new))
        turn += 1


def with_whole(found: Found, whole: Group) -> Found:
    """The same with a group of all candidates; the closest group wins, whatever it covers."""
    others = [
        one for one in found.groups if set(one.recordings) != set(whole.recordings)
    ]
    joins = [one for one in found.joins if one.group in {each.name for each in others}]
    base = min((one for one in others if one.level == 1), key=_closest_first)
    rest = "+".join(name for name in whole.recordings if name not in base.recordings)
    join = Join(whole.level, base.name, rest, whole.name)
    groups, joins = [*others, whole], [*joins, join]
    chain = _chain(groups, joins, _closest_first)
    return replace(found, groups=tuple(groups), joins=tuple(joins), chain=chain)


def _none(best: int) -> str:
    """Why no group of a level goes on."""
    return "no group passes group.keep" if best else "no model covers any recording"


def kept(
    level: Sequence[Group], keep: Mapping[str, Any], turn: int
) -> tuple[bool, ...]:
    """Tell which groups of a level go on.

    Parameters
    ----------
    keep : mapping
        ``GroupOptions.keep``: one rule and its number, or its numbers for the first
        levels.
    turn : int, [-]
        How often a rule has been applied before; the last number of a list holds for
        all further levels.

    Returns
    -------
    tuple of bool
        Never true for a group that covers nothing.
    """
    ((rule, value),) = keep.items()
    count = value[min(turn, len(value) - 1)] if isinstance(value, tuple) else value
    if rule == "top":
        chosen = {id(one) for one in sorted(level, key=_widest_first)[:count]}
        return tuple(id(one) in chosen and one.coverage > 0 for one in level)
    least = max(one.coverage for one in level) if rule == "best" else count
    return tuple(one.coverage >= max(1, least) for one in level)


def reason_to_stop(levels: Sequence[Level], max_level: int, n_validate: int) -> str:
    """Tell whether a search has come to its end.

    Parameters
    ----------
    levels : sequence of Level
        All so far.
    max_level : int, [-]
        Largest number of recordings in a group.
    n_validate : int, [-]
        Validation recordings; a group that covers all of them cannot be surpassed.

    Returns
    -------
    str
        Empty if the search goes on. It does while the widest coverage grows. Where it
        only stays, one more level is tried if more groups than before reach it: the
        level may have prepared what the next one gains.
    """
    if levels[-1].best == n_validate:
        return f"all {n_validate} validation recordings are covered"
    if len(levels) >= 2:
        before, last = levels[-2], levels[-1]
        if last.best < before.best:
            return f"the coverage falls from {before.best} to {last.best}"
        if last.best == before.best:
            is_first_time = len(levels) == 2 or before.best > levels[-3].best
            if not (is_first_time and last.at_best > before.at_best):
                return (
                    f"the coverage stays at {last.best}; groups that reach it: "
                    f"{before.at_best}, then {last.at_best}"
                )
    if len(levels) >= max_level:
        return f"groups of {max_level} are the largest that group.max_level allows"
    return ""


def _joined_groups(
    level: Sequence[Group],
    flags: Sequence[bool],
    candidates: Sequence[str],
    *,
    is_ordered: bool,
) -> list[tuple[Join, tuple[str, ...]]]:
    """Every kept group with every candidate that it does not hold."""
    new = []
    for base in [one for one, flag in zip(level, flags, strict=True) if flag]:
        for add_on in candidates:
            if add_on in base.recordings:
                continue
            recordings = (*base.recordings, add_on)
            if not is_ordered:
                recordings = tuple(
                    sorted(recordings, key=lambda name: _place(name, candidates))
                )
            join = Join(len(recordings), base.name, add_on, "+".join(recordings))
            new.append((join, recordings))
    return new


def _place(name: str, candidates: Sequence[str]) -> tuple[int, str]:
    return (candidates.index(name), "") if name in candidates else (-1, name)


def _chain(
    groups: Sequence[Group], joins: Sequence[Join], rank: Callable[[Group], Any]
) -> tuple[str, ...]:
    """The winner and what it grew from; of several bases always the widest."""
    by_name = {one.name: one for one in groups}
    winner = min(groups, key=rank)
    if not winner.model_name:
        return ()
    chain = [winner]
    while chain[0].level > 1:
        bases = [by_name[one.base] for one in joins if one.group == chain[0].name]
        bases = [one for one in bases if one.model_name]
        if not bases:
            break
        chain.insert(0, min(bases, key=_widest_first))
    return tuple(one.name for one in chain)


def _best_first(one: Group) -> tuple[bool, int, float, tuple[int, float]]:
    """Order of groups by recordings that none of them holds, where there are such.

    A group that covers more because it holds more says nothing about the next recording.
    """
    rmsd = one.unseen_rmsd if np.isfinite(one.unseen_rmsd) else np.inf
    return one.coverage == 0, -one.unseen_coverage, rmsd, _widest_first(one)


def _closest_first(one: Group) -> tuple[float, float]:
    """Order of groups by how far they are off, whatever threshold that is below."""
    pair = one.unseen_rmsd, one.validation_rmsd
    return tuple(one if np.isfinite(one) else np.inf for one in pair)  # type: ignore[return-value]


def _widest_first(one: Group) -> tuple[int, float]:
    rmsd = one.validation_rmsd
    return -one.coverage, rmsd if np.isfinite(rmsd) else np.inf
