"""Dry friction with two levels: Coulomb while sliding, break-away at rest.

Sliding, friction is ``-Fc sgn v``. At rest it balances the applied force as long as
that stays within the break-away level ``Fs >= Fc``. There is no smoothing around
velocity zero; ``mechanics.simulate_motion`` finds stops and break-aways inside the
sampling step. docs/method_simulation.md, eq. (G2) and (G3).
"""

import numpy as np

from hwid_cli.records.mechanics import Friction


def friction_force(
    velocity_m_per_s: np.ndarray, applied_N: np.ndarray, friction: Friction
) -> np.ndarray:
    """Force of dry friction for a given velocity and applied force.

    Parameters
    ----------
    velocity_m_per_s : ndarray, any shape, [m/s]
        Exactly 0 means at rest.
    applied_N : ndarray, same shape, [N]
        Sum of all other forces; matters at rest only.

    Returns
    -------
    ndarray, same shape, [N]

    References
    ----------
    docs/method_simulation.md, eq. (G2).

    Examples
    --------
    >>> import numpy as np
    >>> law = Friction(coulomb_N=2.0, break_away_N=3.0)
    >>> friction_force(np.array([0.1, 0.0, 0.0]), np.array([9.0, 2.5, 4.0]), law)
    array([-2. , -2.5, -2. ])
    """
    velocity, applied = np.broadcast_arrays(
        np.asarray(velocity_m_per_s, dtype=float), np.asarray(applied_N, dtype=float)
    )
    at_rest = np.where(
        sticks(applied, friction), -applied, -friction.coulomb_N * np.sign(applied)
    )
    return np.where(velocity == 0, at_rest, -friction.coulomb_N * np.sign(velocity))


def sticks(applied_N: np.ndarray, friction: Friction) -> np.ndarray:
    """Whether a body at rest stays at rest under an applied force.

    Parameters
    ----------
    applied_N : ndarray, any shape, [N]
        Sum of all other forces.

    Returns
    -------
    ndarray of bool, same shape

    References
    ----------
    docs/method_simulation.md, eq. (G3).
    """
    return np.abs(applied_N) <= friction.break_away_N
