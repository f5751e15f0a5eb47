"""Compiled arithmetic on normal equations; nothing else compiles here."""

import numpy as np
from numba import njit


@njit(cache=True)
def scaled_equations(
    matrix: np.ndarray, vector: np.ndarray, least: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equations of parameters that all matter alike.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
    vector : ndarray, shape (n,)
    least : float, [-]
        Diagonal elements below this share of the largest count as much as that; where
        all are zero they stay so.

    Returns
    -------
    matrix : ndarray, shape (n, n)
        With a diagonal of ones; not finite where the given one is not.
    vector : ndarray, shape (n,)
    scale : ndarray, shape (n,)
        The parameters are this times those of the scaled equations.
    """
    n = vector.size
    largest = 0.0
    for i in range(n):
        largest = max(largest, matrix[i, i])
    # A dead zone may swallow its whole signal: then no parameter moves the output.
    lowest = least * largest if largest > 0.0 else 1.0
    scale = np.empty(n)
    for i in range(n):
        scale[i] = 1.0 / np.sqrt(max(matrix[i, i], lowest))
    scaled, right = np.empty((n, n)), np.empty(n)
    for i in range(n):
        right[i] = vector[i] * scale[i]
        for k in range(n):
            scaled[i, k] = matrix[i, k] * scale[i] * scale[k]
    return scaled, right, scale


@njit(cache=True)
def combined(total: np.ndarray, change: np.ndarray, first: int) -> np.ndarray:
    """Products of columns after some of them are replaced by combinations of them.

    Parameters
    ----------
    total : ndarray, shape (n, n)
        Symmetric.
    change : ndarray, shape (n_new, n_old)
        Combinations, nearly all zeros.
    first : int
        First of the columns that are replaced.

    Returns
    -------
    ndarray, shape (n - n_old + n_new, n - n_old + n_new)
    """
    n, (new, old) = total.shape[0], change.shape
    rows = np.zeros((n - old + new, n))
    rows[:first] = total[:first]
    rows[first + new :] = total[first + old :]
    for i in range(new):
        for j in range(old):
            share = change[i, j]
            if share != 0.0:
                for k in range(n):
                    rows[first + i, k] += share * total[first + j, k]
    result = np.zeros((n - old + new, n - old + new))
    result[:, :first] = rows[:, :first]
    result[:, first + new :] = rows[:, first + old :]
    for i in range(new):
        for j in range(old):
            share = change[i, j]
            if share != 0.0:
                for r in range(result.shape[0]):
                    result[r, first + i] += share * rows[r, first + j]
    return result
