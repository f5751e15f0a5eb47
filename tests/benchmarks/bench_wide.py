"""Fits of many kinds of plants against fits that begin at the true plant.

``python -m tests.benchmarks.bench_wide [--plants N] [--first SEED]``: orders to 6, delays 1 to 3, 0.1 to
5 % noise, 200 to 20 000 samples, held levels, few levels, coloured noise and multisines,
maps with dead zones, limits, roots, folds and exponentials, half of them not at rest at
the start. A fit that begins with the true plant, its maps cut to as many break-points,
says what can be reached; the table counts how often a fit from nothing comes near it.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.records.model import HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.plants import cut_model, linear_block

Curve = Callable[[np.ndarray], np.ndarray]
INPUT_MAPS: dict[str, Curve] = {
    "dead zone": lambda u: u - np.clip(u, -0.6, 0.4),
    "limits": lambda u: np.clip(u, -1.2, 1.6),
    "tanh": lambda u: np.tanh(0.8 * u) + 0.15 * u,
    "kink": lambda u: u + 0.3 * np.abs(u),
    "none": lambda u: u,
    "cubic": lambda u: u + 0.1 * u**2 + 0.05 * u**3,
    "root": lambda u: np.sign(u) * np.sqrt(np.abs(u) + 0.01),
}
OUTPUT_MAPS: dict[str, Curve] = {
    "tanh": lambda x: 2.0 * np.tanh(0.6 * x),
    "limits": lambda x: np.clip(x, -1.0, 0.8) + 0.1 * x,
    "cubic": lambda x: x + 0.12 * x**2 + 0.08 * x**3,
    "none": lambda x: x,
    "fold": lambda x: np.abs(x) + 0.2 * x,
    "dead zone": lambda x: x - np.clip(x, -0.3, 0.3),
    "exponential": lambda x: np.exp(0.5 * x),
}
LEAD_IN = 300


@dataclass(frozen=True, eq=False)
class WidePlant:
    """A plant, its recording and what reaches its output map."""

    recording: Recording
    orders: Orders
    numerator: np.ndarray
    denominator: np.ndarray
    maps: tuple[str, str]
    x: np.ndarray


def signal(kind: int, n: int, rng: np.random.Generator) -> np.ndarray:
    """Held levels, few levels, coloured noise or a multisine."""
    if kind == 0:
        held = np.repeat(rng.uniform(-2.8, 2.8, n // 15 + 1), 15)[:n]
        return held + 0.2 * rng.standard_normal(n)
    if kind == 1:
        return np.repeat(rng.choice(np.linspace(-2.5, 2.5, 9), n // 60 + 1), 60)[:n]
    if kind == 2:
        u = lfilter([0.1], [1.0, -0.9], rng.standard_normal(n))
        return u * 1.3 / np.std(u)
    turns = 2.0 * np.pi * np.arange(n) / max(200, n // 8)
    lines = (1, 3, 7, 11, 19, 29, 41)
    u = sum(np.sin(k * turns + rng.uniform(0.0, 2.0 * np.pi)) for k in lines)
    return u * 1.2 / np.std(u)


def block(rng: np.random.Generator) -> tuple[Orders, np.ndarray, np.ndarray]:
    """Random orders, B and F with static gain one."""
    nf, nk = int(rng.integers(1, 7)), int(rng.integers(1, 4))
    numerator, denominator = linear_block(
        rng, nf, radii=(0.5, 0.985), angles=(0.02, 1.5), reals=(0.2, 0.98)
    )
    return Orders(numerator.size, nf, nk), numerator, denominator


def wide_plant(seed: int) -> WidePlant:
    """Plant number `seed` and a noisy recording of it."""
    rng = np.random.default_rng([seed, 4711])
    orders, numerator, denominator = block(rng)
    n = int(np.exp(rng.uniform(np.log(200), np.log(20_000))))
    noise = float(np.exp(rng.uniform(np.log(0.001), np.log(0.05))))
    kind = int(rng.integers(4))
    maps = (
        list(INPUT_MAPS)[rng.integers(len(INPUT_MAPS))],
        list(OUTPUT_MAPS)[rng.integers(len(OUTPUT_MAPS))],
    )
    first = LEAD_IN if rng.random() < 0.5 else 0
    u = signal(kind, n + LEAD_IN, rng)
    delayed = np.r_[np.zeros(orders.nk), numerator]
    x = lfilter(delayed, denominator, INPUT_MAPS[maps[0]](u))
    u, x = u[first : first + n], x[first : first + n]
    y = OUTPUT_MAPS[maps[1]](x)
    y = y + noise * np.std(y) * rng.standard_normal(n)
    recording = Recording(f"plant_{seed}", u, y, 1.0)
    return WidePlant(recording, orders, numerator, denominator, maps, x)


def true_model(plant: WidePlant) -> HammersteinWiener:
    """The plant with as many break-points as a fit has."""
    curves = (INPUT_MAPS[plant.maps[0]], OUTPUT_MAPS[plant.maps[1]])
    reached = (plant.recording.input, plant.x)
    return cut_model(
        curves, reached, plant.numerator, plant.denominator, plant.orders.nk
    )


def main() -> None:
    """Fit every plant twice and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=150)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    count = asked.plants
    short, seconds = [], 0.0
    print(
        "plants whose training fit stays more than 0.3 points below what is possible:"
    )
    for seed in range(asked.first, asked.first + count):
        plant = wide_plant(seed)
        start = [true_model(plant)]
        possible = fit([plant.recording], plant.orders, starts=start).fit_percent
        begun = time.process_time()
        found = fit([plant.recording], plant.orders).fit_percent
        seconds += time.process_time() - begun
        short.append(possible - found)
        if not short[-1] <= 0.3:
            orders = plant.orders
            print(
                f"{seed:4} [{orders.nb} {orders.nf} {orders.nk}] "
                f"{plant.recording.n_samples:6} samples, {plant.maps[0]} -> "
                f"{plant.maps[1]}: {found:.2f} of {possible:.2f} %"
            )
    missed = np.array(short)
    print(
        f"{count} plants, {seconds / count:.3f} s each: within 0.05 points "
        f"{np.mean(missed <= 0.05):.0%}, within 0.3 {np.mean(missed <= 0.3):.0%}"
    )


if __name__ == "__main__":
    main()
