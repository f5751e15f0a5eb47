"""Linear starts for several delays, at little more than the cost of one.

The delay of the orders gets all its starts. The others begin their least squares with the
best denominator that these found, which is hardly another one, and need few iterations.
Delays whose starts explain the output nearly as well go on together: before the maps
are known the linear blocks alone often cannot tell.

References
----------
docs/method.md, section "Several delays".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.candidates import FitData
from hwid_cli.model.starts import Known, Start, linear_starts
from hwid_cli.records.model import FitOptions, Orders

# Iterations of the other delays, and how many of their starts are kept.
_ITERATIONS, _KEPT = 1, 2
# Delays that go on, and their cost as a multiple of the lowest.
_MOST, _CLOSE = 2, 1.2


def starts_of_delays(
    experiments: Sequence[FitData],
    orders: Orders,
    *,
    options: FitOptions,
    sees_input_map: bool,
    count: int,
) -> tuple[tuple[Start, ...], ...]:
    """Linear starts of the delays that explain the output best.

    Parameters
    ----------
    count : int
        Starts of one delay at most; see `linear_starts`.

    Returns
    -------
    tuple of tuple of Start
        One for each delay, the best first.
    """
    first, *others = options.delays_for(orders)
    found = [
        linear_starts(
            experiments,
            replace(orders, nk=first),
            options=options,
            sees_input_map=sees_input_map,
            count=count,
        )
    ]
    prefilter = min(found[0], key=lambda one: one.cost).denominator
    for delay in others:
        found.append(
            linear_starts(
                experiments,
                replace(orders, nk=delay),
                options=options,
                sees_input_map=sees_input_map,
                count=min(count, _KEPT),
                known=Known(prefilter, _ITERATIONS),
            )
        )
    costs = [min(one.cost for one in starts) for starts in found]
    order = sorted(range(len(found)), key=lambda number: costs[number])
    limit = _CLOSE * costs[order[0]]
    return tuple(found[number] for number in order[:_MOST] if costs[number] <= limit)


def reestimated_blocks(
    experiments: Sequence[FitData],
    found: Orders,
    options: FitOptions,
    *,
    count: int,
    denominator: np.ndarray,
) -> list[Start]:
    """Linear blocks between known maps, of all delays that are tried.

    Parameters
    ----------
    experiments : sequence of FitData
        Signals before and after the linear block.
    found : Orders
        Of the best model so far.
    count : int
        How many to return at most.
    denominator : ndarray, shape (nf + 1,)
        To begin with.

    Returns
    -------
    list of Start
        Best first.
    """
    starts: list[Start] = []
    for delay in options.delays_for(found):
        is_same = delay == found.nk
        known = Known(denominator) if is_same else Known(denominator, _ITERATIONS)
        starts += linear_starts(
            experiments,
            replace(found, nk=delay),
            options=options,
            sees_input_map=False,
            count=count,
            known=known,
        )
    return sorted(starts, key=lambda one: one.cost)[:count]
