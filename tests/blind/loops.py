"""Compiled loops of the blind test's machine: input chain, forces, motion.

The motion is integrated with the classical Runge-Kutta method. A mass with dry friction
either slides in one direction or sticks; the instants where it stops and where it breaks
away are located inside the step, so that sticking is exact.
"""

import math

import numpy as np
from numba import njit

# Places in the state.
X, V, MOTOR_X, MOTOR_V, PART_X, PART_V, YIELD, CREEP, BRISTLE = range(9)
STATES = 9
# Rows of the signals.
CURRENT, HEAT, FORCE, STIFFNESS = range(4)
# Halvings of a step that locate an event: 25 us / 2^40 is below rounding.
HALVINGS = 40
# More events than this within one step are rattling that no step resolves.
MOST_EVENTS = 12


@njit(cache=True)
def after_rate_limit(target, most):
    """A current that follows with at most ``most`` a step; the target is linear between.

    Where the two meet inside a step is solved for, because an error there would stay
    until they meet again.
    """
    current = np.empty_like(target)
    current[0] = target[0]
    for n in range(1, len(target)):
        ahead = target[n - 1] - current[n - 1]
        rise = target[n] - target[n - 1]
        followed = min(max(rise, -most), most)
        if ahead == 0.0:
            current[n] = current[n - 1] + followed
            continue
        chase = math.copysign(most, ahead)
        meet = ahead / (chase - rise) if chase != rise else -1.0
        if not 0.0 <= meet < 1.0:
            meet = 1.0
        current[n] = current[n - 1] + meet * chase + (1.0 - meet) * followed
        if meet < 1.0 and abs(rise) <= most:
            # It has met the target and follows it; rounding must not part them.
            current[n] = target[n]
    return current


@njit(cache=True)
def lagged(target, step, lag):
    """Exact first-order lag of a target that is linear between its values."""
    keep = math.exp(-step / lag)
    ramp = 1.0 - lag / step * (1.0 - keep)
    current = np.empty_like(target)
    current[0] = target[0]
    for n in range(1, len(target)):
        start, rise = target[n - 1], target[n] - target[n - 1]
        current[n] = keep * current[n - 1] + (1.0 - keep) * start + ramp * rise
    return current


@njit(cache=True)
def heating(square, step, time, heat):
    """Temperature from cold under a power that is linear between its values."""
    keep = math.exp(-step / time)
    ramp = 1.0 - time / step * (1.0 - keep)
    heat[0] = 0.0
    for n in range(1, len(square)):
        rise = square[n] - square[n - 1]
        heat[n] = keep * heat[n - 1] + (1.0 - keep) * square[n - 1] + ramp * rise


@njit(cache=True)
def at(signals, row, place):
    first = min(int(place), signals.shape[1] - 2)
    share = place - first
    return (1.0 - share) * signals[row, first] + share * signals[row, first + 1]


@njit(cache=True)
def motor_force(machine, current, heat, v):
    top = machine.voltage_limit_A
    back = machine.voltage_slope_A_s_per_m * v
    current = min(max(current, -top - back), top - back)
    ratio = current / machine.reference_A
    kept = (
        1.0
        - machine.square_loss * ratio * ratio
        - machine.linear_loss * abs(ratio)
        - machine.heat_loss * heat
    )
    return machine.force_constant_N_per_A * kept * current


@njit(cache=True)
def beyond(distance, half_gap):
    return max(distance - half_gap, 0.0) - max(-distance - half_gap, 0.0)


@njit(cache=True)
def tooth_force(machine, state):
    """Force of the motor on the load: a spring and a damper that push and never pull."""
    twist = beyond(state[MOTOR_X] - state[X], machine.gear_half_gap_m)
    if twist == 0.0:
        return 0.0
    force = machine.gear_N_per_m * twist
    force += machine.gear_N_s_per_m * (state[MOTOR_V] - state[V])
    return max(force, 0.0) if twist > 0.0 else min(force, 0.0)


