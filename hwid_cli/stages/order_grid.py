"""Which candidate orders to try."""

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Fit, Orders

# Delay of the published grid, whose second axis counts poles, [samples].
DELAY_OF_POLE_GRID = 1
# Rounds of a grid's growth in which fits are also searched for anew: what is found there
# all later models contain, and beyond it a search anew hardly ever finds better.
SEARCHED_ROUNDS = 4
# As for single recordings, but one round less: a fit from the members' models takes many
# times as long as going on from smaller orders, and groups are told apart by a threshold.
SEARCHED_ROUNDS_OF_GROUPS = 3


def candidate_orders(options: OrdersOptions) -> tuple[tuple[int, int, Orders], ...]:
    """List the candidate orders, each with its place in the grid.

    Returns
    -------
    tuple of (nb, nk, Orders)
        Row by row; ``nb`` and ``nk`` are the grid's axes as the configuration names
        them. With ``nk_role: poles`` the orders are ``[nb, nk, 1]``, with ``delay``
        ``[nb, nf, nk]``.

    Raises
    ------
    ConfigError
        If the grid lacks the number of poles.

    Examples
    --------
    >>> candidate_orders(OrdersOptions(nb=(2,), nk=(3,)))
    ((2, 3, Orders(nb=2, nf=3, nk=1)),)
    """
    if options.nk_role == "delay" and options.nf is None:
        raise ConfigError(
            "orders.nf: missing; expected the number of poles where nk_role is delay; "
            "add nf, or set nk_role: poles"
        )
    return tuple(
        (nb, nk, _orders(options, nb, nk)) for nb in options.nb for nk in options.nk
    )


def growth(
    options: OrdersOptions,
) -> tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]:
    """List the grid in the order in which its models grow out of smaller ones.

    Returns
    -------
    tuple of tuple of (place, places)
        Round by round: each place of the grid, as `candidate_orders` numbers them, with
        those of the largest orders that it contains, which earlier rounds have fitted.

    Examples
    --------
    >>> growth(OrdersOptions(nb=(1, 2), nk=(1, 2)))
    (((0, ()),), ((1, (0,)), (2, (0,))), ((3, (1, 2)),))
    """
    grid = [orders for _, _, orders in candidate_orders(options)]
    contains = np.array([[one.contains(other) for other in grid] for one in grid])
    np.fill_diagonal(contains, False)
    # What is contained through a third one is not among the largest.
    within = contains.astype(np.float32)
    largest = contains & ~(within @ within > 0.0)
    rounds: dict[int, list[tuple[int, tuple[int, ...]]]] = {}
    depth = np.zeros(len(grid), dtype=int)
    for i in np.argsort(contains.sum(axis=1), kind="stable"):
        before = np.flatnonzero(largest[i])
        depth[i] = 1 + max(depth[before], default=-1)
        place = (int(i), tuple(int(one) for one in before))
        rounds.setdefault(int(depth[i]), []).append(place)
    return tuple(tuple(sorted(rounds[number])) for number in sorted(rounds))


def grid_place(fit: Fit, nk_role: str) -> tuple[int, int]:
    """Place of a fit in the order grid.

    Parameters
    ----------
    nk_role : str
        What the second axis counts.

    Returns
    -------
    nb, nk : int, [-]
    """
    nk = fit.orders.nf if nk_role == "poles" else fit.orders.nk
    return fit.orders.nb, nk


def _orders(options: OrdersOptions, nb: int, nk: int) -> Orders:
    if options.nk_role == "delay" and options.nf is not None:
        return Orders(nb, options.nf, nk)
    return Orders(nb, nk, DELAY_OF_POLE_GRID)
