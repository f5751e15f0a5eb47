"""Compiled loops of the piecewise linear map; nothing else compiles here."""

import numpy as np
from numba import njit


@njit(cache=True)
def piecewise_linear(
    argument: np.ndarray, break_points: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evaluate a piecewise linear map.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points, values : ndarray, shape (units,)

    Returns
    -------
    result, slope : ndarray, shape (n,)
    segment : ndarray of int, shape (n,)
        Left break-point of the segment that is used; the outer segments extrapolate.
    """
    n = argument.size
    last = break_points.size - 2
    result = np.empty(n)
    slope = np.empty(n)
    segment = np.empty(n, dtype=np.int64)
    slopes = (values[1:] - values[:-1]) / (break_points[1:] - break_points[:-1])
    k = 0
    for t in range(n):
        v = argument[t]
        # Signals move little from sample to sample: walk from the last segment.
        while k < last and v >= break_points[k + 1]:
            k += 1
        while k > 0 and v < break_points[k]:
            k -= 1
        segment[t] = k
        slope[t] = slopes[k]
        result[t] = values[k] + slopes[k] * (v - break_points[k])
    return result, slope, segment


@njit(cache=True)
def piecewise_linear_jacobian(
    argument: np.ndarray,
    break_points: np.ndarray,
    lines: tuple[np.ndarray, np.ndarray],
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> None:
    """Derivatives of a piecewise linear map by its break-points and values.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points : ndarray, shape (units,)
    lines : tuple of ndarray, shape (n,)
        Slope and segment as `piecewise_linear` returns them.
    with_positions : bool
        Whether the break-points have columns, before those of the values.
    out : ndarray, shape (n, at least first + units or first + 2 units)
    first : int
        First column to write.
    """
    slope, segment = lines
    units = break_points.size
    values_at = first + units if with_positions else first
    for t in range(argument.size):
        k = segment[t]
        width = break_points[k + 1] - break_points[k]
        share = (argument[t] - break_points[k]) / width
        for column in range(first, values_at + units):
            out[t, column] = 0.0
        out[t, values_at + k] = 1.0 - share
        out[t, values_at + k + 1] = share
        if with_positions:
            out[t, first + k] = -slope[t] * (1.0 - share)
            out[t, first + k + 1] = -slope[t] * share


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
    size = (values.max() - values.min()) / (break_points[-1] - break_points[0])
    if size == 0.0:
        size = 1.0
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
        kept = np.concatenate((kept[:cheapest], kept[cheapest + 1 :]))
    return kept


@njit(cache=True)
def _between(
    points: np.ndarray, values: np.ndarray, first: int, last: int, at: int
) -> float:
    """Straight line through two break-points, read at a third."""
    share = (points[at] - points[first]) / (points[last] - points[first])
    return values[first] + share * (values[last] - values[first])
