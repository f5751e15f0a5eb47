"""Compiled motion between two events where all forces are linear.

The state then follows from a linear equation with a cubic of time as its input: a power
series, exact to rounding. For the lengths that come back in every sample the series is
summed once, into matrices. docs/method_diagnosis.md, eq. (D2), (D3).
"""

import numpy as np

from hwid_cli.compiled import INNER, MAKING, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.springs import (
    is_second_straight,
    is_side_straight,
    is_stop_straight,
)
from hwid_cli.drive.motion.state import N_STATE

# Inputs of a step: offsets of gaps and stops, force on the mass, cubic of the drive,
# and the rest of the cubic of the other forces.
OFFSET, STEADY, DRIVEN, OTHERS, N_INPUT = 0, 1, 2, 6, 9
# Places in a table of matrices: columns of the state, of the inputs, and a mark.
N_COLUMNS, FILLED = N_STATE + N_INPUT + 1, N_STATE + N_INPUT
# No more than this phase in one sum, [rad]; 1^20 / 20! is below rounding. Sums of a
# small phase need fewer terms: 0.25^12 / 12! is.
LONGEST_SUM, N_TERMS = 1.0, 20
SHORT_SUM, FEW_TERMS = 0.25, 12
_PARTS = 1.0 / np.arange(1, N_TERMS + 1)


