"""Compiled current of a winding, whose fast part is followed exactly.

A coil settles in a share of a sample; what it drives does not. So steps go with the
motion, and are as short as the coil is fast only while its force is no constant times a
current that has not settled. docs/method_diagnosis.md, eq. (D7a).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.forces import acceleration
from hwid_cli.drive.motion.push import DRIVE, has_losses, shift
from hwid_cli.drive.motion.runge_kutta import LONGEST_PHASE, runge_kutta_stage
from hwid_cli.drive.motion.state import (
    CIRCUIT,
    MOTOR_V,
    MOTOR_X,
    N_STATE,
    PART_V,
    PART_X,
    V,
    X,
)

# Steps in a sample that a winding asks for at most.
WINDING_STEPS = 2.0


@compiled(**INNER)
def is_wound(p: np.ndarray) -> bool:
    """Return whether a winding's fast part is followed exactly.

    Then steps need not be as short as it is fast; beside a limit they have to.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    is_winding = p[slots.RESISTANCE] > 0.0 and p[slots.INDUCTANCE] > 0.0
    return is_winding and p[slots.CLIP_LIMIT] == np.inf


@compiled(**INNER)
def slow_pace(fast: float, phase: float, p: np.ndarray) -> float:
    """Return at which rate a winding is looked at that settles at another one, [1/s].

    Parameters
    ----------
    fast : float, [1/s]
        Rate at which it settles.
    phase : float, [rad]
        By which a step may turn at most.
    p : ndarray, shape (N_SLOTS,)
    """
    return min(fast, WINDING_STEPS * phase / p[slots.SAMPLE_TIME])


@compiled(**INNER)
def rate_of_winding(
    fast: float,
    state: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    p: np.ndarray,
) -> float:
    """Return how fast a current has to be followed that settles at the rate ``fast``.

    Where its force is no constant times it, what has not settled yet decides that.

    Parameters
    ----------
    fast : float, [1/s]
        Rate at which it settles.
    state : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done : float, [s]
        Since the start of the piece.
    p : ndarray, shape (N_SLOTS,)
    """
    slow = slow_pace(fast, LONGEST_PHASE, p)
    if slow == fast or (p[slots.DRIVE_VARIES] == 0.0 and not has_losses(p)):
        return slow
    has_motor = p[slots.GEAR_STIFFNESS] > 0.0
    speed = state[MOTOR_V] if has_motor else state[V]
    gain, motor, _, _ = acceleration(state, memory, push, done, p)
    value, trend, _, _ = shift(push, DRIVE, done)
    across = value - p[slots.BACK_EMF] * speed
    trend -= p[slots.BACK_EMF] * (motor if has_motor else gain)
    drop = p[slots.RESISTANCE] * state[CIRCUIT]
    # What it is behind a voltage that changes evenly, it stays behind.
    unsettled = abs(drop - across + trend / fast)
    share = unsettled / max(abs(drop) + abs(across), 1e-300)
    return max(slow, fast * np.sqrt(np.sqrt(min(share, 1.0))))


@compiled(**INNER)
def step_wound(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    is_held: bool,
    p: np.ndarray,
) -> None:
    """Step of a drive behind a winding, however fast its current settles.

    The current takes an exponential Runge-Kutta step (ETDRK4: Cox, Matthews 2002); in
    place of position and velocity of what it drives their sums with the current are
    followed, which its fast part does not push. docs/method_diagnosis.md, eq. (D7a).

    Parameters
    ----------
    state, trial : ndarray, shape (N_STATE,)
        The second is set.
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    is_held : bool
        Whether position and velocity of the mass stay as they are.
    p : ndarray, shape (N_SLOTS,)
    """
    pace = p[slots.RESISTANCE] / p[slots.INDUCTANCE]
    of_mass, of_motor = _pushed_by_current(pace, is_held, p)
    half, half1, _, _ = _fading(0.5 * pace * h)
    whole, whole1, whole2, whole3 = _fading(pace * h)
    half1 *= 0.5 * h
    outer, inner = whole1 - 3.0 * whole2 + 4.0 * whole3, 2.0 * (whole2 - 2.0 * whole3)
    i0 = i = first = state[CIRCUIT]
    x0, v0 = state[X] - of_mass / pace * i, state[V] + of_mass * i
    xm0, vm0 = state[MOTOR_X] - of_motor / pace * i, state[MOTOR_V] + of_motor * i
    di = dx = dv = dxm = dvm = dxp = dvp = rate0 = 0.0
    for n in range(N_STATE):
        trial[n] = state[n]
    for stage in range(4):
        after, weight, way = runge_kutta_stage(stage, h)
        a, am, ap, rise = acceleration(trial, memory, push, done + after, p)
        rate = rise + pace * i
        a, am = a + of_mass * rise, am + of_motor * rise
        v, vp = trial[V] - of_mass / pace * rise, trial[PART_V]
        vm = trial[MOTOR_V] - of_motor / pace * rise
        if is_held:
            v = a = 0.0
        dx, dv, dxm = dx + weight * v, dv + weight * a, dxm + weight * vm
        dvm, dxp, dvp = dvm + weight * am, dxp + weight * vp, dvp + weight * ap
        if stage == 0:
            rate0, di = rate, outer * rate
            i = first = half * i0 + half1 * rate
        elif stage == 1:
            di += inner * rate
            i = half * i0 + half1 * rate
        elif stage == 2:
            di += inner * rate
            i = half * first + half1 * (2.0 * rate - rate0)
        else:
            i = whole * i0 + h * (di + (4.0 * whole3 - whole2) * rate)
            way, v, a, vm, am, vp, ap = h / 6.0, dx, dv, dxm, dvm, dxp, dvp
        trial[CIRCUIT] = i
        trial[X], trial[V] = (
            x0 + way * v + of_mass / pace * i,
            v0 + way * a - of_mass * i,
        )
        trial[MOTOR_X] = xm0 + way * vm + of_motor / pace * i
        trial[MOTOR_V] = vm0 + way * am - of_motor * i
        trial[PART_X] = state[PART_X] + way * vp
        trial[PART_V] = state[PART_V] + way * ap
    if of_motor == 0.0:
        # A motor that is part of the mass.
        trial[MOTOR_X], trial[MOTOR_V] = trial[X], trial[V]


@compiled(**INNER)
def _pushed_by_current(
    pace: float, is_held: bool, p: np.ndarray
) -> tuple[float, float]:
    """Return the speed that an ampere that dies away gives the mass, and the motor."""
    if p[slots.GEAR_STIFFNESS] > 0.0:
        motor = p[slots.MASS] * p[slots.MOTOR_SHARE]
        return 0.0, p[slots.FORCE_CONSTANT] / (pace * motor)
    return 0.0 if is_held else p[slots.FORCE_CONSTANT] / (pace * p[slots.MASS]), 0.0


@compiled(**INNER)
def _fading(turns: float) -> tuple[float, float, float, float]:
    """Return exp(-z) and the functions phi_1 to phi_3 of exponential integrators at -z.

    Parameters
    ----------
    turns : float, [-]
        z, not negative.
    """
    rest = np.exp(-turns)
    if turns > 1.0:
        first = (1.0 - rest) / turns
        second = (1.0 - first) / turns
        return rest, first, second, (0.5 - second) / turns
    # Small differences of large numbers there: a series in place of them.
    third, term = 0.0, 1.0 / 6.0
    for n in range(4, 18):
        third += term
        term *= -turns / n
    second = 0.5 - turns * third
    return rest, 1.0 - turns * second, second, third
