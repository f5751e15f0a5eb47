"""Compiled push of the drive within one straight piece of the command.

Lag of first or second order, losses of the force constant, heating and a periodic force make a curve of time
out of the straight piece. A cubic stands for it, the projection on polynomials (five
Gauss points): it has the same mean and moments, so that even a lag much faster than
the piece gives the right motion. docs/method_diagnosis.md, eq. (D5), (D6), (D12).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots

TURN = 2.0 * np.pi
# Places in the push: cubic of the drive's force (or command, where the current depends
# on the motion), cubic of the other forces, temperature in the middle; of the piece the
# command at its start, its rate, and the time.
DRIVE, OTHER, WARMTH, COMMAND, COMMAND_RATE, BEGUN, N_PUSH = 0, 4, 8, 9, 10, 11, 12
# Numbers that depend on the length of a piece alone.
N_ROOM = 23
# Below this, the two rates of a second-order lag are one.
_ONE_RATE = 1e-4
# Gauss-Legendre points and weights on -1 to 1.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
# Rows: what each point adds to the coefficients of 1, s, s^2, s^3, with s from 0 to 1.
_P1, _P2 = _POINTS, 1.5 * _POINTS**2 - 0.5
_P3 = 2.5 * _POINTS**3 - 1.5 * _POINTS
_C0, _C1, _C2, _C3 = (
    (n + 0.5) * _WEIGHTS * legendre
    for n, legendre in enumerate((np.ones(5), _P1, _P2, _P3))
)
_PROJECT = np.column_stack(
    [
        _C0 - _C1 + _C2 - _C3,
        2.0 * _C1 - 6.0 * _C2 + 12.0 * _C3,
        6.0 * _C2 - 30.0 * _C3,
        20.0 * _C3,
    ]
)
_SHARES = 0.5 * (_POINTS + 1.0)
_HALF_WEIGHTS = 0.5 * _WEIGHTS


@compiled(**INNER)
def depends_on_motion(p: np.ndarray) -> bool:
    """Return whether the current depends on the motion.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.RESISTANCE] > 0.0 or p[slots.CLIP_LIMIT] < np.inf


@compiled(**INNER)
def has_losses(p: np.ndarray) -> bool:
    """Return whether the force is no constant times the current.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return (
        p[slots.SATURATION_LOSS] != 0.0
        or p[slots.IRON] > 0.0
        or p[slots.SAG_LOSS] != 0.0
        or p[slots.THERMAL_LOSS] != 0.0
    )


@compiled(**INNER)
def is_straight(p: np.ndarray) -> bool:
    """Return whether straight pieces of the command give straight pieces of force.

    And whether nothing has to be carried on from piece to piece, as a temperature has.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    is_bent = p[slots.THERMAL_LOSS] != 0.0
    is_bent = is_bent or (not depends_on_motion(p) and has_losses(p))
    is_bent = is_bent or p[slots.LAG] > 0.0 or p[slots.PERIODIC_FORCE] != 0.0
    return not is_bent


@compiled(**INNER)
def force_of(current: float, warmth: float, p: np.ndarray) -> float:
    """Return the force that a current makes.

    Parameters
    ----------
    current : float, [A]
    warmth : float, [-]
    p : ndarray, shape (N_SLOTS,)
    """
    share = abs(current) / p[slots.REFERENCE_CURRENT]
    loss = (p[slots.SATURATION_LOSS] * share + p[slots.SAG_LOSS]) * share
    loss += p[slots.THERMAL_LOSS] * warmth
    turn = p[slots.IRON] * share
    if turn > 0.0:
        loss += 1.0 - np.tanh(turn) / turn
    return p[slots.FORCE_CONSTANT] * (1.0 - loss) * current


