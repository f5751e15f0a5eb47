"""How long fits will take: one is timed, the others are scaled from it.

The exponents are those that docs/benchmarks.md measures ("How times grow"), for sizes of
the larger half. An estimate to a factor of two: the number of iterations depends on the
data.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.derivative_rows import derivative_rows
from hwid_cli.model.fit import fit
from hwid_cli.records.check import FitCost
from hwid_cli.records.experiment import Experiment, GroupOptions, OrdersOptions
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.order_grid import (
    SEARCHED_ROUNDS,
    SEARCHED_ROUNDS_OF_GROUPS,
    candidate_orders,
    growth,
)

# Growth with samples, units, orders and recordings (docs/benchmarks.md), [-].
_P_SAMPLES, _P_UNITS, _P_ORDERS, _P_RECORDINGS = 0.56, 0.44, 0.54, 0.85
# Beyond this many the last phase, which sees all of them, decides, [samples].
_LONG_SAMPLES = 20_000
# Below this many samples the fixed work of the search decides, [samples].
_LEAST_SAMPLES = 1000
# What docs/benchmarks.md measured: [3 3 1], 2000 samples, 10 units.
MEASURED = FitCost(0.055, 2000, 3.0, 10, "the table in docs/benchmarks.md")
# A fit of so many samples stays below two seconds on a slow machine, [samples].
_MOST_TIMED = 10_000
# Time of a grid's fit against that of one alone from nothing: in the rounds in which fits
# are searched for too, in the later ones, and both for groups that begin with the models
# of their members (docs/benchmarks.md, "A campaign" and "Groups of recordings"), [-].
_SEARCHED, _CONTINUED, _WARM_SEARCHED, _WARM_CONTINUED = 0.5, 0.2, 0.25, 0.1
# So many fits of maps that are compared are timed at least, on as many recordings at most: whether a
# fit is searched again depends on the recording more than on the maps, [-].
_TIMED_MAPS, _TIMED_RECORDINGS = 5, 10
# More of them are timed for so long, [s]; and how many standard errors their mean may be
# off, [-].
_MOST_SECONDS_OF_MAPS, _DEVIATIONS = 1.5, 2.0
# Keeping the result of a task, [s].
TASK_SECONDS = 0.005
# Simulating one model on one sample, its initial state included (docs/benchmarks.md: 1 ms
# for 7500 samples on two cores), [s].
SECONDS_PER_SIMULATED_SAMPLE = 2.7e-7
# Measured on the demo: a stored fit and a stored list of RMSDs, in the cache and again in
# the results, [bytes].
FIT_BYTES, PAIR_BYTES = 22e3, 9e3


def counted(count: int, thing: str) -> str:
    """Say how many there are of something.

    Parameters
    ----------
    count : int, [-]

    Examples
    --------
    >>> counted(1, "fit"), counted(2, "fit")
    ('1 fit', '2 fits')
    """
    return f"{count} {thing}{'s' * (count != 1)}"


def compiled_loops_place() -> str:
    """Folder in which the compiled loops of a fit are kept.

    Returns
    -------
    str
        Where files ``derivative_rows.derivative_rows*.nbi`` are missing, the first fit compiles.
    """
    # numba's own count of what it found there.
    return str(derivative_rows.stats.cache_path)  # type: ignore[attr-defined]


def time_fits(
    recordings: Sequence[Recording], orders: OrdersOptions, options: FitOptions
) -> FitCost:
    """Time a fit of middle orders, and some of the fits that a grid begins with.

    What a fit takes depends on the recording more than on anything else, so one of each
    kind is timed. Processor time: a busy machine would be taken for slow recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    """
    alone = replace(options, join=FitOptions().join)
    middle = middle_orders(orders)
    chosen = _one_of_each_kind(recordings)
    # The first call loads the compiled loops, which no later fit does.
    fit(chosen[:1], middle, replace(alone, starts=1, max_iterations=1))
    start = time.process_time()
    fit(chosen[:1], middle, alone)
    seconds = time.process_time() - start
    each = [_round_seconds(one, orders, alone) for one in chosen]
    return FitCost(
        seconds=seconds,
        n_samples=round(sum(one.n_samples for one in chosen) / len(chosen)),
        order=(middle.nb + middle.nf) / 2,
        units=options.units,
        source=f"one fit of {chosen[0].name} with orders {middle.nb} {middle.nf} "
        f"{middle.nk}",
        rounds=tuple(sum(times) / len(each) for times in zip(*each, strict=True)),
    )


def _one_of_each_kind(recordings: Sequence[Recording]) -> list[Recording]:
    """The recording of middle length of each kind, at most so long as is worth timing."""
    by_length = sorted(recordings, key=lambda one: one.n_samples)
    kinds = dict.fromkeys(one.kind for one in by_length)
    groups = [[one for one in by_length if one.kind == kind] for kind in kinds]
    # The most frequent kind first: it stands for fits of any orders.
    groups.sort(key=len, reverse=True)
    found = []
    for group in groups:
        found.append(livelier_part(group[len(group) // 2]))
    return found


def livelier_part(whole: Recording) -> Recording:
    """As many samples as are timed, from where the input moves: a rest is fitted at once.

    Returns
    -------
    Recording
        The same one where it is short.
    """
    n = min(whole.n_samples, _MOST_TIMED)
    # Of the first or the last samples, and of those between.
    firsts = range(0, whole.n_samples - n + 1, max(n // 4, 1))
    first = max(firsts, key=lambda one: float(np.var(whole.input[one : one + n])))
    part = slice(first, first + n)
    reference = None if whole.reference is None else whole.reference[part]
    return replace(
        whole,
        input=whole.input[part],
        output=whole.output[part],
        reference=reference,
    )


def _round_seconds(
    recording: Recording, orders: OrdersOptions, options: FitOptions
) -> tuple[float, float, float]:
    """Times of fits of the grid's first round, of the second, and of a later one."""
    grid = [one for _, _, one in candidate_orders(orders)]
    rounds = growth(orders)
    later = rounds[SEARCHED_ROUNDS:]
    places = [rounds[0][0][0], rounds[min(1, len(rounds) - 1)][0][0]]
    places.append(later[len(later) // 2][0][0] if later else places[-1])
    times: list[float] = []
    models: list[HammersteinWiener] = []
    for number, place in enumerate(places):
        start = time.process_time()
        found = fit(
            [recording],
            grid[place],
            options,
            contained=[one for one in models if grid[place].contains(one.orders)][-1:],
            search_anew=number < len(places) - 1,
        )
        times.append(time.process_time() - start)
        models += [] if found.model is None else [found.model]
    first, searched, continued = times
    return first, searched, continued


def fit_seconds(
    cost: FitCost,
    orders: Orders,
    n_samples: int,
    *,
    units: float,
    n_recordings: int = 1,
) -> float:
    """Estimate the time of a fit on one core.

    Parameters
    ----------
    n_samples : int, [samples]
        Of each recording.
    units : float, [-]
        Mean of both maps.
    n_recordings : int, [-]
        That are joined.

    Returns
    -------
    float, [s]

    Examples
    --------
    >>> round(fit_seconds(MEASURED, Orders(3, 3, 1), 2000, units=10), 3)
    0.055
    """
    samples = _work(n_samples) / _work(cost.n_samples)
    order = max((orders.nb + orders.nf) / 2, 1.0) / max(cost.order, 1.0)
    return (
        cost.seconds
        * samples
        * order**_P_ORDERS
        * (units / cost.units) ** _P_UNITS
        * n_recordings**_P_RECORDINGS
    )


def share_of_round(
    number: int, *, of_group: bool = False, is_warm: bool = False
) -> float:
    """Time of a fit in a round of a grid's growth, against one alone from nothing.

    Parameters
    ----------
    number : int
        From zero.
    of_group : bool
        Whether it is a group's grid, of which fewer rounds are searched.
    is_warm : bool
        Whether it begins with the models of a group's members.

    Returns
    -------
    float, [-]

    Examples
    --------
    >>> share_of_round(0), share_of_round(0) > share_of_round(1) > share_of_round(9)
    (1.0, True)
    """
    searched = SEARCHED_ROUNDS_OF_GROUPS if of_group else SEARCHED_ROUNDS
    if is_warm:
        return _WARM_SEARCHED if number < searched else _WARM_CONTINUED
    if number == 0:
        return 1.0
    return _SEARCHED if number < searched else _CONTINUED


def grid_seconds(
    experiment: Experiment,
    recordings: Sequence[Recording],
    speed: tuple[FitCost, int],
) -> float:
    """Time of grids: their rounds wait for each other, so few fits leave workers idle.

    Parameters
    ----------
    recordings : sequence of Recording
        Each with a grid of its own.
    speed : tuple of (FitCost, int)
        What a fit costs, and the workers.

    Returns
    -------
    float, [s]
    """
    cost, workers = speed
    grid = [orders for _, _, orders in candidate_orders(experiment.orders)]

    def seconds(number: int, place: int, n_samples: int) -> float:
        if cost.rounds:
            kind = 0 if number == 0 else 1 if number < SEARCHED_ROUNDS else 2
            return cost.rounds[kind] * _work(n_samples) / _work(cost.n_samples)
        units = experiment.fit.units
        alone = fit_seconds(cost, grid[place], n_samples, units=units)
        return share_of_round(number) * alone

    total = 0.0
    for number, places in enumerate(growth(experiment.orders)):
        each = [
            seconds(number, place, one.n_samples) + TASK_SECONDS
            for one in recordings
            for place, _ in places
        ]
        total += max(sum(each) / workers, sum(each) / len(each))
    return total


def group_grid_seconds(
    cost: FitCost, n_samples: int, experiment: Experiment, level: int
) -> float:
    """Time of all fits of one group on one core.

    Parameters
    ----------
    n_samples : int, [samples]
        Of each recording.
    level : int, [-]
        Recordings in the group.

    Returns
    -------
    float, [s]
    """
    grid = [orders for _, _, orders in candidate_orders(experiment.orders)]
    is_warm = (experiment.group or GroupOptions()).warm_start
    units = experiment.fit.units
    return sum(
        share_of_round(number, of_group=True, is_warm=is_warm)
        * fit_seconds(cost, grid[place], n_samples, units=units, n_recordings=level)
        for number, places in enumerate(growth(experiment.orders))
        for place, _ in places
    )


def map_seconds(
    cost: FitCost,
    orders: OrdersOptions,
    recordings: Sequence[Recording],
    maps: Sequence[FitOptions],
) -> tuple[float, float]:
    """Time of fits with several pairs of maps on one core; their orders are not known yet.

    Where fits are timed, so are some of these, each with the next recording and the next
    maps: one is fitted at once where another takes twenty times as long, so there are as
    many as a second or two holds, and what the rest takes is a range.

    Returns
    -------
    tuple of float, [s]
        At least and at most.
    """
    middle = middle_orders(orders)
    if not cost.rounds:
        seconds = sum(
            fit_seconds(
                cost,
                middle,
                one.n_samples,
                units=(options.of_input.units + options.of_output.units) / 2,
            )
            for one in recordings
            for options in maps
        )
        return seconds, seconds
    works = [_work(one.n_samples) for one in recordings]
    each = _timed_maps(middle, recordings, maps)
    # The mean of those that are timed is not that of all.
    doubt = (
        _DEVIATIONS * float(np.std(each, ddof=1)) / len(each) ** 0.5
        if each[1:]
        else 0.0
    )
    mean = sum(each) / len(each)
    least, most = max(mean - doubt, mean / 2), mean + doubt
    slower = order_range(orders)[1]
    return least * sum(works) * len(maps), most * slower * sum(works) * len(maps)


def _timed_maps(
    orders: Orders, recordings: Sequence[Recording], maps: Sequence[FitOptions]
) -> list[float]:
    """Times of some fits, as parts of what recordings of their length are to take."""
    timed = recordings[:: math.ceil(len(recordings) / _TIMED_RECORDINGS)]
    least = min(max(_TIMED_MAPS, len(timed)), len(maps))
    # Every pair once, then the next recording with each.
    pairs = [
        (timed[(number + turn) % len(timed)], maps[number * len(maps) // least])
        for turn in range(len(timed))
        for number in range(least)
    ]
    each: list[float] = []
    start = time.process_time()
    for recording, options in pairs:
        if len(each) >= least and time.process_time() - start > _MOST_SECONDS_OF_MAPS:
            break
        each.append(_seconds_per_work(recording, orders, options))
    return each


def order_range(orders: OrdersOptions) -> tuple[float, float]:
    """Times of a fit of the smallest and of the largest orders over that of middle ones.

    Returns
    -------
    tuple of float, [-]

    Examples
    --------
    >>> least, most = order_range(OrdersOptions(nb=(1, 2, 3), nk=(1, 2, 3)))
    >>> round(least, 2), round(most, 2)
    (0.69, 1.24)
    """
    sizes = [(one.nb + one.nf) / 2 for _, _, one in candidate_orders(orders)]
    middle = middle_orders(orders)
    size = max((middle.nb + middle.nf) / 2, 1.0)
    least, most = (
        (max(one, 1.0) / size) ** _P_ORDERS for one in (min(sizes), max(sizes))
    )
    return least, most


def _seconds_per_work(
    recording: Recording, orders: Orders, options: FitOptions
) -> float:
    """Time a fit, as a part of what a recording of its length is to take."""
    part = livelier_part(recording)
    start = time.process_time()
    fit([part], orders, replace(options, join=FitOptions().join))
    return (time.process_time() - start) / _work(part.n_samples)


def middle_orders(orders: OrdersOptions) -> Orders:
    """Orders that stand for a whole grid."""
    nb = sorted(orders.nb)[len(orders.nb) // 2]
    nk = sorted(orders.nk)[len(orders.nk) // 2]
    if orders.nk_role == "delay":
        return Orders(nb, orders.nf or 0, nk)
    return Orders(nb, nk, 1)


def _work(n_samples: int) -> float:
    """Time against the number of samples, up to a factor."""
    short = min(max(n_samples, _LEAST_SAMPLES), _LONG_SAMPLES)
    return float(short**_P_SAMPLES * max(n_samples / _LONG_SAMPLES, 1.0))
