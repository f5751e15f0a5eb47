"""Compiled forces on a drive: one term for each effect that acts on the motion.

docs/method_diagnosis.md, eq. (D1) to (D3), (D7) to (D13).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.interpreter import formula_value
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

# Places in the state: mass, motor, appendage, current of the circuit.
X, V, MOTOR_X, MOTOR_V, PART_X, PART_V, CIRCUIT, N_STATE = range(8)
# Places in the memory: direction of sliding (0 at rest), position and deflection at the
# last reversal, current after the lag, temperature, side of a preload (0 held at 0), rate
# of a second-order lag, and how far bristles yield at the speed of the last step.
(
    WAY, TURNED_AT, DEFLECTION, LAGGED, HEAT, SIDE, LAG_RATE, LEVEL, N_MEMORY,
) = range(9)  # fmt: skip
# Tries that bracket the position at rest, each this much further, and that narrow it.
MOST_TRIES, FURTHER, NARROWING = 120, 1.3, 90
# Length of a step along the deflection of a hysteresis, in yield lengths, and what is
# left of it when it has yielded, [-].
SHAPE_STEP, YIELDED = 0.1, 1e-14
# Where the law of what is left has a solution of its own, to a part in 1e8 of the force.
NEARLY_YIELDED = 1e-3
# Tries that find how far a motor on its tooth has turned, each far below the last one.
MOST_TURNS = 60


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
        motor = (force - teeth) / (p[slots.MOTOR_SHARE] * p[slots.MASS])
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
        force += memory[SIDE] * p[slots.PRELOAD] + contact_damping(x, v, p)
        force += way * friction_here(x, p)
    return force


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
    is_plain = p[slots.STOP_BEND] + p[slots.STOP_LOSS] == 0.0
    if is_plain and max(high, -low) > p[slots.STOP_POSITION]:
        stiffness += p[slots.STOP_STIFFNESS]
    is_plain = p[slots.SIDE_BEND] + p[slots.SIDE_LOSS] == 0.0
    if is_plain and reaches_side(low, high, p[slots.SIDE_POSITION]):
        stiffness += p[slots.SIDE_STIFFNESS]
    if p[slots.HAS_MORE] != 0.0:
        stiffness += abs(p[slots.GRAVITY_TORQUE])
        stiffness += p[slots.SPRING_SHARE] * p[slots.STIFFNESS]
        if p[slots.SECOND_STIFFNESS] > 0.0:
            is_plain = p[slots.SECOND_BEND] + p[slots.SECOND_LOSS] == 0.0
            if is_plain and reaches_side(low, high, p[slots.SECOND_POSITION]):
                stiffness += p[slots.SECOND_STIFFNESS]
    return stiffness


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

    Parameters
    ----------
    x : float, [m]
    p : ndarray, shape (N_SLOTS,)
    """
    angle = TURN * (x - p[slots.COGGING_ORIGIN]) / p[slots.SECOND_COGGING_PERIOD]
    phase = p[slots.SECOND_COGGING_PHASE]
    return p[slots.SECOND_COGGING_FORCE] * (np.sin(angle + phase) - np.sin(phase))


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
def contact_damping(x: float, v: float, p: np.ndarray) -> float:
    """Return what the damping of stops adds to their force; they never pull.

    Parameters
    ----------
    x : float, [m]
    v : float, [m/s]
    p : ndarray, shape (N_SLOTS,)
    """
    force = 0.0
    if p[slots.STOP_LOSS] > 0.0:
        into = beyond(x, p[slots.STOP_POSITION])
        elastic = p[slots.STOP_STIFFNESS] * bent(into, p[slots.STOP_BEND])
        force += elastic * max(p[slots.STOP_LOSS] * np.sign(into) * v, -1.0)
    if p[slots.SIDE_LOSS] > 0.0:
        into = beyond_side(x, p[slots.SIDE_POSITION])
        elastic = p[slots.SIDE_STIFFNESS] * bent(into, p[slots.SIDE_BEND])
        force += elastic * max(p[slots.SIDE_LOSS] * np.sign(into) * v, -1.0)
    if p[slots.SECOND_LOSS] > 0.0:
        into = beyond_side(x, p[slots.SECOND_POSITION])
        elastic = p[slots.SECOND_STIFFNESS] * bent(into, p[slots.SECOND_BEND])
        force += elastic * max(p[slots.SECOND_LOSS] * np.sign(into) * v, -1.0)
    return force


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
def yielded(x: float, v: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return the deflection of the hysteresis: 1 where it has yielded, at speed.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    way = memory[WAY]
    if way == 0.0:
        return memory[DEFLECTION]
    gone = abs(x - memory[TURNED_AT]) / p[slots.HYSTERESIS_YIELD]
    if p[slots.HAS_BRISTLES] != 0.0:
        return way * _bent(way * memory[DEFLECTION], gone, v, memory, p)
    if p[slots.HAS_SHAPE] != 0.0:
        return way * _yielded_in_shape(way * memory[DEFLECTION], gone, p)
    return way - (way - memory[DEFLECTION]) * np.exp(-gone)


@compiled(**INNER)
def bristle_level(v: float, p: np.ndarray) -> float:
    """Return the deflection at which bristles slide at a speed, [-].

    Parameters
    ----------
    v : float, [m/s]
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.BRISTLE_EXCESS] == 0.0:
        return 1.0
    share = v / p[slots.BRISTLE_VELOCITY]
    return 1.0 + p[slots.BRISTLE_EXCESS] * np.exp(-share * share)


@compiled(**INNER)
def bending(v: float, deflection: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return how fast bristles bend, [m/s].

    Parameters
    ----------
    v : float, [m/s]
    deflection : float, [-]
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    return v * (1.0 - memory[WAY] * deflection / bristle_level(v, p))


@compiled(**INNER)
def _bent(
    ahead: float, gone: float, v: float, memory: np.ndarray, p: np.ndarray
) -> float:
    """Return the deflection of bristles in the direction of motion.

    Their level g changes evenly along the way s: of z' = 1 - z / g follows that z - g dies
    away while -g' drives it.
    """
    before, now = memory[LEVEL], bristle_level(v, p)
    if gone <= 0.0:
        return ahead
    level = 0.5 * (before + now)
    lost = -np.expm1(-gone / level)
    off = (ahead - before) * (1.0 - lost)
    return now + off - (now - before) * level / gone * lost


@compiled(**INNER)
def yielding(ahead: float, p: np.ndarray) -> float:
    """Return how the deflection of a hysteresis of any shape grows, [1/yield length].

    Parameters
    ----------
    ahead : float, [-]
        Deflection in the direction of motion.
    p : ndarray, shape (N_SLOTS,)
    """
    share = np.power(abs(ahead), 1.0 + p[slots.HYSTERESIS_BEND])
    if ahead < 0.0:
        share *= (p[slots.HYSTERESIS_RATIO] - 1.0) / (p[slots.HYSTERESIS_RATIO] + 1.0)
    return 1.0 - share


@compiled(**INNER)
def _yielded_in_shape(ahead: float, gone: float, p: np.ndarray) -> float:
    """Return the deflection in the direction of motion after a way in yield lengths."""
    count = np.ceil(gone * (1.0 + p[slots.HYSTERESIS_BEND]) / SHAPE_STEP)
    h = gone / max(count, 1.0)
    left = gone
    while left > 0.5 * h:
        if 1.0 - ahead < NEARLY_YIELDED:
            return 1.0 - _left_to_yield(1.0 - ahead, left, p)
        step = h
        after = _shape_step(ahead, step, p)
        if ahead < 0.0 and after > 0.0:
            # The law has an edge at 0: there first, by Simpson's rule.
            rest = 1.0 / yielding(ahead, p) + 4.0 / yielding(0.5 * ahead, p)
            step = min(-ahead * (rest + 1.0) / 6.0, h)
            after = _shape_step(0.0, h - step, p)
        ahead = after
        left -= h
    return min(ahead, 1.0)


@compiled(**INNER)
def _left_to_yield(left: float, gone: float, p: np.ndarray) -> float:
    """Return what is left of a deflection near 1, where the law is nearly linear.

    With d = 1 - z the law is d' = -n d + n (n - 1) / 2 d^2, up to d^3.
    """
    fading = np.exp(-(1.0 + p[slots.HYSTERESIS_BEND]) * gone)
    bent = 0.5 * p[slots.HYSTERESIS_BEND] * left * (1.0 - fading)
    return left * fading / (1.0 - bent)


@compiled(**INNER)
def _shape_step(ahead: float, h: float, p: np.ndarray) -> float:
    """Return the deflection one Runge-Kutta step on."""
    k1 = yielding(ahead, p)
    k2 = yielding(ahead + 0.5 * h * k1, p)
    k3 = yielding(ahead + 0.5 * h * k2, p)
    k4 = yielding(ahead + h * k3, p)
    return ahead + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


@compiled(**INNER)
def remember(x: float, v: float, memory: np.ndarray, p: np.ndarray) -> None:
    """Keep how far a hysteresis of any shape has yielded, at the end of a step.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    memory : ndarray, shape (N_MEMORY,)
        Changed in place.
    p : ndarray, shape (N_SLOTS,)
    """
    way = memory[WAY]
    if way == 0.0:
        return
    deflection = yielded(x, v, memory, p)
    if p[slots.HAS_BRISTLES] != 0.0:
        memory[DEFLECTION], memory[LEVEL] = deflection, bristle_level(v, p)
        memory[TURNED_AT] = x
        return
    memory[DEFLECTION] = way if 1.0 - way * deflection <= YIELDED else deflection
    memory[TURNED_AT] = x


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
        share = v / p[slots.STRIBECK_VELOCITY]
        level += p[slots.STATIC_EXCESS] * np.exp(-share * share)
    return level


@compiled(**INNER)
def is_anywhere(p: np.ndarray) -> bool:
    """Return whether nothing holds a position.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.STIFFNESS] <= 0.0 and p[slots.CUBIC] <= 0.0


