"""Stage ``group``: recordings joined greedily into models that cover more of them.

References
----------
docs/method.md, section "Groups".
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import comb
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import CrossvalOptions, GroupOptions
from hwid_cli.records.groups import GroupSearch
from hwid_cli.records.recordings import Calibrated
from hwid_cli.report.groups import chain_table, join_table, levels_table
from hwid_cli.report.table import Block
from hwid_cli.stages.fit_seconds import (
    FIT_BYTES,
    PAIR_BYTES,
    SECONDS_PER_SIMULATED_SAMPLE,
    TASK_SECONDS,
    group_grid_seconds,
)
from hwid_cli.stages.group_levels import NAME, STAGE_VERSION, GroupPlan, search_all
from hwid_cli.stages.identify import Run
from hwid_cli.stages.joint_seconds import joint_plan
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.stages.selection import select_recordings
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.store.group_results import read_group, write_group, write_groups_csv
from hwid_cli.tasks.cache import Store, recording_key, task_key
from hwid_cli.tasks.runner import TaskDone, run_tasks
from hwid_cli.tasks.task import Task


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
        "options": plan.options,
        "threshold": plan.threshold,
    }
    return task_key(NAME, STAGE_VERSION, settings, [])


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


class _NotStoredError(Exception):
    """A search asks for what the cache does not have."""


def stored_tasks(plan: GroupPlan, store: Store) -> int | None:
    """Count the tasks of a search that finds all its results in the cache.

    Returns
    -------
    int or None, [-]
        None where a result is missing.
    """
    count = 0

    def look_up(tasks: Sequence[Task]) -> tuple[TaskDone, ...]:
        nonlocal count
        done: list[TaskDone] = []
        for task in tasks:
            result = store.get(task.key, task.result_type)
            if result is None:
                raise _NotStoredError
            done.append(TaskDone(task, result, from_cache=True))
        count += len(done)
        return tuple(done)

    try:
        search_all(plan, lambda level, unit, total, work: work(look_up))
    except _NotStoredError:
        return None
    return count


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    calibrated = Calibrated(planning.recordings, planning.logs, "")
    context = Context(planning.experiment, Path(), {"calibrate": calibrated})
    stored = stored_tasks(_choose(context), planning.store)
    if stored is not None:
        what = f"a search of {stored} tasks, all stored"
        return (StagePlan(NAME, what, stored, stored, TASK_SECONDS * stored, 0.0),)
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
    of_levels = _seconds_of_levels(planning, n, n_validate, bounds)
    fits = sum(bounds) * n_orders
    what = f"at most {sum(bounds)} groups ({' + '.join(map(str, bounds))}), {fits} fits"
    together = joint_plan(experiment, planning.recordings, planning.cost)
    more, least, most = 0, 0.0, 0.0
    reasons = ["the search goes on to the last level"] if fits else []
    if together is not None:
        more = together.n_fits
        least, most = (one / planning.workers for one in together.search)
        what = f"one group of all, about {more} fits" + (f"; {what}" if fits else "")
        reasons.append("the maps that fit slowest are chosen")
    plan = StagePlan(
        NAME,
        what,
        fits + more,
        None,
        sum(of_levels[:1]) + least,
        FIT_BYTES * (fits + more) + PAIR_BYTES * sum(bounds) * n_validate,
        sum(of_levels) + most,
        " and ".join(reasons),
        is_shared=True,
    )
    return (plan,)


def _seconds_of_levels(
    planning: Planning, n_samples: int, n_validate: int, bounds: Sequence[int]
) -> list[float]:
    """Time of the groups of each level that grow by one recording."""
    n_orders = len(candidate_orders(planning.experiment.orders))
    validating = SECONDS_PER_SIMULATED_SAMPLE * n_samples * n_validate * n_orders
    starting = TASK_SECONDS * (n_orders + n_validate)
    return [
        count
        * (
            group_grid_seconds(planning.cost, n_samples, planning.experiment, level)
            + validating
            + starting
        )
        / planning.workers
        for level, count in enumerate(bounds, start=2)
    ]


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
