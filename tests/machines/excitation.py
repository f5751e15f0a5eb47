"""Commands and references of recordings, all of size 1 and at rest for a while before."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Share of a recording, at its start, in which nothing is commanded.
REST = 0.05


@dataclass(frozen=True)
class Signal:
    """One recording's command or reference."""

    name: str
    kind: str
    values: np.ndarray


@dataclass(frozen=True)
class Timing:
    """Length of a recording, and how many samples the machine's slowest swing takes."""

    samples: int
    swing: float


def _empty(timing: Timing) -> tuple[np.ndarray, int]:
    return np.zeros(timing.samples), max(5, int(REST * timing.samples))


def steps(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Up, down past zero, and back; each level held for a few swings."""
    values, first = _empty(timing)
    side = rng.choice([-1.0, 1.0])
    length = (timing.samples - first) // 3
    for n, level in enumerate((side, -side * rng.uniform(0.5, 1.0), 0.0)):
        values[first + n * length :] = level
    return values


def one_way(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """A step up that stays."""
    values, first = _empty(timing)
    values[first + int(rng.integers(0, max(2, first))) :] = 1.0
    return values


def staircase(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Up in equal treads, and down again."""
    values, first = _empty(timing)
    treads = [0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0]
    length = (timing.samples - first) // len(treads)
    for n, level in enumerate(treads):
        values[first + n * length :] = level
    return rng.choice([-1.0, 1.0]) * values


def triangles(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Straight up and down across zero."""
    values, first = _empty(timing)
    n = np.arange(timing.samples - first)
    period = min(timing.swing * rng.uniform(4.0, 9.0), 0.7 * n.size)
    values[first:] = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * n / period))
    return rng.choice([-1.0, 1.0]) * values


def sine(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """One frequency, from well below the machine's own to somewhat above."""
    values, first = _empty(timing)
    n = np.arange(timing.samples - first)
    period = min(
        timing.swing * np.exp(rng.uniform(np.log(0.6), np.log(5.0))), n.size / 2
    )
    values[first:] = np.sin(2.0 * np.pi * n / period)
    return values


def multisine(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Several frequencies around the machine's own, random phases."""
    values, first = _empty(timing)
    n = np.arange(timing.samples - first)
    total = np.zeros(n.size)
    for period in timing.swing * np.geomspace(0.35, 6.0, 9) * rng.uniform(0.9, 1.1, 9):
        total += np.sin(2.0 * np.pi * n / period + rng.uniform(0.0, 2.0 * np.pi))
    fade = np.minimum(1.0, n / (0.5 * timing.swing))
    values[first:] = fade * total / np.abs(total).max()
    return values


def chirp(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """A sine whose frequency rises, from slow to twice the machine's own."""
    values, first = _empty(timing)
    n = np.arange(timing.samples - first)
    low, high = 1.0 / (8.0 * timing.swing), rng.uniform(1.5, 2.5) / timing.swing
    rate = np.log(high / low) / n.size
    values[first:] = np.sin(2.0 * np.pi * low * (np.exp(rate * n) - 1.0) / rate)
    return values


def levels(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Random levels, each held for a random while."""
    values, first = _empty(timing)
    at = first
    while at < timing.samples:
        values[at:] = rng.uniform(-1.0, 1.0)
        at += max(2, int(timing.swing * rng.uniform(0.2, 1.2)))
    return values / np.abs(values).max()


def doublets(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Push and equal pull, again and again: a free axis stays near where it was."""
    values, first = _empty(timing)
    at = first
    while at < timing.samples:
        width = max(3, int(timing.swing * rng.uniform(0.15, 0.5)))
        size = rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 1.0)
        values[at : at + width] = size
        values[at + width : at + 3 * width] = -size
        values[at + 3 * width : at + 4 * width] = size
        at += 4 * width + int(width * rng.uniform(0.5, 1.5))
    return values / np.abs(values).max()


def moves(rng: np.random.Generator, timing: Timing) -> np.ndarray:
    """Reference of a position controller: there and back with limited speed."""
    values, first = _empty(timing)
    span = (timing.samples - first) // 4
    ramp = max(4, int(span * rng.uniform(0.25, 0.7)))
    rise = 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(span) / ramp, 1.0))
    at, now = first, 0.0
    for goal in (1.0, rng.uniform(-0.2, 0.6), rng.uniform(-1.0, -0.5), 0.0):
        part = values[at : at + span]
        part[:] = now + (goal - now) * rise[: part.size]
        values[at + span :] = goal
        at, now = at + span, goal
    return rng.choice([-1.0, 1.0]) * values


KINDS = {
    "steps": ("step", steps),
    "one_way": ("step", one_way),
    "staircase": ("step", staircase),
    "triangles": ("other", triangles),
    "sine": ("sine", sine),
    "multisine": ("random", multisine),
    "chirp": ("sine", chirp),
    "levels": ("random", levels),
    "doublets": ("step", doublets),
    "moves": ("other", moves),
}


def plan(
    rng: np.random.Generator, menu: Sequence[str], count: int, timing: Timing
) -> list[Signal]:
    """So many signals of the kinds of a menu, shuffled, of sizes from a quarter to one."""
    wanted = [menu[n % len(menu)] for n in range(count)]
    rng.shuffle(wanted)
    sizes = rng.permutation(np.linspace(0.25, 1.0, count))
    signals = []
    for n, (word, size) in enumerate(zip(wanted, sizes, strict=True), start=1):
        kind, make = KINDS[word]
        signals.append(Signal(f"{word}_{n:02d}", kind, size * make(rng, timing)))
    return signals
