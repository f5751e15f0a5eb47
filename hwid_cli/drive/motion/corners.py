"""Compiled corners of the forces: edges of stops, gaps, teeth and limits.

docs/method_diagnosis.md, eq. (D2), (D7), (D10), (D11).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.forces import bite, drawn_current, wanted_current
from hwid_cli.drive.motion.push import depends_on_motion
from hwid_cli.drive.motion.state import MOTOR_V, MOTOR_X, V, X


@compiled(**INNER)
def has_teeth(p: np.ndarray) -> bool:
    """Return whether motor and load can let go of each other.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.GEAR_STIFFNESS] > 0.0 and p[slots.IS_COUPLED] <= 0.0


@compiled(**INNER)
def count_edges(p: np.ndarray) -> int:
    """Return how many effects have corners in their force.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    count = 0
    for slot in (slots.STOP_STIFFNESS, slots.SIDE_STIFFNESS, slots.SPRING_GAP):
        count += p[slot] > 0.0
    for slot in (slots.SECOND_STIFFNESS, slots.HAS_ZERO_EDGE, slots.DRIVE_SHARE):
        count += p[slot] > 0.0
    count += has_teeth(p)
    count += p[slots.CLIP_LIMIT] < np.inf
    return count


@compiled(**INNER)
def corner_of(
    state: np.ndarray, command: float, p: np.ndarray
) -> tuple[int, float, float, float, float, float]:
    """Return between which corners of the forces the drive is.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    command : float, [A] or [V]
        Read where the current depends on the motion.
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    tuple
        Number, stiffness and offset force of the springs, stiffness and offset force of
        the teeth, side on which the current is cut (0 for none).
    """
    x = state[X]
    code = 0
    stiffness, offset = p[slots.STIFFNESS], 0.0
    teeth, teeth_offset, clip = 0.0, 0.0, 0.0
    if p[slots.SPRING_GAP] > 0.0:
        side = _side(x, p[slots.SPRING_GAP])
        code = side
        if side == 1:
            stiffness = 0.0
        offset = (1 - side) * stiffness * p[slots.SPRING_GAP]
    if p[slots.STOP_STIFFNESS] > 0.0:
        side = _side(x, p[slots.STOP_POSITION])
        code = 3 * code + side
        if side != 1:
            stiffness += p[slots.STOP_STIFFNESS]
            offset += (1 - side) * p[slots.STOP_STIFFNESS] * p[slots.STOP_POSITION]
    if p[slots.SIDE_STIFFNESS] > 0.0:
        edge = p[slots.SIDE_POSITION]
        code *= 3
        if (x - edge) * edge > 0.0:
            code += 1
            stiffness += p[slots.SIDE_STIFFNESS]
            offset -= p[slots.SIDE_STIFFNESS] * edge
    if p[slots.HAS_FURTHER_EDGES] != 0.0:
        code = _further_corner(code, state, command, p)
        if (x - p[slots.SECOND_POSITION]) * p[slots.SECOND_POSITION] > 0.0:
            stiffness += p[slots.SECOND_STIFFNESS]
            offset -= p[slots.SECOND_STIFFNESS] * p[slots.SECOND_POSITION]
    if p[slots.IS_COUPLED] > 0.0:
        teeth = p[slots.GEAR_STIFFNESS]
    if has_teeth(p):
        force = bite(state[MOTOR_X] - x, state[MOTOR_V] - state[V], p)
        side = 1 + int(np.sign(force))
        code = 3 * code + side
        if side != 1:
            teeth = p[slots.GEAR_STIFFNESS]
            teeth_offset = (1 - side) * teeth * p[slots.GEAR_GAP]
    if p[slots.CLIP_LIMIT] < np.inf:
        speed = state[MOTOR_V] if p[slots.GEAR_STIFFNESS] > 0.0 else state[V]
        wanted = wanted_current(command, state, p) + p[slots.CLIP_SLOPE] * speed
        side = _side(wanted, p[slots.CLIP_LIMIT])
        code = 3 * code + side
        clip = side - 1.0
    return code, stiffness, offset, teeth, teeth_offset, clip


@compiled(**INNER)
def _further_corner(code: int, state: np.ndarray, command: float, p: np.ndarray) -> int:
    """Number that tells the sides of the edges that few drives have, too."""
    x = state[X]
    if p[slots.SECOND_STIFFNESS] > 0.0:
        edge = p[slots.SECOND_POSITION]
        code *= 3
        if (x - edge) * edge > 0.0:
            code += 1
    if p[slots.HAS_ZERO_EDGE] != 0.0:
        code = 3 * code + _side(x, 0.0)
    if p[slots.DRIVE_SHARE] > 0.0:
        code = 3 * code + _side(_pushing(state, command, p), 0.0)
    return code


@compiled(**INNER)
def margin(state: np.ndarray, command: float, corner: int, p: np.ndarray) -> float:
    """Return how far the drive is from the next corner of a force.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    command : float, [A] or [V]
    corner : int
        Number from ``corner_of``.
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    float
        Negative beyond it; in units of the distances that belong to the corners.
    """
    x, left = state[X], np.inf
    # The number was put together in the opposite order.
    if p[slots.CLIP_LIMIT] < np.inf:
        speed = state[MOTOR_V] if p[slots.GEAR_STIFFNESS] > 0.0 else state[V]
        wanted = wanted_current(command, state, p) + p[slots.CLIP_SLOPE] * speed
        left = _inside(wanted, p[slots.CLIP_LIMIT], corner % 3) / p[slots.CLIP_LIMIT]
        corner //= 3
    if has_teeth(p):
        left = min(left, _inside_teeth(state, corner % 3, p) / p[slots.GEAR_GAP])
        corner //= 3
    if p[slots.DRIVE_SHARE] > 0.0:
        left = min(left, _inside(_pushing(state, command, p), 0.0, corner % 3))
        corner //= 3
    if p[slots.HAS_ZERO_EDGE] != 0.0:
        left = min(left, _inside(x, 0.0, corner % 3))
        corner //= 3
    if p[slots.SECOND_STIFFNESS] > 0.0:
        edge = p[slots.SECOND_POSITION]
        into = (x - edge) * np.sign(edge)
        left = min(left, (into if corner % 3 == 1 else -into) / abs(edge))
        corner //= 3
    if p[slots.SIDE_STIFFNESS] > 0.0:
        edge = p[slots.SIDE_POSITION]
        into = (x - edge) * np.sign(edge)
        left = min(left, (into if corner % 3 == 1 else -into) / abs(edge))
        corner //= 3
    if p[slots.STOP_STIFFNESS] > 0.0:
        edge = p[slots.STOP_POSITION]
        left = min(left, _inside(x, edge, corner % 3) / edge)
        corner //= 3
    if p[slots.SPRING_GAP] > 0.0:
        gap = p[slots.SPRING_GAP]
        left = min(left, _inside(x, gap, corner) / gap)
    return left


@compiled(**INNER)
def _pushing(state: np.ndarray, command: float, p: np.ndarray) -> float:
    """Force of the motor, or the current that has its sign."""
    return drawn_current(command, state, p) if depends_on_motion(p) else command


@compiled(**INNER)
def _inside_teeth(state: np.ndarray, side: int, p: np.ndarray) -> float:
    """Teeth touch beyond the gap, as long as their damping does not pull."""
    twist = state[MOTOR_X] - state[X]
    # Way for which the spring makes up for the damping.
    ahead = p[slots.GEAR_DAMPING] / p[slots.GEAR_STIFFNESS]
    ahead *= state[MOTOR_V] - state[V]
    forward = min(twist, twist + ahead) - p[slots.GEAR_GAP]
    backward = min(-twist, -twist - ahead) - p[slots.GEAR_GAP]
    if side == 1:
        return -max(forward, backward)
    return forward if side == 2 else backward


@compiled(**INNER)
def _inside(x: float, edge: float, side: int) -> float:
    if side == 1:
        return edge - abs(x)
    return x - edge if side == 2 else -edge - x


@compiled(**INNER)
def _side(x: float, edge: float) -> int:
    if x > edge:
        return 2
    if x < -edge:
        return 0
    return 1
