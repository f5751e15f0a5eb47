"""Compiled forces on a drive: one term for each effect that acts on the motion.

docs/method_diagnosis.md, eq. (D1) to (D3), (D7) to (D13).
"""

import numpy as np
from numba import njit

from hwid_cli.drive import slots
from hwid_cli.drive.compiled import INNER
from hwid_cli.drive.motion.push import (
    DRIVE,
    OTHER,
    TURN,
    WARMTH,
    depends_on_motion,
    force_of,
    value_of,
)

# Places in the state: mass, motor, appendage, current of the circuit.
X, V, MOTOR_X, MOTOR_V, PART_X, PART_V, CIRCUIT, N_STATE = range(8)
# Places in the memory: direction of sliding (0 at rest), position and deflection at the
# last reversal, current after the lag, temperature.
WAY, TURNED_AT, DEFLECTION, LAGGED, HEAT, N_MEMORY = range(6)
# Tries that bracket the position at rest, each this much further, and that narrow it.
MOST_TRIES, FURTHER, NARROWING = 120, 1.3, 90


@njit(**INNER)
def acceleration(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> tuple[float, float, float, float]:
    """Return accelerations of mass, motor and appendage, and the current's rate.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    x, v = state[X], state[V]
    has_motor = p[slots.GEAR_STIFFNESS] > 0.0
    force = value_of(push, DRIVE, done)
    rate = 0.0
    if depends_on_motion(p):
        speed = state[MOTOR_V] if has_motor else v
        if p[slots.INDUCTANCE] > 0.0:
            voltage = force - p[slots.BACK_EMF] * speed
            rate = voltage - p[slots.RESISTANCE] * state[CIRCUIT]
            rate /= p[slots.INDUCTANCE]
        current = wanted_current(force, state, p)
        middle, limit = -p[slots.CLIP_SLOPE] * speed, p[slots.CLIP_LIMIT]
        current = min(max(current, middle - limit), middle + limit)
        force = force_of(current, push[WARMTH], p)
    mass, motor = p[slots.MASS], 0.0
    if has_motor:
        inner = p[slots.MOTOR_SHARE] * mass
        mass -= inner
        teeth = bite(state[MOTOR_X] - x, state[MOTOR_V] - v, p)
        motor = (force - teeth) / inner
        force = teeth
    net = force + value_of(push, OTHER, done) - resisting(x, v, memory, p)
    mode = 0.0
    if p[slots.MODE_MASS] > 0.0:
        pull = p[slots.MODE_STIFFNESS] * (state[PART_X] - x)
        pull += p[slots.MODE_DAMPING] * (state[PART_V] - v)
        net += pull
        mode = -pull / p[slots.MODE_MASS]
    return net / mass, motor, mode, rate


@njit(**INNER)
def wanted_current(command: float, state: np.ndarray, p: np.ndarray) -> float:
    """Return the current before the voltage limit.

    Parameters
    ----------
    command : float, [A] or [V]
    state : ndarray, shape (N_STATE,)
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.RESISTANCE] <= 0.0:
        return command
    if p[slots.INDUCTANCE] > 0.0:
        return state[CIRCUIT]
    speed = state[MOTOR_V] if p[slots.GEAR_STIFFNESS] > 0.0 else state[V]
    return (command - p[slots.BACK_EMF] * speed) / p[slots.RESISTANCE]


@njit(**INNER)
def moved_mass(p: np.ndarray) -> float:
    """Return the mass that the spring holds.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.GEAR_STIFFNESS] > 0.0:
        return p[slots.MASS] * (1.0 - p[slots.MOTOR_SHARE])
    return p[slots.MASS]


@njit(**INNER)
def resisting(x: float, v: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return what acts against the motion.

    Parameters
    ----------
    x : float, [m]
    v : float, [m/s]
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    force = p[slots.DAMPING] * v + spring_force(x, p)
    if p[slots.DRAG] != 0.0:
        force += p[slots.DRAG] * v * abs(v)
    if p[slots.HYSTERESIS_FORCE] != 0.0:
        force += p[slots.HYSTERESIS_FORCE] * yielded(x, memory, p)
    way = memory[WAY]
    if way != 0.0:
        force += way * sliding_friction(way, v, p)
    return force


@njit(**INNER)
def spring_force(x: float, p: np.ndarray) -> float:
    """Return the force of everything that depends on position alone.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    free = beyond(x, p[slots.SPRING_GAP]) if p[slots.SPRING_GAP] > 0.0 else x
    force = p[slots.STIFFNESS] * free
    force += (p[slots.CUBIC] * x + p[slots.QUADRATIC]) * x * x
    if p[slots.STOP_STIFFNESS] > 0.0:
        force += p[slots.STOP_STIFFNESS] * beyond(x, p[slots.STOP_POSITION])
    if p[slots.SIDE_STIFFNESS] > 0.0:
        edge = p[slots.SIDE_POSITION]
        into = x - edge
        if into * edge > 0.0:
            force += p[slots.SIDE_STIFFNESS] * into
    if p[slots.COGGING_FORCE] != 0.0:
        force -= cogging(x, p)
    return force


