"""Random plants for the bands of predictions, by other equations than the program's.

Right structure: input curve, linear block, output curve, by scipy's filter. Wrong
structure: a mass on a hardening spring with dry friction; backlash behind a motor; a
winding that heats; a drag that grows with the speed; a valve whose gain follows the state.
Integrated here, step by step.
"""

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from hwid_cli.records.recordings import Recording

STRUCTURES = ("right", "friction", "hardening", "backlash", "heating", "state gain")
INPUTS = ("steps", "multisine", "sweep", "levels")
N_SAMPLES, SAMPLE_TIME_S = 1000, 0.01


def make_input(kind: str, rng: np.random.Generator, largest: float) -> np.ndarray:
    """An input of one kind; after a short rest, within `largest`."""
    n, t = N_SAMPLES, np.arange(N_SAMPLES)
    u = np.zeros(n)
    size = largest * rng.uniform(0.6, 1.0)
    if kind == "steps":
        at = np.sort(rng.choice(np.arange(60, n - 100), 3, replace=False))
        for place, level in zip(at, rng.uniform(-size, size, 3), strict=True):
            u[place:] = level
    elif kind == "multisine":
        lines = np.unique(rng.integers(1, 60, 12))
        u = np.sum(
            [np.sin(2 * np.pi * k * t / n + rng.uniform(0, 6.3)) for k in lines], axis=0
        )
        u *= size / np.abs(u).max()
    elif kind == "sweep":
        low, high = 2.0, rng.uniform(40, 90)
        u = size * np.sin(2 * np.pi * (low + (high - low) * t / n / 2) * t / n)
    else:
        hold = int(rng.integers(15, 50))
        u = np.repeat(rng.uniform(-size, size, n // hold + 1), hold)[:n]
    u[:30] = 0.0
    return u


def _curves(rng: np.random.Generator) -> tuple[Callable, Callable]:
    a, b = rng.uniform(0.1, 0.6, 2)
    first = (
        lambda u: u - np.clip(u, -a, b),
        lambda u: np.clip(u, -1.2 - a, 1.0 + b),
        lambda u: np.tanh(u * (0.4 + a)) + 0.2 * u,
        lambda u: u + 0.2 * np.abs(u) + 0.05 * u**3,
        lambda u: u,
    )
    second = (
        lambda x: 2 * np.tanh(0.6 * x),
        lambda x: np.clip(x, -1.0 - a, 0.8 + b) + 0.15 * x,
        lambda x: x + 0.12 * x**2 + 0.06 * x**3,
        lambda x: x,
    )
    return first[rng.integers(len(first))], second[rng.integers(len(second))]


def _right(rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    f, g = _curves(rng)
    if rng.random() < 0.6:
        radius, angle = rng.uniform(0.85, 0.97), rng.uniform(0.03, 0.3)
        den = np.poly(radius * np.exp(1j * angle * np.array([1, -1]))).real
    else:
        den = np.poly(rng.uniform([0.6, 0.3], [0.98, 0.9]))
    num = np.array([1.0, rng.uniform(-0.5, 0.9)])
    num *= den.sum() / num.sum()
    return lambda u: g(lfilter(np.r_[0.0, num], den, f(u)))


def _second_order(rng: np.random.Generator, structure: str) -> Callable:
    frequency, damping = rng.uniform(4, 12), rng.uniform(0.2, 0.9)
    share = rng.uniform(0.05, 0.3)
    f, _ = _curves(rng)

    def plant(u: np.ndarray) -> np.ndarray:
        v = f(u)
        x = s = heat = 0.0
        y, play = np.zeros(u.size), 0.0
        for k in range(u.size):
            drive = v[k]
            if structure == "heating":
                heat += SAMPLE_TIME_S * (u[k] ** 2 - heat) / 3.0
                drive *= 1 - min(0.6, 0.5 * share * heat)
            if structure == "state gain":
                drive *= 1 + 1.5 * share * np.tanh(x)
            for _ in range(10):
                force = drive - x - 2 * damping / frequency * s
                if structure == "hardening":
                    force -= 2 * share * x**3
                if structure == "friction":
                    force -= 0.4 * share * np.tanh(s / 0.05)
                s += 1e-3 * frequency**2 * force
                x += 1e-3 * s
            play = min(max(play, x - 0.5 * share), x + 0.5 * share)
            y[k] = play if structure == "backlash" else x
        return y

    return plant


def plant_recordings(
    seed: int, structure: str, kinds: list[str], *, largest: float = 2.0
) -> list[Recording]:
    """Recordings of one random plant, one for each kind that is asked for."""
    rng = np.random.default_rng([seed, STRUCTURES.index(structure), 2601])
    plant = _right(rng) if structure == "right" else _second_order(rng, structure)
    noise = rng.choice([0.002, 0.01, 0.03])
    found = []
    for number, kind in enumerate(kinds):
        u = make_input(kind, rng, largest)
        y = plant(u)
        y = y + noise * np.std(y) * rng.standard_normal(u.size)
        found.append(Recording(f"{kind}_{number}", u, y, SAMPLE_TIME_S))
    return found
