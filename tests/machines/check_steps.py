"""Whether the integrator's steps are short enough for every machine.

``python -m tests.machines.check_steps --seeds development [--only NAME ...] [--jobs N]``
simulates each machine with its own cells and with half as long ones. The difference must
stay below a tenth of the noise.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import click
import numpy as np

from tests.machines.bench import SEEDS
from tests.machines.machine import clean_readings, record
from tests.machines.suite import SUITE, built

# Largest difference, in shares of the noise.
TOLERANCE = 0.1


def difference(seeds: str, name: str) -> float:
    """Rms difference between a machine's steps and half as long ones, over the noise."""
    machine = built(name, seeds)
    recordings = record(machine)
    outputs = [
        clean_readings(machine, machine.hidden, recordings.commands, cells=cells)
        for cells in (machine.cells, 2 * machine.cells)
    ]
    size = float(np.sqrt(np.mean((outputs[0] - outputs[1]) ** 2)))
    click.echo(f"{name}: {size / recordings.noise_rms:.2g} of the noise")
    return size / recordings.noise_rms


def main() -> None:
    """Print every machine's difference, and how many are too large."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", choices=list(SEEDS), required=True)
    parser.add_argument("--only", nargs="+", default=list(SUITE), metavar="NAME")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    with ProcessPoolExecutor(chosen.jobs) as pool:
        found = list(pool.map(partial(difference, chosen.seeds), chosen.only))
    long = sum(size > TOLERANCE for size in found)
    click.echo(
        f"{long} of {len(found)} machines differ by more than {TOLERANCE:g} of the noise"
    )


if __name__ == "__main__":
    main()
