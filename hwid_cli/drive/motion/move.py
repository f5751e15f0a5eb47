"""Compiled motion of a drive with every effect, events located inside the step.

Between events the motion is summed exactly where all forces are linear, and follows
Runge-Kutta steps where one is curved. Events are stops and reversals, break-aways, and
the edges of stops, gaps and limits; a step never straddles one. Friction at rest is
exact: position and velocity stay as they are to the last digit.
docs/method_diagnosis.md, eq. (D1) to (D3).
"""

import numpy as np

from hwid_cli.compiled import INNER, MAKING, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.command import MOST_PIECES, static_command
from hwid_cli.drive.controller import N_CONTROL, controlled, is_closed
from hwid_cli.drive.motion.corners import corner_of, count_edges
from hwid_cli.drive.motion.curved import is_always_curved, step_limit
from hwid_cli.drive.motion.events import (
    EDGE,
    LEAVING,
    OFF_EDGE,
    REVERSAL,
    advance,
    excess,
    pass_zero,
    set_off,
    stays,
    stop,
    time_of,
)
from hwid_cli.drive.motion.excursions import LONGEST_PHASE
from hwid_cli.drive.motion.exponential import is_exponential
from hwid_cli.drive.motion.forces import drawn_current, has_dry_friction
from hwid_cli.drive.motion.hysteresis import bristle_level, remember
from hwid_cli.drive.motion.linear import N_COLUMNS, N_INPUT, active_states, fastest
from hwid_cli.drive.motion.pieces import LENGTH, N_PIECE, SAMPLE, list_pieces
from hwid_cli.drive.motion.push import (
    DRIVE,
    N_PUSH,
    N_ROOM,
    depends_on_motion,
    value_of,
)
from hwid_cli.drive.motion.quiet import MOST_STEPS, glide_inner, glide_plain
from hwid_cli.drive.motion.resting import is_anywhere, resting_force, resting_point
from hwid_cli.drive.motion.state import (
    CIRCUIT,
    HEAT,
    LAGGED,
    LEVEL,
    MOTOR_V,
    MOTOR_X,
    N_MEMORY,
    N_STATE,
    PART_V,
    PART_X,
    SIDE,
    TURNED_AT,
    WAY,
    V,
    X,
)
from hwid_cli.drive.motion.winding import is_wound, slow_pace

# Halvings of a sample for exponential steps.
HALVINGS = 6
# Pieces that are listed at once.
MANY_PIECES = 1000
# Most events in one piece; what rattles more often is followed less exactly.
MOST_EVENTS = 100
# Beyond this a drive has run away, [m].
FAR_AWAY = 1e60
# A preload catches a drive at 0 that it would stop within this share of a sample.
CAPTURE_SHARE = 0.02


