"""Compiled loops over break-points; nothing else compiles here."""

import numpy as np
from numba import njit

# Sweeps that put break-points into order.
_SWEEPS = 4


@njit(cache=True)
def mean_slope(break_points: np.ndarray, values: np.ndarray) -> float:
    """Range of the values over that of the break-points; 1 for a constant map.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)
    """
    low = high = values[0]
    for value in values:
        low, high = min(low, value), max(high, value)
    size = (high - low) / (break_points[-1] - break_points[0])
    return size if size != 0.0 else 1.0


@njit(cache=True)
def bends(
    break_points: np.ndarray, values: np.ndarray, with_positions: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Changes of slope of a piecewise linear map, in units of its mean slope.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)
    with_positions : bool
        Whether the break-points have columns in the jacobian.

    Returns
    -------
    bend : ndarray, shape (units - 2,)
    jacobian : ndarray, shape (units - 2, 2 units) or (units - 2, units)
        By the break-points (if asked for) and the values, at a fixed mean slope.
    """
    units = break_points.size
    offset = units if with_positions else 0
    bend = np.zeros(units - 2)
    jacobian = np.zeros((units - 2, offset + units))
    size = mean_slope(break_points, values)
    for i in range(units - 2):
        left = 1.0 / ((break_points[i + 1] - break_points[i]) * size)
        right = 1.0 / ((break_points[i + 2] - break_points[i + 1]) * size)
        rise_left = (values[i + 1] - values[i]) * left
        rise_right = (values[i + 2] - values[i + 1]) * right
        bend[i] = rise_right - rise_left
        jacobian[i, offset + i] = left
        jacobian[i, offset + i + 1] = -left - right
        jacobian[i, offset + i + 2] = right
        if with_positions:
            left, right = rise_left * left * size, rise_right * right * size
            jacobian[i, i] = -left
            jacobian[i, i + 1] = left + right
            jacobian[i, i + 2] = -right
    return bend, jacobian


@njit(cache=True)
def add_bends(
    break_points: np.ndarray,
    values: np.ndarray,
    with_positions: bool,
    weight: float,
    matrix: np.ndarray,
    vector: np.ndarray,
    first: int,
) -> float:
    """Add the rows of all bends to normal equations.

    The slope that counts as one is the mean slope here and grows as the map does, so that
    a factor on the map changes nothing: measured by a slope that stays, every search would
    win by making the map smaller and the next block larger, for ever.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)
    weight : float
        Of the squared bends.
    matrix : ndarray, shape (n_parameters, n_parameters)
    vector : ndarray, shape (n_parameters,)
    first : int
        Where the map's parameters begin.

    Returns
    -------
    float
        Sum of the squared bends.
    """
    bend, jacobian = bends(break_points, values, with_positions)
    units = break_points.size
    offset = units if with_positions else 0
    rates, growing = _relative_growth(break_points, values, with_positions)
    total = 0.0
    places = np.empty(10, dtype=np.int64)
    slopes = np.empty(10)
    for i in range(bend.size):
        total += bend[i] * bend[i]
        count = 0
        for k in range(3):
            places[count], slopes[count] = (
                offset + i + k,
                jacobian[i, offset + i + k],
            )
            count += 1
            if with_positions:
                places[count], slopes[count] = i + k, jacobian[i, i + k]
                count += 1
        for k in range(growing.size):
            places[count], slopes[count] = growing[k], -bend[i] * rates[k]
            count += 1
        for a in range(count):
            left = weight * slopes[a]
            vector[first + places[a]] -= left * bend[i]
            for b in range(count):
                matrix[first + places[a], first + places[b]] += left * slopes[b]
    return total


@njit(cache=True)
def _relative_growth(
    break_points: np.ndarray, values: np.ndarray, with_positions: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the logarithm of `growth`, and the columns that have any."""
    units = break_points.size
    first, last = _inner_ends(units)
    low = first + np.argmin(values[first : last + 1])
    high = first + np.argmax(values[first : last + 1])
    size = values[high] - values[low]
    if size == 0.0:
        return np.empty(0), np.empty(0, dtype=np.int64)
    offset = units if with_positions else 0
    if not with_positions:
        return (
            np.array([-1.0 / size, 1.0 / size]),
            np.array([offset + low, offset + high]),
        )
    width = break_points[last] - break_points[first]
    return (
        np.array([-1.0 / size, 1.0 / size, 1.0 / width, -1.0 / width]),
        np.array([offset + low, offset + high, first, last]),
    )


