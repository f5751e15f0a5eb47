"""A grid of 10 x 10 orders on one plant against the same grid fitted by hand.

Ours grows from its corner, through ``hwid identify``'s own `fit_grid` with one worker and
nothing cached; by hand every pair of orders is fitted by itself with fixed break-points.
``--orders N`` takes a smaller grid.
"""

import argparse
import time

import numpy as np

from hwid_cli.model import scores
from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.identify import identify_all
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers
from tests.benchmarks.by_hand import MOST_IN_GRID, fit_by_hand
from tests.benchmarks.grid_scores import Scored, n_not_monotone, n_worse_than
from tests.benchmarks.plants import grid_plant

LINEAR = FitOptions(input_map="none", output_map="none")
# Percentage points of the test fit by which a model may be worse than the linear one.
WORSE = 0.5


def ours(data, grid, options):
    """All models of the grid, scored, and the seconds that the fits took."""
    u, y, u_test, y_test = data
    settings = RunSettings(store=MemoryStore(), workers=Workers(jobs=1))
    begun = time.perf_counter()
    fits = identify_all([Recording("r", u, y, 1.0)], grid, options, settings)
    seconds = time.perf_counter() - begun
    found = []
    for one in fits:
        if one.model is None:
            found.append(Scored(one.orders, float("inf"), -np.inf, False))
            continue
        # Both stretches begin at rest, so the state of the fit holds for both. An empty
        # block would not be at rest: an offset of w is only fixed together with a state.
        tested = simulate(one.model, u_test)
        percent = scores.fit_percent(y_test, tested)
        found.append(Scored(one.orders, one.rmsd, percent, one.is_stable))
    return found, seconds


def by_hand(data, grid):
    """The same by hand."""
    u, y, u_test, y_test = data
    begun = time.perf_counter()
    orders = [one for _, _, one in candidate_orders(grid)]
    fits = [
        fit_by_hand(one, u, y, free=False, most_evaluations=MOST_IN_GRID)
        for one in orders
    ]
    seconds = time.perf_counter() - begun
    found = [
        Scored(
            one,
            scores.rmsd(y, model.simulate(u)),
            scores.fit_percent(y_test, model.simulate(u_test)),
            model.is_stable,
        )
        for one, model in zip(orders, fits, strict=True)
    ]
    return found, seconds


def row(name, found, seconds, linear):
    """Print one method."""
    percent = np.array([one.test_percent for one in found])
    print(
        f"{name:30}{seconds:9.2f}{seconds / len(found):10.3f}"
        f"{np.median(percent):10.2f}{percent.min():9.2f}"
        f"{sum(not one.is_stable for one in found):10d}"
        f"{n_worse_than(found, linear, WORSE):14d}{n_not_monotone(found):14d}"
    )


def main():
    """Fit the grid in both ways."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", type=int, default=10)
    last = parser.parse_args().orders
    name, data = grid_plant()
    grid = OrdersOptions(nb=tuple(range(1, last + 1)), nk=tuple(range(1, last + 1)))
    ours(data, OrdersOptions(nb=(1, 2), nk=(1, 2)), FitOptions())  # compiles the loops
    linear, linear_s = ours(data, grid, LINEAR)
    mine, mine_s = ours(data, grid, FitOptions())
    hand, hand_s = by_hand(data, grid)
    print(f"\n{last} x {last} orders on {name}, {data[0].size} samples, one core")
    print(
        f"{'method':30}{'total s':>9}{'s/model':>10}{'median %':>10}{'worst %':>9}"
        f"{'unstable':>10}{'below linear':>14}{'not monotone':>14}"
    )
    row("hwid, linear", linear, linear_s, linear)
    row("by hand, fixed break-points", hand, hand_s, linear)
    row("hwid", mine, mine_s, linear)
    print(f"by hand / hwid: {hand_s / mine_s:.1f} times the seconds")


if __name__ == "__main__":
    main()
