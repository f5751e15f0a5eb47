"""The linear block ``x = q^-nk B(q)/F(q) w`` with its initial state.

Before the first sample w and x are taken as constant: zero, or (``steady``) the
equilibrium that belongs to the first value of w. An estimated initial state adds the
response of ``C(q)/F(q)`` to a unit pulse at the first sample.

References
----------
docs/method.md, eqs. (1), (5)-(7).
"""

from functools import lru_cache

import numpy as np
from scipy.special import binom

from hwid_cli.maths.model.kernels import block_output, is_schur_stable

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

    Returns
    -------
    bool

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

    Parameters
    ----------
    count : int

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
    matrix = binom(j, i) * (-1.0) ** i
    matrix.flags.writeable = False
    return matrix


def as_loops_take_it(array: np.ndarray) -> np.ndarray:
    """Array itself, or a copy of a read-only one.

    A compiled loop is compiled again, which takes seconds, for arguments that may not be
    written, although it does not write them.

    Parameters
    ----------
    array : ndarray

    Returns
    -------
    ndarray
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
