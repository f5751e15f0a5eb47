"""Stage ``group``: recordings joined greedily into models that cover more of them.

Every level is three rounds of tasks: the fits of all new groups for all orders, the
RMSDs of those models that pass on their own recordings, and the standard errors of the
best ones. Groups of more than one recording begin with the models of their members
(``group.warm_start``).

References
----------
docs/method.md, section "Groups".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.campaign.cache import task_key
from hwid_cli.campaign.content_keys import recording_key
from hwid_cli.campaign.crossval import deviation_tasks
from hwid_cli.campaign.group_fits import fit_level, fit_singles, judged, judging_task
from hwid_cli.campaign.group_plan import STAGE, STAGE_VERSION, GroupPlan, RunLevel
from hwid_cli.campaign.group_rules import search_groups
from hwid_cli.campaign.order_grid import candidate_orders
from hwid_cli.campaign.runner import Task, TaskDone
from hwid_cli.maths.scores import coverage
from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.model import Fit, HammersteinWiener


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


def _with_standard_errors(
    plan: GroupPlan, level: Sequence[_Scored], run: RunLevel
) -> list[_Scored]:
    """The same, with the standard errors of every group's best model."""
    best = [one.fit for one in level if one.fit is not None]
    tasks = [judging_task(plan, one) for one in best]
    size = len(level[0].group.recordings)
    done = iter(_run_all(run, size, "models", tasks) if tasks else ())
    return [
        one if one.fit is None else replace(one, fit=judged(one.fit, next(done).result))
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
