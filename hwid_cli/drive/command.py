"""Compiled path of the command: delay, dead zone, saturation, rate limit.

Within one sampling interval the command is a chain of straight pieces. Each of these
four effects turns straight pieces into straight pieces, so nothing is lost by working
on their ends. docs/method_diagnosis.md, eq. (D4).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.interpreter import formula_value

# Most pieces of one interval: 2 (delay) x 3 (dead zone) x 3 (saturation) x 2 (rate), with
# room for those that a formula cuts each of the first ones into.
MOST_PIECES = 80
# Straight pieces that stand for a curve of the command within a sample.
OWN_PIECES = 4


@compiled(nogil=True, error_model="numpy")
def command_pieces(
    n: int,
    time: float,
    sample_time: float,
    starts: np.ndarray,
    ends: np.ndarray,
    before: float,
    p: np.ndarray,
    followed: float,
    pieces: np.ndarray,
) -> tuple[int, float]:
    """Fill in the pieces of one sampling interval.

    Parameters
    ----------
    n : int
        Number of the interval.
    time, sample_time : float, [s]
        At its start, and its length.
    starts, ends : ndarray, shape (n_intervals,), [A]
        Command at both ends of each interval, filled up to the n-th one.
    before : float, [A]
        Command before the first sample.
    p : ndarray, shape (N_SLOTS,)
    followed : float, [A]
        Where the rate-limited command is at the start of the interval.
    pieces : ndarray, shape (MOST_PIECES, 3)
        Filled with length [s], first and last value [A].

    Returns
    -------
    followed : float, [A]
        Where the rate-limited command is at the end.
    """
    if p[slots.DELAY] > 0.0:
        count = _delayed(n, sample_time, starts, ends, before, p[slots.DELAY], pieces)
    else:
        pieces[0, 0] = sample_time
        pieces[0, 1] = starts[n]
        pieces[0, 2] = ends[n]
        count = 1
    if p[slots.OWN_INPUT] != 0.0:
        count = _through_formula(pieces, count, time, p)
    if p[slots.DEAD_ZONE] > 0.0:
        count = _split(pieces, count, p[slots.DEAD_ZONE])
        for j in range(count):
            pieces[j, 1] = _dead_zone(pieces[j, 1], p[slots.DEAD_ZONE])
            pieces[j, 2] = _dead_zone(pieces[j, 2], p[slots.DEAD_ZONE])
    limit = p[slots.SATURATION]
    if limit < np.inf:
        count = _split(pieces, count, limit)
        for j in range(count):
            pieces[j, 1] = min(max(pieces[j, 1], -limit), limit)
            pieces[j, 2] = min(max(pieces[j, 2], -limit), limit)
    if p[slots.RATE] < np.inf:
        return _limit_rate(pieces, count, p[slots.RATE], followed)
    return count, followed


@compiled(**INNER)
def is_untouched(p: np.ndarray) -> bool:
    """Return whether the command passes as it is.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return not (
        p[slots.DELAY] > 0.0
        or p[slots.OWN_INPUT] != 0.0
        or p[slots.DEAD_ZONE] > 0.0
        or p[slots.SATURATION] < np.inf
        or p[slots.RATE] < np.inf
    )