@njit(cache=True)
def _inner_ends(units: int) -> tuple[int, int]:
    """Break-points between which a map's growth is measured.

    The outermost ones may slide along the line on which the map goes on; they would run
    away if that made the bends look smaller.
    """
    return (1, units - 2) if units > 3 else (0, units - 1)


@njit(cache=True)
def growth(
    break_points: np.ndarray,
    values: np.ndarray,
    before: np.ndarray,
    values_before: np.ndarray,
) -> float:
    """Factor by which a map has become steeper, measured between its inner break-points.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)
    before, values_before : ndarray, shape (units,)
        Of the map as it was.

    Returns
    -------
    float
        1 where one of the two is constant.
    """
    first, last = _inner_ends(values.size)
    size = np.ptp(values[first : last + 1])
    size_before = np.ptp(values_before[first : last + 1])
    if size == 0.0 or size_before == 0.0:
        return 1.0
    width = break_points[last] - break_points[first]
    return size / size_before * (before[last] - before[first]) / width


@njit(cache=True)
def squared_bends_after(
    break_points: np.ndarray,
    values: np.ndarray,
    before: np.ndarray,
    values_before: np.ndarray,
) -> float:
    """Sum of the squared changes of slope after a step, as the step saw them.

    The slope that counts as one is the mean slope before the step, times the growth of
    the map in it.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)
    before, values_before : ndarray, shape (units,)
        Of the map before the step.
    """
    size = mean_slope(before, values_before)
    size *= growth(break_points, values, before, values_before)
    total = 0.0
    last = 0.0
    for i in range(values.size - 1):
        slope = (values[i + 1] - values[i]) / (break_points[i + 1] - break_points[i])
        if i > 0:
            total += ((slope - last) / size) ** 2
        last = slope
    return total


@njit(cache=True)
def settled_break_points(
    old: np.ndarray, proposed: np.ndarray, least_shrink: float, least_width: float
) -> None:
    """Put break-points into order again, in place.

    Parameters
    ----------
    old, proposed : ndarray, shape (units,)
    least_shrink : float, [-]
        Share of its old width that a segment keeps at least.
    least_width : float, [-]
        Share of the whole that it keeps at least.
    """
    whole = old[-1] - old[0]
    least = np.empty(old.size - 1)
    for i in range(least.size):
        width = old[i + 1] - old[i]
        least[i] = min(max(least_shrink * width, least_width * whole), width)
    # Neighbours that came too close part to both sides alike; what that does to the
    # next ones is mended in further sweeps, and the last one is one-sided.
    for sweep in range(_SWEEPS):
        is_legal = True
        for i in range(least.size):
            lack = least[i] - (proposed[i + 1] - proposed[i])
            if lack > 0.0:
                is_legal = False
                share = 0.5 if sweep < _SWEEPS - 1 else 0.0
                proposed[i] -= share * lack
                proposed[i + 1] += (1.0 - share) * lack
        if is_legal:
            return


@njit(cache=True)
def thinned_break_points(
    break_points: np.ndarray, values: np.ndarray, weights: np.ndarray, count: int
) -> np.ndarray:
    """Choose the break-points that a coarser map needs most.

    One after the other, the inner break-point goes whose absence adds least to the
    weighted squared error at all given break-points.

    Parameters
    ----------
    break_points, values, weights : ndarray, shape (n,)
    count : int
        How many stay.

    Returns
    -------
    ndarray of int, shape (count,)
        Their indices.
    """
    kept = np.arange(break_points.size)
    while kept.size > count:
        cheapest, least = 1, np.inf
        for j in range(1, kept.size - 1):
            first, middle, last = kept[j - 1], kept[j], kept[j + 1]
            added = 0.0
            for i in range(first + 1, last):
                near, far = (first, middle) if i <= middle else (middle, last)
                with_it = _between(break_points, values, near, far, i)
                without = _between(break_points, values, first, last, i)
                added += weights[i] * (
                    (without - values[i]) ** 2 - (with_it - values[i]) ** 2
                )
            if added < least:
                cheapest, least = j, added
        for j in range(cheapest, kept.size - 1):
            kept[j] = kept[j + 1]
        kept = kept[: kept.size - 1]
    return kept


@njit(cache=True)
def _between(
    points: np.ndarray, values: np.ndarray, first: int, last: int, at: int
) -> float:
    """Straight line through two break-points, read at a third."""
    share = (points[at] - points[first]) / (points[last] - points[first])
    return values[first] + share * (values[last] - values[first])
