"""Compiled bounds of where a drive may be within a step, between its two ends.

Inner masses swing fast and move the load little. A step that is long beside their swing is
safe where the load is farther from everything that could happen than that moves it.
docs/method_diagnosis.md, eq. (D2b).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.corners import has_teeth
from hwid_cli.drive.motion.events import ON_EDGE, slowest_straight
from hwid_cli.drive.motion.forces import acceleration, moved_mass
from hwid_cli.drive.motion.state import MOTOR_V, PART_V, WAY, V, X

# Where events are watched, a step turns nothing by more than this, [rad]: a longer one
# could go there and back.
LONGEST_PHASE = 0.5
# Inner masses may swing so much farther within a step than at its ends.
RESERVE = 2.0


@compiled(**INNER)
def bounds(x: float, p: np.ndarray) -> tuple[float, float]:
    """Return between which edges of gaps and stops a position is.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    low, high = -np.inf, np.inf
    for n in range(5):
        edge = np.inf
        if n < 2 and p[slots.SPRING_GAP] > 0.0:
            edge = p[slots.SPRING_GAP]
        if 2 <= n < 4 and p[slots.STOP_STIFFNESS] > 0.0:
            edge = p[slots.STOP_POSITION]
        if n == 4 and p[slots.SIDE_STIFFNESS] > 0.0:
            edge = p[slots.SIDE_POSITION]
        if edge == np.inf:
            continue
        if n % 2 == 1:
            edge = -edge
        # On the edge itself the drive is not beyond it.
        if x > edge or (x == edge and edge < 0.0):
            low = max(low, edge)
        else:
            high = min(high, edge)
    if p[slots.SECOND_STIFFNESS] > 0.0:
        edge = p[slots.SECOND_POSITION]
        if x > edge or (x == edge and edge < 0.0):
            low = max(low, edge)
        else:
            high = min(high, edge)
    if p[slots.HAS_ZERO_EDGE] != 0.0:
        # At 0 itself the drive is on neither side.
        if x > 0.0:
            low = max(low, ON_EDGE)
        elif x < 0.0:
            high = min(high, -ON_EDGE)
    return low, high


@compiled(**INNER)
def is_slow(
    length: float,
    corner: tuple[int, float, float, float, float, float],
    p: np.ndarray,
) -> bool:
    """Return whether a step is short for all but inner masses, which the load hardly feels.

    Parameters
    ----------
    length : float, [s]
    corner : tuple
        From ``corner_of``.
    p : ndarray, shape (N_SLOTS,)
    """
    if has_teeth(p) or p[slots.CLIP_LIMIT] < np.inf or p[slots.DRIVE_SHARE] > 0.0:
        return False
    mass = p[slots.MASS]
    damping = p[slots.DAMPING]
    if p[slots.RESISTANCE] > 0.0:
        damping += p[slots.FORCE_CONSTANT] * p[slots.BACK_EMF] / p[slots.RESISTANCE]
    return length * (np.sqrt(corner[1] / mass) + damping / mass) <= LONGEST_PHASE


@compiled(**INNER)
def _swing(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> float:
    """Return by how much inner masses change the load's velocity at most, [m/s]."""
    a, motor, part, _ = acceleration(state, memory, push, done, p)
    mass, swing = moved_mass(p), 0.0
    if p[slots.GEAR_STIFFNESS] > 0.0:
        share = p[slots.MOTOR_SHARE]
        rate = p[slots.GEAR_STIFFNESS] / (share * mass)
        speed = state[MOTOR_V] - state[V]
        # Of a swing, speed and what is left of the way to its middle.
        swing += share * np.sqrt(speed * speed + (motor - a) * (motor - a) / rate)
    if p[slots.MODE_MASS] > 0.0:
        share = p[slots.MODE_MASS] / (p[slots.MODE_MASS] + mass)
        rate = p[slots.MODE_STIFFNESS] / (p[slots.MODE_MASS] * (1.0 - share))
        speed = state[PART_V] - state[V]
        swing += share * np.sqrt(speed * speed + (part - a) * (part - a) / rate)
    return swing


@compiled(**INNER)
def stays_between(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    is_watched: bool,
    p: np.ndarray,
) -> bool:
    """Return whether nothing can have happened within a long step.

    Parameters
    ----------
    state, trial : ndarray, shape (N_STATE,)
        At both ends of the step.
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    is_watched : bool
        Whether the drive must not turn back.
    p : ndarray, shape (N_SLOTS,)
    """
    swing = _swing(state, memory, push, done, p)
    swing = RESERVE * max(swing, _swing(trial, memory, push, done + h, p))
    if is_watched:
        slow = slowest_straight(p)
        way = memory[WAY]
        if min(way * state[V], way * trial[V]) - swing <= slow:
            return False
    low, high = bounds(state[X], p)
    reach = h * (max(abs(state[V]), abs(trial[V])) + swing)
    return (
        min(state[X], trial[X]) - reach > low and max(state[X], trial[X]) + reach < high
    )
