"""What is counted on a grid of orders."""

from collections.abc import Sequence
from dataclasses import dataclass

from hwid_cli.records.model import Orders

# Share of the RMSD by which more parameters may be worse in training: rounding.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Scored:
    """One model of a grid.

    Parameters
    ----------
    orders : Orders
    train_rmsd : float
    test_percent : float, [%]
    is_stable : bool
    """

    orders: Orders
    train_rmsd: float
    test_percent: float
    is_stable: bool


def n_worse_than(
    found: Sequence[Scored], linear: Sequence[Scored], points: float
) -> int:
    """Models that test worse than the linear model of their orders by so many points."""
    of = {one.orders: one.test_percent for one in linear}
    return sum(one.test_percent < of[one.orders] - points for one in found)


def n_not_monotone(found: Sequence[Scored]) -> int:
    """Models that train worse than one of smaller orders that theirs contain."""
    return sum(
        any(
            other.orders.nb <= one.orders.nb
            and other.orders.nf <= one.orders.nf
            and other.train_rmsd * (1.0 + ROUNDING) < one.train_rmsd
            for other in found
        )
        for one in found
    )
