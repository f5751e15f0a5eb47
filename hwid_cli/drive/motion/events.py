"""Compiled steps of a drive, and the times at which something happens within them.

docs/method_diagnosis.md, eq. (D2), (D3).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.corners import corner_of, margin
from hwid_cli.drive.motion.curved import is_curved_here, step_all, step_plain
from hwid_cli.drive.motion.forces import (
    acceleration,
    held_further,
    moved_mass,
    speed_of_excess,
    surplus,
)
from hwid_cli.drive.motion.hysteresis import yielded
from hwid_cli.drive.motion.linear import (
    DRIVEN,
    OFFSET,
    OTHERS,
    STEADY,
    sum_plain,
    sum_series,
)
from hwid_cli.drive.motion.push import DRIVE, OTHER, shift, value_of
from hwid_cli.drive.motion.state import DEFLECTION, SIDE, TURNED_AT, WAY, V, X

# Iterations that locate an event; each one at least halves what is left.
LOCATING = 40
# A force below this share of the force constant counts as balanced.
BALANCE = 1e-12
# A Stribeck excess that is left out must be below exp(-5^2) at the end of a step.
STILL_FAST = 5.0
# Stands for the sign of a distance that is 0.
TINY = 1e-300
# Where the drive is that has just left 0, and nearer than that it is at 0, [m].
OFF_EDGE, ON_EDGE = 1e-100, 1e-200
# What can happen within a step.
LEAVING, REVERSAL, EDGE = 0, 1, 2


@compiled(**INNER)
def steady_force(memory: np.ndarray, p: np.ndarray) -> float:
    """Return friction and preload on a stretch that is linear.

    Parameters
    ----------
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    way = memory[WAY]
    if way == 0.0:
        force = -p[slots.HYSTERESIS_FORCE] * memory[DEFLECTION]
    else:
        level = p[slots.FRICTION_FORWARD] if way > 0.0 else p[slots.FRICTION_BACKWARD]
        force = -way * (level + p[slots.HYSTERESIS_FORCE])
    if p[slots.PRELOAD] > 0.0:
        force -= memory[SIDE] * p[slots.PRELOAD]
    return force


@compiled(**INNER)
def slowest_straight(p: np.ndarray) -> float:
    """Return the speed above which friction near rest may be left out, [m/s].

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.STATIC_EXCESS] == 0.0:
        return 0.0
    return speed_of_excess(STILL_FAST, p)


@compiled(**INNER)
def stays(p: np.ndarray) -> bool:
    """Return whether nothing curved goes on in a drive whose mass is held.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.GEAR_STIFFNESS] == 0.0


