"""Stage ``group``: recordings joined greedily into models that cover more of them.

Every level is three rounds of tasks: the fits of all new groups for all orders, the
RMSDs of those models that pass on their own recordings, and the standard errors of the
best ones. Groups of more than one recording begin with the models of their members
(``group.warm_start``).

References
----------
docs/method.md, section "Groups".

What a search for groups depends on, and how its work is run.

The greedy search for groups as decisions about coverage, whoever counts it.

Level by level, every group that goes on is joined with every candidate that it does not
hold. Which groups go on, when to stop and who wins depends on the coverage alone (and
on the validation RMSD where it is equal), so the same rules run on models and on tables.

References
----------
docs/method.md, section "Groups"; section 3.3 of the thesis.

All fits of a level of groups.

A fit begins with the models of the group's members and with those of smaller orders.
Standard errors take a third of the time of such a fit, so only the best model of a group
gets them.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb
from typing import Any

import numpy as np

from hwid_cli.model.fit import fit_without_standard_errors
from hwid_cli.model.scores import coverage
from hwid_cli.model.uncertainty import with_standard_errors
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import CrossvalOptions, GroupOptions, OrdersOptions
from hwid_cli.records.groups import Group, GroupSearch, Join
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.report.groups import chain_table, join_table, levels_table
from hwid_cli.report.table import Block
from hwid_cli.stages.crossval import deviation_tasks
from hwid_cli.stages.fit_seconds import (
    FIT_BYTES,
    PAIR_BYTES,
    SECONDS_PER_SIMULATED_SAMPLE,
    TASK_SECONDS,
    group_grid_seconds,
)
from hwid_cli.stages.identify import Run, fit_grid
from hwid_cli.stages.order_grid import (
    SEARCHED_ROUNDS_OF_GROUPS,
    candidate_orders,
    growth,
)
from hwid_cli.stages.selection import select_recordings
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.store.group_results import read_group, write_group, write_groups_csv
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.runner import Task, TaskDone, run_tasks

NAME = "group"
STAGE_VERSION = 12

# Does the work of a level with what runs its tasks. The text says what they are, "fits",
# "pairs" or "models", the second number how many there will be.
RunLevel = Callable[[int, str, int, Callable[[Run], Any]], Any]


@dataclass(frozen=True, eq=False)
class GroupPlan:
    """Everything that a search depends on.

    Parameters
    ----------
    recordings : tuple of Recording
        All that start, join or validate, in the order of the experiment.
    start : tuple of str or None
        None: every candidate, of which ``options.keep`` chooses.
    candidates, validate : tuple of str
        In the order of the experiment.
    threshold : float, [output unit]
    """

    recordings: tuple[Recording, ...]
    start: tuple[str, ...] | None
    candidates: tuple[str, ...]
    validate: tuple[str, ...]
    orders: OrdersOptions
    fit_options: FitOptions
    options: GroupOptions
    threshold: float

    @property
    def is_unseen(self) -> np.ndarray:
        """Which validation recordings no group may hold, ndarray of bool, shape (m,)."""
        held = {*self.candidates, *(self.start or ())}
        return np.array([name not in held for name in self.validate], dtype=bool)


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
            return Found(tuple(groups), tuple(joins), _chain(groups, joins), reason)
        joins += [join for join, _ in new]
        tried = list(dict.fromkeys(recordings for _, recordings in new))
        turn += 1


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


def _chain(groups: Sequence[Group], joins: Sequence[Join]) -> tuple[str, ...]:
    """The winner and what it grew from; of several bases always the widest."""
    by_name = {one.name: one for one in groups}
    winner = min(groups, key=_best_first)
    if winner.coverage == 0:
        return ()
    chain = [winner.name]
    while by_name[chain[0]].level > 1:
        bases = [by_name[join.base] for join in joins if join.group == chain[0]]
        chain.insert(0, min(bases, key=_widest_first).name)
    return tuple(chain)


def _best_first(one: Group) -> tuple[bool, int, float, tuple[int, float]]:
    """Order of groups by recordings that none of them holds, where there are such.

    A group that covers more because it holds more says nothing about the next recording.
    """
    rmsd = one.unseen_rmsd if np.isfinite(one.unseen_rmsd) else np.inf
    return one.coverage == 0, -one.unseen_coverage, rmsd, _widest_first(one)


def _widest_first(one: Group) -> tuple[int, float]:
    rmsd = one.validation_rmsd
    return -one.coverage, rmsd if np.isfinite(rmsd) else np.inf


def fit_singles(
    plan: GroupPlan, names: Collection[str], run: RunLevel
) -> dict[str, list[Fit]]:
    """Fit single recordings, with the same tasks as ``identify``.

    Returns
    -------
    dict of str to list of Fit
        For each recording, in the order of the grid.
    """
    if not names:
        return {}
    # With explicit starts the others are fitted when they first join, as warm starts.
    wanted = [one for one in plan.recordings if one.name in names]
    n_grid = len(candidate_orders(plan.orders))
    fits = run(
        1,
        "fits",
        n_grid * len(wanted),
        lambda execute: fit_grid(wanted, plan.orders, plan.fit_options, execute),
    )
    return {
        one.name: list(fits[first : first + n_grid])
        for one, first in zip(wanted, range(0, len(fits), n_grid), strict=True)
    }


def fit_level(
    plan: GroupPlan,
    tried: Sequence[tuple[str, ...]],
    singles: dict[str, list[Fit]],
    run: RunLevel,
) -> list[list[Fit]]:
    """Fit every group of a level with every pair of orders, the smaller ones first.

    Parameters
    ----------
    tried : sequence of tuple of str
        Names of the recordings of each group.

    Returns
    -------
    list of list of Fit
        For each group, in the order of the grid.
    """
    level = len(tried[0])
    if level == 1:
        return [singles[name] for (name,) in tried]
    grid = candidate_orders(plan.orders)
    contents = {one.name: recording_key(one) for one in plan.recordings}
    found: list[dict[int, Fit]] = [{} for _ in tried]

    def work(execute: Run) -> None:
        for number, places in enumerate(growth(plan.orders)):
            anew = number < SEARCHED_ROUNDS_OF_GROUPS
            tasks = [
                _fit_task(plan, singles, group, (place, smaller, fits, contents, anew))
                for group, fits in zip(tried, found, strict=True)
                for place, smaller in places
            ]
            done = iter(execute(tasks))
            for group, fits in zip(tried, found, strict=True):
                for place, _ in places:
                    # A fit is cached by content; the names are those of today.
                    fits[place] = replace(next(done).result, identified_on=group)

    run(level, "fits", len(tried) * len(grid), work)
    return [[fits[place] for place in range(len(grid))] for fits in found]


def scoring_task(plan: GroupPlan, fit: Fit) -> Task:
    """Task that works out the standard errors of a group's best model.

    Parameters
    ----------
    fit : Fit
        With a model.

    Returns
    -------
    Task
        Its result is the fit with its standard errors and criteria.
    """
    by_name = {one.name: one for one in plan.recordings}
    recordings = tuple(by_name[name] for name in fit.identified_on)
    matters = {
        "recordings": [recording_key(one) for one in recordings],
        "options": fit.options,
        "standard_errors_of": None if fit.model is None else model_key(fit.model),
    }
    return Task(
        key=task_key(NAME, STAGE_VERSION, matters, []),
        name=f"{fit.name}/standard errors",
        function=with_standard_errors,
        arguments=(fit, recordings),
        result_type=Fit,
    )


def scored(fit: Fit, found: Fit) -> Fit:
    """Fit with the standard errors that its task found.

    Parameters
    ----------
    found : Fit
        Cached by content: its names may be those of another day.
    """
    return replace(fit, uncertainty=found.uncertainty, information=found.information)


def _fit_task(
    plan: GroupPlan,
    singles: Mapping[str, Sequence[Fit]],
    group: tuple[str, ...],
    cell: tuple[int, Sequence[int], Mapping[int, Fit], Mapping[str, str], bool],
) -> Task:
    """One fit of a group; its key holds the models that it begins with."""
    place, smaller, fits, contents, anew = cell
    nb, nk, orders = candidate_orders(plan.orders)[place]
    by_name = {one.name: one for one in plan.recordings}
    recordings = tuple(by_name[name] for name in group)
    starts = _starts(plan, singles, group, place)
    models = [fits[number].model for number in smaller]
    contained = tuple(model for model in models if model is not None)
    matters = {
        "recordings": [contents[name] for name in group],
        "orders": orders,
        "options": plan.fit_options,
        "starts": [model_key(one) for one in starts],
        "contained": [model_key(one) for one in contained],
        "search_anew": anew,
    }
    return Task(
        key=task_key(NAME, STAGE_VERSION, matters, []),
        name=f"{'+'.join(group)}/{nb}/{nk}",
        function=_fit_group,
        arguments=(recordings, orders, plan.fit_options, starts, contained, anew),
        result_type=Fit,
    )


def _starts(
    plan: GroupPlan, singles: Mapping[str, Sequence[Fit]], group: Sequence[str], at: int
) -> tuple[HammersteinWiener, ...]:
    """Models of a group's members at one place in the grid."""
    if not plan.options.warm_start:
        return ()
    models = (singles[name][at].model for name in group)
    return tuple(model for model in models if model is not None)


