"""Outliers of a recording: samples whose error stands out from those around it.

References
----------
docs/method.md, eqs. (34a), (34b).
"""

import numpy as np
import scipy

# Neighbours on each side that a sample is compared with: more than a burst is long,
# fewer than a transient lasts.
_REACH = 20
# Samples of the most similar movement that it is compared with too, since those of a fast
# transient are fewer than the neighbours; and over how many samples, up to itself, movement
# is measured.
_SIMILAR, _MOVING = 41, 3
# Robust standard deviations beyond which a sample stands out: of normal ones, 6 in ten
# million. A stepped sensor flickers by a step, and a response that comes a sample early
# or late is off by a share of its movement.
_STANDS_OUT, _STEPS, _SHIFT = 5.0, 2.0, 0.5
# Standard deviation of a normal variable over the median of its size.
_NORMAL = 1.4826


def find_outliers(output: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Find samples whose error stands out from all that it can be compared with.

    These are the errors before it, those after it, and those wherever the simulation moves
    as much: what a model leaves of a transient differs from the rest before it, but not
    from the transient's other samples, nor from other transients.

    Parameters
    ----------
    output : ndarray, shape (n_samples,), [output unit]
    simulated : ndarray, shape (n_samples,), [output unit]

    Returns
    -------
    ndarray of bool, shape (n_samples,)

    References
    ----------
    docs/method.md, eqs. (34a), (34b).
    """
    residual = output - simulated
    centre, spread = _sides(residual)
    movement = _movement(simulated)
    usual = np.maximum(
        usual_error(output, residual), _similar_error(residual, movement)
    )
    limit = _STANDS_OUT * np.maximum(spread, usual)
    least = np.maximum(_STEPS * _step(output), _SHIFT * movement)
    distance = np.abs(residual - centre)
    return np.all(distance > np.maximum(limit, least), axis=0)


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
    is_outlier = find_outliers(output, simulated)
    if not is_outlier.any():
        return output, 0
    centre, _ = _sides(residual)
    repaired = np.where(is_outlier, simulated + centre.mean(axis=0), output)
    return repaired, int(is_outlier.sum())


def tells_errors(output: np.ndarray) -> np.ndarray:
    """Which samples say how large errors are: those that do not repeat the one before.

    A sensor with steps repeats itself as long as a machine rests, and a model soon leaves
    nothing there.

    Parameters
    ----------
    output : ndarray, shape (n_samples,), [output unit]
        As it was measured.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
    """
    return np.diff(output, prepend=np.nan) != 0.0


def usual_error(output: np.ndarray, residual: np.ndarray) -> float:
    """Robust standard deviation of the residual where it tells errors.

    Parameters
    ----------
    output : ndarray, shape (n_samples,), [output unit]
        As it was measured.
    residual : ndarray, shape (n_samples,), [output unit]

    Returns
    -------
    float, [output unit]
    """
    deviation = np.abs(residual - np.median(residual))
    return _NORMAL * float(np.median(deviation[tells_errors(output)]))


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


def _movement(simulated: np.ndarray) -> np.ndarray:
    """Range of the last samples up to each one."""
    until_now = {"size": _MOVING, "origin": _MOVING // 2, "mode": "nearest"}
    highest = scipy.ndimage.maximum_filter1d(simulated, **until_now)
    return highest - scipy.ndimage.minimum_filter1d(simulated, **until_now)


def _similar_error(residual: np.ndarray, movement: np.ndarray) -> np.ndarray:
    """Robust standard deviation of the samples where the simulation moves alike."""
    order = np.argsort(movement, kind="stable")
    deviation = np.abs(residual - np.median(residual))[order]
    similar = np.empty(residual.size)
    similar[order] = scipy.ndimage.median_filter(deviation, _SIMILAR, mode="nearest")
    return _NORMAL * similar


def _step(output: np.ndarray) -> float:
    """Smallest change from sample to sample: the step of a sensor that has steps."""
    changes = np.abs(np.diff(output))
    return float(np.min(changes[changes > 0.0], initial=np.ptp(output)))
