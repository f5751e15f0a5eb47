"""Outliers of a recording: samples whose error stands out from those around it.

References
----------
docs/method.md, eq. (34a).
"""

import numpy as np

# Neighbours on each side that a sample is compared with: more than a burst is long,
# fewer than a transient lasts.
_REACH = 20
# Robust standard deviations beyond which a sample stands out: of normal ones, 6 in ten
# million.
_STANDS_OUT = 5.0
# Standard deviation of a normal variable over the median of its size.
_NORMAL = 1.4826


def find_outliers(residual: np.ndarray) -> np.ndarray:
    """Find samples that stand out from those before and from those after them.

    What a model leaves of a transient differs from the rest before it, yet not from the
    transient's own samples: it is no outlier.

    Parameters
    ----------
    residual : ndarray, shape (n_samples,), [any]

    Returns
    -------
    ndarray of bool, shape (n_samples,)

    References
    ----------
    docs/method.md, eq. (34a).
    """
    centre, spread = _sides(residual)
    least = _NORMAL * np.median(np.abs(residual - np.median(residual)))
    distance = np.abs(residual - centre)
    return np.all(distance > _STANDS_OUT * np.maximum(spread, least), axis=0)


def replace_outliers(
    output: np.ndarray, simulated: np.ndarray
) -> tuple[np.ndarray, int]:
    """Output with what a model and its errors nearby expect in the place of outliers.

    Parameters
    ----------
    output : ndarray, shape (n_samples,), [output unit]
    simulated : ndarray, shape (n_samples,), [output unit]

    Returns
    -------
    repaired : ndarray, shape (n_samples,), [output unit]
        The output itself where nothing stands out or the simulation is not finite.
    n_outliers : int, [-]
    """
    residual = output - simulated
    if not np.isfinite(residual).all():
        return output, 0
    is_outlier = find_outliers(residual)
    if not is_outlier.any():
        return output, 0
    centre, _ = _sides(residual)
    repaired = np.where(is_outlier, simulated + centre.mean(axis=0), output)
    return repaired, int(is_outlier.sum())


def _sides(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Median and robust standard deviation of what is before and after each sample.

    Both of shape (2, n_samples). Beyond the ends the residual goes on mirrored.
    """
    padded = np.pad(residual, _REACH, mode="symmetric")
    windows = np.lib.stride_tricks.sliding_window_view(padded, _REACH)
    sides = np.stack([windows[: residual.size], windows[_REACH + 1 :]])
    centre = np.median(sides, axis=2)
    deviation = np.median(np.abs(sides - centre[..., np.newaxis]), axis=2)
    return centre, _NORMAL * deviation