def _fit_group(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
    contained: Sequence[HammersteinWiener],
    anew: bool,
) -> Fit:
    return fit_without_standard_errors(
        recordings,
        orders,
        options,
        starts=starts,
        contained=contained,
        search_anew=anew,
    )


@dataclass(frozen=True, eq=False)
class _Scored:
    """A group, its best model's fit, and that model's RMSDs."""

    group: Group
    fit: Fit | None
    rmsd: np.ndarray


def search_all(plan: GroupPlan, run: RunLevel) -> GroupSearch:
    """Search for groups, level by level.

    Parameters
    ----------
    run : callable
        Runs the tasks of a level.
    """
    singles: dict[str, list[Fit]] = {}
    scored: dict[str, _Scored] = {}

    def score(tried: Sequence[tuple[str, ...]]) -> list[Group]:
        is_needed = len(tried[0]) == 1 or plan.options.warm_start
        names = {name for group in tried for name in group} if is_needed else set()
        names -= set(singles)
        singles.update(fit_singles(plan, names, run))
        fits = fit_level(plan, tried, singles, run)
        deviations = _validate_level(plan, tried, fits, run)
        level = [
            _score_group(plan, group, of_group, values)
            for group, of_group, values in zip(tried, fits, deviations, strict=True)
        ]
        if len(tried[0]) > 1:
            level = _with_standard_errors(plan, level, run)
        scored.update((one.group.name, one) for one in level)
        return [one.group for one in level]

    found = search_groups(
        plan.start,
        plan.candidates,
        plan.options,
        score,
        n_validate=len(plan.validate),
        is_ordered=plan.fit_options.join == "concatenate",
    )
    return GroupSearch(
        groups=found.groups,
        joins=found.joins,
        fits=tuple(scored[one.name].fit for one in found.groups),
        validated_on=plan.validate,
        rmsd=np.array([scored[one.name].rmsd for one in found.groups]),
        chain=found.chain,
        reason=found.reason,
        join=plan.fit_options.join,
        unit=plan.recordings[0].output_unit,
        threshold=plan.threshold,
    )