@compiled(**INNER)
def set_inputs(
    inputs: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> None:
    """Set the inputs of a linear step.

    Parameters
    ----------
    inputs : ndarray, shape (N_INPUT,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    a, b, c, d = shift(push, DRIVE, done)
    inputs[DRIVEN], inputs[DRIVEN + 1] = a, b
    inputs[DRIVEN + 2], inputs[DRIVEN + 3] = c, d
    a, b, c, d = shift(push, OTHER, done)
    inputs[OFFSET], inputs[STEADY] = 1.0, a + steady_force(memory, p)
    inputs[OTHERS], inputs[OTHERS + 1], inputs[OTHERS + 2] = b, c, d


@compiled(**INNER)
def advance(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    corner: tuple[int, float, float, float, float, float],
    is_held: bool,
    kind: tuple[bool, bool, bool, bool, bool, float],
    inputs: np.ndarray,
    p: np.ndarray,
) -> None:
    """Set ``trial`` to the state one step on; forces keep the side of their corners.

    Parameters
    ----------
    state, trial : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    corner : tuple
        From ``corner_of``.
    is_held : bool
        Whether position and velocity of the mass stay as they are.
    kind : tuple
        Whether there are inner states, edges, always curved forces, reversals to watch,
        friction that is curved at times; and the fastest rate.
    inputs : ndarray, shape (N_INPUT,)
        Room to work in.
    p : ndarray, shape (N_SLOTS,)
    """
    has_inner, _, is_curved, _, is_curved_at_times, rate = kind
    if is_held and not has_inner:
        trial[X], trial[V] = state[X], state[V]
        return
    if is_held and stays(p):
        is_curved = False
    elif is_curved_at_times and not is_curved:
        is_curved = is_curved_here(state, memory, p)
    if not is_curved:
        set_inputs(inputs, memory, push, done, p)
        if has_inner:
            sum_series(state, trial, inputs, h, corner, is_held, rate, p)
        else:
            cubic = (
                inputs[DRIVEN] + inputs[STEADY] - corner[2],
                inputs[DRIVEN + 1] + inputs[OTHERS],
                inputs[DRIVEN + 2] + inputs[OTHERS + 1],
                inputs[DRIVEN + 3] + inputs[OTHERS + 2],
            )
            x, v = sum_plain(state[X], state[V], cubic, h, corner[1], rate, p)
            trial[X], trial[V] = x, v
        if is_held or p[slots.STATIC_EXCESS] == 0.0:
            return
        if memory[WAY] * trial[V] > speed_of_excess(STILL_FAST, p):
            return
    if has_inner:
        step_all(state, trial, memory, push, done, h, is_held, p)
    else:
        x, v = step_plain(state[X], state[V], memory, push, done, h, p)
        trial[X], trial[V] = x, v


@compiled(**INNER)
def excess(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> tuple[float, float]:
    """Return the force on the resting mass, and by how much friction cannot hold it.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    net = acceleration(state, memory, push, done, p)[0] * moved_mass(p)
    more = surplus(net, p) - BALANCE * p[slots.FORCE_CONSTANT]
    if p[slots.HAS_MORE] != 0.0 or p[slots.DRIVE_SHARE] > 0.0:
        more -= held_further(state, push, done, p)
    return net, more


@compiled(**INNER)
def set_off(state: np.ndarray, memory: np.ndarray, way: float, p: np.ndarray) -> None:
    """Let the drive slide from where it rests.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    way : float
        Direction of sliding.
    p : ndarray, shape (N_SLOTS,)
    """
    memory[WAY] = way
    if p[slots.HAS_ZERO_EDGE] != 0.0 and state[X] == 0.0:
        state[X] = way * OFF_EDGE
        memory[SIDE] = way


@compiled(**INNER)
def pass_zero(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> None:
    """Notice on which side of 0 the drive is, and whether a preload catches it there.

    A drive that would soon stop stays at 0: smaller and smaller swings to both sides
    would come without end.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    x, way = state[X], memory[WAY]
    if way == 0.0 or np.sign(x) == memory[SIDE]:
        return
    if p[slots.PRELOAD] > 0.0:
        state[X], memory[WAY], memory[SIDE] = 0.0, 0.0, 0.0
        net, more = excess(state, memory, push, done, p)
        # What drives it back once it is beyond 0, friction included.
        back = abs(net) - more - net * way
        if more <= 0.0 and abs(state[V]) * moved_mass(p) < back * p[slots.CAPTURE_TIME]:
            state[V] = 0.0
            return
        state[X], memory[WAY] = x, way
    set_off(state, memory, way, p)
    memory[SIDE] = np.sign(state[X])


@compiled(**INNER)
def stop(
    state: np.ndarray, memory: np.ndarray, push: np.ndarray, done: float, p: np.ndarray
) -> None:
    """Stop, and decide whether the drive sticks or goes on.

    Parameters
    ----------
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    state[V] = 0.0
    if p[slots.HYSTERESIS_FORCE] != 0.0:
        memory[DEFLECTION] = yielded(state[X], 0.0, memory, p)
        memory[TURNED_AT] = state[X]
    memory[WAY] = 0.0
    net, more = excess(state, memory, push, done, p)
    if more > 0.0:
        set_off(state, memory, np.sign(net), p)


@compiled(**INNER)
def time_of(
    event: int,
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    corner: tuple[int, float, float, float, float, float],
    is_held: bool,
    kind: tuple[bool, bool, bool, bool, bool, float],
    inputs: np.ndarray,
    p: np.ndarray,
) -> float:
    """Find when an event happens; leave the state there in ``trial``.

    Parameters
    ----------
    event : int
        LEAVING, REVERSAL or EDGE.
    state, trial, memory, push, done, h, corner, is_held, kind, inputs, p
        As in ``advance``, which has just been called.

    Returns
    -------
    float, [s]
        Just behind the event; 0 if a reversal finds that nothing has moved.
    """
    way = memory[WAY]
    low, high = 0.0, h
    # Before the event this is positive, afterwards not.
    at_low = at_high = 0.0
    is_found = event != REVERSAL or way * state[V] > 0.0
    if event == REVERSAL:
        at_low, at_high = way * state[V], way * trial[V]
    elif event == LEAVING:
        at_low = -excess(state, memory, push, done, p)[1]
        at_high = -excess(trial, memory, push, done + h, p)[1]
    else:
        at_low = margin(state, value_of(push, DRIVE, done), corner[0], p)
        at_high = margin(trial, value_of(push, DRIVE, done + h), corner[0], p)
    enough = 1e-13 * (abs(at_low) + abs(at_high))
    weight_low = weight_high = 1.0
    last = 0
    time = h
    for n in range(2 * LOCATING):
        if not is_found or at_low <= at_high or n > LOCATING:
            time = 0.5 * (low + high)
        else:
            one, two = weight_low * at_low, weight_high * at_high
            time = low + (high - low) * one / (one - two)
        if high - low <= 1e-12 * h:
            time = high
        advance(
            state, trial, memory, push, done, time, corner, is_held, kind, inputs, p
        )
        if time == high:
            break
        if event == REVERSAL:
            value = way * trial[V]
        elif event == LEAVING:
            value = -excess(trial, memory, push, done + time, p)[1]
        else:
            there = value_of(push, DRIVE, done + time)
            value = margin(trial, there, corner[0], p)
            if value == 0.0:
                # On the edge to the last bit: its number decides.
                is_passed = corner_of(trial, there, p)[0] != corner[0]
                value = -TINY if is_passed else TINY
        if value > 0.0:
            is_found = True
            # Illinois rule: halve the weight of the end that stays twice.
            weight_low = 1.0
            weight_high *= 0.5 if last == 1 else 1.0
            low, at_low, last = time, value, 1
        else:
            weight_high = 1.0
            weight_low *= 0.5 if last == -1 else 1.0
            high, at_high, last = time, value, -1
        # An edge has to be passed, or it would be found again.
        if abs(value) <= enough and is_found and (event != EDGE or value < 0.0):
            break
    if not is_found:
        return 0.0
    if event == REVERSAL:
        trial[V] = 0.0
    return time
