"""How the time of a fit grows with samples, units, orders and recordings.

Medians over several plants with the same orders, and the exponent p of seconds = c n^p by
least squares on logarithms. ``--full`` goes to 100 000 samples.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.tasks.task import one_thread
from tests.benchmarks.plants import random_plant

PLANTS = (0, 1, 2, 3, 4)
SAMPLES = (200, 500, 1000, 2000, 5000, 10_000, 20_000)
FULL = (*SAMPLES, 50_000, 100_000)
UNITS = (3, 5, 10, 20, 40)
ORDERS = (1, 2, 3, 4, 6, 8, 10)
RECORDINGS = (1, 2, 4, 8)
USUAL = Orders(3, 3, 1)
JOINED = FitOptions(join="experiments")


def exponent(sizes, seconds) -> float:
    """Slope of the straight line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def seconds_of(orders, options, *, samples=2000, count=1) -> float:
    """Median seconds of a fit over the plants."""
    seconds = []
    for seed in PLANTS:
        _, u, y, *_ = random_plant(seed, samples * count)
        parts = zip(np.split(u, count), np.split(y, count), strict=True)
        recordings = [Recording(f"r{k}", *one, 1.0) for k, one in enumerate(parts)]
        begun = time.perf_counter()
        fit(recordings, orders, options)
        seconds.append(time.perf_counter() - begun)
    return float(np.median(seconds))


def show(title, sizes, seconds) -> None:
    """Print one line of sizes, one of seconds and the exponent."""
    half = (len(sizes) - 1) // 2  # at least three of four sizes
    print(
        f"\n{title}: exponent {exponent(sizes, seconds):.2f}, "
        f"of the larger half {exponent(sizes[half:], seconds[half:]):.2f}"
    )
    print("  " + "".join(f"{size:>9}" for size in sizes))
    print("  " + "".join(f"{one:9.3f}" for one in seconds))


def main() -> None:
    """Grow one thing at a time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true")
    sizes = FULL if parser.parse_args().full else SAMPLES
    print(f"seconds of a fit, median of {len(PLANTS)} plants, one thread")
    print("where nothing else is said: [3 3 1], 2000 samples, 10 units, one recording")
    with one_thread():
        seconds_of(USUAL, JOINED, samples=200)  # compiles the loops
        times = [seconds_of(USUAL, JOINED, samples=n) for n in sizes]
        show("samples", sizes, times)
        times = [seconds_of(USUAL, replace(JOINED, units=n)) for n in UNITS]
        show("units of both maps", UNITS, times)
        times = [seconds_of(Orders(n, n, 1), JOINED) for n in ORDERS]
        show("orders nb = nf", ORDERS, times)
        times = [seconds_of(USUAL, JOINED, count=n) for n in RECORDINGS]
        show("recordings of 2000 samples, each with its own state", RECORDINGS, times)


if __name__ == "__main__":
    main()
