"""How piecewise linear maps should go on beyond the data of their fit.

``python -m tests.benchmarks.bench_beyond [--plants N]``: fits of the plants of
`bench_wide`, whose inputs are then made larger, and fits of the virtual gun's steps,
simulated on each other's inputs. Their maps go on as the outermost segment says, or with
the mean slope over some share of the data at either end.
"""

import argparse
from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from hwid_cli.model.extrapolation import continued, for_search
from hwid_cli.model.fit import fit
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.model import HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.bench_warm_start import measured_steps
from tests.benchmarks.bench_wide import (
    INPUT_MAPS,
    OUTPUT_MAPS,
    WidePlant,
    signal,
    wide_plant,
)

Way = Callable[[HammersteinWiener], HammersteinWiener]
SHARES = (0.05, 0.1, 0.125, 0.15, 0.25, 0.5, 1.0)
WAYS: dict[str, Way] = {"outermost segment": for_search} | {
    f"outer {share:g}": lambda model, share=share: continued(model, outer=share)
    for share in SHARES
}
GAINS = (1.3, 2.0)
# Fits below this say nothing, wherever they are used.
LEAST_FIT = 90.0
# Orders of the steps' models, and the threshold of the thesis.
ORDERS = tuple(Orders(n, n, 1) for n in (1, 2, 4, 7))
THRESHOLD_M = 0.01


def larger(plant: WidePlant, gain: float, seed: int) -> Recording:
    """Noise-free recording of a plant with a larger input of another kind."""
    rng = np.random.default_rng([seed, 99])
    u = gain * signal(int(rng.integers(4)), 2000, rng)
    numerator = np.r_[np.zeros(plant.orders.nk), plant.numerator]
    x = lfilter(numerator, plant.denominator, INPUT_MAPS[plant.maps[0]](u))
    return Recording("larger", u, OUTPUT_MAPS[plant.maps[1]](x), 1.0)


def of_plants(count: int) -> None:
    """Error beyond the data of plants whose continuation is known."""
    errors: dict[float, list[list[float]]] = {gain: [] for gain in GAINS}
    for seed in range(count):
        plant = wide_plant(seed)
        # What an exponential does beyond its data nobody can tell from the data.
        if plant.maps[1] == "exponential":
            continue
        found = fit([plant.recording], plant.orders)
        if found.model is None or found.fit_percent < LEAST_FIT:
            continue
        for gain in GAINS:
            one = larger(plant, gain, seed)
            errors[gain].append(
                [
                    rmsd(one.output, validation_output(way(found.model), one))
                    / np.std(one.output)
                    for way in WAYS.values()
                ]
            )
    print(f"{len(errors[GAINS[0]])} plants, error as a share of the output's deviation")
    print(f"{'':20}{'input x 1.3: median, ratio':>30}{'x 2: median, ratio':>24}")
    for number, name in enumerate(WAYS):
        line = f"{name:20}"
        for gain, width in zip(GAINS, (20, 14), strict=True):
            table = np.array(errors[gain])
            ratio = np.exp(np.mean(np.log(table[:, number] / table[:, 0])))
            line += f"{np.median(table[:, number]):{width}.4f}{ratio:10.2f}"
        print(line)


def of_steps() -> None:
    """RMSD of the gun's steps on each other."""
    steps = list(measured_steps().values())
    scores: list[list[list[float]]] = [[] for _ in WAYS]
    for one in steps:
        others = [step for step in steps if step is not one]
        for orders in ORDERS:
            model = fit([one], orders).model
            if model is None:
                continue
            for number, way in enumerate(WAYS.values()):
                way_on = way(model)
                scores[number].append(
                    [rmsd(r.output, validation_output(way_on, r)) for r in others]
                )
    print(f"\n{len(steps)} steps of the gun on each other, {len(ORDERS)} orders")
    print(f"{'':20}{'median RMSD, mm':>18}{'90 %':>9}{'below 10 mm':>14}")
    for name, found in zip(WAYS, scores, strict=True):
        values = np.nan_to_num(np.array(found), nan=np.inf)
        middle, high = 1e3 * np.quantile(values, [0.5, 0.9])
        share = np.mean(values < THRESHOLD_M)
        print(f"{name:20}{middle:18.1f}{high:9.0f}{share:14.1%}")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=300)
    of_plants(parser.parse_args().plants)
    of_steps()


if __name__ == "__main__":
    main()
