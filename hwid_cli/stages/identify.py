"""Stage ``identify``: one model for every recording and every pair of orders."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from hwid_cli.model.fit import fit
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.order_grid import SEARCHED_ROUNDS, candidate_orders, growth
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.runner import RunSettings, Task, TaskDone, run_tasks

STAGE = "identify"
STAGE_VERSION = 10

# Runs tasks and returns them with their results, in their order.
Run = Callable[[Sequence[Task]], Sequence[TaskDone]]


def identify_all(
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: FitOptions,
    settings: RunSettings,
) -> tuple[Fit, ...]:
    """Fit every recording with every pair of orders.

    Returns
    -------
    tuple of Fit
        Recording by recording, each in the order of ``candidate_orders``.
    """
    return fit_grid(
        recordings, orders, options, lambda tasks: run_tasks(tasks, settings)
    )


def fit_grid(
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: FitOptions,
    run: Run,
) -> tuple[Fit, ...]:
    """Fit every recording with every pair of orders, the smaller ones first.

    A fit begins with those of the largest orders that its own contain, so that more
    parameters never fit worse; in the first rounds a search anew may find better. The linear model beside it is not worse than theirs
    either: it contains them.

    Parameters
    ----------
    run : callable
        Runs the tasks of a round.

    Returns
    -------
    tuple of Fit
        Recording by recording, each in the order of ``candidate_orders``.
    """
    alone = replace(options, join=FitOptions().join)
    grid = candidate_orders(orders)
    contents = [recording_key(recording) for recording in recordings]
    found: list[dict[int, Fit]] = [{} for _ in recordings]
    for number, places in enumerate(growth(orders)):
        anew = number < SEARCHED_ROUNDS
        tasks = [
            fit_task(
                f"{recording.name}/{grid[place][0]}/{grid[place][1]}",
                (recording, content),
                grid[place][2],
                alone,
                contained=[fits[number].model for number in smaller],
                search_anew=anew,
            )
            for recording, content, fits in zip(
                recordings, contents, found, strict=True
            )
            for place, smaller in places
        ]
        done = iter(run(tasks))
        for fits in found:
            for place, smaller in places:
                fits[place] = _with_linear(next(done).result, fits, smaller)
    # A fit is cached by content: neither the name of its recording nor the rule for
    # joining several, which does nothing to one, is part of it.
    return tuple(
        replace(fits[place], identified_on=(recording.name,), options=options)
        for recording, fits in zip(recordings, found, strict=True)
        for place in range(len(grid))
    )


def identify_key(
    recordings: Sequence[Recording], orders: OrdersOptions, options: FitOptions
) -> str:
    """Content key of the whole stage: its fits and their names."""
    settings = {
        "recordings": [recording_key(recording) for recording in recordings],
        "names": [recording.name for recording in recordings],
        "orders": orders,
        "options": options,
    }
    return task_key(STAGE, STAGE_VERSION, settings, [])


def fit_task(
    name: str,
    source: tuple[Recording, str],
    orders: Orders,
    options: FitOptions,
    *,
    contained: Sequence[HammersteinWiener | None] = (),
    search_anew: bool = True,
) -> Task:
    """Describe one fit; its key holds the models that it begins with.

    Parameters
    ----------
    name : str
        For people.
    source : tuple of (Recording, str)
        The recording and its ``recording_key``.
    contained : sequence of HammersteinWiener or None
        Models of smaller orders; None stands for a failed fit.

    Returns
    -------
    Task
        Gives a ``Fit``.
    """
    recording, content = source
    known = tuple(model for model in contained if model is not None)
    matters = {
        "recordings": [content],
        "orders": orders,
        "options": options,
        "contained": [model_key(model) for model in known],
        "search_anew": search_anew,
    }
    return Task(
        key=task_key(STAGE, STAGE_VERSION, matters, []),
        name=name,
        function=_fit_one,
        arguments=(recording, orders, options, known, search_anew),
        result_type=Fit,
    )


def _with_linear(fit: Fit, fits: dict[int, Fit], smaller: Sequence[int]) -> Fit:
    """Fit beside the best of the linear models that its orders contain."""
    known = [fit.linear_rmsd, *(fits[number].linear_rmsd for number in smaller)]
    least = min((rmsd for rmsd in known if rmsd == rmsd), default=fit.linear_rmsd)
    return replace(fit, linear_rmsd=least)


def _fit_one(
    recording: Recording,
    orders: Orders,
    options: FitOptions,
    contained: Sequence[HammersteinWiener],
    anew: bool,
) -> Fit:
    return fit([recording], orders, options, contained=contained, search_anew=anew)
