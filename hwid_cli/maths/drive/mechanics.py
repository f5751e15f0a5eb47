"""Motion of a current-driven mass with spring, damper, dry friction and a contact.

``m x'' + c x' + k x + contact(x) = kt i(t) + friction``, the current held linearly
between samples. docs/method_simulation.md, eq. (G1) to (G8). Valid for a current sampled
fast enough that a straight line between samples describes it; the time of the events
is found to rounding, so the numbers do not depend on the sampling step.
"""

import numpy as np

from hwid_cli.maths.drive import kernels
from hwid_cli.records.mechanics import Mechanics


def simulate_motion(
    current_A: np.ndarray,
    mechanics: Mechanics,
    *,
    sample_time_s: float,
    position_m: float = 0.0,
    velocity_m_per_s: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity that a current causes.

    Parameters
    ----------
    current_A : ndarray, shape (n_samples,), [A]
        What the drive really delivers, held linearly between samples.
    mechanics : Mechanics
    sample_time_s : float, [s]
    position_m, velocity_m_per_s : float, [m], [m/s]
        State at the first sample.

    Returns
    -------
    displacement : ndarray, shape (n_samples,), [m]
    velocity : ndarray, shape (n_samples,), [m/s]

    Raises
    ------
    ValueError
        If the current is not 1-D and finite, or the sample time not positive.

    References
    ----------
    docs/method_simulation.md, eq. (G1) to (G8).
    """
    current = np.ascontiguousarray(current_A, dtype=np.float64)
    if current.ndim != 1 or not np.isfinite(current).all():
        raise ValueError("current_A must be 1-D and finite")
    if not sample_time_s > 0:
        raise ValueError(f"sample_time_s must be positive, got {sample_time_s!r}")
    friction = mechanics.friction
    lower, upper = _edges(mechanics)
    return kernels.propagate(
        float(mechanics.force_constant_N_per_A) * current,
        float(sample_time_s),
        (
            float(mechanics.mass_kg),
            float(mechanics.damping_N_s_per_m),
            float(mechanics.stiffness_N_per_m),
        ),
        (float(friction.coulomb_N), float(friction.break_away_N)),
        (lower, upper, float(mechanics.contact.stiffness_N_per_m)),
        (float(position_m), float(velocity_m_per_s)),
    )


def limit_current(command_A: np.ndarray, limit_A: float) -> np.ndarray:
    """Cut a command to what the drive can deliver.

    Parameters
    ----------
    command_A : ndarray, any shape, [A]
    limit_A : float, [A]

    Returns
    -------
    ndarray, same shape, [A]

    References
    ----------
    docs/method_simulation.md, eq. (G9).
    """
    return np.clip(command_A, -limit_A, limit_A)


def spring_force(position_m: np.ndarray, mechanics: Mechanics) -> np.ndarray:
    """Force with which spring and contact push back.

    Parameters
    ----------
    position_m : ndarray, any shape, [m]
    mechanics : Mechanics

    Returns
    -------
    ndarray, same shape, [N]
        Positive for a positive displacement.

    References
    ----------
    docs/method_simulation.md, eq. (G4).
    """
    beyond = _beyond_edge(position_m, mechanics)
    stiffness = mechanics.contact.stiffness_N_per_m
    return mechanics.stiffness_N_per_m * np.asarray(position_m) + stiffness * beyond


def energy(
    position_m: np.ndarray, velocity_m_per_s: np.ndarray, mechanics: Mechanics
) -> np.ndarray:
    """Energy in mass, spring and contact.

    Parameters
    ----------
    position_m : ndarray, any shape, [m]
    velocity_m_per_s : ndarray, same shape, [m/s]
    mechanics : Mechanics

    Returns
    -------
    ndarray, same shape, [J]

    References
    ----------
    docs/method_simulation.md, eq. (G10).
    """
    beyond = _beyond_edge(position_m, mechanics)
    return 0.5 * (
        mechanics.mass_kg * np.square(velocity_m_per_s)
        + mechanics.stiffness_N_per_m * np.square(position_m)
        + mechanics.contact.stiffness_N_per_m * np.square(beyond)
    )


def static_position(force_N: float, mechanics: Mechanics) -> float:
    """Position in which spring and contact balance a force, friction left out.

    Parameters
    ----------
    force_N : float, [N]
    mechanics : Mechanics
        With a spring.

    Returns
    -------
    float, [m]

    Raises
    ------
    ValueError
        If there is no spring: a free axis has no such position.

    References
    ----------
    docs/method_simulation.md, eq. (G4) solved for x.

    Examples
    --------
    >>> from hwid_cli.records.mechanics import Contact
    >>> arm = Mechanics(stiffness_N_per_m=100.0, contact=Contact(0.2, 300.0))
    >>> static_position(10.0, arm), static_position(40.0, arm)
    (0.1, 0.25)
    """
    stiffness = mechanics.stiffness_N_per_m
    if not stiffness > 0:
        raise ValueError("stiffness_N_per_m must be positive for a static position")
    free = force_N / stiffness
    lower, upper = _edges(mechanics)
    edge = min(max(free, lower), upper)
    # Beyond an edge the main spring carries the force up to it, both springs the rest.
    both = stiffness + mechanics.contact.stiffness_N_per_m
    return edge + (force_N - stiffness * edge) / both


def rest_range(current_A: float, mechanics: Mechanics) -> tuple[float, float]:
    """Positions in which stiction holds the mass under a constant current.

    Parameters
    ----------
    current_A : float, [A]
    mechanics : Mechanics
        With a spring.

    Returns
    -------
    lowest, highest : float, [m]

    References
    ----------
    docs/method_simulation.md, eq. (G3) and (G4).
    """
    force = mechanics.force_constant_N_per_A * current_A
    hold = mechanics.friction.break_away_N
    return (
        static_position(force - hold, mechanics),
        static_position(force + hold, mechanics),
    )


def _edges(mechanics: Mechanics) -> tuple[float, float]:
    """Return where the contact begins below and above; infinite if it does not."""
    contact = mechanics.contact
    edge = float(contact.position_m) if contact.stiffness_N_per_m > 0 else np.inf
    return (-edge if contact.both_sides else -np.inf), edge


def _beyond_edge(position_m: np.ndarray, mechanics: Mechanics) -> np.ndarray:
    """Return how far positions lie beyond the contact's edges, with sign."""
    lower, upper = _edges(mechanics)
    position = np.asarray(position_m, dtype=float)
    return position - np.clip(position, lower, upper)
