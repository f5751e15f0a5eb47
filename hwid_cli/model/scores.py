"""How good a simulated output is: RMSD, fit percent, coverage."""

import math

import numpy as np


def rmsd(measured: np.ndarray, simulated: np.ndarray) -> float:
    """Root-mean-square deviation between two outputs.

    Parameters
    ----------
    measured : ndarray, shape (n_samples,), [output unit]
    simulated : ndarray, shape (n_samples,), [output unit]

    Returns
    -------
    float, [output unit]
        NaN where the simulated output is not finite.

    Raises
    ------
    ValueError
        If the shapes differ.

    References
    ----------
    docs/method.md, eq. (8).

    Examples
    --------
    >>> rmsd(np.array([1.0, 1.0]), np.array([0.0, 2.0]))
    1.0
    """
    difference = _difference(measured, simulated)
    # Factoring out the largest value keeps the squares of a diverging model finite.
    largest = float(np.max(np.abs(difference), initial=0.0))
    if not math.isfinite(largest):
        return float("nan")
    if largest == 0.0:
        return 0.0
    difference /= largest
    difference *= difference
    return largest * math.sqrt(difference.sum() / difference.size)


def fit_percent(measured: np.ndarray, simulated: np.ndarray) -> float:
    """Share of the output's variation that a simulation explains.

    Parameters
    ----------
    measured : ndarray, shape (n_samples,), [output unit]
    simulated : ndarray, shape (n_samples,), [output unit]

    Returns
    -------
    float, [%]
        100 for a perfect simulation, 0 for one no better than the mean, negative below;
        NaN where the simulated output is not finite or the measured one is constant.

    Raises
    ------
    ValueError
        If the shapes differ.

    References
    ----------
    docs/method.md, eq. (9).
    """
    variation = rmsd(measured, np.full(measured.shape, np.mean(measured)))
    if variation == 0.0:
        return float("nan")
    return 100.0 * (1.0 - rmsd(measured, simulated) / variation)


def coverage(deviations: np.ndarray, threshold: float) -> np.ndarray:
    """Count the recordings that each model covers.

    Parameters
    ----------
    deviations : ndarray, shape (..., n_recordings), [output unit]
        RMSD; NaN covers nothing.
    threshold : float, [output unit]
        A recording is covered when its RMSD lies strictly below.

    Returns
    -------
    ndarray of int, shape (...), [-]

    References
    ----------
    docs/method.md, eq. (10).
    """
    return np.sum(np.asarray(deviations) < threshold, axis=-1)


def _difference(measured: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    if np.shape(measured) != np.shape(simulated):
        raise ValueError(
            f"shapes differ: measured {np.shape(measured)}, "
            f"simulated {np.shape(simulated)}"
        )
    return np.asarray(simulated, dtype=float) - np.asarray(measured, dtype=float)