@compiled(**INNER)
def static_command(value: float, p: np.ndarray) -> float:
    """Return what becomes of a constant command.

    Parameters
    ----------
    value : float, [A] or [V]
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.OWN_INPUT] != 0.0:
        value = formula_value(p[slots.OWN_INPUT], 0.0, 0.0, value, 0.0, 0.0, p)
    if p[slots.DEAD_ZONE] > 0.0:
        value = _dead_zone(value, p[slots.DEAD_ZONE])
    limit = p[slots.SATURATION]
    return min(max(value, -limit), limit)


@compiled(**INNER)
def _dead_zone(value: float, half: float) -> float:
    if value > half:
        return value - half
    if value < -half:
        return value + half
    return 0.0


@compiled(**INNER)
def _delayed(
    n: int,
    sample_time: float,
    starts: np.ndarray,
    ends: np.ndarray,
    before: float,
    delay: float,
    pieces: np.ndarray,
) -> int:
    """Pieces of the command a while ago; before the first sample it is constant."""
    whole = int(np.floor(delay / sample_time))
    part = delay - whole * sample_time
    count = 0
    if part > 0.0:
        at = n - whole - 1
        pieces[count, 0] = part
        if at < 0:
            pieces[count, 1] = before
            pieces[count, 2] = before
        else:
            slope = (ends[at] - starts[at]) / sample_time
            pieces[count, 1] = ends[at] - slope * part
            pieces[count, 2] = ends[at]
        count += 1
    at = n - whole
    left = sample_time - part
    if left > 0.0:
        pieces[count, 0] = left
        if at < 0:
            pieces[count, 1] = before
            pieces[count, 2] = before
        else:
            slope = (ends[at] - starts[at]) / sample_time
            pieces[count, 1] = starts[at]
            pieces[count, 2] = starts[at] + slope * left
        count += 1
    return count


@compiled(**INNER)
def _through_formula(pieces: np.ndarray, count: int, time: float, p: np.ndarray) -> int:
    """Put pieces through a formula of input and time, each cut into several.

    Cut from the last one backwards, so that none is overwritten before it is read.
    """
    at = p[slots.OWN_INPUT]
    end = time
    for j in range(count):
        end += pieces[j, 0]
    for j in range(count - 1, -1, -1):
        length, first, last = pieces[j, 0], pieces[j, 1], pieces[j, 2]
        end -= length
        for k in range(OWN_PIECES - 1, -1, -1):
            row = OWN_PIECES * j + k
            low, high = (k + 0.0) / OWN_PIECES, (k + 1.0) / OWN_PIECES
            before = first + low * (last - first)
            after = first + high * (last - first)
            pieces[row, 0] = length / OWN_PIECES
            pieces[row, 1] = formula_value(
                at, 0.0, 0.0, before, end + low * length, 0.0, p
            )
            pieces[row, 2] = formula_value(
                at, 0.0, 0.0, after, end + high * length, 0.0, p
            )
    return OWN_PIECES * count


@compiled(**INNER)
def _split(pieces: np.ndarray, count: int, level: float) -> int:
    """Split pieces where they cross plus or minus a level."""
    for side in (-1.0, 1.0):
        at = side * level
        j = 0
        while j < count < MOST_PIECES:
            first, last = pieces[j, 1], pieces[j, 2]
            if (first - at) * (last - at) < 0.0:
                for row in range(count, j, -1):
                    for k in range(3):
                        pieces[row, k] = pieces[row - 1, k]
                count += 1
                share = (at - first) / (last - first)
                length = pieces[j, 0]
                pieces[j, 0] = share * length
                pieces[j, 2] = at
                pieces[j + 1, 0] = (1.0 - share) * length
                pieces[j + 1, 1] = at
                j += 1
            j += 1
    return count


@compiled(**INNER)
def _limit_rate(
    pieces: np.ndarray, count: int, rate: float, followed: float
) -> tuple[int, float]:
    """Follow the pieces at a limited rate; each is split where it is caught up."""
    j = 0
    while j < count:
        length, first, last = pieces[j, 0], pieces[j, 1], pieces[j, 2]
        behind = first - followed
        slope = (last - first) / length
        if behind == 0.0 and abs(slope) <= rate:
            followed = last
            j += 1
            continue
        pace = rate if (behind > 0.0 or (behind == 0.0 and slope > 0.0)) else -rate
        # first + slope t = followed + pace t
        closing = pace - slope
        catch = behind / closing if closing * behind > 0.0 else np.inf
        pieces[j, 1] = followed
        if catch < length and count < MOST_PIECES:
            for row in range(count, j, -1):
                for k in range(3):
                    pieces[row, k] = pieces[row - 1, k]
            count += 1
            met = first + slope * catch
            pieces[j, 0] = catch
            pieces[j, 2] = met
            pieces[j + 1, 0] = length - catch
            pieces[j + 1, 1] = met
            pieces[j + 1, 2] = last
            followed = met
        else:
            followed = followed + pace * length
            pieces[j, 2] = followed
        j += 1
    return count, followed