@compiled(**INNER)
def fastest(p: np.ndarray) -> float:
    """Return a bound of the rates of all linear forces together, [1/s].

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    mass, stiffness = p[slots.MASS], p[slots.STIFFNESS]
    if is_stop_straight(p):
        stiffness += p[slots.STOP_STIFFNESS]
    if is_side_straight(p):
        stiffness += p[slots.SIDE_STIFFNESS]
    if is_second_straight(p):
        stiffness += p[slots.SECOND_STIFFNESS]
    damping = p[slots.DAMPING]
    if p[slots.GEAR_STIFFNESS] > 0.0:
        share = p[slots.MOTOR_SHARE]
        mass *= min(share, 1.0 - share)
        stiffness += p[slots.GEAR_STIFFNESS]
        damping += p[slots.GEAR_DAMPING] + p[slots.MOTOR_DAMPING]
    if p[slots.CLIP_LIMIT] < np.inf:
        damping += p[slots.FORCE_CONSTANT] * p[slots.CLIP_SLOPE]
    if p[slots.RESISTANCE] > 0.0:
        damping += p[slots.FORCE_CONSTANT] * p[slots.BACK_EMF] / p[slots.RESISTANCE]
    rate = np.sqrt(stiffness / mass) + damping / mass
    if p[slots.MODE_MASS] > 0.0:
        both = 1.0 / p[slots.MODE_MASS] + 1.0 / mass
        rate += np.sqrt(p[slots.MODE_STIFFNESS] * both)
        rate += p[slots.MODE_DAMPING] * both
    if p[slots.INDUCTANCE] > 0.0:
        rate += p[slots.RESISTANCE] / p[slots.INDUCTANCE]
    return rate


@compiled(**INNER)
def sum_series(
    state: np.ndarray,
    out: np.ndarray,
    inputs: np.ndarray,
    length: float,
    corner: tuple[int, float, float, float, float, float],
    is_held: bool,
    rate: float,
    p: np.ndarray,
) -> None:
    """Move the state through one step by the power series.

    Parameters
    ----------
    state, out : ndarray, shape (N_STATE,)
    inputs : ndarray, shape (N_INPUT,)
    length : float, [s]
    corner : tuple
        Number, stiffness and offset force of the springs, stiffness and offset force of
        the teeth, side on which the current is cut (0 for none).
    is_held : bool
        Whether position and velocity of the mass stay as they are.
    rate : float, [1/s]
        From ``fastest``.
    p : ndarray, shape (N_SLOTS,)
    """
    _, k, offset, teeth, teeth_offset, clip = corner
    has_motor, has_mode = p[slots.GEAR_STIFFNESS] > 0.0, p[slots.MODE_MASS] > 0.0
    resistance, inductance = p[slots.RESISTANCE], p[slots.INDUCTANCE]
    is_current = resistance > 0.0 or p[slots.CLIP_LIMIT] < np.inf
    gain = p[slots.FORCE_CONSTANT] if is_current else 1.0
    emf, damping = p[slots.BACK_EMF], p[slots.DAMPING]
    k2, c2 = p[slots.MODE_STIFFNESS], p[slots.MODE_DAMPING]
    inner = p[slots.MOTOR_SHARE] * p[slots.MASS] if has_motor else 1.0
    mass = p[slots.MASS] - inner if has_motor else p[slots.MASS]
    part = p[slots.MODE_MASS] if has_mode else 1.0
    teeth_damping = p[slots.GEAR_DAMPING] if teeth > 0.0 else 0.0
    motor_damping = p[slots.MOTOR_DAMPING]
    count = max(1, int(np.ceil(length * rate / LONGEST_SUM)))
    h = length / count
    n_terms = FEW_TERMS if h * rate <= SHORT_SUM else N_TERMS
    for n in range(N_STATE):
        out[n] = state[n]
    for turn in range(count):
        at = turn * h
        x, v, xm, vm = out[0], out[1], out[2], out[3]
        xp, vp, i = out[4], out[5], out[6]
        power = 1.0
        for n in range(n_terms):
            drive, other, one = 0.0, 0.0, 0.0
            if n < 4:
                drive = _coefficient(inputs, DRIVEN, n, at) * power
                other = _coefficient(inputs, OTHERS - 1, n, at) * power
                power *= h
            if n == 0:
                one = inputs[OFFSET]
                other += inputs[STEADY]
            step = h * _PARTS[n]
            speed = vm if has_motor else v
            di = 0.0
            current = drive
            if resistance > 0.0:
                if inductance > 0.0:
                    di = (drive - emf * speed - resistance * i) / inductance
                    current = i
                else:
                    current = (drive - emf * speed) / resistance
            if clip != 0.0:
                current = clip * p[slots.CLIP_LIMIT] * one - p[slots.CLIP_SLOPE] * speed
            force = gain * current
            am = 0.0
            if has_motor:
                bite = teeth * (xm - x) + teeth_offset * one + teeth_damping * (vm - v)
                am = (force - bite - motor_damping * vm) / inner
                force = bite
            net = force + other - offset * one - damping * v - k * x
            ap = 0.0
            if has_mode:
                pull = k2 * (xp - x) + c2 * (vp - v)
                net += pull
                ap = -pull / part
            if is_held:
                x, v = 0.0, 0.0
            else:
                x, v = step * v, step * net / mass
            xm, vm = step * vm, step * am
            xp, vp, i = step * vp, step * ap, step * di
            out[0] += x
            out[1] += v
            out[2] += xm
            out[3] += vm
            out[4] += xp
            out[5] += vp
            out[6] += i


@compiled(**INNER)
def _coefficient(inputs: np.ndarray, first: int, n: int, at: float) -> float:
    """Return a coefficient of a cubic counted from a later time."""
    d = inputs[first + 3]
    if n == 3:
        return d
    c = inputs[first + 2]
    if n == 2:
        return c + 3.0 * at * d
    b = inputs[first + 1]
    if n == 1:
        return b + at * (2.0 * c + 3.0 * at * d)
    # Of the other forces the constant is an input of its own.
    a = inputs[first] if first == DRIVEN else 0.0
    return a + at * (b + at * (c + at * d))


@compiled(**INNER)
def sum_plain(
    x: float,
    v: float,
    inputs: tuple[float, float, float, float],
    length: float,
    stiffness: float,
    rate: float,
    p: np.ndarray,
) -> tuple[float, float]:
    """Return position and velocity after one step, without inner states.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    inputs : tuple
        Cubic of the force.
    length : float, [s]
    stiffness : float, [N/m]
    rate : float, [1/s]
        From ``fastest``.
    p : ndarray, shape (N_SLOTS,)
    """
    a, b, c, d = inputs
    per_mass = 1.0 / p[slots.MASS]
    damping, stiffness = p[slots.DAMPING] * per_mass, stiffness * per_mass
    count = max(1, int(np.ceil(length * rate / LONGEST_SUM)))
    h = length / count
    n_terms = FEW_TERMS if h * rate <= SHORT_SUM else N_TERMS
    for _ in range(count):
        dx = h * v
        dv = h * (a * per_mass - damping * v - stiffness * x)
        one, two = x + dx, v + dv
        force, power = b * per_mass, h
        for n in range(1, n_terms):
            push = 0.0
            if n < 4:
                push = force * power
                force = (c if n == 1 else d) * per_mass
                power *= h
            step = h * _PARTS[n]
            dx, dv = step * dv, step * (push - damping * dv - stiffness * dx)
            one += dx
            two += dv
        x, v = one, two
        a += h * (b + h * (c + h * d))
        b += h * (2.0 * c + 3.0 * h * d)
        c += 3.0 * h * d
    return x, v


@compiled(**MAKING)
def active_states(p: np.ndarray) -> np.ndarray:
    """Return the places of the state that move at all.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    active = np.empty(N_STATE, np.int64)
    active[0], active[1] = 0, 1
    count = 2
    if p[slots.GEAR_STIFFNESS] > 0.0:
        active[count], active[count + 1] = 2, 3
        count += 2
    if p[slots.MODE_MASS] > 0.0:
        active[count], active[count + 1] = 4, 5
        count += 2
    if p[slots.INDUCTANCE] > 0.0:
        active[count] = 6
        count += 1
    return active[:count]


