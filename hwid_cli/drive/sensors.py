"""What a measuring chain makes of a signal: offset, noise, resolution, damaged samples.

docs/method_simulation.md, eq. (G11) and (G12).
"""

import numpy as np

# Damaged samples stay single: at least this far from each other and from both ends.
DAMAGE_DISTANCE = 20

# Smallest error of a damaged sample as a share of the largest: always visible.
SMALLEST_DAMAGE = 0.5


def read_sensor(
    true: np.ndarray,
    *,
    offset: float,
    noise: float,
    resolution: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Add offset and white noise to a signal and round it to the sensor's resolution.

    Parameters
    ----------
    true : ndarray, shape (n_samples,), [unit of the signal]
    offset : float, [same]
    noise : float, [same]
        Standard deviation.
    resolution : float, [same]
        Readings are multiples of this; 0 for any value.

    Returns
    -------
    ndarray, shape (n_samples,), [same]

    References
    ----------
    docs/method_simulation.md, eq. (G11).
    """
    reading = true + offset + noise * rng.standard_normal(true.size)
    if resolution > 0:
        reading = resolution * np.round(reading / resolution)
    return reading


def damage_samples(
    reading: np.ndarray, largest: int, size: float, rng: np.random.Generator
) -> tuple[np.ndarray, tuple[int, ...]]:
    """Make a few single samples of a reading grossly wrong.

    Parameters
    ----------
    reading : ndarray, shape (n_samples,), [unit of the signal]
    largest : int, [samples]
        0 to so many samples are damaged; fewer where the reading is too short to keep
        them apart.
    size : float, [unit of the signal]
        The error is 50 to 100 % of this, in either direction.

    Returns
    -------
    damaged : ndarray, shape (n_samples,), [unit of the signal]
    indices : tuple of int
        Samples that were damaged, ascending.

    References
    ----------
    docs/method_simulation.md, eq. (G12).
    """
    # One slot of twice the distance for each damaged sample, which lies in its first half.
    n_slots = max(0, reading.size // DAMAGE_DISTANCE - 2) // 2
    count = min(int(rng.integers(0, largest + 1)), n_slots)
    slots = np.sort(rng.choice(n_slots, size=count, replace=False))
    within = rng.integers(0, DAMAGE_DISTANCE, size=count)
    indices = DAMAGE_DISTANCE * (2 * slots + 1) + within
    error = size * rng.uniform(SMALLEST_DAMAGE, 1.0, size=count)
    damaged = reading.copy()
    damaged[indices] += error * rng.choice([-1.0, 1.0], size=count)
    return damaged, tuple(int(index) for index in indices)
