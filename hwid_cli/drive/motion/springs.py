"""Compiled forces that go with the position: springs, stops, contacts, cogging, weight.

docs/method_diagnosis.md, eq. (D10).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.push import TURN
from hwid_cli.drive.motion.state import IN_SECOND, IN_SIDE, IN_STOP


@compiled(**INNER)
def spring_force(x: float, p: np.ndarray) -> float:
    """Return the force of everything that depends on position alone but a preload.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    free = beyond(x, p[slots.SPRING_GAP]) if p[slots.SPRING_GAP] > 0.0 else x
    force = p[slots.STIFFNESS] * free
    force += (p[slots.CUBIC] * x + p[slots.QUADRATIC]) * x * x
    if p[slots.STOP_STIFFNESS] > 0.0:
        into = beyond(x, p[slots.STOP_POSITION])
        force += p[slots.STOP_STIFFNESS] * bent(into, p[slots.STOP_BEND])
    if p[slots.SIDE_STIFFNESS] > 0.0:
        into = beyond_side(x, p[slots.SIDE_POSITION])
        force += p[slots.SIDE_STIFFNESS] * bent(into, p[slots.SIDE_BEND])
    if p[slots.COGGING_FORCE] != 0.0:
        force -= cogging(x, p)
    if p[slots.HAS_MORE] != 0.0:
        force += further_spring(x, p)
    return force


@compiled(**INNER)
def further_spring(x: float, p: np.ndarray) -> float:
    """Return the force of what few drives have: weight, a second of a kind.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    force = 0.0
    if p[slots.GRAVITY_TORQUE] != 0.0:
        force += p[slots.GRAVITY_TORQUE] * np.sin(x + p[slots.GRAVITY_ANGLE])
        force -= p[slots.GRAVITY_REST]
    if p[slots.SECOND_STIFFNESS] > 0.0:
        into = beyond_side(x, p[slots.SECOND_POSITION])
        force += p[slots.SECOND_STIFFNESS] * bent(into, p[slots.SECOND_BEND])
    if p[slots.SECOND_COGGING_FORCE] != 0.0:
        force -= second_cogging(x, p)
    return force


@compiled(**INNER)
def spring_rate(x: float, low: float, high: float, p: np.ndarray) -> float:
    """Return how stiff the springs are at most but for curved contacts, [N/m].

    Parameters
    ----------
    x : float, [m]
    low, high : float, [m]
        Between which places the next step stays: a stop in between counts.
    p : ndarray, shape (N_SLOTS,)
    """
    stiffness = p[slots.STIFFNESS]
    if p[slots.CUBIC] != 0.0 or p[slots.QUADRATIC] != 0.0:
        bend = 3.0 * p[slots.CUBIC] * x + 2.0 * p[slots.QUADRATIC]
        stiffness += abs(bend * x)
    if is_stop_straight(p) and max(high, -low) > p[slots.STOP_POSITION]:
        stiffness += p[slots.STOP_STIFFNESS]
    if is_side_straight(p) and reaches_side(low, high, p[slots.SIDE_POSITION]):
        stiffness += p[slots.SIDE_STIFFNESS]
    if p[slots.HAS_MORE] != 0.0:
        stiffness += abs(p[slots.GRAVITY_TORQUE])
        stiffness += p[slots.SPRING_SHARE] * p[slots.STIFFNESS]
        # Not there it has no stiffness to add.
        edge = p[slots.SECOND_POSITION]
        if is_second_straight(p) and reaches_side(low, high, edge):
            stiffness += p[slots.SECOND_STIFFNESS]
    return stiffness


@compiled(**INNER)
def is_stop_straight(p: np.ndarray) -> bool:
    """Return whether the stop on both sides is a spring alone.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.STOP_BEND] + p[slots.STOP_LOSS] + p[slots.STOP_DASHPOT] == 0.0


@compiled(**INNER)
def is_side_straight(p: np.ndarray) -> bool:
    """Return whether the stop on one side is a spring alone.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.SIDE_BEND] + p[slots.SIDE_LOSS] + p[slots.SIDE_DASHPOT] == 0.0


@compiled(**INNER)
def is_second_straight(p: np.ndarray) -> bool:
    """Return whether the second stop on one side is a spring alone.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    loss = p[slots.SECOND_LOSS] + p[slots.SECOND_DASHPOT]
    return p[slots.SECOND_BEND] + loss == 0.0


@compiled(**INNER)
def reaches_side(low: float, high: float, position: float) -> bool:
    """Return whether a stop on one side begins between two places.

    Parameters
    ----------
    low, high : float, [m]
    position : float, [m]
    """
    return beyond_side(low, position) != 0.0 or beyond_side(high, position) != 0.0


