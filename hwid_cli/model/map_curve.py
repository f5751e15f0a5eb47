"""A static map as a curve to look at."""

import numpy as np

from hwid_cli.model.static_map import RULES, evaluate
from hwid_cli.records.model import StaticMap
from hwid_cli.records.report import MapCurve

# Points of a curve, and how far it goes on beyond the fit's range on each side, as a
# share of it, [-].
_COUNT, _MARGIN = 201, 0.05


def map_curve(static_map: StaticMap) -> MapCurve:
    """Values of a static map over the range of its argument in the fit.

    Returns
    -------
    MapCurve
        Reaches a little further, to show how the map goes on; corners that no sample of
        the fit reached are left out.

    Examples
    --------
    >>> map_curve(StaticMap("dead_zone", np.array([-1.0, 2.0]), (-3.0, 3.0))).corners
    array([-1.,  2.])
    """
    low, high = static_map.domain
    margin = _MARGIN * (high - low)
    corners = RULES[static_map.kind].corners(static_map)
    corners = corners[(corners >= low - margin) & (corners <= high + margin)]
    argument = np.union1d(np.linspace(low - margin, high + margin, _COUNT), corners)
    return MapCurve(
        argument,
        evaluate(static_map, argument),
        corners,
        evaluate(static_map, corners),
    )
