"""Fits of a grid of orders."""

from collections.abc import Iterator
from dataclasses import dataclass

from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Fit
from hwid_cli.records.shown import Shown


@dataclass(frozen=True, eq=False, repr=False)
class FitGrid(Shown):
    """Fits of several recordings with every pair of orders.

    Parameters
    ----------
    fits : tuple of Fit
        Recording by recording, each in the order of the grid.
    orders : OrdersOptions
        The grid.
    """

    fits: tuple[Fit, ...]
    orders: OrdersOptions

    def __iter__(self) -> Iterator[Fit]:
        return iter(self.fits)

    def __len__(self) -> int:
        return len(self.fits)

    def __getitem__(self, place: int) -> Fit:
        return self.fits[place]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the recordings."""
        return tuple(dict.fromkeys(one.name for one in self.fits))

    def facts(self) -> tuple[tuple[str, str], ...]:
        """What there is of it."""
        return (
            ("fits", str(len(self.fits))),
            ("recordings", str(len(self.names))),
            ("nb", f"{self.orders.nb[0]} to {self.orders.nb[-1]}"),
            ("nk", f"{self.orders.nk[0]} to {self.orders.nk[-1]}"),
            ("failed", str(sum(one.model is None for one in self.fits))),
        )