@compiled(**INNER)
def prepare_push(room: np.ndarray, length: float, p: np.ndarray) -> None:
    """Prepare what depends on the length of a piece alone.

    Parameters
    ----------
    room : ndarray, shape (N_ROOM,)
        Length; fading of the lag at the Gauss points and at the end; fading of the
        temperature; cubics of sine and cosine of the periodic force; what the rate of a
        second-order lag adds at the Gauss points and at the end.
    length : float, [s]
    p : ndarray, shape (N_SLOTS,)
    """
    room[0] = length
    if p[slots.LAG] > 0.0:
        turns, ratio = length / p[slots.LAG], p[slots.LAG_DAMPING_RATIO]
        for j in range(5):
            room[1 + j], room[17 + j] = faded(_SHARES[j] * turns, ratio)
        room[6], room[22] = faded(turns, ratio)
    if p[slots.THERMAL_LOSS] != 0.0:
        room[7] = np.exp(-length / p[slots.THERMAL_TIME])
        room[8] = np.sqrt(room[7])
    if p[slots.PERIODIC_FORCE] != 0.0:
        for n in range(9, 17):
            room[n] = 0.0
        for j in range(5):
            angle = TURN * p[slots.PERIODIC_FREQUENCY] * _SHARES[j] * length
            for n in range(4):
                room[9 + n] += _PROJECT[j, n] * np.cos(angle)
                room[13 + n] += _PROJECT[j, n] * np.sin(angle)


@compiled(**INNER)
def faded(turns: float, ratio: float) -> tuple[float, float]:
    """Return what is left of a lag's value, and what its rate has added, without input.

    Parameters
    ----------
    turns : float, [-]
        Time over the time constant, which the rate is in as well.
    ratio : float, [-]
        Damping ratio; 0 for a first-order lag.

    Returns
    -------
    tuple of float, [-]
    """
    if ratio <= 0.0:
        return np.exp(-turns), 0.0
    square = ratio * ratio - 1.0
    spread = np.sqrt(abs(square))
    if spread < _ONE_RATE:
        rest = np.exp(-ratio * turns)
        return rest * (1.0 + ratio * turns), rest * turns
    if square < 0.0:
        rest = np.exp(-ratio * turns)
        held, added = rest * np.cos(spread * turns), rest * np.sin(spread * turns)
    else:
        slow, fast = np.exp((spread - ratio) * turns), np.exp(-(spread + ratio) * turns)
        held, added = 0.5 * (slow + fast), 0.5 * (slow - fast)
    added /= spread
    return held + ratio * added, added


