"""Stages as functions on records in memory: the code of the commands, without files."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.experiment import (
    CrossvalOptions,
    DiagnoseOptions,
    GroupOptions,
    OrdersOptions,
    SimulationOptions,
)
from hwid_cli.records.fit_grid import FitGrid
from hwid_cli.records.groups import GroupSearch
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages import diagnose as diagnosing
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.stages.group_levels import GroupPlan, search_all
from hwid_cli.stages.identify import identify_all
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.stages.selection import select_recordings
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, TaskDone, run_tasks
from hwid_cli.tasks.workers import Workers

# Called with what is being done, how much of it is done, and how much there is.
OnProgress = Callable[[str, int, int], None]
Progress = bool | OnProgress
# So wide that a line hides the one that it is written over, [characters].
_LINE = 60


def fit_grid(
    recordings: Sequence[Recording],
    orders: OrdersOptions | None = None,
    options: FitOptions | None = None,
    *,
    jobs: int | None = 1,
    progress: Progress = False,
) -> FitGrid:
    """Fit every recording with every pair of orders, the smaller orders first.

    Parameters
    ----------
    recordings : sequence of Recording
        Every name once.
    orders : OrdersOptions, optional
        The grid, such as ``OrdersOptions(nb=(1, 2, 3), nk=(1, 2, 3))``.
    jobs : int or None, [-]
        Processes; None means one for each core. No number depends on it.
    progress : bool or callable
        True shows on stderr how far the work is; a callable is told what is being done,
        how much of it is done, and how much there is.

    Returns
    -------
    FitGrid
        What ``hwid identify`` stores. A fit that fails is one of its values.

    Raises
    ------
    TypeError, ValueError
        If these are no recordings, or two have one name.

    Examples
    --------
    >>> import numpy as np
    >>> from hwid_cli import FitOptions, OrdersOptions, Recording, fit_grid
    >>> u = np.repeat(np.random.default_rng(1).uniform(-1, 1, 20), 15)
    >>> y = np.convolve(np.r_[0.0, u], 0.8 ** np.arange(60))[:300]
    >>> grid = fit_grid(
    ...     [Recording("r1", u, y, 1e-3)],
    ...     OrdersOptions(nb=(1,), nk=(1, 2)),
    ...     FitOptions(input_map="none", output_map="none"),
    ... )
    >>> [(one.orders.nf, one.fit_percent > 99) for one in grid]
    [(1, True), (2, True)]
    """
    _check(recordings)
    grid = orders or OrdersOptions()
    total = len(recordings) * len(candidate_orders(grid))
    with _settings("fits", total, jobs, progress) as settings:
        fits = identify_all(recordings, grid, options or FitOptions(), settings)
    return FitGrid(fits, grid)


def identify(
    recordings: Sequence[Recording],
    orders: OrdersOptions | None = None,
    options: FitOptions | None = None,
    *,
    jobs: int | None = 1,
    progress: Progress = False,
) -> FitGrid:
    """``fit_grid`` by the name of its command."""
    return fit_grid(recordings, orders, options, jobs=jobs, progress=progress)


def crossval(
    grid: FitGrid,
    recordings: Sequence[Recording],
    threshold: float = CrossvalOptions().threshold,
    *,
    jobs: int | None = 1,
    progress: Progress = False,
) -> CrossValidation:
    """Validate every model of a grid on every recording.

    Parameters
    ----------
    recordings : sequence of Recording
        Those that validate.
    threshold : float, [output unit]
        Largest RMSD that counts as good.

    Returns
    -------
    CrossValidation
        What ``hwid crossval`` stores.
    """
    _check(recordings)
    total = len(grid.names) * len(recordings)
    options = CrossvalOptions(threshold=threshold)
    with _settings("pairs", total, jobs, progress) as settings:
        return cross_validate(grid.fits, recordings, grid.orders, options, settings)


def group(
    grid: FitGrid,
    recordings: Sequence[Recording],
    options: GroupOptions | None = None,
    *,
    threshold: float = CrossvalOptions().threshold,
    jobs: int | None = 1,
    progress: Progress = False,
) -> GroupSearch:
    """Join recordings, level by level, into models that cover more of them.

    Parameters
    ----------
    grid : FitGrid
        Says which orders are fitted, and with which options.
    recordings : sequence of Recording
        All that may start, join or validate.
    options : GroupOptions, optional
        Which recordings start, join and validate, and which groups go on.
    threshold : float, [output unit]
        Largest RMSD that counts as covered.

    Returns
    -------
    GroupSearch
        What ``hwid group`` stores.

    Raises
    ------
    ConfigError
        If the options name recordings that there are not.
    """
    _check(recordings)
    asked = options or GroupOptions()

    def chosen(key: str) -> tuple[str, ...]:
        found = select_recordings(recordings, getattr(asked, key), key=key)
        return tuple(one.name for one in found)

    plan = GroupPlan(
        recordings=tuple(recordings),
        start=None if asked.start is None else chosen("start"),
        candidates=chosen("candidates"),
        validate=chosen("validate"),
        orders=grid.orders,
        fit_options=grid[0].options,
        options=asked,
        threshold=threshold,
    )
    store = MemoryStore()

    def run(level: int, unit: str, total: int, work: Callable[[Any], Any]) -> Any:
        what = f"{unit} of level {level}"
        with _settings(what, total, jobs, progress, store) as settings:
            return work(lambda tasks: run_tasks(tasks, settings))

    return search_all(plan, run)


def diagnose(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions | None = None,
    *,
    jobs: int | None = 1,
    progress: Progress = False,
) -> Diagnosis:
    """Find what a simulation of a drive lacks, beside recordings of it.

    Parameters
    ----------
    recordings : sequence of Recording
        Inputs in ampere and outputs in metre unless the simulation is of other units;
        every name once.
    simulation : SimulationOptions
        The physics model, in SI units.
    options : DiagnoseOptions, optional
        Which recordings take part and are held out, which effects may be named.
    jobs : int or None, [-]
        Processes; None means one for each core.
    progress : bool or callable
        As for ``fit_grid``.

    Returns
    -------
    Diagnosis
        What ``hwid diagnose`` writes to ``diagnosis.json``: ``verdict``, ``effects``
        with their parameters, ``explained_share``, ``summary`` in words, and more.

    Raises
    ------
    ConfigError
        If the options name unknown recordings or leave none to train on.
    ValueError
        If two recordings have one name.
    """
    tell = _teller(progress)
    found = diagnosing.diagnose(
        recordings,
        simulation,
        options,
        jobs=jobs,
        on_stage=lambda what, total: tell(what, 0, total),
    )
    if progress is True:
        sys.stderr.write("\n")
    return found


@contextmanager
def _settings(
    what: str,
    total: int,
    jobs: int | None,
    progress: Progress,
    store: MemoryStore | None = None,
) -> Iterator[RunSettings]:
    """Run tasks in memory and tell of each."""
    tell, done = _teller(progress), [0]

    def on_done(_: TaskDone) -> None:
        done[0] += 1
        tell(what, done[0], total)

    yield RunSettings(store or MemoryStore(), Workers(jobs), on_done=on_done)
    if progress is True:
        sys.stderr.write("\n")


def _teller(progress: Progress) -> OnProgress:
    """Whom to tell of progress."""
    if callable(progress):
        return progress
    return _tell if progress else lambda what, done, total: None


def _tell(what: str, done: int, total: int) -> None:
    """One line that is written anew, in a terminal and in a notebook."""
    counted = f"{done} of {total} " if total else ""
    sys.stderr.write("\r" + f"{counted}{what}".ljust(_LINE))
    sys.stderr.flush()


def _check(recordings: Sequence[Recording]) -> None:
    if isinstance(recordings, Recording) or not all(
        isinstance(one, Recording) for one in recordings
    ):
        raise TypeError(
            "recordings must be a sequence of Recording; give [recording] for one"
        )
    names = [one.name for one in recordings]
    if not names:
        raise ValueError("recordings must hold at least one")
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two recordings are named {name!r}")
