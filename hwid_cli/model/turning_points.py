"""Where a static map is not monotonic: turns back, so that two arguments give one value.

Such a map is legitimate, such as that of a sensor that rectifies, but the position
can no longer be told from the output, and no controller can invert it.

References
----------
docs/method.md, section "What a fit reports".
"""

import numpy as np

from hwid_cli.model.map_curve import map_curve
from hwid_cli.records.model import StaticMap

# Share of a map's range by which it must turn back; less is the shape of a flat part.
_LEAST_DEPTH = 0.02


def turning_points(
    one: StaticMap,
    *,
    least: float = 0.0,
    between: tuple[float, float] | None = None,
) -> np.ndarray:
    """Arguments at which a map turns back.

    Parameters
    ----------
    least : float
        Turning back by less than this, in the unit of the value, does not count, nor does
        less than 2 % of the map's range.
    between : tuple of float, optional
        Range of the argument that counts; the domain unless given.

    Returns
    -------
    ndarray, shape (n_turns,)
        Rising; empty for a map that is monotonic.

    Examples
    --------
    >>> turning_points(StaticMap("polynomial", np.array([0.5, 0.0, 0.5]), (-1.0, 1.0)))
    array([0.])
    """
    curve = map_curve(one)
    low, high = one.domain if between is None else between
    inside = (curve.argument >= low) & (curve.argument <= high)
    argument, value = curve.argument[inside], curve.value[inside]
    if value.size < 3 or not np.isfinite(value).all() or _is_monotonic(value):
        return np.zeros(0)
    depth = max(_LEAST_DEPTH * float(np.ptp(value)), least)
    return argument[_turns(value, depth)]


def _is_monotonic(value: np.ndarray) -> bool:
    steps = np.diff(value)
    return bool((steps >= 0.0).all() or (steps <= 0.0).all())


def _turns(value: np.ndarray, depth: float) -> list[int]:
    """Places of the extremes from which a curve goes back by a depth on both sides."""
    turns: list[int] = []
    highest = lowest = 0
    rising: bool | None = None
    for place, here in enumerate(value):
        if here > value[highest]:
            highest = place
        if here < value[lowest]:
            lowest = place
        if rising is not False and here < value[highest] - depth:
            if rising:
                turns.append(highest)
            rising, lowest = False, place
        elif rising is not True and here > value[lowest] + depth:
            if rising is False:
                turns.append(lowest)
            rising, highest = True, place
    return turns
