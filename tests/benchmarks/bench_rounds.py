"""In how many rounds of a grid's growth a search anew is worth its time.

``make bench-rounds``: grids of 10 x 10 orders on steps of the virtual gun, one process.
A fit goes on from the models of smaller orders; in the first rounds it is also searched
for anew. Compared are the times and the RMSDs with those of a search in every round.
"""

import time

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.stages import identify
from hwid_cli.stages.order_grid import SEARCHED_ROUNDS
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers
from tests.benchmarks.bench_warm_start import measured_steps

STEPS = ("step_01", "step_02", "step_06", "step_12", "step_14")
GRID = OrdersOptions(nb=tuple(range(1, 11)), nk=tuple(range(1, 11)))
ROUNDS = (1, 2, SEARCHED_ROUNDS, 6, 19)


def grid_of(recordings, rounds):
    """RMSDs of all fits with searches in so many rounds, and the seconds for each."""
    identify.SEARCHED_ROUNDS = rounds
    settings = RunSettings(store=MemoryStore(), workers=Workers(jobs=1))
    begun = time.process_time()
    fits = identify.identify_all(recordings, GRID, FitOptions(), settings)
    seconds = (time.process_time() - begun) / len(fits)
    return np.array([one.rmsd for one in fits]), seconds


def main():
    """Print one line for each number of rounds."""
    recordings = [measured_steps()[name] for name in STEPS]
    fit(recordings[:1], Orders(2, 2, 1))
    found = {rounds: grid_of(recordings, rounds) for rounds in ROUNDS}
    whole, longest = found[ROUNDS[-1]]
    print(f"{len(whole)} fits, {recordings[0].n_samples} samples, one process")
    print("RMSD against a search in every round")
    print(
        f"{'rounds':>7}{'ms a fit':>10}{'time':>7}{'5 %':>9}{'median':>9}{'95 %':>9}"
        f"{'worst':>9}"
    )
    for rounds, (rmsd, seconds) in found.items():
        ratio = rmsd / whole
        low, median, high = np.quantile(ratio, [0.05, 0.5, 0.95])
        print(
            f"{rounds:7d}{1e3 * seconds:10.1f}{seconds / longest:7.2f}"
            f"{low:9.3f}{median:9.3f}{high:9.3f}{ratio.max():9.3f}"
        )


if __name__ == "__main__":
    main()