@njit(**INNER)
def spring_rate(x: float, p: np.ndarray) -> float:
    """Return how stiff the springs are here at most, [N/m].

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    stiffness = p[slots.STIFFNESS]
    if p[slots.CUBIC] != 0.0 or p[slots.QUADRATIC] != 0.0:
        bend = 3.0 * p[slots.CUBIC] * x + 2.0 * p[slots.QUADRATIC]
        stiffness += abs(bend * x)
    if p[slots.STOP_STIFFNESS] > 0.0 and abs(x) > p[slots.STOP_POSITION]:
        stiffness += p[slots.STOP_STIFFNESS]
    edge = p[slots.SIDE_POSITION]
    if p[slots.SIDE_STIFFNESS] > 0.0 and (x - edge) * edge > 0.0:
        stiffness += p[slots.SIDE_STIFFNESS]
    return stiffness


@njit(**INNER)
def is_force_curved(p: np.ndarray) -> bool:
    """Return whether a force on the mass is curved everywhere.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return (
        p[slots.CUBIC] != 0.0
        or p[slots.QUADRATIC] != 0.0
        or p[slots.COGGING_FORCE] != 0.0
        or p[slots.DRAG] != 0.0
    )


@njit(**INNER)
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


@njit(**INNER)
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


@njit(**INNER)
def bite(twist: float, speed: float, p: np.ndarray) -> float:
    """Return the force of the teeth, which push and never pull, or of the coupling.

    Parameters
    ----------
    twist : float, [m]
        Of the motor against the mass.
    speed : float, [m/s]
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.IS_COUPLED] > 0.0:
        return p[slots.GEAR_STIFFNESS] * twist + p[slots.GEAR_DAMPING] * speed
    into = beyond(twist, p[slots.GEAR_GAP])
    force = p[slots.GEAR_STIFFNESS] * into + p[slots.GEAR_DAMPING] * speed
    if into > 0.0:
        return max(force, 0.0)
    return min(force, 0.0) if into < 0.0 else 0.0


@njit(**INNER)
def yielded(x: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return the deflection of the hysteresis, -1 to 1.

    Parameters
    ----------
    x : float, [m]
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    way = memory[WAY]
    if way == 0.0:
        return memory[DEFLECTION]
    gone = abs(x - memory[TURNED_AT]) / p[slots.HYSTERESIS_YIELD]
    return way - (way - memory[DEFLECTION]) * np.exp(-gone)


@njit(**INNER)
def has_dry_friction(p: np.ndarray) -> bool:
    """Return whether the drive can stick.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    level = max(p[slots.FRICTION_FORWARD], p[slots.FRICTION_BACKWARD])
    return level > 0.0 or p[slots.STATIC_EXCESS] != 0.0


@njit(**INNER)
def surplus(net: float, p: np.ndarray) -> float:
    """Return by how much a force exceeds what friction at rest holds.

    Parameters
    ----------
    net : float, [N]
    p : ndarray, shape (N_SLOTS,)
    """
    way = slots.FRICTION_FORWARD if net > 0.0 else slots.FRICTION_BACKWARD
    return abs(net) - max(p[way] + p[slots.STATIC_EXCESS], 0.0)


@njit(**INNER)
def sliding_friction(way: float, v: float, p: np.ndarray) -> float:
    """Return the size of dry friction while sliding.

    Parameters
    ----------
    way : float
        Direction of sliding.
    v : float, [m/s]
    p : ndarray, shape (N_SLOTS,)
    """
    level = p[slots.FRICTION_FORWARD] if way > 0.0 else p[slots.FRICTION_BACKWARD]
    if p[slots.STATIC_EXCESS] != 0.0:
        share = v / p[slots.STRIBECK_VELOCITY]
        level += p[slots.STATIC_EXCESS] * np.exp(-share * share)
    return level


@njit(**INNER)
def is_anywhere(p: np.ndarray) -> bool:
    """Return whether nothing holds a position.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.STIFFNESS] <= 0.0 and p[slots.CUBIC] <= 0.0


@njit(**INNER)
def resting_point(current: float, has_cogging: bool, p: np.ndarray) -> float:
    """Return where the drive rests without friction, nearest to zero.

    Parameters
    ----------
    current : float, [A]
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    float, [m]
        The given start where nothing holds a position.
    """
    if is_anywhere(p):
        return p[slots.START_POSITION]
    limit = p[slots.CLIP_LIMIT]
    force = force_of(min(max(current, -limit), limit), 0.0, p) + p[slots.LOAD]
    if force == 0.0:
        return 0.0
    stiffness = p[slots.STIFFNESS]
    stiffness += np.cbrt(max(p[slots.CUBIC], 0.0) * force * force)
    far = 1e-3 * force / stiffness
    near = 0.0
    for _ in range(MOST_TRIES):
        if _away(far, force, has_cogging, p) * force <= 0.0:
            break
        near = far
        far *= FURTHER
    for _ in range(NARROWING):
        middle = 0.5 * (near + far)
        if _away(middle, force, has_cogging, p) * force > 0.0:
            near = middle
        else:
            far = middle
    return far


@njit(**INNER)
def _away(x: float, force: float, has_cogging: bool, p: np.ndarray) -> float:
    """Return the force that is not balanced."""
    left = force - spring_force(x, p)
    if not has_cogging and p[slots.COGGING_FORCE] != 0.0:
        left -= cogging(x, p)
    return left