@compiled(nogil=True, error_model="numpy")
def move(
    command: np.ndarray, force: np.ndarray, sample_time: float, given_p: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position and velocity of the measured place, and command, at every sample.

    Parameters
    ----------
    command : ndarray, shape (n,), [A] or [V]; the reference [m] under a controller
    force : ndarray, shape (n,) or (0,), [N]
        That acts on the mass beside the drive's own; empty where there is none.
    sample_time : float, [s]
    given_p : ndarray, shape (N_SLOTS,)
    """
    n = command.size
    p = given_p.copy()
    positions, velocities = np.full(n, np.nan), np.full(n, np.nan)
    given = command.copy()
    has_controller, control = is_closed(p), np.zeros(N_CONTROL)
    is_reset, summed = p[slots.LOOP_RESET] > 0.0, 0.0
    if is_reset:
        force = force.copy() if force.size > 0 else np.zeros(n)
    before = 0.0 if has_controller else command[0]
    state, memory = np.zeros(N_STATE), np.zeros(N_MEMORY)
    at_start = force[0] if force.size > 0 else 0.0
    followed = _start(state, memory, before, at_start, sample_time, p)
    trial, inputs, active = state.copy(), np.zeros(N_INPUT), active_states(p)
    kind = _kind_of(p)
    step = _longest_step(sample_time, kind, p)
    matrices, lengths = _make_room(sample_time, step, kind, p)
    # Pieces are listed for many samples at once, or for one after the other where the
    # command, a force or the temperature depends on the motion.
    is_single = (
        has_controller
        or is_reset
        or (depends_on_motion(p) and p[slots.THERMAL_LOSS] != 0.0)
    )
    pieces = np.empty((MOST_PIECES + (0 if is_single else MANY_PIECES), N_PIECE))
    pushes, ends = np.zeros((pieces.shape[0], N_PUSH)), np.empty((2, n))
    room = np.zeros(N_ROOM)
    seen = MOTOR_X if p[slots.SENSOR_AT_MOTOR] > 0.0 else X
    positions[0], velocities[0] = state[seen], state[seen + 1]
    # Not plain 0: numba would compile what it is handed to twice.
    sample: int = np.int64(0)  # type: ignore[assignment]
    while sample < n and np.isfinite(positions[sample]):
        if has_controller:
            given[sample] = controlled(
                command[sample], positions[sample], velocities[sample], sample_time,
                control, p,
            )  # fmt: skip
        if is_reset and sample + 1 < n:
            driving = p[slots.FORCE_CONSTANT] * given[sample]
            driving -= p[slots.STIFFNESS] * positions[sample]
            summed += p[slots.LOOP_RESET] * sample_time * driving
            force[sample + 1] += summed
        now = drawn_current(given[sample], state, p) if is_single else 0.0
        count, followed, sample = list_pieces(
            sample, sample_time, given, force, ends, before, followed, now, pieces,
            pushes, room, memory, p,
        )  # fmt: skip
        j: int = np.int64(0)  # type: ignore[assignment]
        # A drive that has run away stays there: nothing bounds its steps any more.
        while j < count and np.abs(state[X]) < FAR_AWAY:
            push, length, done = pushes[j], pieces[j, LENGTH], 0.0
            if kind[0]:
                done = glide_inner(
                    state, trial, memory, push, length, step, kind, matrices,
                    lengths, inputs, active, p,
                )  # fmt: skip
            else:
                j, done = glide_plain(
                    j, count, pieces, pushes, positions, velocities, state, memory,
                    step, kind, matrices, lengths, p,
                )  # fmt: skip
                if j == count:
                    break
                push, length = pushes[j], pieces[j, LENGTH]
            if done < length:
                _move_piece(
                    state, trial, memory, push, done, length, step, kind, inputs, p
                )
            at = int(pieces[j, SAMPLE])
            if at >= 0:
                positions[at], velocities[at] = state[seen], state[seen + 1]
            j += 1
        if count == 0 or not np.abs(state[X]) < FAR_AWAY:
            break
    _blank(positions, velocities, given)
    return positions, velocities, given


@compiled(**INNER)
def _blank(positions: np.ndarray, velocities: np.ndarray, given: np.ndarray) -> None:
    """Set everything to NaN from where the simulation has run away."""
    is_away = False
    for i in range(positions.size):
        is_away = is_away or not np.isfinite(positions[i])
        if is_away:
            positions[i] = velocities[i] = given[i] = np.nan


@compiled(**INNER)
def _kind_of(p: np.ndarray) -> tuple[bool, bool, bool, bool, bool, float]:
    """Return what kind of drive it is, as in ``events.advance``."""
    has_inner = (
        p[slots.GEAR_STIFFNESS] > 0.0
        or p[slots.MODE_MASS] > 0.0
        or depends_on_motion(p)
    )
    is_watched = has_dry_friction(p) or p[slots.HYSTERESIS_FORCE] != 0.0
    at_times = p[slots.STATIC_EXCESS] != 0.0 or p[slots.HYSTERESIS_FORCE] != 0.0
    at_times = at_times or p[slots.HAS_CONTACT] != 0.0
    return (
        has_inner,
        count_edges(p) > 0,
        is_always_curved(p),
        is_watched,
        at_times,
        fastest(p),
    )


@compiled(**INNER)
def _longest_step(
    sample_time: float,
    kind: tuple[bool, bool, bool, bool, bool, float],
    p: np.ndarray,
) -> float:
    """Return the longest step of linear motion, a whole part of a sample."""
    has_inner, has_edges, is_curved, is_watched, is_curved_at_times, rate = kind
    count = 1.0
    if has_edges or is_watched:
        if is_wound(p):
            # What settles does not go there and back.
            fast = p[slots.RESISTANCE] / p[slots.INDUCTANCE]
            rate += slow_pace(fast, LONGEST_PHASE, p) - fast
        count = np.ceil(sample_time * rate / LONGEST_PHASE)
        count = min(max(count, 1.0), MOST_STEPS)
        if has_inner and (is_curved or is_curved_at_times):
            # Exponential steps are halves of halves of a sample.
            halves = 1.0
            while halves < count:
                halves *= 2.0
            count = halves
    return sample_time / count


@compiled(**MAKING)
def _make_room(
    sample_time: float,
    step: float,
    kind: tuple[bool, bool, bool, bool, bool, float],
    p: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return room for matrices, and the lengths that they are for."""
    # Lengths that come back in every sample: whole steps, and both parts that a delay
    # makes of a sample.
    whole = np.floor(p[slots.DELAY] / sample_time) * sample_time
    part = p[slots.DELAY] - whole
    halvings = 0
    if kind[0] and (kind[2] or kind[4]) and is_exponential(p):
        halvings = HALVINGS
    n_parts = 3 if part > 0.0 else 1
    parts = (sample_time, part, sample_time - part)
    lengths = np.empty(1 + n_parts * (1 + halvings))
    lengths[0] = step
    count = 1
    for n in range(n_parts):
        length = parts[n]
        for _ in range(1 + halvings):
            lengths[count] = length
            length *= 0.5
            count += 1
    n_matrices = lengths.size * 2 * 3 ** count_edges(p)
    return np.zeros((n_matrices, N_STATE, N_COLUMNS)), lengths


@compiled(**INNER)
def _start(
    state: np.ndarray,
    memory: np.ndarray,
    command: float,
    force: float,
    sample_time: float,
    p: np.ndarray,
) -> float:
    """Set the drive to rest in equilibrium, or to the given start.

    Parameters
    ----------
    force : float, [N]
        That acts at first beside the drive's own; it moves no magnets.
    """
    _couple(p)
    take_stock(sample_time, p)
    command = static_command(command, p)
    # One start for both: a lag that is followed by a winding is only the quicker one.
    has_winding = p[slots.RESISTANCE] > 0.0 and p[slots.INDUCTANCE] > 0.0
    memory[LAGGED] = command
    memory[LAGGED] += 0.0 if has_winding else p[slots.START_CURRENT]
    current = memory[LAGGED]
    if p[slots.RESISTANCE] > 0.0:
        current /= p[slots.RESISTANCE]
        current += p[slots.START_CURRENT] if has_winding else 0.0
        state[CIRCUIT] = current
    if p[slots.COGGING_ABOUT_MEAN] == 0.0:
        p[slots.COGGING_REST] = np.sin(p[slots.COGGING_PHASE])
    if p[slots.GRAVITY_IS_SETTLED] > 0.0:
        angle = p[slots.START_POSITION] + p[slots.GRAVITY_ANGLE]
        p[slots.GRAVITY_REST] = p[slots.GRAVITY_TORQUE] * np.sin(angle)
    if p[slots.STIFFNESS] > 0.0:
        p[slots.COGGING_ORIGIN] = resting_point(0.0, False, p)
    if p[slots.IS_START_GIVEN] > 0.0:
        state[X] = p[slots.START_POSITION]
        state[V] = p[slots.START_VELOCITY]
    else:
        p[slots.LOAD] += force
        state[X] = resting_point(current, True, p)
        p[slots.LOAD] -= force
    if p[slots.GEAR_STIFFNESS] > 0.0:
        # Of both masses that swing against each other on the teeth.
        swinging = p[slots.MASS] * p[slots.MOTOR_SHARE] * (1.0 - p[slots.MOTOR_SHARE])
        p[slots.GEAR_DAMPING] = 2.0 * p[slots.GEAR_DAMPING_RATIO]
        p[slots.GEAR_DAMPING] *= np.sqrt(p[slots.GEAR_STIFFNESS] * swinging)
        p[slots.MOTOR_DAMPING] = p[slots.MOTOR_DAMPING_SHARE] * p[slots.DAMPING]
        p[slots.DAMPING] -= p[slots.MOTOR_DAMPING]
    driving = resting_force(state[X], current, p)
    state[MOTOR_X] = state[X]
    if p[slots.GEAR_STIFFNESS] > 0.0 and driving != 0.0:
        state[MOTOR_X] += np.sign(driving) * p[slots.GEAR_GAP]
        state[MOTOR_X] += driving / p[slots.GEAR_STIFFNESS]
    elif p[slots.GEAR_STIFFNESS] > 0.0:
        state[MOTOR_X] += p[slots.GEAR_START] * p[slots.GEAR_GAP]
    is_placed = p[slots.IS_START_GIVEN] > 0.0 or is_anywhere(p)
    if p[slots.SENSOR_AT_MOTOR] > 0.0 and is_placed:
        # The start is that of the place that is measured.
        state[X], state[MOTOR_X] = 2.0 * state[X] - state[MOTOR_X], state[X]
    if is_placed:
        ahead = p[slots.OUTPUT_START] * p[slots.OUTPUT_GAP]
        state[X], state[MOTOR_X] = state[X] - ahead, state[MOTOR_X] - ahead
    state[MOTOR_V] = state[V]
    state[PART_X], state[PART_V] = state[X], state[V]
    memory[HEAT] = p[slots.START_WARMTH]
    memory[SIDE] = np.sign(state[X])
    memory[TURNED_AT] = state[X]
    memory[LEVEL] = bristle_level(state[V], p)
    memory[WAY] = np.sign(state[V])
    if memory[WAY] != 0.0:
        set_off(state, memory, memory[WAY], p)
    return command


@compiled(**INNER)
def _couple(p: np.ndarray) -> None:
    """Make an elastic coupling what the loops know; with teeth both are in series."""
    stiffness, teeth = p[slots.COUPLING_STIFFNESS], p[slots.GEAR_STIFFNESS]
    if stiffness <= 0.0:
        return
    share, rubbing = p[slots.COUPLING_SHARE], p[slots.COUPLING_DAMPING_SHARE]
    if teeth > 0.0:
        stiffness *= teeth / (stiffness + teeth)
        share = 0.5 * (share + p[slots.MOTOR_SHARE])
        rubbing = 0.5 * (rubbing + p[slots.MOTOR_DAMPING_SHARE])
    else:
        p[slots.IS_COUPLED] = 1.0
    p[slots.GEAR_STIFFNESS], p[slots.MOTOR_SHARE] = stiffness, share
    p[slots.MOTOR_DAMPING_SHARE] = rubbing
    p[slots.GEAR_DAMPING_RATIO] += p[slots.COUPLING_DAMPING_RATIO]


@compiled(**INNER)
def take_stock(sample_time: float, p: np.ndarray) -> None:
    """Note what the drive has of what few drives have, so that others need not ask.

    Parameters
    ----------
    sample_time : float, [s]
    p : ndarray, shape (N_SLOTS,)
        Changed in place.
    """
    p[slots.CAPTURE_TIME] = CAPTURE_SHARE * sample_time
    p[slots.SAMPLE_TIME] = sample_time
    has_zero_edge = p[slots.PRELOAD] > 0.0 or p[slots.SPRING_SHARE] > 0.0
    p[slots.HAS_ZERO_EDGE] = 1.0 if has_zero_edge else 0.0
    has_edges = has_zero_edge or p[slots.DRIVE_SHARE] > 0.0
    has_edges = has_edges or p[slots.SECOND_STIFFNESS] > 0.0
    p[slots.HAS_FURTHER_EDGES] = 1.0 if has_edges else 0.0
    contact = p[slots.STOP_BEND] + p[slots.SIDE_BEND] + p[slots.SECOND_BEND]
    contact += p[slots.STOP_LOSS] + p[slots.SIDE_LOSS] + p[slots.SECOND_LOSS]
    contact += p[slots.STOP_DASHPOT] + p[slots.SIDE_DASHPOT]
    contact += p[slots.SECOND_DASHPOT]
    p[slots.HAS_CONTACT] = 1.0 if contact > 0.0 else 0.0
    has_second = p[slots.SECOND_STIFFNESS] > 0.0
    has_second = has_second or p[slots.SECOND_COGGING_FORCE] != 0.0
    has_more = has_zero_edge or has_second or contact > 0.0
    has_more = has_more or p[slots.GRAVITY_TORQUE] != 0.0
    has_more = has_more or p[slots.WAVY_FRICTION] != 0.0
    has_more = has_more or p[slots.OWN_FRICTION] != 0.0
    p[slots.HAS_MORE] = 1.0 if has_more else 0.0
    has_shape = p[slots.HYSTERESIS_BEND] != 0.0 or p[slots.HYSTERESIS_RATIO] != 0.0
    has_bristles = p[slots.BRISTLE_EXCESS] != 0.0 or p[slots.BRISTLE_DAMPING] != 0.0
    p[slots.HAS_BRISTLES] = 1.0 if has_bristles else 0.0
    p[slots.HAS_SHAPE] = 1.0 if has_shape or has_bristles else 0.0
    varies = p[slots.RIPPLE_SHARE] != 0.0 or p[slots.DRIVE_SHARE] > 0.0
    p[slots.DRIVE_VARIES] = 1.0 if varies else 0.0


@compiled(**INNER)
def _move_piece(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    length: float,
    step: float,
    kind: tuple[bool, bool, bool, bool, bool, float],
    inputs: np.ndarray,
    p: np.ndarray,
) -> None:
    """Move through what is left of one straight piece of the command."""
    _, has_edges, is_curved, is_watched, is_curved_at_times, _ = kind
    corner = corner_of(state, value_of(push, DRIVE, done), p)
    events, is_stuck = 0, False
    while done < length:
        left = length - done
        h = left if left <= step else left / np.ceil(left / step)
        is_held = is_watched and memory[WAY] == 0.0
        is_wild = events > MOST_EVENTS
        if is_held and not is_wild and not is_stuck:
            net, more = excess(state, memory, push, done, p)
            if more > 0.0:
                set_off(state, memory, np.sign(net), p)
                if has_edges:
                    corner = corner_of(state, value_of(push, DRIVE, done), p)
                is_held = False
                events += 1
        if (is_curved or is_curved_at_times) and not (is_held and stays(p)):
            limit = step_limit(state, memory, push, done, False, p)
            limit = max(limit, length / MOST_STEPS)
            if limit < h:
                h = left / np.ceil(left / limit)
        advance(state, trial, memory, push, done, h, corner, is_held, kind, inputs, p)
        is_turned = is_watched and not is_held and memory[WAY] * trial[V] < 0.0
        event = -1
        if is_turned:
            event = REVERSAL
        elif is_held and not is_stuck:
            more = excess(trial, memory, push, done + h, p)[1]
            event = LEAVING if more > 0.0 else -1
        is_stuck = False
        is_leaving = event == LEAVING and not is_wild
        for stage in range(2):
            if stage == 1:
                event = -1
                if has_edges:
                    there = corner_of(trial, value_of(push, DRIVE, done + h), p)
                    event = EDGE if there[0] != corner[0] else -1
            if event < 0 or is_wild:
                continue
            events += 1
            when = time_of(
                event, state, trial, memory, push, done, h, corner, is_held, kind,
                inputs, p,
            )  # fmt: skip
            if when == 0.0 and event == REVERSAL:
                is_stuck = True
                break
            if event == EDGE:
                # The other event only counts if the edge is not before it.
                is_leaving = is_leaving and when == h
                is_turned = is_turned and when == h
                trial[V] = 0.0 if is_turned else trial[V]
            h = when
        if p[slots.DRIVE_SHARE] > 0.0 and is_held and event == EDGE:
            # At the edge the motor holds the drive least: it may have left before.
            is_leaving = excess(trial, memory, push, done + h, p)[1] > 0.0
            if is_leaving:
                h = time_of(
                    LEAVING, state, trial, memory, push, done, h, corner, is_held, kind,
                    inputs, p,
                )  # fmt: skip
        if is_stuck:
            # It left on rounding only: rest for one step.
            state[V], memory[WAY] = 0.0, 0.0
            if p[slots.HAS_ZERO_EDGE] != 0.0 and abs(state[X]) <= OFF_EDGE:
                state[X], memory[SIDE] = 0.0, 0.0
                corner = corner_of(state, value_of(push, DRIVE, done), p)
            continue
        for n in range(N_STATE):
            state[n] = trial[n]
        done = length if h >= left * (1.0 - 1e-12) else done + h
        if p[slots.HAS_SHAPE] != 0.0:
            remember(state[X], state[V], memory, p)
        if is_leaving:
            # Whether the force here is a last bit above or below, it is growing.
            way = np.sign(excess(state, memory, push, done, p)[0])
            set_off(state, memory, way, p)
        if is_turned and is_wild:
            memory[WAY] = np.sign(state[V])
        elif is_turned:
            stop(state, memory, push, done, p)
        if p[slots.HAS_ZERO_EDGE] != 0.0:
            pass_zero(state, memory, push, done, p)
        if has_edges:
            corner = corner_of(state, value_of(push, DRIVE, done), p)