def group_key(plan: GroupPlan) -> str:
    """Content key of a whole search."""
    settings = {
        "recordings": [recording_key(one) for one in plan.recordings],
        "names": [one.name for one in plan.recordings],
        "start": plan.start,
        "candidates": plan.candidates,
        "validate": plan.validate,
        "orders": plan.orders,
        "fit": plan.fit_options,
        "keep": plan.options.keep,
        "max_level": plan.options.max_level,
        "warm_start": plan.options.warm_start,
        "threshold": plan.threshold,
    }
    return task_key(NAME, STAGE_VERSION, settings, [])


def _validate_level(
    plan: GroupPlan,
    tried: Sequence[tuple[str, ...]],
    fits: Sequence[Sequence[Fit]],
    run: RunLevel,
) -> list[np.ndarray]:
    """RMSD of every model on the validation recordings, shape (n_models, m) a group.

    NaN for models above the threshold on their own recordings: they are not simulated.
    """
    validation = [one for one in plan.recordings if one.name in plan.validate]
    contents = [recording_key(one) for one in validation]
    passing = [_self_passed(plan, of_group) for of_group in fits]
    tasks: list[Task] = []
    for group, models in zip(tried, passing, strict=True):
        if any(model is not None for model in models):
            tasks += deviation_tasks(models, validation, contents, "+".join(group))
    done = iter(_run_all(run, len(tried[0]), "pairs", tasks))
    return [
        np.transpose([next(done).result.rmsd for _ in validation])
        if any(model is not None for model in models)
        else np.full((len(models), len(validation)), np.nan)
        for models in passing
    ]


