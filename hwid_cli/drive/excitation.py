"""Inputs with which a machine is excited: step and ramp, sine, random levels.

Every input starts with its first sample; a rest before it is the caller's business.
docs/method_simulation.md, eq. (E1) to (E3).
"""

import numpy as np


def step(n_samples: int, amplitude: float, ramp_samples: int = 0) -> np.ndarray:
    """Rise to a level along a straight line, then hold it.

    Parameters
    ----------
    n_samples : int, [samples]
    amplitude : float, [input unit]
        Level that is held.
    ramp_samples : int, [samples]
        Time of the rise from 0; 0 for a jump at the first sample.

    Returns
    -------
    ndarray, shape (n_samples,), [input unit]

    References
    ----------
    docs/method_simulation.md, eq. (E1).

    Examples
    --------
    >>> step(4, 6.0, ramp_samples=2)
    array([0., 3., 6., 6.])
    """
    if ramp_samples == 0:
        return np.full(n_samples, float(amplitude))
    return amplitude * np.minimum(np.arange(n_samples) / ramp_samples, 1.0)


def sine(
    n_samples: int, amplitude: float, rad_per_sample: float, fade_in_samples: int = 0
) -> np.ndarray:
    """Sine that starts at zero.

    Parameters
    ----------
    n_samples : int, [samples]
    amplitude : float, [input unit]
    rad_per_sample : float, [rad/sample]
    fade_in_samples : int, [samples]
        The amplitude rises along a straight line for so long; 0 for all at once.

    Returns
    -------
    ndarray, shape (n_samples,), [input unit]

    References
    ----------
    docs/method_simulation.md, eq. (E2).
    """
    wave = np.sin(rad_per_sample * np.arange(n_samples))
    return step(n_samples, amplitude, fade_in_samples) * wave


def random_levels(
    n_samples: int,
    amplitude: float,
    *,
    shortest_samples: int,
    longest_samples: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Random levels joined by straight lines, starting at zero.

    Parameters
    ----------
    n_samples : int, [samples]
    amplitude : float, [input unit]
        Levels are uniform within plus and minus this.
    shortest_samples, longest_samples : int, [samples]
        The distance between two levels is uniform within this range, both included.

    Returns
    -------
    ndarray, shape (n_samples,), [input unit]

    References
    ----------
    docs/method_simulation.md, eq. (E3).
    """
    # So many levels reach beyond the end even if every distance is the shortest.
    n_levels = n_samples // shortest_samples + 1
    distances = rng.integers(shortest_samples, longest_samples + 1, size=n_levels)
    levels = rng.uniform(-amplitude, amplitude, size=n_levels)
    times = np.concatenate([[0], np.cumsum(distances)])
    return np.interp(np.arange(n_samples), times, np.concatenate([[0.0], levels]))
