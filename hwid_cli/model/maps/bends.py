"""The prior on the shape of a piecewise linear map: how much it bends, and where.

A search adds the squared bends to its cost, so that segments of few samples follow their
neighbours; where no sample has been at all, the smallest bends stay.

References
----------
docs/method.md, section "The search" and eq. (15c).

Compiled loops; of the rest only `smallest_bends` is no loop.
"""

import numpy as np

from hwid_cli.compiled import INNER, MAKING, compiled

# Share of a segment over which its samples must spread to tell its slope, and strength
# of a direction, as a share of the strongest, below which the samples do not see it.
_LEAST_SPREAD, _UNSEEN = 1e-3, 1e-6


def smallest_bends(
    points: np.ndarray, values: np.ndarray, argument: np.ndarray
) -> np.ndarray:
    """Values with the smallest bends that give the same map where samples have been.

    Parameters
    ----------
    points, values : ndarray, shape (units,)
    argument : ndarray, shape (n,)
        What reaches the map.

    Returns
    -------
    ndarray, shape (units,)
        The same ones where samples tell the slope of every segment.
    """
    if points.size < 3 or not np.isfinite(argument).all():
        return values
    levels = np.sort(argument)
    if _is_told(points, levels):
        return values
    seen = _shares(points, np.unique(levels))
    _, strength, directions = np.linalg.svd(np.linalg.qr(seen, mode="r"))
    rank = int(np.sum(strength > _UNSEEN * strength[0]))
    unseen = directions[rank:].T
    if unseen.shape[1] == 0:
        return values
    bend, jacobian = bends(points, values, False)
    steps = np.linalg.lstsq(jacobian @ unseen, -bend, rcond=None)[0]
    return values + unseen @ steps


def _is_told(points: np.ndarray, levels: np.ndarray) -> bool:
    """Tell whether the samples in every segment spread enough to know its line."""
    inner = np.searchsorted(levels, points[1:-1], side="left")
    first, end = np.append(0, inner), np.append(inner, levels.size)
    if np.any(first == end):
        return False
    spread = levels[end - 1] - levels[first]
    return bool(np.all(spread > _LEAST_SPREAD * np.diff(points)))


def _shares(points: np.ndarray, argument: np.ndarray) -> np.ndarray:
    """How much the value at each break-point counts for a map's values."""
    segment = np.clip(
        np.searchsorted(points, argument, side="right") - 1, 0, points.size - 2
    )
    share = (argument - points[segment]) / (points[segment + 1] - points[segment])
    rows = np.zeros((argument.size, points.size))
    at = np.arange(argument.size)
    rows[at, segment], rows[at, segment + 1] = 1.0 - share, share
    return rows


@compiled(**INNER)
def _mean_slope(break_points: np.ndarray, values: np.ndarray) -> float:
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


@compiled(error_model="numpy")
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
    size = _mean_slope(break_points, values)
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


@compiled(error_model="numpy")
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


@compiled(**MAKING)
def _relative_growth(
    break_points: np.ndarray, values: np.ndarray, with_positions: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the logarithm of `growth`, and the columns that have any."""
    units = break_points.size
    first, last = _inner_ends(units)
    low, high = _extremes(values, first, last)
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


@compiled(**INNER)
def _extremes(values: np.ndarray, first: int, last: int) -> tuple[int, int]:
    """Places of the first lowest and the first highest value from one place to another."""
    low = high = first
    for i in range(first + 1, last + 1):
        if values[i] < values[low]:
            low = i
        if values[i] > values[high]:
            high = i
    return low, high


@compiled(**INNER)
def _inner_ends(units: int) -> tuple[int, int]:
    """Break-points between which a map's growth is measured.

    The outermost ones may slide along the line on which the map goes on; they would run
    away if that made the bends look smaller.
    """
    return (1, units - 2) if units > 3 else (0, units - 1)


@compiled(error_model="numpy")
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
    low, high = _extremes(values, first, last)
    size = values[high] - values[low]
    low, high = _extremes(values_before, first, last)
    size_before = values_before[high] - values_before[low]
    if size == 0.0 or size_before == 0.0:
        return 1.0
    width = break_points[last] - break_points[first]
    return size / size_before * (before[last] - before[first]) / width


@compiled(error_model="numpy")
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
    size = _mean_slope(before, values_before)
    size *= growth(break_points, values, before, values_before)
    total = 0.0
    last = 0.0
    for i in range(values.size - 1):
        slope = (values[i + 1] - values[i]) / (break_points[i + 1] - break_points[i])
        if i > 0:
            total += ((slope - last) / size) ** 2
        last = slope
    return total
