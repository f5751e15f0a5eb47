"""Speed and accuracy of the fit against what a user would write by hand.

``make bench`` runs this file; it asserts nothing and times nothing in the test suite.
All methods see the same plants in the same run: random ones made here, and the public
suite where it lies beside the measured data. jax-sysid has a row where it is installed.
"""

import time
from importlib.util import find_spec

import numpy as np

from hwid_cli.model import scores
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from tests.benchmarks.by_hand import fit_by_hand
from tests.benchmarks.plants import public_plants, random_plant

N_RANDOM = 20
# Runs of each fit, of which the median counts, and methods that run once.
REPEATS = 3
SLOW = ("jax-sysid, 10-knot maps",)
BASELINE = "by hand, free break-points"


def by_hwid(orders, u, y, u_test):
    """The fit of this project with its defaults."""
    result = fit([Recording("r", u, y, 1.0)], orders, FitOptions())
    return simulate(result.model, u_test)


METHODS = {
    "by hand, fixed break-points": lambda orders, u, y, u_test: fit_by_hand(
        orders, u, y, free=False
    ).simulate(u_test),
    BASELINE: lambda orders, u, y, u_test: fit_by_hand(
        orders, u, y, free=True
    ).simulate(u_test),
    "hwid": by_hwid,
}


def compare(title, plants, methods):
    """Print one row for each method."""
    print(f"\n{title}: {len(plants)} plants, noise floor 99.00 % test fit")
    print(
        f"{'method':30} {'total s':>8} {'s/plant':>8} {'/ by hand':>9} "
        f"{'median %':>9} {'worst %':>8} {'>= 98 %':>8}"
    )
    seconds = {name: np.zeros(len(plants)) for name in methods}
    percents = {name: np.zeros(len(plants)) for name in methods}
    for number, (orders, u, y, u_test, y_test) in enumerate(plants):
        # One plant after the other, all methods in turn: machines change their pace.
        runs = {name: [] for name in methods}
        for repeat in range(REPEATS):
            for name, method in methods.items():
                if repeat and name in SLOW:
                    continue
                begun = time.perf_counter()
                simulated = method(orders, u, y, u_test)
                runs[name].append(time.perf_counter() - begun)
                percents[name][number] = scores.fit_percent(y_test, simulated)
        for name in methods:
            seconds[name][number] = np.median(runs[name])
    baseline = seconds[BASELINE].sum()
    for name in methods:
        seconds_each, percent = seconds[name], percents[name]
        print(
            f"{name:30} {seconds_each.sum():8.2f} {np.median(seconds_each):8.3f} "
            f"{seconds_each.sum() / baseline:9.3f} {np.median(percent):9.2f} "
            f"{np.min(percent):8.2f} {np.sum(percent >= 98.0):8d}"
        )


def main():
    """Compare on random plants and on the public suite."""
    by_hwid(*random_plant(0)[:4])  # compiled loops are built once, outside the clock
    methods = dict(METHODS)
    if find_spec("jax_sysid"):
        from tests.benchmarks.jax_sysid_fit import by_jax_sysid

        methods[SLOW[0]] = by_jax_sysid
    compare("random plants", [random_plant(seed) for seed in range(N_RANDOM)], METHODS)
    plants = public_plants()
    if plants:
        compare("public suite", plants, methods)


if __name__ == "__main__":
    main()