@compiled(**INNER)
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
    force = resting_force(0.0, current, p) + p[slots.LOAD]
    force -= p[slots.GRAVITY_TORQUE] * np.sin(p[slots.GRAVITY_ANGLE])
    if p[slots.OWN_FORCE] != 0.0:
        force += own_force_at_rest(0.0, _command_at(current, p), p)
    if abs(force) <= p[slots.PRELOAD]:
        return 0.0
    side = np.sign(force)
    force -= side * p[slots.PRELOAD]
    stiffness = p[slots.STIFFNESS]
    stiffness += np.cbrt(max(p[slots.CUBIC], 0.0) * force * force)
    far = 1e-3 * force / stiffness
    near = 0.0
    for _ in range(MOST_TRIES):
        if _away(far, side, current, has_cogging, p) * force <= 0.0:
            break
        near = far
        far *= FURTHER
    for _ in range(NARROWING):
        middle = 0.5 * (near + far)
        if _away(middle, side, current, has_cogging, p) * force > 0.0:
            near = middle
        else:
            far = middle
    return far


@compiled(**INNER)
def _away(
    x: float, side: float, current: float, has_cogging: bool, p: np.ndarray
) -> float:
    """Return the force that is not balanced."""
    force = resting_force(x, current, p) + p[slots.LOAD]
    left = force - side * p[slots.PRELOAD] - spring_force(x, p)
    if not has_cogging and p[slots.COGGING_FORCE] != 0.0:
        left -= cogging(x, p)
    if not has_cogging and p[slots.SECOND_COGGING_FORCE] != 0.0:
        left -= second_cogging(x, p)
    if p[slots.OWN_FORCE] != 0.0:
        left += own_force_at_rest(x, _command_at(current, p), p)
    return left


@compiled(**INNER)
def _command_at(current: float, p: np.ndarray) -> float:
    """Return the command that lets a current flow at rest."""
    return current * p[slots.RESISTANCE] if p[slots.RESISTANCE] > 0.0 else current


@compiled(**INNER)
def resting_force(x: float, current: float, p: np.ndarray) -> float:
    """Return the motor's force at rest.

    Parameters
    ----------
    x : float, [m]
    current : float, [A]
    p : ndarray, shape (N_SLOTS,)
    """
    limit = p[slots.CLIP_LIMIT]
    constant = force_of(min(max(current, -limit), limit), 0.0, p)
    force = constant
    if p[slots.RIPPLE_SHARE] != 0.0 and p[slots.GEAR_STIFFNESS] > 0.0:
        # The motor turns with its force, and the force with its angle.
        for _ in range(MOST_TURNS):
            turned = np.sign(force) * p[slots.GEAR_GAP]
            turned += force / p[slots.GEAR_STIFFNESS]
            force = constant * ripple(x + turned, p)
    elif p[slots.RIPPLE_SHARE] != 0.0:
        force *= ripple(x, p)
    return force
