"""How the time of a joint fit grows with the number of its recordings.

``python -m tests.benchmarks.bench_joint [--plants N]``: each recording of 600 samples with
an initial state of its own (``join: experiments``), two maps, four to eight states. One
process, one plant after the other with all numbers of recordings in turn; the table has
medians over the plants, of the seconds of an iteration and of a whole fit.
"""

import argparse
import time

import numpy as np
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.plants import linear_block

COUNTS = (10, 20, 40, 80)
SAMPLES, LEAD_IN = 600, 200


def joint_plant(seed, count):
    """Recordings of one plant, moving at their start."""
    rng = np.random.default_rng([seed, 88])
    orders = Orders(2, int(rng.integers(4, 9)), 1)
    _, denominator = linear_block(rng, orders.nf)
    numerator = np.array([0.7, 0.3]) * denominator.sum()
    found = []
    for number in range(count):
        n = SAMPLES + LEAD_IN
        u = np.repeat(rng.uniform(-2.0, 2.0, n // 15 + 1), 15)[:n]
        u = u + 0.1 * rng.standard_normal(n)
        x = lfilter(np.r_[0.0, numerator], denominator, np.tanh(u))[LEAD_IN:]
        y = x + 0.1 * x**3
        y = y + 0.01 * np.std(y) * rng.standard_normal(SAMPLES)
        found.append(Recording(f"r{number}", u[LEAD_IN:], y, 1.0))
    return orders, found


def main():
    """Time fits of ten to eighty recordings."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=7)
    count = parser.parse_args().plants
    options = FitOptions(join="experiments")
    seconds = np.zeros((count, len(COUNTS)))
    each = np.zeros_like(seconds)
    fit(joint_plant(0, 2)[1], Orders(2, 4, 1), options)
    for seed in range(count):
        orders, recordings = joint_plant(300 + seed, max(COUNTS))
        for place, number in enumerate(COUNTS):
            begun = time.process_time()
            found = fit(recordings[:number], orders, options)
            seconds[seed, place] = time.process_time() - begun
            each[seed, place] = seconds[seed, place] / found.iterations
    print(
        f"{'recordings':>10} {'s a fit':>9} {'/ of 10':>8} {'ms / iter.':>11} {'/ of 10':>8}"
    )
    for place, number in enumerate(COUNTS):
        print(
            f"{number:10} {np.median(seconds[:, place]):9.2f} "
            f"{np.median(seconds[:, place] / seconds[:, 0]):8.2f} "
            f"{1e3 * np.median(each[:, place]):11.1f} "
            f"{np.median(each[:, place] / each[:, 0]):8.2f}"
        )


if __name__ == "__main__":
    main()
