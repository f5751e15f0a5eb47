"""Compiled output: one term for each effect of the sensor.

docs/method_diagnosis.md, eq. (D14).
"""

import numpy as np
from numba import njit

from hwid_cli.drive import slots
from hwid_cli.drive.compiled import INNER, MAKING


@njit(cache=True, nogil=True, error_model="numpy")
def read(
    positions: np.ndarray, velocities: np.ndarray, sample_time: float, p: np.ndarray
) -> np.ndarray:
    """Return what the sensor reads at every sample.

    Parameters
    ----------
    positions, velocities : ndarray, shape (n,), [m], [m/s]
    sample_time : float, [s]
    p : ndarray, shape (N_SLOTS,)
    """
    output = positions.copy()
    if p[slots.OUTPUT_GAP] > 0.0:
        output = _play(positions, velocities, sample_time, p[slots.OUTPUT_GAP])
    for i in range(output.size):
        output[i] = sensed(output[i], sample_time * i, p)
    return output


@njit(**INNER)
def sensed(y: float, time: float, p: np.ndarray) -> float:
    """Return what the sensor makes of the place that it measures.

    Parameters
    ----------
    y : float, [m]
    time : float, [s]
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.OUTPUT_ZERO] != 0.0:
        y -= p[slots.OUTPUT_ZERO]
    if p[slots.SENSOR_QUADRATIC] != 0.0 or p[slots.SENSOR_CUBIC] != 0.0:
        share = y / p[slots.REFERENCE_DISPLACEMENT]
        y *= 1.0 + (p[slots.SENSOR_QUADRATIC] + p[slots.SENSOR_CUBIC] * share) * share
    if p[slots.SENSOR_DRIFT] != 0.0:
        y += p[slots.SENSOR_DRIFT] * time
    return y


@njit(**MAKING)
def _play(
    positions: np.ndarray,
    velocities: np.ndarray,
    sample_time: float,
    half_gap: float,
) -> np.ndarray:
    """Return what follows the position with play.

    A turning point between two samples pushes further than both of them: it is found on
    the cubic through positions and velocities.
    """
    followed = np.empty(positions.size)
    y = positions[0]
    followed[0] = y
    for i in range(1, positions.size):
        x0, x1 = positions[i - 1], positions[i]
        v0, v1 = sample_time * velocities[i - 1], sample_time * velocities[i]
        if v0 * v1 < 0.0:
            extreme = _extreme(x0, v0, x1, v1)
            y = min(max(y, extreme - half_gap), extreme + half_gap)
        y = min(max(y, x1 - half_gap), x1 + half_gap)
        followed[i] = y
    return followed


@njit(**INNER)
def _extreme(x0: float, v0: float, x1: float, v1: float) -> float:
    """Return the turning point of the cubic with these ends and slopes."""
    # Slope of the cubic: a t^2 + b t + v0 for t from 0 to 1.
    a = 3.0 * (2.0 * (x0 - x1) + v0 + v1)
    b = 2.0 * (3.0 * (x1 - x0) - 2.0 * v0 - v1)
    root = np.sqrt(max(b * b - 4.0 * a * v0, 0.0))
    # The slope changes its sign once: the root between 0 and 1, free of cancellation.
    half = -0.5 * (b + (root if b >= 0.0 else -root))
    t = v0 / half if half != 0.0 else 0.5
    if not 0.0 <= t <= 1.0:
        t = half / a if a != 0.0 else 0.5
    t = min(max(t, 0.0), 1.0)
    return x0 + t * (v0 + t * (0.5 * b + t * a / 3.0))
