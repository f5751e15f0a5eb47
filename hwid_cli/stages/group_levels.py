"""The work of a search for groups, level by level, and what it depends on.

Every level is three rounds of tasks: the fits of all new groups for all orders, the
RMSDs of those models that pass on their own recordings, and the standard errors of the
best ones. A fit begins with the models of the group's members (``group.warm_start``) and
with those of smaller orders. Standard errors take a third of the time of such a fit, so
only the best model of a group gets them.

References
----------
docs/method.md, section "Groups".
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.model.fit import fit_without_standard_errors
from hwid_cli.model.scores import coverage
from hwid_cli.model.uncertainty import with_standard_errors
from hwid_cli.records.experiment import GroupOptions, OrdersOptions
from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.crossval import deviation_tasks
from hwid_cli.stages.group_search import search_groups, with_whole
from hwid_cli.stages.identify import Run, fit_grid
from hwid_cli.stages.order_grid import (
    SEARCHED_ROUNDS_OF_GROUPS,
    candidate_orders,
    growth,
)
from hwid_cli.stages.together import fit_together
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.runner import Task, TaskDone

NAME = "group"
STAGE_VERSION = 17

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

    @property
    def asks_for_whole(self) -> bool:
        """Whether all candidates make one group as well."""
        return self.options.together and len(self.candidates) > 1


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
    if plan.asks_for_whole:
        whole = _scored_whole(plan, run)
        scored[whole.group.name] = whole
        found = with_whole(found, whole.group)
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


def _scored_whole(plan: GroupPlan, run: RunLevel) -> _Scored:
    """The group of all candidates, whatever its model covers."""
    own = [one for one in plan.recordings if one.name in plan.candidates]
    level = len(own)
    found = fit_together(
        own,
        plan.orders,
        plan.fit_options,
        lambda total, work: run(level, "fits", total, work),
    )
    group = tuple(one.name for one in own)
    validation = [one for one in plan.recordings if one.name in plan.validate]
    tasks = deviation_tasks(
        [found.fit.model], validation, [recording_key(one) for one in validation],
        "+".join(group),
    )  # fmt: skip
    done = _run_all(run, level, "pairs", tasks)
    deviations = np.array([one.result.rmsd[0] for one in done])
    blank = _blank(plan, group, found.n_models, deviations)
    if found.fit.model is None:
        return _Scored(blank, None, deviations)
    chosen = _chosen(
        plan, replace(blank, nb=found.nb, nk=found.nk), found.fit, deviations
    )
    return _Scored(chosen, found.fit, deviations)


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
    # A model that diverges somewhere may still be the widest, but wins no tie.
    order = np.lexsort((np.where(np.isfinite(pooled), pooled, np.inf), -covered))
    best = int(order[0])
    blank = replace(
        _blank(plan, group, len(fits), deviations[best]),
        n_self_passed=sum(one is not None for one in _self_passed(plan, fits)),
        n_cross_passed=int(np.sum(covered > 0)),
    )
    if covered[best] == 0:
        return _Scored(blank, None, np.full(deviations.shape[1], np.nan))
    nb, nk, _ = candidate_orders(plan.orders)[best]
    chosen = _chosen(plan, replace(blank, nb=nb, nk=nk), fits[best], deviations[best])
    return _Scored(chosen, fits[best], deviations[best])


def _blank(
    plan: GroupPlan, group: tuple[str, ...], n_models: int, deviations: np.ndarray
) -> Group:
    """A group before its model is known.

    Parameters
    ----------
    deviations : ndarray, shape (m,), [output unit]
        Of its best model on the validation recordings.
    """
    return Group(
        recordings=group,
        coverage=int(coverage(deviations[None], plan.threshold)[0]),
        nb=0,
        nk=0,
        rmsd=float("nan"),
        validation_rmsd=float("nan"),
        n_models=n_models,
        n_self_passed=n_models,
        n_cross_passed=n_models,
        is_kept=False,
    )


def _chosen(plan: GroupPlan, blank: Group, fit: Fit, deviations: np.ndarray) -> Group:
    """The same with how far its best model is off.

    Parameters
    ----------
    deviations : ndarray, shape (m,), [output unit]
    """
    pooled = float(np.sqrt(np.mean(deviations**2)))
    chosen = replace(blank, rmsd=fit.rmsd, validation_rmsd=pooled)
    if not plan.is_unseen.any():
        return chosen
    unseen = deviations[plan.is_unseen]
    return replace(
        chosen,
        unseen_coverage=int(coverage(unseen[None], plan.threshold)[0]),
        unseen_rmsd=float(np.sqrt(np.mean(unseen**2))),
    )
