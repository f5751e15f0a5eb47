"""Compiled output: one term for each effect of the sensor.

docs/method_diagnosis.md, eq. (D14), (D14a).
"""

import numpy as np

from hwid_cli.compiled import INNER, MAKING, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.interpreter import formula_value
from hwid_cli.drive.motion.push import TURN, faded

# Play is at its end within this share of it, for rounding.
TOUCHING = 1e-9


@compiled(nogil=True, error_model="numpy")
def read(
    positions: np.ndarray,
    velocities: np.ndarray,
    command: np.ndarray,
    sample_time: float,
    p: np.ndarray,
) -> np.ndarray:
    """Return what the sensor reads at every sample.

    Parameters
    ----------
    positions, velocities : ndarray, shape (n,), [m], [m/s]
    command : ndarray, shape (n,), [A] or [V]
    sample_time : float, [s]
    p : ndarray, shape (N_SLOTS,)
    """
    output = positions.copy()
    if p[slots.OUTPUT_GAP] > 0.0:
        output = _play(positions, velocities, sample_time, p)
    for i in range(output.size):
        lag = positions[i] - output[i]
        time = sample_time * i
        output[i] = sensed(output[i], lag, velocities[i], command[i], time, p)
    if p[slots.SENSOR_LAG] > 0.0:
        speed = 0.0 if p[slots.OUTPUT_IS_VELOCITY] > 0.0 else velocities[0]
        _let_lag(output, speed, sample_time, p)
    return output


@compiled(**INNER)
def lagged(
    late: float,
    pace: float,
    before: float,
    now: float,
    sample_time: float,
    p: np.ndarray,
) -> tuple[float, float]:
    """Return what a sensor that lags reads one sample on, and how fast that changes.

    Parameters
    ----------
    late, pace : float, [m] or [m/s]
        Reading at the sample before, and its rate times the time constant.
    before, now : float, [same]
        What it follows at both samples; a straight line between them.
    sample_time : float, [s]
    p : ndarray, shape (N_SLOTS,)
    """
    ratio = p[slots.SENSOR_LAG_DAMPING_RATIO]
    held, added = faded(sample_time / p[slots.SENSOR_LAG], ratio)
    # A line is followed at a distance; what is off it dies away.
    even = (now - before) * p[slots.SENSOR_LAG] / sample_time
    off = late - before + _behind(even, p)
    turning = pace - even if ratio > 0.0 else 0.0
    after = now - _behind(even, p) + off * held + turning * added
    return after, even - off * added + turning * (held - 2.0 * ratio * added)


@compiled(**INNER)
def first_late(now: float, speed: float, p: np.ndarray) -> tuple[float, float]:
    """Return the same at the first sample, before which the motion went on at one speed.

    Parameters
    ----------
    now, speed : float, [m], [m/s]; or [m/s] and 0
        What is followed, and how fast it changes.
    p : ndarray, shape (N_SLOTS,)
    """
    even = speed * p[slots.SENSOR_LAG]
    return now - _behind(even, p), even


@compiled(**INNER)
def _behind(even: float, p: np.ndarray) -> float:
    """Return how far a lag is behind a line that rises by this in a time constant."""
    ratio = p[slots.SENSOR_LAG_DAMPING_RATIO]
    return 2.0 * ratio * even if ratio > 0.0 else even


@compiled(**INNER)
def _let_lag(
    output: np.ndarray, speed: float, sample_time: float, p: np.ndarray
) -> None:
    """Let readings lag in place."""
    before = output[0]
    output[0], pace = first_late(before, speed, p)
    for i in range(1, output.size):
        now = output[i]
        output[i], pace = lagged(output[i - 1], pace, before, now, sample_time, p)
        before = now


@compiled(nogil=True, error_model="numpy")
def on_other_clock(
    positions: np.ndarray, velocities: np.ndarray, step: float, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion at other times, on the cubics through positions and velocities.

    Parameters
    ----------
    positions, velocities : ndarray, shape (m,), [sample], [sample/sample]
        Velocities are per sample; the last time must not be beyond the last sample.
    step : float, [samples]
        From one time to the next; the first one is 0.
    n : int
        Number of times.

    Returns
    -------
    positions : ndarray, shape (n,)
    velocities : ndarray, shape (n,), [1/sample]
    """
    places, speeds = np.empty(n), np.empty(n)
    for i in range(n):
        at = min(int(i * step), positions.size - 2)
        t = i * step - at
        x0, v0 = positions[at], velocities[at]
        v1 = velocities[at + 1]
        rise = positions[at + 1] - x0
        # x0 + v0 t + a t^2 + b t^3
        a, b = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
        places[i] = x0 + t * (v0 + t * (a + t * b))
        speeds[i] = v0 + t * (2.0 * a + 3.0 * t * b)
    return places, speeds


@compiled(**INNER)
def sensed(
    y: float, lag: float, speed: float, command: float, time: float, p: np.ndarray
) -> float:
    """Return what the sensor makes of the place that it measures.

    Parameters
    ----------
    y : float, [m]
    lag : float, [m]
        By which the drive is ahead of that place, which follows it with play.
    speed : float, [m/s]
        Of the drive.
    command : float, [A] or [V]
    time : float, [s]
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.OUTPUT_ZERO] != 0.0:
        y -= p[slots.OUTPUT_ZERO]
    is_velocity = p[slots.OUTPUT_IS_VELOCITY] > 0.0
    if is_velocity and p[slots.OUTPUT_GAP] > 0.0:
        is_pushed = abs(lag) >= (1.0 - TOUCHING) * p[slots.OUTPUT_GAP]
        speed = speed if is_pushed and lag * speed > 0.0 else 0.0
    if p[slots.ECCENTRICITY] != 0.0:
        phase, size = p[slots.ECCENTRIC_PHASE], p[slots.ECCENTRICITY]
        turn = TURN / p[slots.ECCENTRIC_PERIOD]
        speed *= 1.0 + size * turn * np.cos(turn * y + phase)
        y += size * (np.sin(turn * y + phase) - np.sin(phase))
    if p[slots.OWN_OUTPUT] != 0.0:
        own = formula_value(
            p[slots.OWN_OUTPUT], y, speed, command, time, np.sign(speed), p
        )
        y, speed = own, own
    if is_velocity:
        y = speed
    if p[slots.SENSOR_QUADRATIC] != 0.0 or p[slots.SENSOR_CUBIC] != 0.0:
        share = y / p[slots.REFERENCE_DISPLACEMENT]
        y *= 1.0 + (p[slots.SENSOR_QUADRATIC] + p[slots.SENSOR_CUBIC] * share) * share
    if p[slots.SENSOR_DRIFT] != 0.0:
        y += p[slots.SENSOR_DRIFT] * time
    if p[slots.HUM_AMPLITUDE] != 0.0:
        angle = TURN * p[slots.HUM_FREQUENCY] * time + p[slots.HUM_PHASE]
        y += p[slots.HUM_AMPLITUDE] * np.sin(angle)
    limit = p[slots.OUTPUT_LIMIT]
    if limit < np.inf:
        y = min(max(y, -limit), limit)
    return y


@compiled(**MAKING)
def _play(
    positions: np.ndarray,
    velocities: np.ndarray,
    sample_time: float,
    p: np.ndarray,
) -> np.ndarray:
    """Return what follows the position with play.

    A turning point between two samples pushes further than both of them: it is found on
    the cubic through positions and velocities.
    """
    followed, half_gap = np.empty(positions.size), p[slots.OUTPUT_GAP]
    y = positions[0] + p[slots.OUTPUT_START] * half_gap
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


@compiled(**INNER)
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
