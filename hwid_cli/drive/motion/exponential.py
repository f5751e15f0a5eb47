"""Compiled exponential steps: linear forces exactly, a curved one on the mass beside them.

A coupling, a flexible part or a circuit swings or settles in a share of a sample; a spring
that hardens does not. Runge-Kutta steps would have to follow the former, at some 20 times
the cost. docs/method_diagnosis.md, eq. (D2a).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.events import set_inputs, steady_force
from hwid_cli.drive.motion.forces import own_force, resisting
from hwid_cli.drive.motion.linear import OTHERS, STEADY, after_row, apply
from hwid_cli.drive.motion.push import depends_on_motion, has_losses
from hwid_cli.drive.motion.springs import touch
from hwid_cli.drive.motion.state import N_STATE, WAY, V, X

# Columns of a matrix: what a constant, a slope and a bend of the force on the mass lead to.
_CONSTANT = N_STATE + STEADY
_SLOPE, _BEND = N_STATE + OTHERS, N_STATE + OTHERS + 1


@compiled(**INNER)
def is_exponential(p: np.ndarray) -> bool:
    """Return whether all that is curved acts on the mass, beside linear inner states.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    if depends_on_motion(p) and has_losses(p):
        return False
    return p[slots.DRIVE_VARIES] == 0.0


@compiled(**INNER)
def _curved_force(
    place: tuple[float, float],
    memory: np.ndarray,
    push: np.ndarray,
    at: float,
    linear: tuple[float, float],
    p: np.ndarray,
) -> float:
    """Return the force on the mass beyond the linear ones.

    Parameters
    ----------
    place : tuple of float, [m], [m/s]
    linear : tuple of float, [N/m], [N]
        Stiffness and offset force of the linear ones.
    """
    x, v = place
    force = p[slots.DAMPING] * v + linear[0] * x + linear[1]
    force -= resisting(x, v, memory, p)
    if p[slots.OWN_FORCE] != 0.0:
        force += own_force(x, v, memory[WAY], push, at, p)
    return force


@compiled(**INNER)
def _after(
    matrices: np.ndarray,
    which: int,
    free: tuple[float, float],
    force: float,
    slope: float,
) -> tuple[float, float]:
    """Return position and velocity of the mass under a force that is a straight line.

    Parameters
    ----------
    free : tuple of float, [m], [m/s]
        Both without that force.
    force, slope : float, [N], [N/s]
    """
    table = matrices[which]
    x = free[0] + table[0, _CONSTANT] * force + table[0, _SLOPE] * slope
    v = free[1] + table[1, _CONSTANT] * force + table[1, _SLOPE] * slope
    return x, v


@compiled(**INNER)
def step_exponential(
    state: np.ndarray,
    trial: np.ndarray,
    memory: np.ndarray,
    push: np.ndarray,
    done: float,
    h: float,
    corner: tuple[int, float, float, float, float, float],
    which: tuple[int, int],
    matrices: np.ndarray,
    inputs: np.ndarray,
    active: np.ndarray,
    p: np.ndarray,
) -> None:
    """Set ``trial`` to the state one exponential Runge-Kutta step of fourth order on.

    Parameters
    ----------
    state, trial : ndarray, shape (N_STATE,)
    memory : ndarray, shape (N_MEMORY,)
    push : ndarray, shape (N_PUSH,)
    done, h : float, [s]
        Since the start of the piece, and length of the step.
    corner : tuple
        From ``corner_of``.
    which : tuple of int
        Numbers of the matrices of the whole step and of half of it, which are filled.
    matrices : ndarray, shape (n_matrices, N_STATE, N_COLUMNS)
    inputs : ndarray, shape (N_INPUT,)
        Room to work in.
    active : ndarray, shape (n_active,)
    p : ndarray, shape (N_SLOTS,)

    References
    ----------
    S. Krogstad, Generalized integrating factor methods for stiff PDEs, Journal of
    Computational Physics 203 (2005), 72-88: the scheme ETDRK4-B.
    """
    if p[slots.HAS_CONTACT] != 0.0:
        touch(state[X], memory, p)
    set_inputs(inputs, memory, push, done, p)
    linear = corner[1], corner[2] - steady_force(memory, p)
    whole, half = which
    apply(matrices, whole, state, inputs, trial, active)
    middle = after_row(matrices, half, X, state, inputs, active)
    middle_speed = after_row(matrices, half, V, state, inputs, active)
    free, end = (middle, middle_speed), (trial[X], trial[V])
    mid = done + 0.5 * h
    first = _curved_force((state[X], state[V]), memory, push, done, linear, p)
    at = _after(matrices, half, free, first, 0.0)
    second = _curved_force(at, memory, push, mid, linear, p)
    at = _after(matrices, half, free, first, 4.0 * (second - first) / h)
    third = _curved_force(at, memory, push, mid, linear, p)
    at = _after(matrices, whole, end, first, 2.0 * (third - first) / h)
    last = _curved_force(at, memory, push, done + h, linear, p)
    between = 0.5 * (second + third)
    slope = (4.0 * between - 3.0 * first - last) / h
    bend = 2.0 * (first - 2.0 * between + last) / (h * h)
    for n in range(active.size):
        row = active[n]
        trial[row] += matrices[whole, row, _CONSTANT] * first
        trial[row] += matrices[whole, row, _SLOPE] * slope
        trial[row] += matrices[whole, row, _BEND] * bend
