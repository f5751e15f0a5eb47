"""Maps of the default size against maps that the data choose, on single recordings.

``make bench-maps`` (``python -m tests.benchmarks.bench_maps [--plants N]``): the random
plants at their true orders. Each is fitted with every pair of some maps, and BIC chooses,
as ``hwid order`` does for a lone recording; test data judge. A fit that begins at the
true plant, its maps cut to as many break-points, says what ten of them can reach.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed

from hwid_cli.model import scores
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import OrderOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.map_choice import candidate_maps
from tests.benchmarks.plants import random_plant, true_random_plant

CANDIDATES = candidate_maps(
    FitOptions(),
    OrderOptions(maps=("none", "polynomial", "cubic_spline"), units=(5, 20)),
)
POOR = 98.8


@dataclass(frozen=True)
class Compared:
    """Test fits of one plant, in percent."""

    seed: int
    orders: Orders
    default: float
    from_truth: float
    chosen: float
    maps: str


def compare(seed: int) -> Compared:
    """Fit one plant with all maps."""
    orders, u, y, u_test, y_test = random_plant(seed)
    recording = Recording(f"plant_{seed}", u, y, 1.0)

    def judged(options, starts=()):
        found = fit([recording], orders, options, starts=starts)
        simulated = simulate(found.model, u_test)
        return found.information.bic, scores.fit_percent(y_test, simulated)

    results = [judged(options) for options in CANDIDATES]
    best = int(np.argmin([bic for bic, _ in results]))
    first, second = CANDIDATES[best].of_input, CANDIDATES[best].of_output
    return Compared(
        seed,
        orders,
        results[0][1],
        judged(FitOptions(), [true_random_plant(seed)])[1],
        results[best][1],
        f"{first.kind}, {first.units} -> {second.kind}, {second.units}",
    )


def main():
    """Print the plants that the default does not suit, and the quantiles of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=80)
    count = parser.parse_args().plants
    found = Parallel(2)(delayed(compare)(seed) for seed in range(count))
    print(f"plants whose default test fit is below {POOR} % (noise floor 99.00 %):")
    for one in found:
        if one.default < POOR:
            nb, nf, nk = one.orders.nb, one.orders.nf, one.orders.nk
            print(
                f"  {one.seed} [{nb} {nf} {nk}]: default {one.default:.2f}, begun at the "
                f"truth {one.from_truth:.2f}, chosen {one.chosen:.2f} ({one.maps})"
            )
    print(f"{count} plants, {len(CANDIDATES)} pairs of maps    median %   worst %")
    for name in ("default", "from_truth", "chosen"):
        values = [getattr(one, name) for one in found]
        print(f"{name:26} {np.median(values):16.2f} {np.min(values):9.2f}")


if __name__ == "__main__":
    main()
