"""A mass on a spring with dry friction, integrated here and not by the program's drive.

Small steps; friction takes in each what stops the mass, up to its limit. A hardening
spring, and a machine that differs from recording to recording, can be added.
"""

import numpy as np

from hwid_cli.records.recordings import Recording

MASS, DAMPING, STIFFNESS, FORCE = 0.3, 12.0, 1200.0, 5.0
SAMPLE_TIME_S, N = 2e-3, 600
_STEPS = 40


def motion(current, *, friction=0.8, hardening=0.0, change=0.0):
    """Position at every sample; the current is held linearly between samples."""
    step = SAMPLE_TIME_S / _STEPS
    x = v = 0.0
    found = np.zeros(current.size)
    for k in range(current.size - 1):
        found[k] = x
        for part in range(_STEPS):
            share = part / _STEPS
            u = (1 - share) * current[k] + share * current[k + 1]
            push = FORCE * (1.0 + change) * u - STIFFNESS * x - hardening * x**3
            free = v + step * (push - DAMPING * v) / MASS
            most = step * friction / MASS
            v = 0.0 if abs(free) <= most else free - np.sign(free) * most
            x += step * v
    found[-1] = x
    return found


def current_of(kind, rng):
    """A random current of a kind: steps, or a multisine; at rest at first."""
    t = np.arange(N)
    if kind == "steps":
        at = np.sort(rng.integers(40, N - 80, 2))
        levels = rng.uniform(1.0, 4.0, 2) * rng.choice([-1, 1], 2)
        u = levels[0] * (t >= at[0]) + (levels[1] - levels[0]) * (t >= at[1])
    else:
        lines = rng.integers(1, 16, 6)
        phases = rng.uniform(0, 6.28, 6)
        u = np.sin(2 * np.pi * np.outer(t / N, lines) + phases).sum(axis=1)
        u *= rng.uniform(1.5, 4.0) / np.abs(u).max()
        u *= np.minimum(1.0, np.maximum(0.0, (t - 30) / 30))
    u = np.asarray(u, dtype=float)
    u[:30] = 0.0
    return u


def recording(kind, seed, *, noise=2e-5, scatter=0.0, **machine):
    """A noisy recording of the machine; ``scatter`` changes its force constant."""
    rng = np.random.default_rng([2611, seed])
    u = current_of(kind, rng)
    y = motion(u, change=scatter * rng.standard_normal(), **machine)
    return Recording(
        f"{kind}_{seed}", u, y + noise * rng.standard_normal(N), SAMPLE_TIME_S
    )
