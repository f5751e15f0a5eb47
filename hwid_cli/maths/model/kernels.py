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
