"""How long the model of all recordings together takes, and what follows from it.

Its search, the bands of its test and the linear model beside it are fits of nearly all
recordings. Two of each kind of maps are timed; which kind the search chooses is not known,
so the forecast is a range.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model.fit import fit_without_standard_errors
from hwid_cli.records.check import FitCost
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.fit_seconds import (
    TASK_SECONDS,
    fit_seconds,
    livelier_part,
    middle_orders,
    order_range,
)
from hwid_cli.stages.linear_reference import MOST_JOINED_LINEAR, linear_options
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.stages.together import (
    FEW_UNITS,
    LONGER_DELAYS_FITS,
    kinds_tried,
    most_fits,
    with_units,
)
from hwid_cli.trust.judged import MOST_JUDGES

# Recordings of a joint fit that are timed.
_MOST_JOINED = 6
# A fit that no smaller one leads to, over one that it does, [-].
_ANEW = 2.5


@dataclass(frozen=True)
class JointSeconds:
    """Time of what is done with all recordings together, on one core.

    Parameters
    ----------
    n_fits : int, [-]
        Of the search.
    search, bands : tuple of float, [s]
        Of the search, and of the bands of its model: at least and at most.
    linear : float, [s]
        Of the linear models beside it.
    """

    n_fits: int
    search: tuple[float, float]
    bands: tuple[float, float]
    linear: float


def joined(experiment: Experiment, recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings that are fitted together; none where no such model is asked for."""
    options = experiment.group
    if options is None or not options.together:
        return []
    held_out = () if experiment.test is None else experiment.test.recordings
    found = [
        one
        for one in recordings
        if one.name not in held_out
        and (options.candidates is None or one.name in options.candidates)
    ]
    return found if len(found) > 1 else []


def time_joint_fits(
    experiment: Experiment, recordings: Sequence[Recording]
) -> tuple[float, ...]:
    """Time fits of all recordings together, as ``FitCost.joint`` holds them.

    Parameters
    ----------
    recordings : sequence of Recording
        All of the experiment.

    Returns
    -------
    tuple of float, [s]
        With each of the maps that are tried, and of a linear model; empty where nothing is
        fitted together.
    """
    own = joined(experiment, recordings)
    if not own:
        return ()
    kinds = [with_units(one, FEW_UNITS) for one in kinds_tried(experiment.fit)]
    linear = linear_options(experiment.fit, own)
    return joint_seconds(own, middle_orders(experiment.orders), (*kinds, linear))


def joint_seconds(
    recordings: Sequence[Recording], orders: Orders, kinds: Sequence[FitOptions]
) -> tuple[float, ...]:
    """Times of fits of all recordings but one on one core, measured.

    Each the mean of two, the first or the last recording left out: how often one is
    searched again depends on the recordings more than on their length.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one; few of them, and parts of long ones, stand for all.
    kinds : sequence of FitOptions
        Each with its own maps.

    Returns
    -------
    tuple of float, [s]
        Of each kind.
    """
    parts = [livelier_part(one) for one in recordings[:_MOST_JOINED]]
    # The first call loads the compiled loops, which no later fit does.
    few = replace(kinds[-1], starts=1, max_iterations=1)
    fit_without_standard_errors(parts[:1], orders, few)
    folds = (parts[:-1], parts[1:]) if len(parts) > 1 else (parts,)
    n_timed = sum(one.n_samples for one in parts)
    share = sum(one.n_samples for one in recordings) / n_timed / len(folds)
    found = []
    for one in kinds:
        start = time.process_time()
        for fold in folds:
            fit_without_standard_errors(fold, orders, one)
        found.append(share * (time.process_time() - start))
    return tuple(found)


def joint_plan(
    experiment: Experiment, recordings: Sequence[Recording], cost: FitCost
) -> JointSeconds | None:
    """Forecast what is done with all recordings together; None where nothing is.

    Parameters
    ----------
    recordings : sequence of Recording
        All of the experiment.
    """
    own = joined(experiment, recordings)
    if not own:
        return None
    *with_maps, linear = cost.joint or _scaled(experiment, own, cost)
    n_grid = len(candidate_orders(experiment.orders))
    n_fits = most_fits(experiment.fit, len(own), n_grid)
    # With the maps that are chosen, its orders are searched.
    n_chosen = n_fits - most_fits(experiment.fit, len(own), 0)
    n_before = n_fits - n_chosen - LONGER_DELAYS_FITS, n_fits - n_chosen
    extremes, mean = (min(with_maps), max(with_maps)), float(np.mean(with_maps))
    least, most = (
        n * mean + n_chosen * each + (n + n_chosen) * TASK_SECONDS
        for n, each in zip(n_before, extremes, strict=True)
    )
    # Nothing else judges a model of all: each recording is left out once more.
    n_left_out = min(len(own), MOST_JUDGES)
    faster, slower = order_range(experiment.orders)
    return JointSeconds(
        n_fits,
        (least, most),
        (n_left_out * extremes[0] * faster, n_left_out * extremes[1] * slower),
        linear * n_grid * min(1.0, MOST_JOINED_LINEAR / len(own)),
    )


def _scaled(
    experiment: Experiment, recordings: Sequence[Recording], cost: FitCost
) -> list[float]:
    """What ``FitCost.joint`` would hold, from the time of a fit of one recording."""
    each = _ANEW * fit_seconds(
        cost,
        middle_orders(experiment.orders),
        int(np.median([one.n_samples for one in recordings])),
        units=min(experiment.fit.units, FEW_UNITS),
        n_recordings=len(recordings) - 1,
    )
    return [each] * (len(kinds_tried(experiment.fit)) + 1)
