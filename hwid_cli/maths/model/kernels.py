"""Compiled inner loops of the Hammerstein-Wiener model; nothing else compiles here.

Signals that a filter reads carry ``pad`` rows in front that hold their values before
the first sample, so that no loop asks whether a past value exists.

Arithmetic is strict IEEE everywhere: with reassociation or contraction the last bits would
depend on whether a process compiled a loop or loaded it, and so on the number of workers.
"""

import numpy as np
from numba import njit

# Decaying responses end in subnormal numbers, which processors handle a hundred times
# slower; anything this small is far below the rounding of the values it is added to.
_TINY = 1e-200
# Samples between two looks for such numbers.
_FLUSH = 64


@njit(cache=True)
def block_output(
    signal: np.ndarray,
    numerator: np.ndarray,
    denominator: np.ndarray,
    delay: int,
    states: np.ndarray,
    steady: bool,
) -> np.ndarray:
    """Run ``q^-delay B/F`` along a signal and add the response of ``C/F``.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)
        Monic.
    delay : int, [samples]
    states : ndarray, shape (n_state,) or (0,)
        Coefficients of C.
    steady : bool
        Start in equilibrium with the first value instead of empty.

    Returns
    -------
    ndarray, shape (n,)
    """
    n, nb = signal.size, numerator.size
    past, rest = 0.0, 0.0
    if steady:
        past = signal[0]
        below = denominator.sum()
        rest = past * (numerator.sum() / below if below != 0.0 else np.inf)
    # What does not depend on the result first: that loop runs on vectors.
    lead = min(n, nb - 1 + delay)
    passed = np.empty(n)
    for t in range(lead):
        passed[t] = 0.0
        for i in range(nb):
            s = t - delay - i
            passed[t] += numerator[i] * (signal[s] if s >= 0 else past)
    later = passed[lead:]
    for i in range(nb):
        b, source = numerator[i], signal[lead - delay - i : n - delay - i]
        if i == 0:
            for t in range(later.size):
                later[t] = b * source[t]
        else:
            for t in range(later.size):
                later[t] += b * source[t]
    for t in range(min(n, states.size)):
        passed[t] += states[t]
    return _all_pole(passed, denominator, rest)


@njit(cache=True)
def _all_pole(signal: np.ndarray, denominator: np.ndarray, rest: float) -> np.ndarray:
    """Run 1/F along a signal; before it the result was at rest."""
    n, nf = signal.size, denominator.size - 1
    taps = np.zeros(4 * max(1, (nf + 3) // 4))
    far = taps.size - 4
    for j in range(nf):
        taps[taps.size - 1 - j] = denominator[1 + j]
    f1, f2, f3, f4 = taps[far + 3], taps[far + 2], taps[far + 1], taps[far]
    out = np.empty(taps.size + n)
    for j in range(taps.size):
        out[j] = rest
    x1 = x2 = x3 = x4 = rest
    for t in range(n):
        value = signal[t]
        older = out[t : t + far]
        # The newest value comes last: all else is ready before it is.
        for j in range(0, far, 4):
            value -= taps[j] * older[j] + taps[j + 1] * older[j + 1]
            value -= taps[j + 2] * older[j + 2]
            value -= taps[j + 3] * older[j + 3]
        value -= f4 * x4 + f3 * x3
        value -= f2 * x2
        value -= f1 * x1
        out[taps.size + t] = value
        x4, x3, x2, x1 = x3, x2, x1, value
        if t % _FLUSH == 0:
            recent = out[t + 1 : t + 1 + taps.size]
            for j in range(recent.size):
                recent[j] = 0.0 if abs(recent[j]) < _TINY else recent[j]
            x4, x3, x2, x1 = (
                recent[far],
                recent[far + 1],
                recent[far + 2],
                recent[far + 3],
            )
    return out[taps.size :]


@njit(cache=True)
def residuals_and_loss(
    measured: np.ndarray, simulated: np.ndarray, counted: np.ndarray, threshold: float
) -> tuple[np.ndarray, float]:
    """Measured minus simulated, and the sum of the losses.

    Parameters
    ----------
    measured : ndarray, shape (n,)
    simulated : ndarray, shape (n_rows,)
        At the samples that count.
    counted : ndarray of int, shape (n_rows,)
    threshold : float
        In the unit of the residuals; infinite for the sum of squares.

    Returns
    -------
    residuals : ndarray, shape (n_rows,)
    total : float
        In that unit squared.

    References
    ----------
    docs/method.md, eq. (15a).
    """
    residuals = np.empty(counted.size)
    for r in range(counted.size):
        residuals[r] = measured[counted[r]] - simulated[r]
    total = 0.0
    if threshold == np.inf:
        for value in residuals:
            total += value * value
    else:
        for value in residuals:
            size = abs(value)
            inner = min(size, threshold)
            total += inner * (2.0 * size - inner)
    return residuals, total


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
