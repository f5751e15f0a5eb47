"""The named parts of each kind of map: how a file shows the numbers of a ``StaticMap``.

The parts of a map, one after the other, are its parameters.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hwid_cli.records.maps import StaticMap


@dataclass(frozen=True)
class Part:
    """One part of a map's parameters.

    Parameters
    ----------
    size : callable (int) -> int
        Its length, from the number of all parameters.
    is_rising : bool
        Whether its numbers must rise.
    is_positive : bool
        Whether they must be above zero.
    """

    name: str
    size: Callable[[int], int]
    is_rising: bool = False
    is_positive: bool = False


def _network_units(total: int) -> int:
    return (total - 2) // 3


_NETWORK = (
    Part("centres", _network_units),
    Part("widths", _network_units, is_positive=True),
    Part("heights", _network_units),
    Part("line", lambda total: 2),
)

MAP_PARTS: dict[str, tuple[Part, ...]] = {
    "none": (),
    "piecewise_linear": (
        Part("break_points", lambda total: total // 2, is_rising=True),
        Part("values", lambda total: total // 2),
    ),
    "saturation": (Part("limits", lambda total: total),),
    "dead_zone": (Part("edges", lambda total: total),),
    "polynomial": (Part("chebyshev", lambda total: total),),
    "sigmoid_network": _NETWORK,
    "wavelet_network": _NETWORK,
    "cubic_spline": (
        Part("ends", lambda total: 2, is_rising=True),
        Part("values", lambda total: total - 2),
    ),
    "piecewise_constant": (
        Part("edges", lambda total: total // 2, is_rising=True),
        Part("levels", lambda total: total - total // 2),
    ),
    "own_function": (Part("parameters", lambda total: total),),
}


def parts_of(one: StaticMap) -> dict[str, np.ndarray]:
    """Split a map's parameters into their named parts.

    Examples
    --------
    >>> parts_of(StaticMap("piecewise_linear", np.array([0.0, 1.0, 5.0, 6.0])))
    {'break_points': array([0., 1.]), 'values': array([5., 6.])}
    """
    total, first = one.parameters.size, 0
    parts = {}
    for part in MAP_PARTS[one.kind]:
        size = part.size(total)
        parts[part.name] = one.parameters[first : first + size]
        first += size
    return parts