@compiled(**MAKING)
def fill(
    matrices: np.ndarray,
    which: int,
    length: float,
    corner: tuple[int, float, float, float, float, float],
    is_held: bool,
    rate: float,
    p: np.ndarray,
) -> None:
    """Fill the matrix of one length: what each state and each input leads to.

    Parameters
    ----------
    matrices : ndarray, shape (n_matrices, N_STATE, N_COLUMNS)
    which : int
        Nothing is done where it is filled already.
    length, corner, is_held, rate, p
        As in ``sum_series``.
    """
    if matrices[which, 0, FILLED] != 0.0:
        return
    state, inputs, out = np.zeros(N_STATE), np.zeros(N_INPUT), np.empty(N_STATE)
    for column in range(N_STATE + N_INPUT):
        if column < N_STATE:
            state[column] = 1.0
        else:
            inputs[column - N_STATE] = 1.0
        sum_series(state, out, inputs, length, corner, is_held, rate, p)
        for row in range(N_STATE):
            matrices[which, row, column] = out[row]
            state[row] = 0.0
        for row in range(N_INPUT):
            inputs[row] = 0.0
    matrices[which, 0, FILLED] = 1.0


@compiled(**INNER)
def after_row(
    matrices: np.ndarray,
    which: int,
    row: int,
    state: np.ndarray,
    inputs: np.ndarray,
    active: np.ndarray,
) -> float:
    """Return one place of the state after a step by the matrix of its length.

    Parameters
    ----------
    matrices, which, state, inputs, active
        As in ``apply``.
    """
    total = 0.0
    for n in range(active.size):
        total += matrices[which, row, active[n]] * state[active[n]]
    for column in range(N_INPUT):
        total += matrices[which, row, N_STATE + column] * inputs[column]
    return total


@compiled(**INNER)
def apply(
    matrices: np.ndarray,
    which: int,
    state: np.ndarray,
    inputs: np.ndarray,
    out: np.ndarray,
    active: np.ndarray,
) -> None:
    """Move the state through one step by the matrix of its length.

    Parameters
    ----------
    matrices : ndarray, shape (n_matrices, N_STATE, N_COLUMNS)
    state, out : ndarray, shape (N_STATE,)
    inputs : ndarray, shape (N_INPUT,)
    active : ndarray, shape (n_active,)
        From ``active_states``.
    """
    for n in range(active.size):
        row = active[n]
        out[row] = after_row(matrices, which, row, state, inputs, active)
