"""Compiled motion between two events where a force is curved: Runge-Kutta steps.

docs/method_diagnosis.md, eq. (D2), (D8) to (D10).
"""

import numpy as np

from hwid_cli.compiled import INNER, MAKING, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.interpreter import formula_value
from hwid_cli.drive.motion.forces import (
    acceleration,
    drive_now,
    is_force_curved,
    moved_mass,
    net_forces,
    own_force,
    resisting,
    ripple,
    speed_of_excess,
)
from hwid_cli.drive.motion.hysteresis import YIELDED, bristle_level, yielding
from hwid_cli.drive.motion.push import (
    DRIVE,
    OTHER,
    TURN,
    depends_on_motion,
    has_losses,
    shift,
    value_of,
)
from hwid_cli.drive.motion.runge_kutta import LONGEST_PHASE, runge_kutta_stage
from hwid_cli.drive.motion.springs import (
    beyond,
    beyond_side,
    is_second_straight,
    is_side_straight,
    is_stop_straight,
    reaches_side,
    spring_rate,
    touch,
)
from hwid_cli.drive.motion.state import (
    DEFLECTION,
    MOTOR_V,
    MOTOR_X,
    N_STATE,
    PART_V,
    TURNED_AT,
    WAY,
    V,
    X,
)
from hwid_cli.drive.motion.winding import (
    is_wound,
    rate_of_winding,
    slow_pace,
    step_wound,
)

# Beyond this many Stribeck velocities the excess is below rounding, exp(-6.1^2); and
# beyond this many yield lengths the hysteresis has yielded, exp(-37).
FAST, FAR = 6.1, 37.0
# Forces of formulas are differentiated over this share of the largest displacement, and
# of the velocity that it has at this rate, [1/s].
OWN_SHARE, OWN_RATE = 1e-4, 30.0
# Samples that a bend of such a force is seen ahead: as many as steps go on without a look.
OWN_AHEAD = 6.0
# Places on each side at which it is asked whether such a force has jumped.
JUMP_POINTS = 2
# Depth of a contact that is only ahead, [m].
JUST_IN = 1e-300
# A step within which drag settles so often is taken implicitly: Runge-Kutta steps explode
# from 2.8 on.
SETTLES = 2.0
# A contact's force begins with an edge in its slope: its steps are this much shorter.
CONTACT_FINER = 2.0


@compiled(**INNER)
def is_always_curved(p: np.ndarray) -> bool:
    """Return whether no stretch of the motion is linear.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return is_force_curved(p) or (depends_on_motion(p) and has_losses(p))


@compiled(**INNER)
def is_curved_here(state: np.ndarray, memory: np.ndarray, p: np.ndarray) -> bool:
    """Return whether friction is curved at this velocity and after this way.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.STATIC_EXCESS] != 0.0:
        speed = memory[WAY] * state[V]
        if memory[WAY] != 0.0 and speed < speed_of_excess(FAST, p):
            return True
    if p[slots.HYSTERESIS_FORCE] != 0.0 and memory[WAY] != 0.0:
        if p[slots.HAS_SHAPE] != 0.0 and memory[WAY] != memory[DEFLECTION]:
            return True
        gone = abs(state[X] - memory[TURNED_AT])
        if p[slots.HAS_SHAPE] == 0.0 and gone < FAR * p[slots.HYSTERESIS_YIELD]:
            return True
    return p[slots.HAS_CONTACT] != 0.0 and _touches(state[X], p)


@compiled(**INNER)
def _touches(x: float, p: np.ndarray) -> bool:
    """Whether the drive is in a contact whose force is curved."""
    if not is_stop_straight(p) and beyond(x, p[slots.STOP_POSITION]) != 0.0:
        return True
    if not is_side_straight(p) and beyond_side(x, p[slots.SIDE_POSITION]) != 0.0:
        return True
    is_in_second = beyond_side(x, p[slots.SECOND_POSITION]) != 0.0
    return is_in_second and not is_second_straight(p)


