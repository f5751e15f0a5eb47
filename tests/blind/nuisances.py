"""What spoils a measurement without being an effect of the machine."""

import numpy as np

from tests.blind.inputs import LARGEST_A
from tests.blind.machine import SAMPLE_TIME_S

COLOURED_TIME_S = 0.02
CURRENT_NOISE_A = 0.01 * LARGEST_A
QUANTISATION_SHARE = 0.01
GAIN_SPREAD = 0.005
# Offset and slope in shares of the largest displacement; the slope is per second.
SLOW_SHARES = (0.002, 0.005)
NUISANCES = ("coloured_noise", "current_noise", "coarse_sensor", "gain_spread", "drift")


def measure(displacement_m, current_A, nuisance, sigma_m, full_scale_m, rng):
    """The recorded displacement and current of one recording."""
    y = np.array(displacement_m)
    if nuisance == "gain_spread":
        y *= 1.0 + GAIN_SPREAD * rng.standard_normal()
    if nuisance == "drift":
        offset, drift = rng.uniform(*SLOW_SHARES, 2) * rng.choice([-1.0, 1.0], 2)
        y += full_scale_m * (offset + drift * SAMPLE_TIME_S * np.arange(len(y)))
    if nuisance == "coloured_noise":
        share = np.sqrt(0.5) * sigma_m
        y += share * rng.standard_normal(len(y)) + share * coloured(len(y), rng)
    else:
        y += sigma_m * rng.standard_normal(len(y))
    if nuisance == "coarse_sensor":
        smallest = QUANTISATION_SHARE * full_scale_m
        y = smallest * np.round(y / smallest)
    current = np.array(current_A)
    if nuisance == "current_noise":
        current += CURRENT_NOISE_A * rng.standard_normal(len(current))
    return y, current


def coloured(samples, rng):
    """Noise of unit power that forgets within ``COLOURED_TIME_S``."""
    keep = np.exp(-SAMPLE_TIME_S / COLOURED_TIME_S)
    shocks = np.sqrt(1 - keep**2) * rng.standard_normal(samples)
    noise = np.empty(samples)
    noise[0] = rng.standard_normal()
    for n in range(1, samples):
        noise[n] = keep * noise[n - 1] + shocks[n]
    return noise
