"""Values of static maps that a program elsewhere can repeat to the last bit.

A search needs values and derivatives of whole arrays fast; a simulation is what a model
that leaves the program is compared with, so its arithmetic has one order, term by term.
"""

from collections.abc import Callable

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.maps.cubic_spline import bends
from hwid_cli.model.maps.smooth_values import sigmoid_sum, spline_value, wavelet_sum
from hwid_cli.records.maps import StaticMap

_SUMS: dict[str, Callable[..., np.ndarray]] = {
    "sigmoid_network": sigmoid_sum,
    "wavelet_network": wavelet_sum,
}


def evaluate(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    """Value of a static map, equal to that of ``static_map.evaluate`` but for rounding.

    Parameters
    ----------
    argument : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> line = StaticMap("cubic_spline", np.array([0.0, 1.0, 0.0, 2.0]), (0.0, 1.0))
    >>> evaluate(line, np.array([-1.0, 0.25]))
    array([-2. ,  0.5])
    """
    if one.kind in _SUMS:
        centres, widths, heights = np.split(one.parameters[:-2], 3)
        (left, right), (low, high) = one.parameters[-2:], one.domain
        line = left + (right - left) / (high - low) * (argument - low)
        return line + _SUMS[one.kind](argument, centres, widths, heights)
    if one.kind == "cubic_spline":
        first, last = one.parameters[:2]
        return spline_value(argument, first, last, one.parameters[2:], bends(one))
    return static_map.evaluate(one, argument)
