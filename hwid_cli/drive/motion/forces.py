"""Compiled forces on a drive: one term for each effect that acts on the motion.

docs/method_diagnosis.md, eq. (D1) to (D3), (D7) to (D13).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.interpreter import formula_value
from hwid_cli.drive.motion.hysteresis import bending, yielded
from hwid_cli.drive.motion.push import (
    BEGUN,
    COMMAND,
    COMMAND_RATE,
    DRIVE,
    OTHER,
    TURN,
    WARMTH,
    depends_on_motion,
    force_of,
    value_of,
)
from hwid_cli.drive.motion.springs import beyond, contact_damping, spring_force
from hwid_cli.drive.motion.state import (
    CIRCUIT,
    MOTOR_V,
    MOTOR_X,
    PART_V,
    PART_X,
    SIDE,
    WAY,
    V,
    X,
)


@compiled(**INNER)
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
        force = force_of(drawn_current(force, state, p), push[WARMTH], p)
    x_motor = state[MOTOR_X] if has_motor else x
    v_motor = state[MOTOR_V] if has_motor else v
    net, motor = net_forces(x, v, x_motor, v_motor, force, memory, push, done, p)
    mass = p[slots.MASS]
    if has_motor:
        mass -= p[slots.MOTOR_SHARE] * mass
    mode = 0.0
    if p[slots.MODE_MASS] > 0.0:
        pull = p[slots.MODE_STIFFNESS] * (state[PART_X] - x)
        pull += p[slots.MODE_DAMPING] * (state[PART_V] - v)
        net += pull
        mode = -pull / p[slots.MODE_MASS]
    return net / mass, motor, mode, rate


@compiled(**INNER)
def net_forces(
    x: float,
    v: float,
    x_motor: float,
    v_motor: float,
    force: float,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    p: np.ndarray,
) -> tuple[float, float]:
    """Return the force on the mass and the acceleration of a motor that has its own.

    Parameters
    ----------
    x, v, x_motor, v_motor : float, [m], [m/s]
        Mass and motor; the same where the motor is part of the mass.
    force : float, [N]
        Of the motor, without ripple.
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    rubbing = motor = 0.0
    if p[slots.DRIVE_VARIES] != 0.0:
        force *= ripple(x_motor, p)
        rubbing = memory[WAY] * p[slots.DRIVE_SHARE] * abs(force)
    if p[slots.GEAR_STIFFNESS] > 0.0:
        teeth = bite(x_motor - x, v_motor - v, p)
        motor = force - teeth - p[slots.MOTOR_DAMPING] * v_motor
        motor /= p[slots.MOTOR_SHARE] * p[slots.MASS]
        force = teeth
    net = force + value_of(push, OTHER, done) - resisting(x, v, memory, p)
    if rubbing != 0.0:
        net -= rubbing
    if p[slots.OWN_FORCE] != 0.0:
        net += own_force(x, v, memory[WAY], push, done, p)
    return net, motor


@compiled(**INNER)
def own_force(
    x: float, v: float, way: float, push: np.ndarray, done: float, p: np.ndarray
) -> float:
    """Return the force of the user's own formulas; of a resting drive without friction.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    way : float
        Direction of sliding, 0 at rest.
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    at = p[slots.OWN_FORCE]
    u = push[COMMAND] + done * push[COMMAND_RATE]
    t = push[BEGUN] + done
    if p[slots.OWN_FRICTION] == 0.0:
        return formula_value(at, x, v, u, t, np.sign(v), p)
    if way != 0.0:
        return formula_value(at, x, v, u, t, way, p)
    forward = formula_value(at, x, 0.0, u, t, 1.0, p)
    return 0.5 * (forward + formula_value(at, x, 0.0, u, t, -1.0, p))


@compiled(**INNER)
def own_friction(x: float, push: np.ndarray, done: float, p: np.ndarray) -> float:
    """Return up to which force formulas of the user's own hold a resting drive.

    Half of the jump that the force makes with the direction of motion.

    Parameters
    ----------
    x : float, [m]
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    at = p[slots.OWN_FORCE]
    u = push[COMMAND] + done * push[COMMAND_RATE]
    t = push[BEGUN] + done
    backward = formula_value(at, x, 0.0, u, t, -1.0, p)
    return 0.5 * (backward - formula_value(at, x, 0.0, u, t, 1.0, p))


@compiled(**INNER)
def own_force_at_rest(x: float, command: float, p: np.ndarray) -> float:
    """Return the force of the user's own formulas on a drive that rests at first.

    Of what it may be at rest, what is nearest to 0: friction holds no load at first.

    Parameters
    ----------
    x : float, [m]
    command : float, [A] or [V]
    p : ndarray, shape (N_SLOTS,)
    """
    at = p[slots.OWN_FORCE]
    forward = formula_value(at, x, 0.0, command, 0.0, 1.0, p)
    backward = formula_value(at, x, 0.0, command, 0.0, -1.0, p)
    low, high = min(forward, backward), max(forward, backward)
    return min(max(0.0, low), high)


@compiled(**INNER)
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