def _with_standard_errors(
    plan: GroupPlan, level: Sequence[_Scored], run: RunLevel
) -> list[_Scored]:
    """The same, with the standard errors of every group's best model."""
    best = [one.fit for one in level if one.fit is not None]
    tasks = [scoring_task(plan, one) for one in best]
    size = len(level[0].group.recordings)
    done = iter(_run_all(run, size, "models", tasks) if tasks else ())
    return [
        one if one.fit is None else replace(one, fit=scored(one.fit, next(done).result))
        for one in level
    ]


def _run_all(
    run: RunLevel, level: int, unit: str, tasks: Sequence[Task]
) -> Sequence[TaskDone]:
    """Run tasks that do not depend on each other."""
    done: Sequence[TaskDone] = run(
        level, unit, len(tasks), lambda execute: execute(tasks)
    )
    return done


def _self_passed(
    plan: GroupPlan, fits: Sequence[Fit]
) -> list[HammersteinWiener | None]:
    """Self filter: models below the threshold on their own recordings, else None."""
    return [one.model if one.rmsd < plan.threshold else None for one in fits]


def _score_group(
    plan: GroupPlan,
    group: tuple[str, ...],
    fits: Sequence[Fit],
    deviations: np.ndarray,
) -> _Scored:
    """Cross filter, and the best of the models that are left."""
    covered = coverage(deviations, plan.threshold)
    pooled = np.sqrt(np.mean(deviations**2, axis=1))
    unseen = deviations[:, plan.is_unseen]
    # A model that diverges somewhere may still be the widest, but wins no tie.
    order = np.lexsort((np.where(np.isfinite(pooled), pooled, np.inf), -covered))
    best = int(order[0])
    scored = Group(
        recordings=group,
        coverage=int(covered[best]),
        nb=0,
        nk=0,
        rmsd=float("nan"),
        validation_rmsd=float("nan"),
        n_models=len(fits),
        n_self_passed=sum(one is not None for one in _self_passed(plan, fits)),
        n_cross_passed=int(np.sum(covered > 0)),
        is_kept=False,
    )
    if covered[best] == 0:
        return _Scored(scored, None, np.full(deviations.shape[1], np.nan))
    nb, nk, _ = candidate_orders(plan.orders)[best]
    chosen = replace(
        scored,
        nb=nb,
        nk=nk,
        rmsd=fits[best].rmsd,
        validation_rmsd=float(pooled[best]),
    )
    if plan.is_unseen.any():
        chosen = replace(
            chosen,
            unseen_coverage=int(coverage(unseen, plan.threshold)[best]),
            unseen_rmsd=float(np.sqrt(np.mean(unseen[best] ** 2))),
        )
    return _Scored(chosen, fits[best], deviations[best])


def _choose(context: Context) -> GroupPlan:
    """Everything that the search depends on, from the configuration."""
    experiment = context.experiment
    recordings = context.results["calibrate"].recordings
    options = experiment.group or GroupOptions()
    held_out = () if experiment.test is None else experiment.test.recordings

    def chosen(key: str) -> tuple[str, ...]:
        place = f"{experiment.source}: group.{key}"
        names = getattr(options, key)
        found = select_recordings(recordings, names, key=place, held_out=held_out)
        return tuple(one.name for one in found)

    start = None if options.start is None else chosen("start")
    candidates, validate = chosen("candidates"), chosen("validate")
    used = {*(start or ()), *candidates, *validate}
    return GroupPlan(
        recordings=tuple(one for one in recordings if one.name in used),
        start=start,
        candidates=candidates,
        validate=validate,
        orders=experiment.orders,
        fit_options=experiment.fit,
        options=options,
        threshold=(experiment.crossval or CrossvalOptions()).threshold,
    )