@compiled(**INNER)
def cogging(x: float, p: np.ndarray) -> float:
    """Return the force that repeats along the way.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    angle = TURN * (x - p[slots.COGGING_ORIGIN]) / p[slots.COGGING_PERIOD]
    swing = np.sin(angle + p[slots.COGGING_PHASE]) - p[slots.COGGING_REST]
    return p[slots.COGGING_FORCE] * swing


@compiled(**INNER)
def second_cogging(x: float, p: np.ndarray) -> float:
    """Return the force that repeats along the way with another period.

    It has its zero where the first one has it.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    angle = TURN * (x - p[slots.COGGING_ORIGIN]) / p[slots.SECOND_COGGING_PERIOD]
    phase = p[slots.SECOND_COGGING_PHASE]
    rest = np.sin(phase) if p[slots.COGGING_ABOUT_MEAN] == 0.0 else 0.0
    return p[slots.SECOND_COGGING_FORCE] * (np.sin(angle + phase) - rest)


@compiled(**INNER)
def bent(into: float, bend: float) -> float:
    """Return how a contact's force grows: ``into |into|^bend``.

    Parameters
    ----------
    into : float, [m]
        How far into the contact, with its sign.
    bend : float, [-]
        Exponent of the law less 1.
    """
    if bend == 0.0 or into == 0.0:
        return into
    return into * np.power(abs(into), bend)


@compiled(**INNER)
def contact_damping(x: float, v: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return what the damping of stops adds to their force; they never pull.

    Parameters
    ----------
    x : float, [m]
    v : float, [m/s]
    memory : ndarray, shape (N_MEMORY,)
        With the contacts of ``touch``: a dashpot's force begins with a jump, which no
        step may meet half-way.
    p : ndarray, shape (N_SLOTS,)
    """
    force = 0.0
    if p[slots.STOP_LOSS] + p[slots.STOP_DASHPOT] > 0.0:
        into = beyond(x, p[slots.STOP_POSITION])
        elastic = p[slots.STOP_STIFFNESS] * bent(into, p[slots.STOP_BEND])
        loss, dashpot = p[slots.STOP_LOSS], p[slots.STOP_DASHPOT]
        force += _damping_of(elastic, v, memory[IN_STOP], loss, dashpot)
    if p[slots.SIDE_LOSS] + p[slots.SIDE_DASHPOT] > 0.0:
        into = beyond_side(x, p[slots.SIDE_POSITION])
        elastic = p[slots.SIDE_STIFFNESS] * bent(into, p[slots.SIDE_BEND])
        loss, dashpot = p[slots.SIDE_LOSS], p[slots.SIDE_DASHPOT]
        force += _damping_of(elastic, v, memory[IN_SIDE], loss, dashpot)
    if p[slots.SECOND_LOSS] + p[slots.SECOND_DASHPOT] > 0.0:
        into = beyond_side(x, p[slots.SECOND_POSITION])
        elastic = p[slots.SECOND_STIFFNESS] * bent(into, p[slots.SECOND_BEND])
        loss, dashpot = p[slots.SECOND_LOSS], p[slots.SECOND_DASHPOT]
        force += _damping_of(elastic, v, memory[IN_SECOND], loss, dashpot)
    return force


@compiled(**INNER)
def _damping_of(
    elastic: float, v: float, side: float, loss: float, dashpot: float
) -> float:
    """Return it for one contact: losses go with its force, a dashpot acts beside it.

    Parameters
    ----------
    elastic : float, [N]
        Force of its spring, with its sign.
    side : float
        On which the drive touched it when the step began; 0 where it did not.
    """
    force = elastic * max(loss * np.sign(elastic) * v, -1.0)
    if dashpot > 0.0 and side != 0.0:
        force += side * max(dashpot * side * v, -abs(elastic))
    return force


@compiled(**INNER)
def touch(x: float, memory: np.ndarray, p: np.ndarray) -> None:
    """Note in which contacts with a dashpot the drive is as a step begins.

    Parameters
    ----------
    x : float, [m]
    memory : ndarray, shape (N_MEMORY,)
        Changed in place.
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.STOP_DASHPOT] > 0.0:
        memory[IN_STOP] = np.sign(beyond(x, p[slots.STOP_POSITION]))
    if p[slots.SIDE_DASHPOT] > 0.0:
        memory[IN_SIDE] = np.sign(beyond_side(x, p[slots.SIDE_POSITION]))
    if p[slots.SECOND_DASHPOT] > 0.0:
        memory[IN_SECOND] = np.sign(beyond_side(x, p[slots.SECOND_POSITION]))


@compiled(**INNER)
def beyond_side(x: float, edge: float) -> float:
    """Return how far a position is beyond a stop on the side of its sign.

    Parameters
    ----------
    x, edge : float, [m]
    """
    into = x - edge
    return into if into * edge > 0.0 else 0.0


@compiled(**INNER)
def beyond(x: float, half_gap: float) -> float:
    """Return how far a position is beyond a gap, with its sign.

    Parameters
    ----------
    x : float, [m]
    half_gap : float, [m]
    """
    if x > half_gap:
        return x - half_gap
    if x < -half_gap:
        return x + half_gap
    return 0.0
