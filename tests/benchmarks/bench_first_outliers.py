"""Huber fits of recordings with gross errors among their first samples.

``python -m tests.benchmarks.bench_first_outliers [--plants N] [--first SEED]``: linear
plants, and ones with a tanh at the input, of one to three poles; 2 % noise, 3 % outliers
of two to ten standard deviations, and one to four of them among the first twelve samples.
What counts is the deviation of the model from the plant without noise, over the noise:
with the start, and from the 30th sample on.
"""

import argparse

import numpy as np
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.plants import linear_block

SAMPLES, LEAD_IN, NOISE = 1000, 300, 0.02
LINEAR = FitOptions(input_map="none", output_map="none", loss="huber")
WITH_MAP = FitOptions(
    input_map="piecewise_linear", output_map="none", loss="huber", units=6
)


def damaged(seed, bent=False):
    """Recording, true output, noise and orders of plant number `seed`."""
    rng = np.random.default_rng([seed, 606])
    nf = int(rng.integers(1, 4))
    numerator, denominator = linear_block(rng, nf)
    nk, count = int(rng.integers(1, 3)), SAMPLES + LEAD_IN
    u = np.repeat(rng.uniform(-2.0, 2.0, count // 10 + 1), 10)[:count]
    u = u + 0.1 * rng.standard_normal(count)
    w = np.tanh(u) if bent else u
    clean = lfilter(np.r_[np.zeros(nk), numerator], denominator, w)[LEAD_IN:]
    size = np.std(clean)
    y = clean + NOISE * size * rng.standard_normal(SAMPLES)
    bad = np.flatnonzero(rng.random(SAMPLES) < 0.03)
    first = rng.choice(12, size=int(rng.integers(1, 5)), replace=False)
    bad = np.union1d(bad, first)
    y[bad] += size * rng.uniform(2.0, 10.0, bad.size) * rng.choice([-1, 1], bad.size)
    orders = Orders(numerator.size, nf, nk)
    return Recording(f"p{seed}", u[LEAD_IN:], y, 1.0), clean, NOISE * size, orders


def deviations(seed, bent=False):
    """Deviation from the truth over the noise: all samples, and without the first 30."""
    recording, clean, noise, orders = damaged(seed, bent)
    found = fit([recording], orders, WITH_MAP if bent else LINEAR)
    error = (simulate(found.model, recording.input) - clean) / noise
    return np.sqrt(np.mean(error**2)), np.sqrt(np.mean(error[30:] ** 2))


def main():
    """Count the plants whose start, or whose model, is spoilt."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=60)
    parser.add_argument("--first", type=int, default=200)
    asked = parser.parse_args()
    for title, bent in (("linear", False), ("tanh at the input", True)):
        seeds = range(asked.first, asked.first + asked.plants)
        found = np.array([deviations(seed, bent) for seed in seeds])
        print(
            f"{title}: {asked.plants} plants, median {np.median(found[:, 0]):.2f} of the "
            f"noise; start spoilt (beyond the noise) {np.mean(found[:, 0] > 1.0):.0%}, "
            f"model spoilt {np.mean(found[:, 1] > 1.0):.0%}"
        )


if __name__ == "__main__":
    main()
