"""All fits of a level of groups.

A fit begins with the models of the group's members and with those of smaller orders.
Standard errors take a third of the time of such a fit, so only the best model of a group
gets them.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from hwid_cli.campaign.cache import task_key
from hwid_cli.campaign.content_keys import model_key, recording_key
from hwid_cli.campaign.group_plan import STAGE, STAGE_VERSION, GroupPlan, RunLevel
from hwid_cli.campaign.identify import Run, fit_grid
from hwid_cli.campaign.order_grid import candidate_orders, growth
from hwid_cli.campaign.runner import Task
from hwid_cli.maths.model.fit import fit_without_standard_errors
from hwid_cli.maths.model.uncertainty import with_standard_errors
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording

# As for single recordings, but one round less: a fit from the members' models takes many
# times as long as going on from smaller orders, and groups are told apart by a threshold.
SEARCHED_ROUNDS_OF_GROUPS = 3


def fit_singles(
    plan: GroupPlan, names: Collection[str], run: RunLevel
) -> dict[str, list[Fit]]:
    """Fit single recordings, with the same tasks as ``identify``.

    Parameters
    ----------
    plan : GroupPlan
    names : collection of str
    run : callable

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
    plan : GroupPlan
    tried : sequence of tuple of str
        Names of the recordings of each group.
    singles : dict of str to list of Fit
    run : callable

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


def judging_task(plan: GroupPlan, fit: Fit) -> Task:
    """Task that works out the standard errors of a group's best model.

    Parameters
    ----------
    plan : GroupPlan
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
        key=task_key(STAGE, STAGE_VERSION, matters, []),
        name=f"{fit.name}/standard errors",
        function=with_standard_errors,
        arguments=(fit, recordings),
        result_type=Fit,
    )


def judged(fit: Fit, found: Fit) -> Fit:
    """Fit with the standard errors that its task found.

    Parameters
    ----------
    fit : Fit
    found : Fit
        Cached by content: its names may be those of another day.

    Returns
    -------
    Fit
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
        key=task_key(STAGE, STAGE_VERSION, matters, []),
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
