"""Compiled inner loops of the Hammerstein-Wiener model; nothing else compiles here.

Signals that a filter reads carry ``pad`` rows in front that hold their values before
the first sample, so that no loop asks whether a past value exists.
"""

import numpy as np
from numba import njit

# Reassociation lets the compiler use vector instructions in sums; NaN and infinity keep
# their meaning because 'nnan' and 'ninf' are left out.
_FAST = {"reassoc", "contract", "arcp", "nsz"}
# Decaying responses end in subnormal numbers, which processors handle a hundred times
# slower; anything this small is far below the rounding of the values it is added to.
_TINY = 1e-200


@njit(cache=True, fastmath=_FAST)
def filter_columns(
    columns: np.ndarray,
    block: tuple[np.ndarray, np.ndarray, int],
    past: tuple[np.ndarray, np.ndarray],
    gain: np.ndarray,
    out: np.ndarray,
    first: int,
) -> None:
    """Run ``q^-delay B(q)/F(q)`` down every column, then multiply by ``gain(t)``.

    Parameters
    ----------
    columns : ndarray, shape (n, k)
    block : tuple of numerator (nb,), monic denominator (nf + 1,), delay
    past : tuple of ndarray, shape (k,)
        Constant values before the first sample: of the columns, of the result.
    gain : ndarray, shape (n,)
    out : ndarray, shape (n, at least first + k)
        Columns ``first ... first + k - 1`` are written.
    first : int
    """
    numerator, denominator, delay = block
    n_rows, n_columns = columns.shape
    for t in range(n_rows):
        row = out[t, first : first + n_columns]
        for k in range(n_columns):
            row[k] = 0.0
        for i in range(numerator.size):
            b = numerator[i]
            s = t - delay - i
            source = columns[s] if s >= 0 else past[0]
            for k in range(n_columns):
                row[k] += b * source[k]
        for j in range(1, denominator.size):
            f = denominator[j]
            source = out[t - j, first : first + n_columns] if t >= j else past[1]
            for k in range(n_columns):
                row[k] -= f * source[k]
        for k in range(n_columns):
            if abs(row[k]) < _TINY:
                row[k] = 0.0
    for t in range(n_rows):
        for k in range(first, first + n_columns):
            out[t, k] *= gain[t]


@njit(cache=True, fastmath=_FAST)
def filter_signal(
    signal: np.ndarray,
    pad: int,
    numerator: np.ndarray,
    denominator: np.ndarray,
    delay: int,
    out: np.ndarray,
) -> None:
    """Run ``q^-delay B(q)/F(q)`` along one signal.

    Parameters
    ----------
    signal : ndarray, shape (pad + n,)
        With its past in front.
    pad : int, [samples]
        At least ``max(nf, nb - 1 + delay)``.
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)
        Monic.
    delay : int, [samples]
    out : ndarray, shape (pad + n,)
        The first ``pad`` values are read, the others written.
    """
    nf = denominator.size - 1
    for t in range(pad, signal.size):
        value = 0.0
        for i in range(numerator.size):
            value += numerator[i] * signal[t - delay - i]
        for j in range(1, nf + 1):
            value -= denominator[j] * out[t - j]
        if abs(value) < _TINY:
            value = 0.0
        out[t] = value


@njit(cache=True)
def difference_columns(
    signal: np.ndarray,
    pad: int,
    lag: int,
    gain: np.ndarray,
    first: int,
    count: int,
    out: np.ndarray,
) -> None:
    """Write ``gain(t) (1 - q^-1)^j signal(t - lag)`` for j below `count` into columns.

    Parameters
    ----------
    signal : ndarray, shape (pad + n,)
        Padded with at least ``lag + count`` rows.
    pad : int
    lag : int, [samples]
    gain : ndarray, shape (n,)
    first, count : int
        Columns ``first ... first + count - 1`` of `out` are written.
    out : ndarray, shape (n, n_parameters)
    """
    if count == 0:
        return
    differences = np.zeros(count)
    before = np.zeros(count)
    for warm in range(count, 0, -1):
        _push(signal[pad - lag - warm], differences, before)
    for t in range(gain.size):
        _push(signal[pad + t - lag], differences, before)
        for j in range(count):
            out[t, first + j] = gain[t] * differences[j]


@njit(cache=True)
def _push(value: float, differences: np.ndarray, before: np.ndarray) -> None:
    """Advance the differences of all orders by one sample."""
    current = value
    for j in range(differences.size):
        differences[j] = current
        current = current - before[j]
        before[j] = differences[j]


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
def is_schur_stable(denominator: np.ndarray) -> bool:
    """Tell whether every root of a monic polynomial lies inside the unit circle.

    Schur-Cohn recursion on the reflection coefficients; no roots are computed.

    Parameters
    ----------
    denominator : ndarray, shape (n + 1,)

    Returns
    -------
    bool
    """
    a = denominator.copy()
    for order in range(a.size - 1, 0, -1):
        k = a[order]
        if not abs(k) < 1.0:
            return False
        scale = 1.0 - k * k
        previous = a.copy()
        for i in range(1, order):
            a[i] = (previous[i] - k * previous[order - i]) / scale
    return True


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