@compiled(**INNER)
def _contact_rate(
    x: float, low: float, high: float, v: float, mass: float, p: np.ndarray
) -> float:
    """Return how fast the motion in curved contacts turns, also in those just ahead."""
    into = beyond(x, p[slots.STOP_POSITION])
    if into == 0.0 and max(high, -low) > p[slots.STOP_POSITION]:
        into = JUST_IN
    loss, dashpot = p[slots.STOP_LOSS], p[slots.STOP_DASHPOT]
    law = p[slots.STOP_STIFFNESS], p[slots.STOP_BEND], loss, dashpot
    rate = _rate_of_contact(into, v, mass, law)
    into = beyond_side(x, p[slots.SIDE_POSITION])
    if into == 0.0 and reaches_side(low, high, p[slots.SIDE_POSITION]):
        into = JUST_IN
    loss, dashpot = p[slots.SIDE_LOSS], p[slots.SIDE_DASHPOT]
    law = p[slots.SIDE_STIFFNESS], p[slots.SIDE_BEND], loss, dashpot
    rate += _rate_of_contact(into, v, mass, law)
    into = beyond_side(x, p[slots.SECOND_POSITION])
    if into == 0.0 and reaches_side(low, high, p[slots.SECOND_POSITION]):
        into = JUST_IN
    loss, dashpot = p[slots.SECOND_LOSS], p[slots.SECOND_DASHPOT]
    law = p[slots.SECOND_STIFFNESS], p[slots.SECOND_BEND], loss, dashpot
    return rate + _rate_of_contact(into, v, mass, law)