@compiled(**INNER)
def set_push(
    push: np.ndarray,
    room: np.ndarray,
    memory: np.ndarray,
    piece: tuple[float, float, float, float],
    current_now: float,
    p: np.ndarray,
) -> None:
    """Set the cubics of one piece; move lag and temperature to its end.

    Parameters
    ----------
    push : ndarray, shape (N_PUSH,)
    room : ndarray, shape (N_ROOM,)
        From ``prepare_push``; prepared again where the length is another one.
    memory : ndarray, shape (N_MEMORY,)
        The fourth is the current after the lag, the fifth the temperature, the seventh
        the rate of a second-order lag times its time constant.
    piece : tuple
        Time at its start [s], length [s], command at both ends.
    current_now : float, [A]
        What flows at its start; read where the current depends on the motion.
    p : ndarray, shape (N_SLOTS,)
    """
    time, length, first, last = piece
    if room[0] != length:
        prepare_push(room, length, p)
    lag, swing = p[slots.LAG], p[slots.PERIODIC_FORCE]
    ratio = p[slots.LAG_DAMPING_RATIO]
    depends, is_hot = depends_on_motion(p), p[slots.THERMAL_LOSS] != 0.0
    is_force = has_losses(p) and not depends
    rise = last - first
    # What the lag tends to, how far its value is off, and its rate.
    steady, fading, turning, pace = first, 0.0, 0.0, 0.0
    if lag > 0.0:
        pace = rise * lag / length
        steady = first - pace
        if ratio > 0.0:
            steady = first - 2.0 * ratio * pace
            turning = memory[6] - pace
        fading = memory[3] - steady
    for n in range(4):
        push[DRIVE + n], push[OTHER + n] = 0.0, 0.0
    push[OTHER] = p[slots.LOAD]
    cold = memory[4]
    if is_hot:
        square = current_now / p[slots.REFERENCE_CURRENT]
        square *= square
        if not depends:
            square = 0.0
            for j in range(5):
                share = steady + rise * _SHARES[j] + fading * room[1 + j]
                share += turning * room[17 + j]
                share /= p[slots.REFERENCE_CURRENT]
                square += _HALF_WEIGHTS[j] * share * share
        push[WARMTH] = square + (cold - square) * room[8]
        memory[4] = square + (cold - square) * room[7]
    if lag > 0.0 or is_force:
        for j in range(5):
            value = steady + rise * _SHARES[j] + fading * room[1 + j]
            value += turning * room[17 + j]
            if is_force:
                value = force_of(value, cold + (memory[4] - cold) * _SHARES[j], p)
            elif not depends:
                value *= p[slots.FORCE_CONSTANT]
            for n in range(4):
                push[DRIVE + n] += _PROJECT[j, n] * value
    else:
        gain = 1.0 if depends else p[slots.FORCE_CONSTANT]
        push[DRIVE] = gain * first
        push[DRIVE + 1] = gain * rise
    if swing != 0.0:
        angle = TURN * p[slots.PERIODIC_FREQUENCY] * time + p[slots.PERIODIC_PHASE]
        sine, cosine = swing * np.sin(angle), swing * np.cos(angle)
        for n in range(4):
            push[OTHER + n] += sine * room[9 + n] + cosine * room[13 + n]
    memory[3] = last
    if lag > 0.0:
        memory[3] = steady + rise + fading * room[6] + turning * room[22]
        if ratio > 0.0:
            left = room[6] - 2.0 * ratio * room[22]
            memory[6] = pace - fading * room[22] + turning * left
    # From shares of the piece to seconds.
    scale = 1.0
    for n in range(1, 4):
        scale /= length
        push[DRIVE + n] *= scale
        push[OTHER + n] *= scale


@compiled(**INNER)
def set_moment(
    push: np.ndarray, time: float, length: float, first: float, last: float
) -> None:
    """Note when a piece begins, and how its command goes on.

    Parameters
    ----------
    push : ndarray, shape (N_PUSH,)
    time, length : float, [s]
    first, last : float, [A] or [V]
        Command at both ends.
    """
    push[COMMAND], push[COMMAND_RATE] = first, (last - first) / length
    push[BEGUN] = time


@compiled(**INNER)
def value_of(push: np.ndarray, which: int, done: float) -> float:
    """Return the value of a cubic.

    Parameters
    ----------
    push : ndarray, shape (N_PUSH,)
    which : int
        DRIVE or OTHER.
    done : float, [s]
        Since the start of the piece.
    """
    rest = push[which + 2] + done * push[which + 3]
    return push[which] + done * (push[which + 1] + done * rest)


@compiled(**INNER)
def turns_sign(push: np.ndarray, done: float, h: float) -> bool:
    """Return whether the motor's force has another sign at the end of a step.

    Parameters
    ----------
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    """
    first = np.sign(value_of(push, DRIVE, done))
    return first != np.sign(value_of(push, DRIVE, done + h))


@compiled(**INNER)
def shift(
    push: np.ndarray, which: int, done: float
) -> tuple[float, float, float, float]:
    """Return the cubic's coefficients counted from a later time.

    Parameters
    ----------
    push : ndarray, shape (N_PUSH,)
    which : int
        DRIVE or OTHER.
    done : float, [s]
        Since the start of the piece.
    """
    a, b, c, d = push[which], push[which + 1], push[which + 2], push[which + 3]
    if done == 0.0:
        return a, b, c, d
    return (
        a + done * (b + done * (c + done * d)),
        b + done * (2.0 * c + 3.0 * done * d),
        c + 3.0 * done * d,
        d,
    )