@compiled(**INNER)
def moved_mass(p: np.ndarray) -> float:
    """Return the mass that the spring holds.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.GEAR_STIFFNESS] > 0.0:
        return p[slots.MASS] * (1.0 - p[slots.MOTOR_SHARE])
    return p[slots.MASS]


@compiled(**INNER)
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
        deflection = yielded(x, v, memory, p)
        force += p[slots.HYSTERESIS_FORCE] * deflection
        if p[slots.BRISTLE_DAMPING] != 0.0:
            force += p[slots.BRISTLE_DAMPING] * bending(v, deflection, memory, p)
    way = memory[WAY]
    if way != 0.0:
        force += way * sliding_friction(way, v, p)
    if p[slots.HAS_MORE] != 0.0:
        force += memory[SIDE] * p[slots.PRELOAD] + contact_damping(x, v, memory, p)
        force += way * friction_here(x, p)
    return force


@compiled(**INNER)
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
        or p[slots.GRAVITY_TORQUE] != 0.0
        or p[slots.SECOND_COGGING_FORCE] != 0.0
        or p[slots.WAVY_FRICTION] != 0.0
        or p[slots.SPRING_SHARE] != 0.0
        or p[slots.DRIVE_VARIES] != 0.0
        or p[slots.OWN_FORCE] != 0.0
        or p[slots.HAS_BRISTLES] != 0.0
    )


@compiled(**INNER)
def ripple(angle: float, p: np.ndarray) -> float:
    """Return by what the motor's force is multiplied at an angle.

    Parameters
    ----------
    angle : float, [rad] or [m]
    p : ndarray, shape (N_SLOTS,)
    """
    turned = p[slots.RIPPLE_PER_TURN] * angle + p[slots.RIPPLE_PHASE]
    return 1.0 + p[slots.RIPPLE_SHARE] * np.sin(turned)


@compiled(**INNER)
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


@compiled(**INNER)
def has_dry_friction(p: np.ndarray) -> bool:
    """Return whether the drive can stick.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    level = max(p[slots.FRICTION_FORWARD], p[slots.FRICTION_BACKWARD])
    level += p[slots.PRELOAD] + p[slots.SPRING_SHARE] + p[slots.DRIVE_SHARE]
    level += p[slots.OWN_FRICTION]
    return level > 0.0 or p[slots.STATIC_EXCESS] != 0.0


@compiled(**INNER)
def friction_here(x: float, p: np.ndarray) -> float:
    """Return the part of dry friction that depends on position.

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    level = 0.0
    if p[slots.WAVY_FRICTION] != 0.0:
        angle = TURN * x / p[slots.WAVY_PERIOD] + p[slots.WAVY_PHASE]
        level += p[slots.WAVY_FRICTION] * np.sin(angle)
    if p[slots.SPRING_SHARE] != 0.0:
        free = beyond(x, p[slots.SPRING_GAP]) if p[slots.SPRING_GAP] > 0.0 else x
        load = p[slots.STIFFNESS] * free
        load += (p[slots.CUBIC] * x + p[slots.QUADRATIC]) * x * x
        level += p[slots.SPRING_SHARE] * abs(load)
    return level


@compiled(**INNER)
def held_further(
    state: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> float:
    """Return what holds a resting drive beside constant friction.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    level = friction_here(state[X], p)
    if state[X] == 0.0:
        level += p[slots.PRELOAD]
    if p[slots.DRIVE_SHARE] != 0.0:
        level += p[slots.DRIVE_SHARE] * abs(drive_now(state, push, done, p))
    if p[slots.OWN_FRICTION] != 0.0:
        level += own_friction(state[X], push, done, p)
    return level


@compiled(**INNER)
def drive_now(state: np.ndarray, push: np.ndarray, done: float, p: np.ndarray) -> float:
    """Return the motor's force.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    has_motor = p[slots.GEAR_STIFFNESS] > 0.0
    force = value_of(push, DRIVE, done)
    if depends_on_motion(p):
        force = force_of(drawn_current(force, state, p), push[WARMTH], p)
    return force * ripple(state[MOTOR_X] if has_motor else state[X], p)


@compiled(**INNER)
def drawn_current(command: float, state: np.ndarray, p: np.ndarray) -> float:
    """Return the current behind the voltage limit.

    Parameters
    ----------
    command : float, [A] or [V]
    state : ndarray, shape (N_STATE,)
    p : ndarray, shape (N_SLOTS,)
    """
    speed = state[MOTOR_V] if p[slots.GEAR_STIFFNESS] > 0.0 else state[V]
    middle, limit = -p[slots.CLIP_SLOPE] * speed, p[slots.CLIP_LIMIT]
    current = wanted_current(command, state, p)
    return min(max(current, middle - limit), middle + limit)


@compiled(**INNER)
def surplus(net: float, p: np.ndarray) -> float:
    """Return by how much a force exceeds what friction at rest holds.

    Parameters
    ----------
    net : float, [N]
    p : ndarray, shape (N_SLOTS,)
    """
    way = slots.FRICTION_FORWARD if net > 0.0 else slots.FRICTION_BACKWARD
    return abs(net) - max(p[way] + p[slots.STATIC_EXCESS], 0.0)


@compiled(**INNER)
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
        share = abs(v) / p[slots.STRIBECK_VELOCITY]
        if p[slots.IS_STRIBECK_EXPONENTIAL] == 0.0:
            share *= share
        level += p[slots.STATIC_EXCESS] * np.exp(-share)
    return level


@compiled(**INNER)
def speed_of_excess(times: float, p: np.ndarray) -> float:
    """Return the speed at which the excess near rest has fallen to ``exp(-times^2)``.

    Parameters
    ----------
    times : float, [-]
        Of the velocity in its law, where the square falls.
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    float, [m/s]
    """
    if p[slots.IS_STRIBECK_EXPONENTIAL] != 0.0:
        times *= times
    return times * p[slots.STRIBECK_VELOCITY]
