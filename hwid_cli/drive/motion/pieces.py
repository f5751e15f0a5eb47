"""Compiled list of the pieces of the command, each with the push of the drive.

docs/method_diagnosis.md, eq. (D4) to (D6).
"""

import numpy as np

from hwid_cli.compiled import MAKING, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.command import MOST_PIECES, command_pieces, is_untouched
from hwid_cli.drive.controller import is_closed
from hwid_cli.drive.motion.push import (
    DRIVE,
    OTHER,
    depends_on_motion,
    is_straight,
    set_moment,
    set_push,
)

# Columns of the list of pieces: length, and the sample at the end (-1 within one).
LENGTH, SAMPLE, N_PIECE = range(3)


@compiled(**MAKING)
def list_pieces(
    sample: int,
    sample_time: float,
    given: np.ndarray,
    force: np.ndarray,
    ends: np.ndarray,
    before: float,
    followed: float,
    now: float,
    pieces: np.ndarray,
    pushes: np.ndarray,
    room: np.ndarray,
    memory: np.ndarray,
    p: np.ndarray,
) -> tuple[int, float, int]:
    """List the pieces of as many samples as there is room for.

    Parameters
    ----------
    sample : int
        First sample.
    sample_time : float, [s]
    given : ndarray, shape (n_samples,), [A] or [V]
    force : ndarray, shape (n_samples,) or (0,), [N]
        Beside the drive's own, a straight line between samples.
    ends : ndarray, shape (2, n_samples)
        Filled with the command at both ends of each interval.
    before : float
        Command before the first sample.
    followed : float
        Where the rate-limited command is.
    now : float, [A]
        Current at the first sample; read where it depends on the motion.
    pieces : ndarray, shape (n_pieces, N_PIECE)
        Filled.
    pushes : ndarray, shape (n_pieces, N_PUSH)
        Filled with the push of each piece.
    room : ndarray, shape (N_ROOM,)
    memory : ndarray, shape (N_MEMORY,)
        Current after the lag and temperature are moved on.
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    count : int
        Number of pieces.
    sample : int
        The sample at which the pieces end.
    """
    is_held = is_closed(p) or p[slots.ZERO_ORDER_HOLD] > 0.0
    is_simple, is_plain = is_untouched(p), is_straight(p)
    gain = 1.0 if depends_on_motion(p) else p[slots.FORCE_CONSTANT]
    rows = np.empty((MOST_PIECES, 3))
    count = 0
    while sample + 1 < given.size and count + MOST_PIECES <= pieces.shape[0]:
        first, last = given[sample], given[sample if is_held else sample + 1]
        ends[0, sample], ends[1, sample] = first, last
        rows[0, 0], rows[0, 1], rows[0, 2] = sample_time, first, last
        n_rows = 1
        time = sample * sample_time
        if not is_simple:
            n_rows, followed = command_pieces(
                sample, time, sample_time, ends[0], ends[1], before, p, followed, rows
            )
        for row in range(n_rows):
            length, first, last = rows[row, 0], rows[row, 1], rows[row, 2]
            if length <= 0.0:
                continue
            pieces[count, LENGTH], pieces[count, SAMPLE] = length, -1.0
            push = pushes[count]
            set_moment(push, time, length, first, last)
            if is_plain:
                push[DRIVE], push[OTHER] = gain * first, p[slots.LOAD]
                push[DRIVE + 1] = gain * (last - first) / length
            else:
                set_push(push, room, memory, (time, length, first, last), now, p)
            if force.size > 0:
                slope = (force[sample + 1] - force[sample]) / sample_time
                here = force[sample] + (time - sample * sample_time) * slope
                push[OTHER] = here + (p[slots.LOAD] if is_plain else push[OTHER])
                push[OTHER + 1] = slope + (0.0 if is_plain else push[OTHER + 1])
            time += length
            count += 1
        sample += 1
        pieces[count - 1, SAMPLE] = sample
    return count, followed, sample
