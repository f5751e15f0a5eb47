"""``check``: what the stages of an experiment would do, and what is there already."""

from collections.abc import Sequence
from math import comb, nan

import numpy as np

from hwid_cli.records.check import FitCost, StagePlan
from hwid_cli.records.experiment import (
    CrossvalOptions,
    Experiment,
    GroupOptions,
    OrderOptions,
)
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.crossval import Deviations, crossval_tasks
from hwid_cli.stages.fit_seconds import (
    SECONDS_PER_SIMULATED_SAMPLE,
    grid_seconds,
    group_grid_seconds,
    map_seconds,
)
from hwid_cli.stages.identify import fit_grid
from hwid_cli.stages.map_choice import candidate_maps
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.stages.selection import select_recordings
from hwid_cli.tasks.cache import Store
from hwid_cli.tasks.runner import Task, TaskDone

# Measured on the demo: a stored fit and a stored list of RMSDs, in the cache and again in
# the results, [bytes]; figures of a recording, [bytes]; the page, [bytes].
_FIT_BYTES, _PAIR_BYTES, _FIGURE_BYTES, _PAGE_BYTES = 22e3, 9e3, 80e3, 4e6
_SAMPLE_BYTES = 16
# Sections that need a cross-validation.
_NEED_CROSSVAL = ("crossval", "order", "group", "test")


def plan_stages(
    experiment: Experiment,
    recordings: Sequence[Recording],
    cost: FitCost,
    store: Store,
    *,
    workers: int = 1,
) -> tuple[StagePlan, ...]:
    """Say what each stage that the configuration names would do.

    Parameters
    ----------
    recordings : sequence of Recording
        Calibrated; at least one.
    store : Store
        What was computed before.
    workers : int, [-]
        Processes that share the work.

    Returns
    -------
    tuple of StagePlan
        In the order in which they run.
    """
    samples = sum(one.n_samples for one in recordings)
    plans = [
        StagePlan(
            "calibrate",
            f"{_counted(len(recordings), 'recording')}, {_counted(samples, 'sample')}",
            len(recordings),
            None,
            0.0,
            _SAMPLE_BYTES * samples + _FIGURE_BYTES * len(recordings) + _PAGE_BYTES,
        )
    ]
    wants_fits = ("identify", *_NEED_CROSSVAL)
    if any(getattr(experiment, stage) is not None for stage in wants_fits):
        plans += _identify_and_crossval(experiment, recordings, (cost, workers), store)
    if experiment.group is not None:
        plans.append(_group(experiment, recordings, (cost, workers)))
    if experiment.test is not None:
        n = len(recordings)
        plans.append(
            StagePlan("test", _counted(n, "recording"), n, None, 0.0, n * _PAIR_BYTES)
        )
    if experiment.diagnose is not None:
        what = f"up to {_counted(len(recordings), 'recording')}; time depends on what is missing"
        plans.append(StagePlan("diagnose", what, len(recordings), None, nan, 1e6))
    return tuple(plans)


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


def _identify_and_crossval(
    experiment: Experiment,
    recordings: Sequence[Recording],
    speed: tuple[FitCost, int],
    store: Store,
) -> list[StagePlan]:
    held_out = () if experiment.test is None else experiment.test.recordings
    identify, crossval = experiment.identify, experiment.crossval or CrossvalOptions()
    chosen = select_recordings(
        recordings,
        None if identify is None else identify.recordings,
        key=f"{experiment.source}: identify.recordings",
        held_out=held_out,
    )
    judges = select_recordings(
        recordings,
        crossval.recordings,
        key=f"{experiment.source}: crossval.recordings",
        held_out=held_out,
    )
    grid = [orders for _, _, orders in candidate_orders(experiment.orders)]
    fits, n_cached = _stored_fits(experiment, chosen, store)
    total = len(chosen) * len(grid)
    seconds = grid_seconds(experiment, chosen, speed)
    plan = StagePlan(
        "identify",
        f"{_counted(len(chosen), 'recording')} x {_counted(len(grid), 'order')} = "
        f"{_counted(total, 'fit')}",
        total,
        n_cached,
        seconds * (1 - n_cached / total),
        _FIT_BYTES * (2 * total - n_cached),
    )
    if all(getattr(experiment, one) is None for one in _NEED_CROSSVAL):
        return [plan]
    done = 0
    if n_cached == total:
        tasks = crossval_tasks(fits, judges, experiment.orders)
        done = sum(store.get(task.key, Deviations) is not None for task in tasks)
    plans = [plan, _crossval(len(chosen), total, judges, (done, speed[1]))]
    maps = candidate_maps(experiment.fit, experiment.order or OrderOptions())
    if len(maps) > 1:
        plans.append(_maps(experiment, chosen, maps, speed))
    return plans


def _crossval(
    n_chosen: int, n_models: int, judges: Sequence[Recording], known: tuple[int, int]
) -> StagePlan:
    """Plan of the cross-validation; known are its stored tasks and the processes."""
    done, workers = known
    pairs = n_chosen * len(judges)
    samples = n_models * sum(one.n_samples for one in judges) * (1 - done / pairs)
    return StagePlan(
        "crossval",
        f"{_counted(n_models, 'model')} on {_counted(len(judges), 'recording')} = "
        f"{_counted(n_models * len(judges), 'validation')} in {_counted(pairs, 'task')}",
        pairs,
        done,
        SECONDS_PER_SIMULATED_SAMPLE * samples / min(workers, pairs),
        _PAIR_BYTES * pairs,
    )


def _maps(
    experiment: Experiment,
    recordings: Sequence[Recording],
    maps: Sequence[FitOptions],
    speed: tuple[FitCost, int],
) -> StagePlan:
    """Plan of the comparison of maps; the orders are not known yet."""
    total = len(recordings) * len(maps)
    return StagePlan(
        "order",
        f"{_counted(len(recordings), 'recording')} x {len(maps)} pairs of maps = "
        f"{_counted(total, 'fit')}",
        total,
        None,
        map_seconds(speed[0], experiment.orders, recordings, maps) / speed[1],
        _FIT_BYTES * total,
    )


def _stored_fits(
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


def _group(
    experiment: Experiment,
    recordings: Sequence[Recording],
    speed: tuple[FitCost, int],
) -> StagePlan:
    options = experiment.group or GroupOptions()
    held_out = () if experiment.test is None else experiment.test.recordings
    usable = [one for one in recordings if one.name not in held_out]
    n_candidates = len(options.candidates or usable)
    n_validate = len(options.validate or usable)
    bounds = group_bound(
        len(options.start) if options.start is not None else n_candidates,
        n_candidates,
        options,
        is_ordered=experiment.fit.join == "concatenate",
    )
    n = int(np.median([one.n_samples for one in usable] or [0]))
    fits = sum(bounds) * len(candidate_orders(experiment.orders))
    seconds = (
        sum(
            count * group_grid_seconds(speed[0], n, experiment, level)
            for level, count in enumerate(bounds, start=2)
        )
        + SECONDS_PER_SIMULATED_SAMPLE * n * n_validate * fits
    )
    return StagePlan(
        "group",
        f"at most {sum(bounds)} groups ({' + '.join(map(str, bounds))}), {fits} fits",
        fits,
        None,
        seconds / speed[1],
        _FIT_BYTES * fits + _PAIR_BYTES * sum(bounds) * n_validate,
        is_bound=True,
    )


def _counted(count: int, thing: str) -> str:
    return f"{count} {thing}{'s' * (count != 1)}"