def _compute(plan: GroupPlan, runner: Runner) -> GroupSearch:
    def run(level: int, unit: str, total: int, work: Callable[[Run], Any]) -> Any:
        with runner.tasks(total, unit, part=f"level {level}") as settings:
            # Fits of single recordings are those of another stage: --force spares them.
            is_forced = settings.force and not (level == 1 and unit == "fits")
            own = replace(settings, force=is_forced)
            return work(lambda tasks: run_tasks(tasks, own))

    return search_all(plan, run)


def _tables(_: Context, search: GroupSearch) -> list[Block]:
    """The coverage of every group, what the levels filtered, and the chain."""
    joins = [join_table(search, level) for level in search.levels[1:]]
    return [*joins, levels_table(search), chain_table(search)]


def group_bound(
    n_start: int, n_candidates: int, options: GroupOptions, *, is_ordered: bool
) -> tuple[int, ...]:
    """Count the groups that a search may try, level by level from the second one.

    Parameters
    ----------
    n_start, n_candidates : int, [-]
    is_ordered : bool
        Whether the order of recordings makes another group.

    Examples
    --------
    >>> group_bound(5, 5, GroupOptions(keep={"top": 2}, max_level=3), is_ordered=False)
    (8, 6)
    >>> group_bound(5, 5, GroupOptions(keep={"best": True}), is_ordered=False)
    (10, 10, 5)
    """
    counts: list[int] = []
    going_on = n_start
    for level in range(2, options.max_level + 1):
        # All explicit starts go on; the rule of keeping holds from the next level.
        if counts or options.start is None:
            rule = options.keep.get("top")
            values = rule if isinstance(rule, tuple) else (rule,)
            turn = len(counts) - (options.start is not None)
            most = values[min(turn, len(values) - 1)]
            if most is not None:
                going_on = min(going_on, int(most))
        tried = going_on * max(n_candidates - level + 1, 0)
        if not is_ordered and n_start <= n_candidates:
            tried = min(tried, comb(n_candidates, level))
        counts.append(tried)
        going_on = tried
    return tuple(counts)


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    experiment = planning.experiment
    options = experiment.group or GroupOptions()
    held_out = () if experiment.test is None else experiment.test.recordings
    usable = [one for one in planning.recordings if one.name not in held_out]
    n_candidates = len(options.candidates or usable)
    n_validate = len(options.validate or usable)
    bounds = group_bound(
        len(options.start) if options.start is not None else n_candidates,
        n_candidates,
        options,
        is_ordered=experiment.fit.join == "concatenate",
    )
    n = int(np.median([one.n_samples for one in usable] or [0]))
    n_orders = len(candidate_orders(experiment.orders))
    fits = sum(bounds) * n_orders
    of_levels = [
        count
        * (
            group_grid_seconds(planning.cost, n, experiment, level)
            + SECONDS_PER_SIMULATED_SAMPLE * n * n_validate * n_orders
            + TASK_SECONDS * (n_orders + n_validate)
        )
        / planning.workers
        for level, count in enumerate(bounds, start=2)
    ]
    plan = StagePlan(
        NAME,
        f"at most {sum(bounds)} groups ({' + '.join(map(str, bounds))}), {fits} fits",
        fits,
        None,
        sum(of_levels[:1]),
        FIT_BYTES * fits + PAIR_BYTES * sum(bounds) * n_validate,
        sum(of_levels),
        "the search goes on to the last level",
    )
    return (plan,)


STAGE = Stage(
    name=NAME,
    needs=("calibrate", "identify"),
    sections=("crossval", "group"),
    choose=_choose,
    key=group_key,
    compute=_compute,
    storage=in_results(
        NAME,
        read_group,
        lambda path, plan, result, origin: write_group(path, result, origin),
    ),
    summary=lambda plan, result, is_stored: (
        f"{len(result.groups)} groups from the cache, 0 computed" if is_stored else ""
    ),
    write_files=lambda out, plan, result, origin, is_new: write_groups_csv(
        out / "groups.csv", result
    ),
    tables=_tables,
    files=("results.h5", "groups.csv"),
    plan=_plan,
)