@njit(cache=True)
def spring_force(machine, x, rest, change):
    stretch = beyond(x, machine.spring_gap_m)
    if machine.sinh_m > 0.0:
        stretch = machine.sinh_m * math.sinh(stretch / machine.sinh_m)
    force = machine.stiffness_N_per_m * (1.0 + change) * stretch
    force += machine.cubic_N_per_m3 * x * x * x + machine.quadratic_N_per_m2 * x * x
    above, below = x - machine.upper_stop_m, -x - machine.lower_stop_m
    force += machine.stop_N_per_m * (max(above, 0.0) - max(below, 0.0))
    if machine.cogging_N != 0.0:
        q = machine.cogging_phase
        angle = 2.0 * math.pi * (x - rest) / machine.cogging_period_m + q
        force += machine.cogging_N * (math.sin(angle) - math.sin(q))
    return force


@njit(cache=True)
def bristle_rate(machine, v, z):
    near_rest = math.exp(-((v / machine.stribeck_m_per_s) ** 2))
    level = machine.bristle_N + machine.bristle_excess_N * near_rest
    return v - machine.bristle_N_per_m * abs(v) * z / level


@njit(cache=True)
def free_force(machine, rest, signals, place, state):
    """Force on the mass without dry friction."""
    x, v = state[X], state[V]
    motor = motor_force(
        machine, at(signals, CURRENT, place), at(signals, HEAT, place), v
    )
    if machine.motor_kg > 0.0:
        motor = tooth_force(machine, state)
    force = motor + machine.load_N + at(signals, FORCE, place)
    force -= spring_force(machine, x, rest, at(signals, STIFFNESS, place))
    force -= machine.damping_N_s_per_m * v
    force -= machine.hysteresis_N * state[YIELD]
    force -= machine.creep_N_per_m * (x - state[CREEP])
    if machine.drag != 0.0:
        force -= machine.drag * abs(v) ** (machine.drag_exponent - 1.0) * v
    if machine.appendage_kg > 0.0:
        force += machine.appendage_N_per_m * (state[PART_X] - x)
        force += machine.appendage_N_s_per_m * (state[PART_V] - v)
    if machine.bristle_N_per_m > 0.0:
        rate = bristle_rate(machine, v, state[BRISTLE])
        force -= machine.bristle_N_per_m * state[BRISTLE]
        force -= machine.bristle_damping_N_s_per_m * rate
    return force


@njit(cache=True)
def friction_level(machine, direction, x, v):
    sliding = machine.forward_N if direction > 0 else machine.backward_N
    near_rest = math.exp(-((v / machine.stribeck_m_per_s) ** 2))
    return (
        sliding
        + machine.static_excess_N * near_rest
        + machine.position_friction_N_per_m * abs(x)
    )


@njit(cache=True)
def slope(machine, rest, signals, place, state, way, held, out):
    """Rate of the state; ``way`` is the direction of sliding, 0 without friction."""
    x, v = state[X], state[V]
    force = free_force(machine, rest, signals, place, state)
    if way != 0:
        force -= way * friction_level(machine, way, x, v)
    out[X] = 0.0 if held else v
    out[V] = 0.0 if held else force / (machine.mass_kg - machine.motor_kg)
    if machine.motor_kg > 0.0:
        current, heat = at(signals, CURRENT, place), at(signals, HEAT, place)
        drive = motor_force(machine, current, heat, state[MOTOR_V])
        out[MOTOR_X] = state[MOTOR_V]
        out[MOTOR_V] = (drive - tooth_force(machine, state)) / machine.motor_kg
    if machine.appendage_kg > 0.0:
        pull = machine.appendage_N_per_m * (x - state[PART_X])
        pull += machine.appendage_N_s_per_m * (v - state[PART_V])
        out[PART_X] = state[PART_V]
        out[PART_V] = pull / machine.appendage_kg
    out[YIELD] = (v - abs(v) * state[YIELD]) / machine.yield_m
    out[CREEP] = (x - state[CREEP]) / machine.creep_time_s
    if machine.bristle_N_per_m > 0.0:
        out[BRISTLE] = bristle_rate(machine, v, state[BRISTLE])


