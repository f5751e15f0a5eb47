"""Arithmetic on normal equations, compiled where it is by loops; the solution of them."""

import numpy as np
import scipy

from hwid_cli.compiled import compiled

# Initial states of fewer experiments are solved for together with all else.
_FEW = 3


def solved(
    matrix: np.ndarray, vector: np.ndarray, damping: float, states: tuple[slice, int]
) -> np.ndarray | None:
    """Solution of damped normal equations.

    Initial states of different experiments do not meet in any equation, so those of many
    are eliminated one experiment after the other, which takes time in proportion to their
    number instead of to its third power.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
    vector : ndarray, shape (n,)
    damping : float
        Added to the diagonal.
    states : tuple of slice and int
        Where the initial states stand, and how many each experiment has.

    Returns
    -------
    ndarray, shape (n,), or None
        None where rounding made the matrix indefinite.

    References
    ----------
    docs/method.md, eq. (14a).
    """
    damped = matrix.copy()
    damped.flat[:: vector.size + 1] += damping
    part, n_state = states
    if n_state == 0 or part.stop - part.start < _FEW * n_state:
        return _positive(damped, vector)
    count = (part.stop - part.start) // n_state
    shared = np.r_[0 : part.start, part.stop : vector.size]
    each = np.arange(count)
    blocks = damped[part, part].reshape(count, n_state, count, n_state)
    own = blocks[each, :, each, :]
    right = np.concatenate([damped[part][:, shared], vector[part, None]], axis=1)
    try:
        np.linalg.cholesky(own)
    except np.linalg.LinAlgError:
        return None
    ratio = np.linalg.solve(own, right.reshape(count, n_state, -1))
    ratio = ratio.reshape(count * n_state, -1)
    reduced = damped[np.ix_(shared, shared)] - right[:, :-1].T @ ratio[:, :-1]
    step = _positive(reduced, vector[shared] - right[:, :-1].T @ ratio[:, -1])
    if step is None:
        return None
    result = np.empty(vector.size)
    result[shared] = step
    result[part] = ratio[:, -1] - ratio[:, :-1] @ step
    return result if np.isfinite(result @ result) else None


def _positive(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray | None:
    """Solution with a positive definite matrix, which is overwritten; None without."""
    # The transpose of a symmetric matrix lies in memory as LAPACK takes it.
    _, step, info = scipy.linalg.lapack.dposv(matrix.T, vector, lower=1, overwrite_a=1)
    return step if info == 0 and np.isfinite(step @ step) else None


@compiled()
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


@compiled()
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
    # By loops: assignments of arrays bring a second of compiling with them.
    for r in range(n):
        if r < first or r >= first + old:
            at = r if r < first else r - old + new
            for k in range(n):
                rows[at, k] = total[r, k]
    for i in range(new):
        for j in range(old):
            share = change[i, j]
            if share != 0.0:
                for k in range(n):
                    rows[first + i, k] += share * total[first + j, k]
    result = np.zeros((n - old + new, n - old + new))
    for r in range(result.shape[0]):
        for k in range(first):
            result[r, k] = rows[r, k]
        for k in range(first + old, n):
            result[r, k - old + new] = rows[r, k]
    for i in range(new):
        for j in range(old):
            share = change[i, j]
            if share != 0.0:
                for r in range(result.shape[0]):
                    result[r, first + i] += share * rows[r, first + j]
    return result
