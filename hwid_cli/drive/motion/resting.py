"""Compiled search for where a drive rests under a constant current.

docs/method_diagnosis.md, eq. (D3).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.forces import own_force_at_rest, ripple
from hwid_cli.drive.motion.push import force_of
from hwid_cli.drive.motion.springs import cogging, second_cogging, spring_force

# Tries that bracket the position at rest, each this much further, and that narrow it.
MOST_TRIES, FURTHER, NARROWING = 120, 1.3, 90
# Tries that find how far a motor on its tooth has turned, each far below the last one.
MOST_TURNS = 60


@compiled(**INNER)
def is_anywhere(p: np.ndarray) -> bool:
    """Return whether nothing holds a position.

    Parameters
    ----------
    p : ndarray, shape (N_SLOTS,)
    """
    return p[slots.STIFFNESS] <= 0.0 and p[slots.CUBIC] <= 0.0


@compiled(**INNER)
def resting_point(current: float, has_cogging: bool, p: np.ndarray) -> float:
    """Return where the drive rests without friction, nearest to zero.

    Parameters
    ----------
    current : float, [A]
    p : ndarray, shape (N_SLOTS,)

    Returns
    -------
    float, [m]
        The given start where nothing holds a position.
    """
    if is_anywhere(p):
        return p[slots.START_POSITION]
    force = resting_force(0.0, current, p) + p[slots.LOAD]
    force -= p[slots.GRAVITY_TORQUE] * np.sin(p[slots.GRAVITY_ANGLE])
    force += p[slots.GRAVITY_REST]
    if p[slots.OWN_FORCE] != 0.0:
        force += own_force_at_rest(0.0, _command_at(current, p), p)
    if abs(force) <= p[slots.PRELOAD]:
        return 0.0
    side = np.sign(force)
    force -= side * p[slots.PRELOAD]
    stiffness = p[slots.STIFFNESS]
    stiffness += np.cbrt(max(p[slots.CUBIC], 0.0) * force * force)
    far = 1e-3 * force / stiffness
    near = 0.0
    for _ in range(MOST_TRIES):
        if _away(far, side, current, has_cogging, p) * force <= 0.0:
            break
        near = far
        far *= FURTHER
    for _ in range(NARROWING):
        middle = 0.5 * (near + far)
        if _away(middle, side, current, has_cogging, p) * force > 0.0:
            near = middle
        else:
            far = middle
    return far


@compiled(**INNER)
def _away(
    x: float, side: float, current: float, has_cogging: bool, p: np.ndarray
) -> float:
    """Return the force that is not balanced."""
    force = resting_force(x, current, p) + p[slots.LOAD]
    left = force - side * p[slots.PRELOAD] - spring_force(x, p)
    if not has_cogging and p[slots.COGGING_FORCE] != 0.0:
        left -= cogging(x, p)
    if not has_cogging and p[slots.SECOND_COGGING_FORCE] != 0.0:
        left -= second_cogging(x, p)
    if p[slots.OWN_FORCE] != 0.0:
        left += own_force_at_rest(x, _command_at(current, p), p)
    return left


@compiled(**INNER)
def _command_at(current: float, p: np.ndarray) -> float:
    """Return the command that lets a current flow at rest."""
    return current * p[slots.RESISTANCE] if p[slots.RESISTANCE] > 0.0 else current


@compiled(**INNER)
def resting_force(x: float, current: float, p: np.ndarray) -> float:
    """Return the motor's force at rest.

    Parameters
    ----------
    x : float, [m]
    current : float, [A]
    p : ndarray, shape (N_SLOTS,)
    """
    limit = p[slots.CLIP_LIMIT]
    warmth = p[slots.START_WARMTH]
    constant = force_of(min(max(current, -limit), limit), warmth, p)
    force = constant
    if p[slots.RIPPLE_SHARE] != 0.0 and p[slots.GEAR_STIFFNESS] > 0.0:
        # The motor turns with its force, and the force with its angle.
        for _ in range(MOST_TURNS):
            turned = np.sign(force) * p[slots.GEAR_GAP]
            turned += force / p[slots.GEAR_STIFFNESS]
            force = constant * ripple(x + turned, p)
    elif p[slots.RIPPLE_SHARE] != 0.0:
        force *= ripple(x, p)
    return force