@njit(cache=True)
def advance(machine, rest, signals, place, width, step, state, way, held, work, new):
    """One Runge-Kutta step of ``width`` half steps, each ``step`` seconds."""
    a, b, c, d, between = work[0], work[1], work[2], work[3], work[4]
    h = width * step
    slope(machine, rest, signals, place, state, way, held, a)
    for n in range(STATES):
        between[n] = state[n] + 0.5 * h * a[n]
    slope(machine, rest, signals, place + 0.5 * width, between, way, held, b)
    for n in range(STATES):
        between[n] = state[n] + 0.5 * h * b[n]
    slope(machine, rest, signals, place + 0.5 * width, between, way, held, c)
    for n in range(STATES):
        between[n] = state[n] + h * c[n]
    slope(machine, rest, signals, place + width, between, way, held, d)
    for n in range(STATES):
        new[n] = state[n] + h / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n])


@njit(cache=True)
def breaks_away(machine, rest, signals, place, state):
    """Direction in which the mass leaves rest, 0 where friction holds it."""
    force = free_force(machine, rest, signals, place, state)
    if force > friction_level(machine, 1, state[X], 0.0):
        return 1
    if -force > friction_level(machine, -1, state[X], 0.0):
        return -1
    return 0


@njit(cache=True)
def event_within(machine, rest, signals, place, new, way):
    """Whether the state at the end of a step ends this way of moving."""
    if way == 0:
        return breaks_away(machine, rest, signals, place, new) != 0
    return new[V] * way < 0.0


@njit(cache=True)
def through_events(machine, rest, signals, start, step, state, way, work, new):
    """Two half steps with stops and break-aways located inside; the way at the end."""
    place, left = start, 2.0
    for _ in range(MOST_EVENTS):
        held = way == 0
        advance(machine, rest, signals, place, left, step, state, way, held, work, new)
        if not event_within(machine, rest, signals, place + left, new, way):
            state[:] = new
            return way
        low, high = 0.0, left
        for _ in range(HALVINGS):
            width = 0.5 * (low + high)
            advance(
                machine, rest, signals, place, width, step, state, way, held, work, new
            )
            if event_within(machine, rest, signals, place + width, new, way):
                high = width
            else:
                low = width
        advance(machine, rest, signals, place, high, step, state, way, held, work, new)
        state[:] = new
        state[V] = 0.0
        place += high
        left -= high
        way = breaks_away(machine, rest, signals, place, state)
        if left <= 0.0:
            return way
    # Rattling about zero speed: friction holds for the rest of the step.
    advance(machine, rest, signals, place, left, step, state, 0, True, work, new)
    state[:] = new
    return 0


@njit(cache=True)
def motion(machine, signals, rest, step, steps, dry):
    """Position, speed and position behind the play at the samples."""
    samples = (signals.shape[1] - 1) // (2 * steps) + 1
    x, v, played = np.empty(samples), np.empty(samples), np.empty(samples)
    state, new = np.zeros(STATES), np.zeros(STATES)
    work = np.zeros((5, STATES))
    state[X] = state[MOTOR_X] = state[PART_X] = state[CREEP] = rest
    follower, gap = rest, machine.play_half_gap_m
    x[0], v[0], played[0] = rest, 0.0, rest
    way = breaks_away(machine, rest, signals, 0.0, state) if dry else 0
    for n in range(1, samples):
        for inner in range(steps):
            place = 2.0 * ((n - 1) * steps + inner)
            if dry:
                way = through_events(
                    machine, rest, signals, place, step, state, way, work, new
                )
            else:
                advance(
                    machine, rest, signals, place, 2.0, step, state, 0, False, work, new
                )
                state[:] = new
            follower = min(max(follower, state[X] - gap), state[X] + gap)
        x[n], v[n], played[n] = state[X], state[V], follower
    return x, v, played
