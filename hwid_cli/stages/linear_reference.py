"""The linear model beside the model to take: the best of the same order grid.

The linear model of the same orders would flatter the maps: orders that suit a model with
maps may suit no linear one, and so may the one recording of its fit. So the linear model is
chosen as the other one was, out of the same orders and by the same recordings. It is fitted
to the same data, or to all that others judge: few coefficients make much of many recordings.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.best_model import LINEAR
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.identify import STAGE_VERSION, Run
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.tasks.cache import recording_key, task_key
from hwid_cli.tasks.task import Task

# Recordings of a joint fit at most: more change few coefficients hardly.
MOST_JOINED_LINEAR = 8
# Share of its range at which an output has to begin for a level, and over how many samples.
_LEAST_LEVEL, _FIRST_SAMPLES = 0.5, 5
# Of models that are as good within this share, the one of the fewest coefficients, [-].
_AS_GOOD = 0.01


@dataclass(frozen=True, eq=False)
class LinearReference:
    """The linear model of the best orders.

    Parameters
    ----------
    name : str
        ``linear:step_06/3/7``, by which it is exported and compared.
    fit : Fit
        With a model.
    ratio : float, [-]
        RMSD of the model with maps over that of this one: geometric mean over all
        recordings that choose or judge and are not those of its fit; NaN without any.
    """

    name: str
    fit: Fit
    ratio: float


@dataclass(frozen=True)
class Roles:
    """Which recordings chose a model, and which judge it.

    Parameters
    ----------
    choosing : tuple of str
        They choose the linear model too; those of the fit where there are no others.
    judging : tuple of str
        No linear model is fitted to them.
    """

    choosing: tuple[str, ...] = ()
    judging: tuple[str, ...] = ()


def linear_options(
    options: FitOptions, recordings: Sequence[Recording] = ()
) -> FitOptions:
    """Give the options of a linear model beside a nonlinear one: the same, without maps.

    Parameters
    ----------
    recordings : sequence of Recording
        That it is fitted to. Where their outputs keep a level, as a room's temperature, a
        straight line at the output adds it: without one an integrator would imitate it.
    """
    linear = replace(
        options,
        input_map="none",
        output_map="none",
        input_function=None,
        output_function=None,
        linear_block=None,
    )
    if not any(map(_keeps_a_level, recordings)):
        return linear
    return replace(linear, output_map="polynomial", degree=1)


def _keeps_a_level(recording: Recording) -> bool:
    """Whether an output begins far from zero."""
    swing = float(np.ptp(recording.output))
    first = float(np.mean(recording.output[:_FIRST_SAMPLES]))
    return abs(first) > _LEAST_LEVEL * swing


def linear_fits(
    recordings: Sequence[Recording],
    grid: Sequence[Orders],
    options: FitOptions,
    run: Run,
) -> tuple[Fit, ...]:
    """Fit linear output-error models to all of these recordings together.

    Parameters
    ----------
    options : FitOptions
        Of a model with maps; all but the maps is kept.
    run : callable
        Runs the tasks, one for each of the orders.

    Returns
    -------
    tuple of Fit
        In the order of ``grid``; one that failed has no model.
    """
    own = tuple(recordings)
    linear = linear_options(options, own)
    if len(own) == 1:
        # A rule for joining recordings does nothing to one and is no part of its fit.
        linear = replace(linear, join=FitOptions().join)
    contents = [recording_key(one) for one in own]
    named = "+".join(one.name for one in own)
    tasks = [
        Task(
            key=task_key(
                "linear",
                STAGE_VERSION,
                {"recordings": contents, "orders": orders, "options": linear},
                [],
            ),
            name=f"{LINEAR}{named}, {orders.nb} and {orders.nf}",
            function=fit,
            arguments=(own, orders, linear),
            result_type=Fit,
        )
        for orders in grid
    ]
    # A fit is cached by content; its names may be those of another day.
    names = tuple(one.name for one in own)
    return tuple(replace(one.result, identified_on=names) for one in run(tasks))


def linear_reference(
    found: Fit,
    fits: Iterable[Fit],
    recordings: Sequence[Recording],
    roles: Roles,
    run: Run,
    *,
    nk_role: str,
) -> LinearReference | None:
    """Choose the linear model that stands beside a model with maps.

    Parameters
    ----------
    found : Fit
        The model with maps.
    fits : iterable of Fit
        Of the grid that it was chosen from: their orders are tried, and their recordings
        together.
    recordings : sequence of Recording
        Those of the fit among them.
    roles : Roles
        Of the recordings for ``found``.
    run : callable
        Runs tasks.
    nk_role : str
        What the second axis of the order grid means.

    Returns
    -------
    LinearReference or None
        None where the model is linear itself, a recording is gone, or all fits fail.
    """
    by_name = {one.name: one for one in recordings}
    if not found.options.has_maps or not set(found.identified_on) <= set(by_name):
        return None
    own = [by_name[name] for name in found.identified_on]
    tried = (found, *fits)
    places = {grid_place(one, nk_role): one.orders for one in tried}
    grid = [places[place] for place in sorted(places)]
    linear = linear_fits(own, grid, found.options, run)
    choosing = [
        by_name[name] for name in roles.choosing if name not in found.identified_on
    ]
    together = dict.fromkeys(name for one in tried for name in one.identified_on)
    are_there = set(together) <= set(by_name)
    if (
        are_there
        and len(together) > len(own)
        and not set(together) & set(roles.judging)
    ):
        # Both kinds are chosen on all of them: each was fitted to a part.
        choosing = [by_name[name] for name in together]
        linear += linear_fits(_evenly(choosing), grid, found.options, run)
    chosen = _smallest_good(linear, choosing or own)
    if chosen is None:
        return None
    nb, nk = grid_place(chosen, nk_role)
    asked = dict.fromkeys((*roles.choosing, *roles.judging))
    others = [by_name[one] for one in asked if one not in found.identified_on]
    return LinearReference(
        f"{LINEAR}{chosen.name}/{nb}/{nk}", chosen, _ratio(found, chosen, others)
    )


def _ratio(one: Fit, other: Fit, recordings: Sequence[Recording]) -> float:
    """Geometric mean of the RMSD of one model over that of another; NaN without any."""
    if not recordings:
        return np.nan
    mine, yours = ([_mean_rmsd(fit, [at]) for at in recordings] for fit in (one, other))
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.exp(np.mean(np.log(mine) - np.log(yours))))


def _smallest_good(linear: Sequence[Fit], choosing: Sequence[Recording]) -> Fit | None:
    """The smallest of those that are about as good as the best; None without a model."""
    means = np.array([_mean_rmsd(one, choosing) for one in linear])
    if not np.isfinite(means).any():
        return None
    good = np.flatnonzero(means <= (1.0 + _AS_GOOD) * np.nanmin(means))
    sizes = [one.orders.nb + one.orders.nf for one in linear]
    return linear[int(min(good, key=lambda place: (sizes[place], means[place])))]


def _evenly(recordings: Sequence[Recording]) -> list[Recording]:
    """So many of them as are joined, evenly chosen."""
    count = min(len(recordings), MOST_JOINED_LINEAR)
    at = np.linspace(0, len(recordings) - 1, count)
    return [recordings[round(place)] for place in at]


def _mean_rmsd(one: Fit, judges: Sequence[Recording]) -> float:
    """Mean over recordings, [unit]; NaN without a model or with an output that runs away."""
    if one.model is None:
        return float("nan")
    each = [rmsd(judge.output, validation_output(one.model, judge)) for judge in judges]
    mean = float(np.mean(each))
    return mean if np.isfinite(mean) else float("nan")
