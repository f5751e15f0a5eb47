"""Compiled Kalman filter and Rauch-Tung-Striebel smoother of three states.

``x[n+1] = transition x[n] + w``, ``w`` moves the last state only, and
``y[n] = reading x[n] + v`` with ``v`` of variance 1. The gains do not depend on the
data, so that recordings of one sample time share them. docs/method_diagnosis.md.
"""

import numpy as np
from numba import njit

_N = 3
# Once the covariance changes by less than this share in a step, it is settled.
_SETTLED = 1e-12


@njit(cache=True, nogil=True, error_model="numpy")
def forward_gains(
    transition: np.ndarray,
    reading: np.ndarray,
    walk: float,
    first: np.ndarray,
    gains: np.ndarray,
    variances: np.ndarray,
    covariances: np.ndarray,
) -> int:
    """Fill in the gains of the filter until they are settled.

    Parameters
    ----------
    transition : ndarray, shape (3, 3)
    reading : ndarray, shape (3,)
    walk : float
        Variance by which the last state moves in a step.
    first : ndarray, shape (3,)
        Variances of the first state.
    gains : ndarray, shape (n_samples, 3)
        Filled in.
    variances : ndarray, shape (n_samples,)
        Filled in: of the prediction of each reading.
    covariances : ndarray, shape (n_samples, 3, 3)
        Filled in: after each reading.

    Returns
    -------
    int
        Number of samples filled in; from the last of them on nothing changes.
    """
    predicted = np.zeros((_N, _N))
    for a in range(_N):
        predicted[a, a] = first[a]
    keep = np.zeros((_N, _N))
    for n in range(gains.shape[0]):
        carried = predicted @ reading
        variance = reading @ carried + 1.0
        gain = carried / variance
        variances[n] = variance
        gains[n] = gain
        for a in range(_N):
            for b in range(_N):
                keep[a, b] = (1.0 if a == b else 0.0) - gain[a] * reading[b]
        # The form of Joseph: it stays symmetric and positive under rounding.
        after = keep @ predicted @ keep.T
        for a in range(_N):
            for b in range(_N):
                after[a, b] += gain[a] * gain[b]
        covariances[n] = after
        following = transition @ after @ transition.T
        following[_N - 1, _N - 1] += walk
        change = 0.0
        for a in range(_N):
            change = max(
                change, abs(following[a, a] - predicted[a, a]) / following[a, a]
            )
        predicted = following
        if change < _SETTLED:
            return n + 1
    return int(gains.shape[0])


@njit(cache=True, nogil=True, error_model="numpy")
def misfit(
    measured: np.ndarray,
    transition: np.ndarray,
    reading: np.ndarray,
    gains: np.ndarray,
    variances: np.ndarray,
    n_gains: int,
) -> float:
    """Minus twice the logarithm of the likelihood, without its constant.

    Parameters
    ----------
    measured : ndarray, shape (n_samples,)
    transition : ndarray, shape (3, 3)
    reading : ndarray, shape (3,)
    gains : ndarray, shape (n_samples, 3)
    variances : ndarray, shape (n_samples,)
    n_gains : int
        As ``forward_gains`` returns it.

    Returns
    -------
    float
    """
    position = speed = force = 0.0
    total = 0.0
    for n in range(measured.size):
        g = min(n, n_gains - 1)
        error = measured[n] - (
            reading[0] * position + reading[1] * speed + reading[2] * force
        )
        total += error * error / variances[g] + np.log(variances[g])
        position += gains[g, 0] * error
        speed += gains[g, 1] * error
        force += gains[g, 2] * error
        moved = (
            transition[0, 0] * position
            + transition[0, 1] * speed
            + transition[0, 2] * force
        )
        speed = (
            transition[1, 0] * position
            + transition[1, 1] * speed
            + transition[1, 2] * force
        )
        position = moved
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def backward_gains(
    transition: np.ndarray,
    walk: float,
    covariances: np.ndarray,
    n_gains: int,
    gains: np.ndarray,
) -> None:
    """Fill in the gains of the smoother.

    Parameters
    ----------
    transition : ndarray, shape (3, 3)
    walk : float
    covariances : ndarray, shape (n_samples, 3, 3)
        After each reading.
    n_gains : int
        As ``forward_gains`` returns it.
    gains : ndarray, shape (n_samples, 3, 3)
        Filled in up to ``n_gains``.
    """
    for n in range(n_gains):
        predicted = transition @ covariances[n] @ transition.T
        predicted[_N - 1, _N - 1] += walk
        gains[n] = np.linalg.solve(predicted, transition @ covariances[n]).T


@njit(cache=True, nogil=True, error_model="numpy")
def smoothed_variance(
    transition: np.ndarray,
    walk: float,
    covariances: np.ndarray,
    n_gains: int,
    gains: np.ndarray,
    variance: np.ndarray,
) -> None:
    """Fill in the variance of the last state, given all readings.

    Parameters
    ----------
    transition : ndarray, shape (3, 3)
    walk : float
    covariances : ndarray, shape (n_samples, 3, 3)
        After each reading.
    n_gains : int
        As ``forward_gains`` returns it.
    gains : ndarray, shape (n_samples, 3, 3)
        Of the smoother.
    variance : ndarray, shape (n_samples,)
        Filled in.
    """
    last = variance.size - 1
    known = covariances[min(last, n_gains - 1)].copy()
    variance[last] = known[_N - 1, _N - 1]
    for n in range(last - 1, -1, -1):
        g = min(n, n_gains - 1)
        predicted = transition @ covariances[g] @ transition.T
        predicted[_N - 1, _N - 1] += walk
        gain = gains[g]
        known = covariances[g] + gain @ (known - predicted) @ gain.T
        variance[n] = known[_N - 1, _N - 1]


@njit(cache=True, nogil=True, error_model="numpy")
def smooth(
    measured: np.ndarray,
    transition: np.ndarray,
    reading: np.ndarray,
    gains: np.ndarray,
    n_gains: int,
    back: np.ndarray,
) -> np.ndarray:
    """States given all readings.

    Parameters
    ----------
    measured : ndarray, shape (n_samples,)
    transition : ndarray, shape (3, 3)
    reading : ndarray, shape (3,)
    gains : ndarray, shape (n_samples, 3)
        Of the filter.
    n_gains : int
        As ``forward_gains`` returns it.
    back : ndarray, shape (n_samples, 3, 3)
        Gains of the smoother.

    Returns
    -------
    ndarray, shape (n_samples, 3)
    """
    size = measured.size
    states = np.zeros((size, _N))
    predicted = np.zeros((size + 1, _N))
    for n in range(size):
        g = min(n, n_gains - 1)
        error = measured[n]
        for a in range(_N):
            error -= reading[a] * predicted[n, a]
        for a in range(_N):
            states[n, a] = predicted[n, a] + gains[g, a] * error
        for a in range(_N):
            for b in range(_N):
                predicted[n + 1, a] += transition[a, b] * states[n, b]
    change = np.zeros(_N)
    for n in range(size - 2, -1, -1):
        g = min(n, n_gains - 1)
        for a in range(_N):
            change[a] = states[n + 1, a] - predicted[n + 1, a]
        for a in range(_N):
            for b in range(_N):
                states[n, a] += back[g, a, b] * change[b]
    return states
