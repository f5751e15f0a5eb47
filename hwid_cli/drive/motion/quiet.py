"""Compiled stretches of motion without events: as fast as they can be.

Everything here could be done by ``events`` as well. A stretch ends before the step in
which something happens. docs/method_diagnosis.md, eq. (D2).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.corners import corner_of
from hwid_cli.drive.motion.curved import is_curved_here, step_limit, step_plain
from hwid_cli.drive.motion.events import (
    excess,
    set_inputs,
    slowest_straight,
    steady_force,
)
from hwid_cli.drive.motion.excursions import bounds, is_slow, stays_between
from hwid_cli.drive.motion.exponential import is_exponential, step_exponential
from hwid_cli.drive.motion.hysteresis import remember
from hwid_cli.drive.motion.linear import (
    DRIVEN,
    N_STATE,
    apply,
    fill,
    sum_plain,
    sum_series,
)
from hwid_cli.drive.motion.pieces import LENGTH, SAMPLE
from hwid_cli.drive.motion.push import DRIVE, OTHER, shift, turns_sign, value_of
from hwid_cli.drive.motion.state import WAY, V, X

# The limit of curved steps is not looked at again for so many pieces if it was twice
# the piece: forces that depend on position change little within them, but for stops.
FAR_FROM_LIMIT = 4
# Most steps in one piece; what is faster than that is followed less exactly.
MOST_STEPS = 400


@compiled(**INNER)
def which_matrix(h: float, lengths: np.ndarray, corner: int, is_held: bool) -> int:
    """Return the number of a matrix; -1 for a length that does not come back.

    Parameters
    ----------
    h : float, [s]
    lengths : ndarray, shape (n_lengths,), [s]
    """
    for n in range(lengths.size):
        if h == lengths[n]:
            return lengths.size * (2 * corner + is_held) + n
    return -1


@compiled(**INNER)
def glide_plain(
    j: int,
    count: int,
    pieces: np.ndarray,
    pushes: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    state: np.ndarray,
    memory: np.ndarray,
    step: float,
    kind: tuple[bool, bool, bool, bool, bool, float],
    matrices: np.ndarray,
    lengths: np.ndarray,
    p: np.ndarray,
) -> tuple[int, float]:
    """Move until something happens or the pieces end, without inner states.

    Parameters
    ----------
    j, count : int
        First piece, and the end of the pieces.
    pieces : ndarray, shape (n_pieces, N_PIECE)
    pushes : ndarray, shape (n_pieces, N_PUSH)
    positions, velocities : ndarray, shape (n_samples,)
        Filled at the end of each sample.
    state : ndarray, shape (N_STATE,)
        Changed in place.
    memory : ndarray, shape (N_MEMORY,)
    step : float, [s]
        Longest step of linear motion.
    kind : tuple
        As in ``events.advance``.
    matrices : ndarray, shape (n_matrices, N_STATE, N_COLUMNS)
    lengths : ndarray, shape (n_lengths,), [s]
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    j : int
        Piece in which something happens.
    done : float, [s]
        How far into it.
    """
    _, has_edges, is_always_curved, is_watched, is_curved_at_times, rate = kind
    way = memory[WAY]
    low, high = -np.inf, np.inf
    corner = (0, p[slots.STIFFNESS], 0.0, 0.0, 0.0, 0.0)
    if has_edges:
        low, high = bounds(state[X], p)
        corner = corner_of(state, 0.0, p)
    steady = steady_force(memory, p) - corner[2]
    slow = slowest_straight(p)
    is_held = is_watched and way == 0.0
    done, x, v = 0.0, state[X], state[V]
    n = N_STATE + DRIVEN
    trusted = j
    # In drag a drive at rest speeds up within a step, as soon as a force comes.
    is_smooth = not (is_curved_at_times or has_edges or p[slots.DRAG] != 0.0)
    while j < count:
        length = pieces[j, LENGTH]
        push = pushes[j]
        if is_held:
            if excess(state, memory, push, 0.0, p)[1] > 0.0:
                break
            if excess(state, memory, push, length, p)[1] > 0.0:
                break
            if p[slots.DRIVE_SHARE] > 0.0 and turns_sign(push, 0.0, length):
                break
            done = length
        while done < length:
            h = left = length - done
            is_curved = is_always_curved
            if is_curved_at_times and not is_curved:
                state[X], state[V] = x, v
                is_curved = is_curved_here(state, memory, p)
            if is_curved:
                if j >= trusted:
                    state[X], state[V] = x, v
                    limit = step_limit(state, memory, push, done, False, p)
                    limit = max(limit, length / MOST_STEPS)
                    if limit < left:
                        h = left / np.ceil(left / limit)
                    elif limit > 2.0 * left and is_smooth:
                        trusted = j + FAR_FROM_LIMIT
                x1, v1 = step_plain(x, v, memory, push, done, h, p)
                if p[slots.DRIVE_SHARE] > 0.0 and turns_sign(push, done, h):
                    break
            else:
                if h > step * (1.0 + 1e-9) or abs(h - step) < 1e-9 * step:
                    h = step
                a, b, c, d = shift(push, DRIVE, done)
                a1, b1, c1, d1 = shift(push, OTHER, done)
                a, b, c, d = a + a1 + steady, b + b1, c + c1, d + d1
                m = which_matrix(h, lengths, corner[0], is_held)
                if m < 0:
                    x1, v1 = sum_plain(x, v, (a, b, c, d), h, corner[1], rate, p)
                else:
                    fill(matrices, m, h, corner, is_held, rate, p)
                    x1 = matrices[m, 0, 0] * x + matrices[m, 0, 1] * v
                    x1 += matrices[m, 0, n] * a + matrices[m, 0, n + 1] * b
                    x1 += matrices[m, 0, n + 2] * c + matrices[m, 0, n + 3] * d
                    v1 = matrices[m, 1, 0] * x + matrices[m, 1, 1] * v
                    v1 += matrices[m, 1, n] * a + matrices[m, 1, n + 1] * b
                    v1 += matrices[m, 1, n + 2] * c + matrices[m, 1, n + 3] * d
                if is_watched and way * v1 < slow:
                    break
            if (is_watched and way * v1 < 0.0) or x1 < low or x1 > high:
                break
            x, v = x1, v1
            if p[slots.HAS_SHAPE] != 0.0:
                remember(x, v, memory, p)
            done = length if h >= left * (1.0 - 1e-12) else done + h
        if done < length:
            break
        sample = int(pieces[j, SAMPLE])
        if sample >= 0:
            positions[sample], velocities[sample] = x, v
        done = 0.0
        j += 1
    state[X], state[V] = x, v
    return j, done


@compiled(**INNER)
def glide_inner(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    length: float,
    step: float,
    kind: tuple[bool, bool, bool, bool, bool, float],
    matrices: np.ndarray,
    lengths: np.ndarray,
    inputs: np.ndarray,
    active: np.ndarray,
    p: np.ndarray,
) -> float:
    """Move until something happens or the piece ends, with inner states.

    Parameters
    ----------
    state, trial : ndarray, shape (N_STATE,)
        The first is changed in place.
    memory, step, kind, matrices, lengths, p
        As in ``glide_plain``.
    push : ndarray, shape (N_PUSH,)
    length : float, [s]
        Of the piece.
    inputs : ndarray, shape (N_INPUT,)
        Room to work in.
    active : ndarray, shape (n_active,)

    Returns
    -------
    float, [s]
        How far into the piece.
    """
    _, has_edges, is_always_curved, is_watched, is_curved_at_times, rate = kind
    may_be_curved = is_always_curved or is_curved_at_times
    if may_be_curved and not is_exponential(p):
        return 0.0
    is_held = is_watched and memory[WAY] == 0.0
    if is_held and excess(state, memory, push, 0.0, p)[1] > 0.0:
        return 0.0
    corner = corner_of(state, push[DRIVE], p)
    slow = slowest_straight(p)
    done = 0.0
    # Nothing may happen within a step; most pieces are far from where it could.
    is_short = is_held or not is_slow(length, corner, p)
    while done < length:
        left = length - done
        is_curved = is_always_curved and not is_held
        if is_curved_at_times and not (is_curved or is_held):
            is_curved = is_curved_here(state, memory, p)
        h = left
        if (is_short or done > 0.0) and h > step * (1.0 - 1e-9):
            h = step
        if is_curved:
            limit = step_limit(state, memory, push, done, True, p)
            if is_short:
                limit = min(limit, step * (1.0 + 1e-9))
            h = length
            while h > limit or h > left * (1.0 + 1e-9):
                h *= 0.5
        m = which_matrix(h, lengths, corner[0], is_held)
        if is_curved:
            half = which_matrix(0.5 * h, lengths, corner[0], is_held)
            if m < 0 or half < 0:
                return done
            fill(matrices, m, h, corner, is_held, rate, p)
            fill(matrices, half, 0.5 * h, corner, is_held, rate, p)
            step_exponential(
                state, trial, memory, push, done, h, corner, (m, half), matrices,
                inputs, active, p,
            )  # fmt: skip
        else:
            set_inputs(inputs, memory, push, done, p)
            if m < 0:
                sum_series(state, trial, inputs, h, corner, is_held, rate, p)
            else:
                fill(matrices, m, h, corner, is_held, rate, p)
                apply(matrices, m, state, inputs, trial, active)
        is_long = h > step * (1.0 + 1e-9) and (has_edges or is_watched)
        if is_long and not stays_between(
            state, trial, memory, push, done, h, is_watched, p
        ):
            is_short = True
            continue
        if is_held:
            if excess(trial, memory, push, done + h, p)[1] > 0.0:
                return done
        elif is_watched and memory[WAY] * trial[V] < 0.0:
            return done
        if slow > 0.0 and not (is_curved or is_held) and memory[WAY] * trial[V] < slow:
            return done
        if has_edges:
            there = corner_of(trial, value_of(push, DRIVE, done + h), p)
            if there[0] != corner[0]:
                return done
        for n in range(active.size):
            state[active[n]] = trial[active[n]]
        if p[slots.HAS_SHAPE] != 0.0 and not is_held:
            remember(state[X], state[V], memory, p)
        done = length if h >= left * (1.0 - 1e-12) else done + h
    return length
