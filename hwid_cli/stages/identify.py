"""Stage ``identify``: one model for every recording and every pair of orders."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import Experiment, IdentifyOptions, OrdersOptions
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.report.fits import best_models_table, fits_ended
from hwid_cli.report.residuals import residual_table
from hwid_cli.report.table import Block
from hwid_cli.stages.fit_seconds import FIT_BYTES, counted, grid_seconds
from hwid_cli.stages.order_grid import SEARCHED_ROUNDS, candidate_orders, growth
from hwid_cli.stages.ranking import best_fits, count_statuses
from hwid_cli.stages.residuals import own_residuals
from hwid_cli.stages.selection import select_recordings
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.stages.swapped_signals import swapped_sentence
from hwid_cli.store.result_files import Provenance
from hwid_cli.store.results import read_fits, write_fits
from hwid_cli.tasks.cache import Store, model_key, recording_key, task_key
from hwid_cli.tasks.runner import RunSettings, Task, TaskDone, run_tasks

NAME = "identify"
STAGE_VERSION = 17

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
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: FitOptions,
    section: IdentifyOptions,
) -> str:
    """Content key of the whole stage: its fits and their names."""
    settings = {
        "recordings": [recording_key(recording) for recording in recordings],
        "names": [recording.name for recording in recordings],
        "orders": orders,
        "options": options,
        "section": section,
    }
    return task_key(NAME, STAGE_VERSION, settings, [])


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
        key=task_key(NAME, STAGE_VERSION, matters, []),
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


@dataclass(frozen=True, eq=False)
class _Given:
    """Recordings that get models, and of which orders."""

    recordings: tuple[Recording, ...]
    orders: OrdersOptions
    options: FitOptions
    section: IdentifyOptions

    @property
    def key(self) -> str:
        """Content key of all fits."""
        return identify_key(self.recordings, self.orders, self.options, self.section)


def _choose(context: Context) -> _Given:
    experiment = context.experiment
    recordings = context.results["calibrate"].recordings
    chosen = recordings_with_models(recordings, experiment)
    section = experiment.identify or IdentifyOptions()
    return _Given(chosen, experiment.orders, experiment.fit, section)


def recordings_with_models(
    recordings: Sequence[Recording], experiment: Experiment
) -> tuple[Recording, ...]:
    """Choose the recordings that get models.

    Raises
    ------
    ConfigError
        If a name is unknown, or none is left.
    """
    return select_recordings(
        recordings,
        None if experiment.identify is None else experiment.identify.recordings,
        key=f"{experiment.source}: identify.recordings",
        held_out=() if experiment.test is None else experiment.test.recordings,
    )


def _compute(given: _Given, runner: Runner) -> tuple[Fit, ...]:
    total = len(given.recordings) * len(candidate_orders(given.orders))
    with runner.tasks(total, "fits") as settings:
        return identify_all(given.recordings, given.orders, given.options, settings)


def _write(
    path: Path, given: _Given, result: tuple[Fit, ...], origin: Provenance
) -> None:
    write_fits(path, result, given.orders, origin)


def _tables(context: Context, fits: tuple[Fit, ...]) -> list[Block]:
    """The best models of each recording, what they leave, and how the fits ended."""
    experiment, recordings = context.experiment, context.results["calibrate"].recordings
    nk_role = experiment.orders.nk_role
    unit = recordings[0].output_unit
    table = best_models_table(best_fits(fits), unit, nk_is_delay=nk_role == "delay")
    blocks: list[Block] = [table]
    left = own_residuals(fits, recordings, nk_role, context.store)
    if left:
        blocks.append(residual_table(left))
    return [*blocks, *fits_ended(count_statuses(fits), fits)]


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    experiment = planning.experiment
    chosen = recordings_with_models(planning.recordings, experiment)
    n_grid = len(candidate_orders(experiment.orders))
    _, n_cached = stored_fits(experiment, chosen, planning.store)
    total = len(chosen) * n_grid
    seconds = grid_seconds(experiment, chosen, (planning.cost, planning.workers))
    what = (
        f"{counted(len(chosen), 'recording')} x {counted(n_grid, 'order')} = "
        f"{counted(total, 'fit')}"
    )
    size = FIT_BYTES * (2 * total - n_cached)
    left = seconds * (1 - n_cached / total)
    return (StagePlan(NAME, what, total, n_cached, left, size, is_shared=True),)


def stored_fits(
    experiment: Experiment, recordings: Sequence[Recording], store: Store
) -> tuple[tuple[Fit, ...], int]:
    """Fits as far as they are stored, and their number.

    The key of a fit holds the models that it begins with. Where one of those is missing,
    a model that nobody can have stored stands for it, and what follows is missing too.
    """
    found = 0

    def look_up(tasks: Sequence[Task]) -> list[TaskDone]:
        nonlocal found
        done = []
        for task in tasks:
            stored = store.get(task.key, Fit)
            found += stored is not None
            result = _absent(task) if stored is None else stored
            done.append(TaskDone(task, result, stored is not None))
        return done

    fits = fit_grid(recordings, experiment.orders, experiment.fit, look_up)
    return fits, found


def _absent(task: Task) -> Fit:
    recording, orders, options, *_ = task.arguments
    none = StaticMap("none", np.zeros(0))
    nobody = HammersteinWiener(
        none, np.array([nan]), np.array([1.0]), 0, none, recording.sample_time_s
    )
    return Fit((recording.name,), orders, options, nobody, "stalled", "not stored")


def _warnings(context: Context, given: _Given) -> list[str]:
    """Whether input and output may be swapped."""
    said = swapped_sentence(given.recordings, str(context.experiment.source))
    return [said] if said else []


STAGE = Stage(
    name=NAME,
    needs=("calibrate",),
    sections=("orders", "fit", "identify"),
    choose=_choose,
    key=lambda given: given.key,
    compute=_compute,
    storage=in_results(NAME, read_fits, _write),
    summary=lambda given, fits, is_stored: (
        f"{len(fits)} fits from the cache, 0 computed" if is_stored else ""
    ),
    tables=_tables,
    files=("results.h5",),
    plan=_plan,
    warnings=_warnings,
)
