"""Compiled controllers: they set the command from what they read at a sample.

docs/method_diagnosis.md, eq. (D1a), (D1b).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.output import first_late, lagged

# Places in what a controller keeps: sum of the error over time, error at the last sample,
# whether there was one, and motion, readings and their rates of a sensor that lags.
(
    ERROR_SUM, LAST_ERROR, HAS_ERROR, LAST_X, LAST_V, LATE_X, LATE_V, PACE_X, PACE_V,
    N_CONTROL,
) = range(10)  # fmt: skip


@compiled(**INNER)
def is_closed(p: np.ndarray) -> bool:
    """Return whether a controller sets the command.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.VELOCITY_GAIN] > 0.0 or p[slots.PROPORTIONAL_GAIN] > 0.0


@compiled(**INNER)
def controlled(
    reference: float,
    x: float,
    v: float,
    sample_time: float,
    control: np.ndarray,
    p: np.ndarray,
) -> float:
    """Return the command until the next sample.

    Parameters
    ----------
    reference : float, [m] or [m/s]
    x, v : float, [m], [m/s]
        Of the place that is measured.
    sample_time : float, [s]
    control : ndarray, shape (N_CONTROL,)
        Changed in place.
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.SENSOR_LAG] > 0.0:
        x, v = _late(x, v, sample_time, control, p)
    error, gain = reference - x, p[slots.PROPORTIONAL_GAIN]
    reset = p[slots.INTEGRAL_GAIN]
    if p[slots.VELOCITY_GAIN] > 0.0:
        error, gain = p[slots.POSITION_GAIN] * error - v, p[slots.VELOCITY_GAIN]
        reset = gain * p[slots.RESET_RATE]
    elif p[slots.OUTPUT_IS_VELOCITY] > 0.0:
        error = reference - v
    total = control[ERROR_SUM] + sample_time * error
    wanted = gain * error + reset * total + p[slots.START_COMMAND]
    if p[slots.DERIVATIVE_GAIN] != 0.0 and control[HAS_ERROR] > 0.0:
        rate = (error - control[LAST_ERROR]) / sample_time
        wanted += p[slots.DERIVATIVE_GAIN] * rate
    control[LAST_ERROR], control[HAS_ERROR] = error, 1.0
    limit = p[slots.COMMAND_LIMIT]
    given = min(max(wanted, -limit), limit)
    # Beyond the limit the sum only goes back: it would wind up.
    if (wanted - given) * error <= 0.0:
        control[ERROR_SUM] = total
    return given


@compiled(**INNER)
def _late(
    x: float, v: float, sample_time: float, control: np.ndarray, p: np.ndarray
) -> tuple[float, float]:
    """Return position and velocity as a sensor that lags reads them."""
    late_x, pace_x = first_late(x, v, p)
    late_v, pace_v = first_late(v, 0.0, p)
    if control[HAS_ERROR] > 0.0:
        late_x, pace_x = lagged(
            control[LATE_X], control[PACE_X], control[LAST_X], x, sample_time, p
        )
        late_v, pace_v = lagged(
            control[LATE_V], control[PACE_V], control[LAST_V], v, sample_time, p
        )
    control[LAST_X], control[LAST_V] = x, v
    control[LATE_X], control[LATE_V] = late_x, late_v
    control[PACE_X], control[PACE_V] = pace_x, pace_v
    return late_x, late_v
