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
def piecewise_linear_value(
    argument: np.ndarray, break_points: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """Evaluate a piecewise linear map.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points, values : ndarray, shape (units,)

    Returns
    -------
    ndarray, shape (n,)
    """
    last = break_points.size - 2
    result = np.empty(argument.size)
    slopes = (values[1:] - values[:-1]) / (break_points[1:] - break_points[:-1])
    k = 0
    for t in range(argument.size):
        v = argument[t]
        # Signals move little from sample to sample: walk from the last segment.
        while k < last and v >= break_points[k + 1]:
            k += 1
        while k > 0 and v < break_points[k]:
            k -= 1
        result[t] = values[k] + slopes[k] * (v - break_points[k])
    return result


@njit(cache=True)
def piecewise_linear_shares(
    argument: np.ndarray, break_points: np.ndarray, values: np.ndarray, spacing: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Value and slope of a piecewise linear map, and its derivatives, which are local.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    break_points, values : ndarray, shape (units,)
    spacing : int
        1: columns are those of the values. 2: every segment has two columns, those of
        its own left and right value.

    Returns
    -------
    value, slope : ndarray, shape (n,)
    first : ndarray of int, shape (n,)
        First of the two columns that are not zero.
    shares : ndarray, shape (n, 2)
        What stands in them.
    """
    n, last = argument.size, break_points.size - 2
    value, slope = np.empty(n), np.empty(n)
    first, shares = np.empty(n, dtype=np.int64), np.empty((n, 2))
    widths = 1.0 / (break_points[1:] - break_points[:-1])
    slopes = (values[1:] - values[:-1]) * widths
    k = 0
    for t in range(n):
        v = argument[t]
        while k < last and v >= break_points[k + 1]:
            k += 1
        while k > 0 and v < break_points[k]:
            k -= 1
        beyond = v - break_points[k]
        first[t] = spacing * k
        slope[t] = slopes[k]
        value[t] = values[k] + slopes[k] * beyond
        shares[t, 1] = beyond * widths[k]
        shares[t, 0] = 1.0 - shares[t, 1]
    return value, slope, first, shares


@njit(cache=True)
def columns_of_segments(break_points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Parameters' columns out of those of each segment's own end values.

    A break-point that moves to the right lowers the line through it by its slope: on
    either side by another one.

    Parameters
    ----------
    break_points, values : ndarray, shape (units,)

    Returns
    -------
    ndarray, shape (2 units, 2 (units - 1))
    """
    units = values.size
    change = np.zeros((2 * units, 2 * (units - 1)))
    for i in range(units - 1):
        slope = (values[i + 1] - values[i]) / (break_points[i + 1] - break_points[i])
        change[i, 2 * i] = -slope
        change[i + 1, 2 * i + 1] = -slope
        change[units + i, 2 * i] = 1.0
        change[units + i + 1, 2 * i + 1] = 1.0
    return change