@compiled(**INNER)
def _places_ahead(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> tuple[float, float]:
    """Return between which places the drive stays within a sample, where it has stops.

    A step into a stop and out of it would else not be seen to have met one.
    """
    x, v = state[X], state[V]
    stiffness = p[slots.STOP_STIFFNESS] + p[slots.SIDE_STIFFNESS]
    if stiffness + p[slots.SECOND_STIFFNESS] == 0.0:
        return x, x
    time = p[slots.SAMPLE_TIME]
    ahead = x + time * v
    further = ahead + 0.5 * time * time * acceleration(state, memory, push, done, p)[0]
    return min(x, min(ahead, further)), max(x, max(ahead, further))


@compiled(**INNER)
def _rate_of_contact(
    into: float, v: float, mass: float, law: tuple[float, float, float, float]
) -> float:
    """Return it for one contact, with its stiffness where the speed will be used up.

    Parameters
    ----------
    law : tuple of float
        Stiffness, exponent less 1, loss and dashpot.
    """
    stiffness, bend, loss, dashpot = law
    if into == 0.0 or bend + loss + dashpot == 0.0:
        return 0.0
    exponent = 1.0 + bend
    energy = 0.5 * (exponent + 1.0) * mass * v * v / stiffness
    deep = abs(into) + np.power(energy, 1.0 / (exponent + 1.0))
    steep = stiffness * np.power(deep, bend) * (1.0 + loss * abs(v))
    damping = loss * steep * deep + dashpot
    return CONTACT_FINER * (np.sqrt(exponent * steep / mass) + damping / mass)


@compiled(**INNER)
def step_limit(
    state: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    is_exponential: bool,
    p: np.ndarray,
) -> float:
    """Return the longest step in which no curved force turns too far.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    is_exponential : bool
        Whether the step follows motor, appendage and circuit exactly, however fast.
    p : ndarray, shape (N_SLOTS,)
    """
    mass = moved_mass(p)
    x, v = state[X], state[V]
    speed = abs(v)
    low, high = _places_ahead(state, memory, push, done, p)
    stiffness = spring_rate(x, low, high, p)
    damping = p[slots.DAMPING] + 2.0 * abs(p[slots.DRAG]) * speed
    if not is_exponential:
        if p[slots.GEAR_STIFFNESS] > 0.0:
            mass = min(mass, p[slots.MASS] - mass)
            if abs(state[MOTOR_X] - x) > p[slots.GEAR_GAP]:
                stiffness += p[slots.GEAR_STIFFNESS]
                damping += p[slots.GEAR_DAMPING]
        if p[slots.CLIP_LIMIT] < np.inf:
            damping += p[slots.FORCE_CONSTANT] * p[slots.CLIP_SLOPE]
        if p[slots.RESISTANCE] > 0.0:
            resistance = p[slots.RESISTANCE]
            damping += p[slots.FORCE_CONSTANT] * p[slots.BACK_EMF] / resistance
    if p[slots.COGGING_FORCE] != 0.0:
        turn = TURN / p[slots.COGGING_PERIOD]
        stiffness += abs(p[slots.COGGING_FORCE]) * turn
        # A forcing, not a motion of its own: it may turn further.
        damping += 0.12 * mass * turn * speed
    turning = 0.0
    if p[slots.HAS_MORE] != 0.0 or p[slots.DRIVE_VARIES] != 0.0:
        more, turning = _further_stiffness(state, push, done, p)
        stiffness += more
        turning *= 0.12 * speed
    rate = np.sqrt(stiffness / mass) + damping / mass + turning
    if p[slots.DRAG] != 0.0:
        # From rest the drive reaches the speed at which the drag holds it so fast.
        pull = abs(acceleration(state, memory, push, done, p)[0])
        ahead = acceleration(state, memory, push, p[slots.SAMPLE_TIME], p)[0]
        fast = 2.0 * np.sqrt(abs(p[slots.DRAG]) * max(pull, abs(ahead)) / mass)
        # What settles over several samples is told by the speed alone.
        if fast * p[slots.SAMPLE_TIME] > 1.0:
            rate += fast
    if p[slots.HAS_CONTACT] != 0.0:
        rate += _contact_rate(x, low, high, v, mass, p)
    if not is_exponential:
        rate += _rate_of_inner(state, memory, push, done, mass, p)
    elif p[slots.INDUCTANCE] > 0.0:
        # What a coil lets through within a sample changes the motion within it.
        rate += slow_pace(p[slots.RESISTANCE] / p[slots.INDUCTANCE], LONGEST_PHASE, p)
    if p[slots.HYSTERESIS_FORCE] != 0.0:
        rate += _rate_of_yielding(state, memory, mass, p)
    if p[slots.OWN_FORCE] != 0.0:
        rate += _rate_of_own(state, memory, push, done, mass, p)
    slow = p[slots.BRISTLE_VELOCITY]
    if p[slots.BRISTLE_EXCESS] != 0.0 and speed < FAST * slow:
        pull = abs(acceleration(state, memory, push, done, p)[0])
        rate += 0.5 * pull / slow
    if p[slots.STATIC_EXCESS] != 0.0 and memory[WAY] != 0.0:
        slow = p[slots.STRIBECK_VELOCITY]
        if speed < speed_of_excess(FAST, p):
            pull = abs(acceleration(state, memory, push, done, p)[0])
            rate += abs(p[slots.STATIC_EXCESS]) / (mass * slow) + 0.5 * pull / slow
    return LONGEST_PHASE / max(rate, 1e-9)


@compiled(**INNER)
def _rate_of_inner(
    state: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    mass: float,
    p: np.ndarray,
) -> float:
    """Return how fast an appendage and a circuit turn."""
    rate = 0.0
    if p[slots.MODE_MASS] > 0.0:
        both = 1.0 / p[slots.MODE_MASS] + 1.0 / mass
        rate += np.sqrt(p[slots.MODE_STIFFNESS] * both) + p[slots.MODE_DAMPING] * both
    if p[slots.INDUCTANCE] > 0.0:
        fast = p[slots.RESISTANCE] / p[slots.INDUCTANCE]
        if is_wound(p):
            fast = rate_of_winding(fast, state, memory, push, done, p)
        rate += fast
    return rate


@compiled(**INNER)
def _rate_of_own(
    state: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    mass: float,
    p: np.ndarray,
) -> float:
    """Return how fast motion under forces of the user's own turns."""
    x, v, way = state[X], state[V], memory[WAY]
    dx = OWN_SHARE * p[slots.REFERENCE_DISPLACEMENT]
    dv = OWN_SHARE * (abs(v) + OWN_RATE * p[slots.REFERENCE_DISPLACEMENT])
    if way * v < dv and way < 0.0:
        # The other way would be over the edge.
        dv = -dv
    here = own_force(x, v, way, push, done, p)
    stiffness = abs(own_force(x + dx, v, way, push, done, p) - here) / dx
    if p[slots.OWN_BENDS] > 0.0:
        # A stop that is near is as stiff as if the drive were in it.
        way_on = OWN_AHEAD * p[slots.SAMPLE_TIME] * v
        if abs(way_on) > dx:
            ahead = own_force(x + way_on, v, way, push, done, p)
            edge = own_force(x + way_on + dx, v, way, push, done, p)
            stiffness = max(stiffness, abs(edge - ahead) / dx)
    damping = (own_force(x, v + dv, way, push, done, p) - here) / dv
    rate = np.sqrt(stiffness / mass) + abs(damping) / mass
    rate += 0.12 * p[slots.OWN_WAVES] * abs(v) + 0.12 * p[slots.OWN_TURNING]
    if p[slots.OWN_FINENESS] > 0.0 and _may_jump(state, memory, push, done, p):
        # The shortest time that is known here is a share of a sample.
        rate += LONGEST_PHASE * p[slots.OWN_FINENESS] / p[slots.SAMPLE_TIME]
    return rate


@compiled(**INNER)
def _may_jump(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> bool:
    """Return whether forces of the user's own may jump until steps are looked at again."""
    at = p[slots.OWN_JUMPS]
    if at == 0.0:
        return True
    x, v, time = state[X], state[V], OWN_AHEAD * p[slots.SAMPLE_TIME]
    pull = acceleration(state, memory, push, done, p)[0]
    reach = time * (abs(v) + 0.5 * time * abs(pull))
    here = formula_value(at, x, v, 0.0, 0.0, 0.0, p)
    for n in range(-JUMP_POINTS, JUMP_POINTS + 1):
        place = x + n * reach / JUMP_POINTS
        if formula_value(at, place, v, 0.0, 0.0, 0.0, p) != here:
            return True
    return False


@compiled(**INNER)
def _further_stiffness(
    state: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> tuple[float, float]:
    """Return stiffness and waves per metre of forces that repeat along the way."""
    stiffness = waves = 0.0
    if p[slots.SECOND_COGGING_FORCE] != 0.0:
        turn = TURN / p[slots.SECOND_COGGING_PERIOD]
        stiffness += abs(p[slots.SECOND_COGGING_FORCE]) * turn
        waves += turn
    if p[slots.WAVY_FRICTION] != 0.0:
        turn = TURN / p[slots.WAVY_PERIOD]
        stiffness += abs(p[slots.WAVY_FRICTION]) * turn
        waves += turn
    if p[slots.RIPPLE_SHARE] != 0.0:
        turn = p[slots.RIPPLE_PER_TURN]
        force = abs(drive_now(state, push, done, p))
        stiffness += abs(p[slots.RIPPLE_SHARE]) * force * turn
        waves += turn
    return stiffness, waves


@compiled(**INNER)
def _rate_of_yielding(
    state: np.ndarray, memory: np.ndarray, mass: float, p: np.ndarray
) -> float:
    """Return how fast the hysteresis changes, as long as it has not yielded."""
    if p[slots.HAS_BRISTLES] != 0.0:
        return _rate_of_bending(state, memory, mass, p)
    if p[slots.HAS_SHAPE] != 0.0:
        return _rate_in_shape(state, memory, mass, p)
    gone = abs(state[X] - memory[TURNED_AT]) / p[slots.HYSTERESIS_YIELD]
    if gone >= FAR:
        return 0.0
    fading = np.exp(-gone)
    stiffness = 2.0 * abs(p[slots.HYSTERESIS_FORCE]) / p[slots.HYSTERESIS_YIELD]
    # How much of it is left decides how exactly it has to be followed.
    speed = abs(state[V]) / p[slots.HYSTERESIS_YIELD]
    return np.sqrt(stiffness * fading / mass) + 0.6 * speed * np.sqrt(np.sqrt(fading))


@compiled(**INNER)
def _rate_of_bending(
    state: np.ndarray, memory: np.ndarray, mass: float, p: np.ndarray
) -> float:
    """Return it for bristles, whose level falls with the speed."""
    v, force = state[V], abs(p[slots.HYSTERESIS_FORCE])
    level = bristle_level(v, p)
    if abs(v) > FAST * p[slots.BRISTLE_VELOCITY]:
        level = 1.0
    slope = abs(1.0 - memory[WAY] * memory[DEFLECTION] / level)
    stiffness = force * slope / p[slots.HYSTERESIS_YIELD]
    speed = abs(v) / p[slots.HYSTERESIS_YIELD]
    rate = np.sqrt(stiffness / mass) + p[slots.BRISTLE_DAMPING] * slope / mass
    rate += 0.6 * speed * np.sqrt(np.sqrt(min(0.5 * slope, 1.0)))
    if level > 1.0:
        # How steeply the level falls, at most; the force follows no faster than it bends.
        falls = force * p[slots.BRISTLE_EXCESS] / (mass * p[slots.BRISTLE_VELOCITY])
        rate += min(falls, np.sqrt(falls * speed))
    return rate


@compiled(**INNER)
def _rate_in_shape(
    state: np.ndarray, memory: np.ndarray, mass: float, p: np.ndarray
) -> float:
    """Return it for a hysteresis of any shape."""
    ahead = memory[WAY] * memory[DEFLECTION]
    if memory[WAY] == 0.0 or 1.0 - ahead <= YIELDED:
        return 0.0
    exponent = 1.0 + p[slots.HYSTERESIS_BEND]
    slope = max(yielding(ahead, p), 1.0 - ahead)
    stiffness = slope * abs(p[slots.HYSTERESIS_FORCE]) / p[slots.HYSTERESIS_YIELD]
    fading = min(0.5 * slope, 1.0)
    speed = exponent * abs(state[V]) / p[slots.HYSTERESIS_YIELD]
    return np.sqrt(stiffness / mass) + 0.6 * speed * np.sqrt(np.sqrt(fading))


@compiled(**INNER)
def step_plain(
    x: float,
    v: float,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    p: np.ndarray,
) -> tuple[float, float]:
    """Return position and velocity one Runge-Kutta step on, without inner states.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.HAS_CONTACT] != 0.0:
        touch(x, memory, p)
    if p[slots.DRIVE_VARIES] != 0.0 or p[slots.OWN_FORCE] != 0.0:
        return _step_varying(x, v, memory, push, done, h, p)
    half, inverse = 0.5 * h, 1.0 / p[slots.MASS]
    a0, b0, c0, d0 = shift(push, DRIVE, done)
    a1, b1, c1, d1 = shift(push, OTHER, done)
    first, b, c, d = a0 + a1, b0 + b1, c0 + c1, d0 + d1
    middle = first + half * (b + half * (c + half * d))
    last = first + h * (b + h * (c + h * d))
    if p[slots.DRAG] > 0.0:
        free = last - resisting(x, 0.0, memory, p)
        fast = abs(v) * p[slots.DRAG] + np.sqrt(abs(free) * p[slots.DRAG])
        if 2.0 * fast * h * inverse > SETTLES:
            return _step_in_drag(x, v, free, h, p)
    k1 = (first - resisting(x, v, memory, p)) * inverse
    v2 = v + half * k1
    k2 = (middle - resisting(x + half * v, v2, memory, p)) * inverse
    v3 = v + half * k2
    k3 = (middle - resisting(x + half * v2, v3, memory, p)) * inverse
    v4 = v + h * k3
    k4 = (last - resisting(x + h * v3, v4, memory, p)) * inverse
    sixth = h / 6.0
    return x + sixth * (v + 2.0 * (v2 + v3) + v4), v + sixth * (
        k1 + 2.0 * (k2 + k3) + k4
    )


@compiled(**INNER)
def _step_in_drag(
    x: float, v: float, free: float, h: float, p: np.ndarray
) -> tuple[float, float]:
    """Step within which drag settles: it and the damping act with the speed at the end.

    Parameters
    ----------
    free : float, [N]
        All other forces.
    """
    slow = p[slots.MASS] / h
    impulse = free + slow * v
    slow += p[slots.DAMPING]
    root = np.sqrt(slow * slow + 4.0 * p[slots.DRAG] * abs(impulse))
    speed = 2.0 * impulse / (slow + root)
    return x + h * speed, speed


@compiled(**INNER)
def _step_varying(
    x: float,
    v: float,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    p: np.ndarray,
) -> tuple[float, float]:
    """Step where the motor's force depends on position, friction on it, or with formulas."""
    inverse = 1.0 / p[slots.MASS]
    xs, vs = x, v
    x1, v1 = x, v
    for stage in range(4):
        after, weight, way = runge_kutta_stage(stage, h)
        at = done + after
        drive = value_of(push, DRIVE, at) * ripple(xs, p)
        net = drive + value_of(push, OTHER, at) - resisting(xs, vs, memory, p)
        net -= memory[WAY] * p[slots.DRIVE_SHARE] * abs(drive)
        if p[slots.OWN_FORCE] != 0.0:
            net += own_force(xs, vs, memory[WAY], push, at, p)
        slope = vs
        weight *= h / 6.0
        x1 += weight * slope
        v1 += weight * net * inverse
        xs = x + way * slope
        vs = v + way * net * inverse
    return x1, v1


@compiled(**MAKING)
def step_all(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    is_held: bool,
    p: np.ndarray,
) -> None:
    """Set ``trial`` to the state one Runge-Kutta step on.

    Parameters
    ----------
    state, trial : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    is_held : bool
        Whether position and velocity of the mass stay as they are.
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.HAS_CONTACT] != 0.0:
        touch(state[X], memory, p)
    if p[slots.MODE_MASS] == 0.0 and not depends_on_motion(p):
        _step_coupled(state, trial, memory, push, done, h, is_held, p)
        return
    if is_wound(p):
        step_wound(state, trial, memory, push, done, h, is_held, p)
        return
    total, slope = np.zeros(N_STATE), np.empty(N_STATE)
    for n in range(N_STATE):
        trial[n] = state[n]
    for stage in range(4):
        after, weight, way = runge_kutta_stage(stage, h)
        a, motor, part, circuit = acceleration(trial, memory, push, done + after, p)
        slope[0], slope[1] = trial[V], a
        if is_held:
            slope[0], slope[1] = 0.0, 0.0
        slope[2], slope[3] = trial[MOTOR_V], motor
        slope[4], slope[5], slope[6] = trial[PART_V], part, circuit
        for n in range(N_STATE):
            total[n] += weight * slope[n]
            trial[n] = state[n] + way * slope[n]
    for n in range(N_STATE):
        trial[n] = state[n] + h / 6.0 * total[n]


@compiled(**INNER)
def _step_coupled(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    is_held: bool,
    p: np.ndarray,
) -> None:
    """Step of mass and motor alone, without room to work in: the frequent case."""
    load = p[slots.MASS]
    load -= p[slots.MOTOR_SHARE] * load
    x0, v0, xm0, vm0 = state[X], state[V], state[MOTOR_X], state[MOTOR_V]
    x, v, xm, vm = x0, v0, xm0, vm0
    dx = dv = dxm = dvm = 0.0
    for stage in range(4):
        after, weight, way = runge_kutta_stage(stage, h)
        at = done + after
        force = value_of(push, DRIVE, at)
        net, motor = net_forces(x, v, xm, vm, force, memory, push, at, p)
        speed, gain = v, net / load
        if is_held:
            speed = gain = 0.0
        dx += weight * speed
        dv += weight * gain
        dxm += weight * vm
        dvm += weight * motor
        x, v = x0 + way * speed, v0 + way * gain
        xm, vm = xm0 + way * vm, vm0 + way * motor
    for n in range(N_STATE):
        trial[n] = state[n]
    sixth = h / 6.0
    trial[X], trial[V] = x0 + sixth * dx, v0 + sixth * dv
    trial[MOTOR_X], trial[MOTOR_V] = xm0 + sixth * dxm, vm0 + sixth * dvm
