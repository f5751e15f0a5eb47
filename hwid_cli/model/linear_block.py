"""The linear block ``x = q^-nk B(q)/F(q) w`` with its initial state.

Before the first sample w and x are taken as constant: zero, or (``steady``) the
equilibrium that belongs to the first value of w. An estimated initial state adds the
response of ``C(q)/F(q)`` to a unit pulse at the first sample.

References
----------
docs/method.md, eqs. (1), (5)-(7).

Compiled inner loops of the Hammerstein-Wiener model; nothing else compiles here.

Signals that a filter reads carry ``pad`` rows in front that hold their values before
the first sample, so that no loop asks whether a past value exists.

Arithmetic is strict IEEE everywhere: with reassociation or contraction the last bits would
depend on whether a process compiled a loop or loaded it, and so on the number of workers.
"""

from functools import lru_cache

import numpy as np
import scipy

from hwid_cli.compiled import MAKING, compiled

# Decaying responses end in subnormal numbers, which processors handle a hundred times
# slower; anything this small is far below the rounding of the values it is added to.
_TINY = 1e-200
# Samples between two looks for such numbers.
_FLUSH = 64


@compiled()
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
        # A block that integrates has no other equilibrium than that of zero.
        if past != 0.0:
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


@compiled(**MAKING)
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


@compiled()
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


@compiled()
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


@compiled()
def _push(value: float, differences: np.ndarray, before: np.ndarray) -> None:
    """Advance the differences of all orders by one sample."""
    current = value
    for j in range(differences.size):
        differences[j] = current
        current = current - before[j]
        before[j] = differences[j]


@compiled()
def is_schur_stable(denominator: np.ndarray) -> bool:
    """Tell whether every root of a monic polynomial lies inside the unit circle.

    Schur-Cohn recursion on the reflection coefficients; no roots are computed.

    Parameters
    ----------
    denominator : ndarray, shape (n + 1,)
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


_NO_STATES = np.zeros(0)


def filtered(
    signal: np.ndarray,
    numerator: np.ndarray,
    denominator: np.ndarray,
    delay: int,
    *,
    steady: bool = False,
) -> np.ndarray:
    """Output of the linear block for one recording.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)
        Monic.
    delay : int, [samples]
    steady : bool
        Start in equilibrium with the first value instead of empty.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> filtered(np.ones(4), np.array([0.5]), np.array([1.0, -0.5]), 1)
    array([0.   , 0.5  , 0.75 , 0.875])
    """
    return block_output(
        as_loops_take_it(signal),
        as_loops_take_it(numerator),
        as_loops_take_it(denominator),
        delay,
        _NO_STATES,
        steady,
    )


def free_response(
    coefficients: np.ndarray, denominator: np.ndarray, n_samples: int
) -> np.ndarray:
    """Response of ``C(q)/F(q)`` to a unit pulse at the first sample.

    Parameters
    ----------
    coefficients : ndarray, shape (n_state,)
        C; empty for no initial state.
    denominator : ndarray, shape (nf + 1,)
    n_samples : int, [samples]

    Returns
    -------
    ndarray, shape (n_samples,)
    """
    if coefficients.size == 0:
        return np.zeros(n_samples)
    pulse = np.zeros(n_samples)
    pulse[0] = 1.0
    return filtered(pulse, coefficients, denominator, 0)


def static_gain(numerator: np.ndarray, denominator: np.ndarray) -> float:
    """Gain at zero frequency; infinite for a block with a pole at 1.

    Parameters
    ----------
    numerator : ndarray, shape (nb,)
    denominator : ndarray, shape (nf + 1,)

    Returns
    -------
    float, [-]
    """
    # Term by term, as the compiled recursion does: numpy adds long arrays in blocks.
    below = sum(denominator.tolist())
    return sum(numerator.tolist()) / below if below != 0.0 else float("inf")


def poles(denominator: np.ndarray) -> np.ndarray:
    """Poles of the block.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)

    Returns
    -------
    ndarray of complex, shape (nf,)
        Sorted by magnitude, largest first, then by angle.
    """
    found = np.roots(denominator).astype(complex)
    return found[np.lexsort((np.angle(found), -np.abs(found)))]


def is_stable(denominator: np.ndarray, largest_radius: float = 1.0) -> bool:
    """Tell whether every pole lies inside the unit circle, or a smaller one.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)
    largest_radius : float, [-]

    Examples
    --------
    >>> is_stable(np.array([1.0, -0.9])), is_stable(np.array([1.0, -0.9]), 0.8)
    (True, False)
    """
    if largest_radius != 1.0:
        denominator = denominator / largest_radius ** np.arange(denominator.size)
    denominator = np.ascontiguousarray(denominator)
    return bool(is_schur_stable(as_loops_take_it(denominator)))


def reflected(denominator: np.ndarray, largest_radius: float) -> np.ndarray:
    """Stable polynomial: poles outside are mirrored, those too far out drawn in.

    Parameters
    ----------
    denominator : ndarray, shape (nf + 1,)
    largest_radius : float, [-]
        No pole of the result lies further out.

    Returns
    -------
    ndarray, shape (nf + 1,)
    """
    found = np.roots(denominator)
    radius = np.abs(found)
    outside = radius > 1.0
    found[outside] = found[outside] / radius[outside] ** 2
    radius = np.abs(found)
    far = radius > largest_radius
    found[far] *= largest_radius / radius[far]
    return np.concatenate([[1.0], np.real(np.poly(found))[1:]])


@lru_cache(maxsize=64)
def difference_basis(count: int) -> np.ndarray:
    """Matrix from coefficients of ``(1 - q^-1)^j`` to coefficients of ``q^-i``.

    Neighbouring delays of a smooth signal are nearly equal, their differences are not:
    in this basis the normal equations of a fast-sampled drive stay well conditioned.
    The matrix is its own inverse.

    Returns
    -------
    ndarray, shape (count, count)

    Examples
    --------
    >>> difference_basis(3) @ difference_basis(3)
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    i, j = np.indices((count, count))
    matrix = scipy.special.binom(j, i) * (-1.0) ** i
    matrix.flags.writeable = False
    return matrix


def as_loops_take_it(array: np.ndarray) -> np.ndarray:
    """Array itself, or a copy of a read-only one.

    A compiled loop is compiled again, which takes seconds, for arguments that may not be
    written, although it does not write them.

    Parameters
    ----------
    array : ndarray, any shape
    """
    return array if array.flags.writeable else array.copy()


def padded_signal(signal: np.ndarray, pad: int, past: float) -> np.ndarray:
    """Signal with its constant past in front.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    pad : int, [samples]
    past : float
        Value before the first sample.

    Returns
    -------
    ndarray, shape (pad + n,)
    """
    padded = np.empty(pad + signal.size)
    padded[:pad] = past
    padded[pad:] = signal
    return padded
