"""The fit that a user would write: the baseline of the benchmarks.

ARX start, then scipy's ``least_squares`` with finite differences over ``lfilter`` and two
piecewise linear maps, with fixed or free break-points, from zero initial state.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from hwid_cli.records.model import Orders

UNITS = 10
# As in the scripts that measured this fit first: of one model, and of one in a grid.
MOST_EVALUATIONS, MOST_IN_GRID = 200, 100


@dataclass(frozen=True, eq=False)
class ByHand:
    """A fit by hand.

    Parameters
    ----------
    simulate : callable
        Output for an input.
    denominator : ndarray, shape (nf + 1,)
    """

    simulate: Callable[[np.ndarray], np.ndarray]
    denominator: np.ndarray

    @property
    def is_stable(self) -> bool:
        """Whether all poles lie inside the unit circle."""
        return bool(np.all(np.abs(np.roots(self.denominator)) < 1.0))


def extrapolated(argument, points, values):
    """Straight lines between and beyond the break-points."""
    result = np.interp(argument, points, values)
    for end, inner in ((0, 1), (-1, -2)):
        slope = (values[inner] - values[end]) / (points[inner] - points[end])
        outside = argument < points[0] if end == 0 else argument > points[-1]
        result[outside] = values[end] + slope * (argument[outside] - points[end])
    return result


def arx(orders: Orders, u, y):
    """Coefficients of B and F by linear least squares on measured outputs."""
    n, lag = y.size, max(orders.nf, orders.nb + orders.nk - 1)
    rows = [-y[lag - j : n - j] for j in range(1, orders.nf + 1)]
    rows += [u[lag - orders.nk - i : n - orders.nk - i] for i in range(orders.nb)]
    start = np.linalg.lstsq(np.column_stack(rows), y[lag:], rcond=None)[0]
    return start[orders.nf :], start[: orders.nf]


def fit_by_hand(
    orders: Orders, u, y, *, free: bool, most_evaluations=MOST_EVALUATIONS
) -> ByHand:
    """Fit a Hammerstein-Wiener model by hand."""
    b, f = arx(orders, u, y)
    past = np.zeros(orders.nk)
    u_points = np.linspace(u.min(), u.max(), UNITS)
    with np.errstate(all="ignore"):
        x = lfilter(np.r_[past, b], np.r_[1.0, f], u)
    x = np.clip(np.nan_to_num(x, nan=1e6), -1e6, 1e6)
    x_points = np.linspace(x.min(), x.max(), UNITS)
    sizes = [UNITS, orders.nb, orders.nf, UNITS] + [UNITS, UNITS] * free
    cuts = np.cumsum(sizes)[:-1]

    def model(parameters, signal):
        values, b, f, y_values, *points = np.split(parameters, cuts)
        p, q = (np.sort(one) for one in points) if free else (u_points, x_points)
        with np.errstate(all="ignore"):
            w = extrapolated(signal, p, values)
            x = lfilter(np.r_[past, b], np.r_[1.0, f], w)
            x = np.clip(np.nan_to_num(x, nan=1e6), -1e6, 1e6)
            return extrapolated(x, q, y_values)

    first = np.concatenate([u_points, b, f, x_points] + [u_points, x_points] * free)
    found = least_squares(
        lambda parameters: model(parameters, u) - y,
        first,
        x_scale="jac",
        max_nfev=most_evaluations,
    )
    denominator = np.r_[1.0, np.split(found.x, cuts)[2]]
    return ByHand(lambda signal: model(found.x, signal), denominator)
