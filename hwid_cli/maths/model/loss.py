"""How much a residual counts: squared, or beyond a threshold in proportion only.

Huber's loss is the square of a residual e up to a threshold h and ``2 h abs(e) - h^2``
beyond it, so that a gross error pulls no harder than one at the threshold. Its gradient
is that of a sum of squares in which every residual has the weight ``min(1, h / abs(e))``.

References
----------
Huber (1964), p. 79; Holland, Welsch (1977). docs/method.md, eqs. (15a)-(15b).
"""

import numpy as np


def root_weights(residual: np.ndarray, threshold: float) -> np.ndarray:
    """Square roots of the weights with which residuals enter the normal equations.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    threshold : float
        Positive and finite.

    Returns
    -------
    ndarray, shape (n,), [-]
        One up to the threshold, less beyond it.

    References
    ----------
    docs/method.md, eq. (15b).

    Examples
    --------
    >>> root_weights(np.array([1.0, -8.0]), 2.0)
    array([1. , 0.5])
    """
    return np.sqrt(threshold / np.maximum(np.abs(residual), threshold))
