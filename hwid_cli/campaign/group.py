"""Stage ``group``: recordings joined greedily into models that cover more of them.

Every level is two rounds of tasks: the fits of all new groups for all orders, then the
RMSDs of those models that pass on their own recordings. Groups of more than one
recording begin with the models of their members (``group.warm_start``).

References
----------
docs/method.md, section "Groups".
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.campaign.cache import task_key
from hwid_cli.campaign.content_keys import model_key, recording_key
from hwid_cli.campaign.crossval import deviation_tasks
from hwid_cli.campaign.group_rules import search_groups
from hwid_cli.campaign.identify import Run, fit_grid
from hwid_cli.campaign.order_grid import candidate_orders, growth
from hwid_cli.campaign.runner import Task, TaskDone
from hwid_cli.maths.model.fit import fit
from hwid_cli.maths.scores import coverage
from hwid_cli.records.experiment import GroupOptions, OrdersOptions
from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording

STAGE = "group"
STAGE_VERSION = 2

# Does the work of a level with what runs its tasks. The text says what they are, "fits" or
# "pairs", the second number how many there will be.
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
    orders : OrdersOptions
    fit_options : FitOptions
    options : GroupOptions
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
    plan : GroupPlan
    run : callable
        Runs the tasks of a level.

    Returns
    -------
    GroupSearch
    """
    singles: dict[str, list[Fit]] = {}
    scored: dict[str, _Scored] = {}

    def score(tried: Sequence[tuple[str, ...]]) -> list[Group]:
        is_needed = len(tried[0]) == 1 or plan.options.warm_start
        names = {name for group in tried for name in group} if is_needed else set()
        names -= set(singles)
        singles.update(_fit_singles(plan, names, run))
        fits = _fit_level(plan, tried, singles, run)
        deviations = _validate_level(plan, tried, fits, run)
        level = [
            _score_group(plan, group, of_group, values)
            for group, of_group, values in zip(tried, fits, deviations, strict=True)
        ]
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
    """Content key of a whole search.

    Parameters
    ----------
    plan : GroupPlan

    Returns
    -------
    str
    """
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
    return task_key(STAGE, STAGE_VERSION, settings, [])


def _fit_singles(
    plan: GroupPlan, names: Collection[str], run: RunLevel
) -> dict[str, list[Fit]]:
    """Models of single recordings, the same tasks as those of ``identify``."""
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


def _fit_level(
    plan: GroupPlan,
    tried: Sequence[tuple[str, ...]],
    singles: dict[str, list[Fit]],
    run: RunLevel,
) -> list[list[Fit]]:
    """All fits of every group, those of one group in the order of the grid."""
    level = len(tried[0])
    if level == 1:
        return [singles[name] for (name,) in tried]
    grid = candidate_orders(plan.orders)
    contents = {one.name: recording_key(one) for one in plan.recordings}
    found: list[dict[int, Fit]] = [{} for _ in tried]

    def work(execute: Run) -> None:
        for places in growth(plan.orders):
            tasks = [
                _fit_task(plan, singles, group, (place, smaller, fits, contents))
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


def _fit_task(
    plan: GroupPlan,
    singles: Mapping[str, Sequence[Fit]],
    group: tuple[str, ...],
    cell: tuple[int, Sequence[int], Mapping[int, Fit], Mapping[str, str]],
) -> Task:
    """One fit of a group; its key holds the models that it begins with."""
    place, smaller, fits, contents = cell
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
    }
    return Task(
        key=task_key(STAGE, STAGE_VERSION, matters, []),
        name=f"{'+'.join(group)}/{nb}/{nk}",
        function=_fit_group,
        arguments=(recordings, orders, plan.fit_options, starts, contained),
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
) -> Fit:
    return fit(recordings, orders, options, starts=starts, contained=contained)


def _validate_level(
    plan: GroupPlan,
    tried: Sequence[tuple[str, ...]],
    fits: Sequence[Sequence[Fit]],
    run: RunLevel,
) -> list[np.ndarray]:
    """RMSD of every model on the validation recordings, shape (n_models, m) a group.

    NaN for models above the threshold on their own recordings: they are not simulated.
    """
    judges = [one for one in plan.recordings if one.name in plan.validate]
    contents = [recording_key(one) for one in judges]
    passing = [_self_passed(plan, of_group) for of_group in fits]
    tasks: list[Task] = []
    for group, models in zip(tried, passing, strict=True):
        if any(model is not None for model in models):
            tasks += deviation_tasks(models, judges, contents, "+".join(group))
    done = iter(_run_all(run, len(tried[0]), "pairs", tasks))
    return [
        np.transpose([next(done).result.rmsd for _ in judges])
        if any(model is not None for model in models)
        else np.full((len(models), len(judges)), np.nan)
        for models in passing
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
    return _Scored(chosen, fits[best], deviations[best])
