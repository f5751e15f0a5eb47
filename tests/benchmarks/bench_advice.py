"""Are the orders and maps that ``hwid order`` recommends the best ones for new recordings?

``make bench-advice`` (``python -m tests.benchmarks.bench_advice [--plants N] [--first SEED] [--choose]``):
random plants of orders 1 to 4, each with three recordings: a step, levels and a multisine.
``hwid order`` sees these alone. Four fresh ones, of the same kinds with other draws and a
sine, then score every candidate as (33) and (34) do, all pairs counting alike; the factor
is that of the recommended candidate to the best of all offered. The rule was chosen on the
plants that ``--choose`` shows; the others were drawn afterwards.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hwid_cli.records.experiment import CrossvalOptions, OrderOptions, OrdersOptions
from hwid_cli.records.model import Fit, FitOptions
from hwid_cli.records.order import MapCandidate
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.candidate_selection import scored, smallest_good
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.stages.identify import identify_all
from hwid_cli.stages.map_choice import candidate_maps, fit_maps, recommend_maps
from hwid_cli.stages.order import recommend_orders
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings
from hwid_cli.tasks.workers import Workers
from tests.benchmarks.bench_wide import INPUT_MAPS, OUTPUT_MAPS
from tests.benchmarks.plants import linear_block

OWN = ("step", "levels", "multisine")
FRESH = ("step", "levels", "sine", "multisine")
LARGEST, N_SAMPLES, LEAD_IN = 2.0, 600, 60
# Noise of the output over its deviation, and of the measured input over its largest.
OUTPUT_NOISE, INPUT_NOISE = 0.01, 0.005
# Seeds on which the rule was chosen, and the first of those that report.
CHOOSING = (*range(100, 116), *range(7000, 7020), *range(8000, 8020))
REPORTING = 9000
GRID = OrdersOptions(nb=(1, 2, 3, 4), nk=(1, 2, 3, 4))
OPTIONS = OrderOptions(maps=("none", "polynomial"), units=(5,))
MAPS = candidate_maps(FitOptions(), OPTIONS)


@dataclass(frozen=True)
class Advised:
    """Factors of recommended and default candidates to the best on fresh recordings."""

    orders: float
    maps: float
    default_maps: float


def excitation(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Input of a recording that begins at rest."""
    n = N_SAMPLES - LEAD_IN
    if kind == "step":
        moved = np.full(n, rng.uniform(0.4, 1.0) * rng.choice([-1.0, 1.0]))
    elif kind == "levels":
        moved = np.repeat(rng.uniform(-1.0, 1.0, n // 30), 30)
    elif kind == "sine":
        period = np.exp(rng.uniform(np.log(60.0), np.log(400.0)))
        height = rng.uniform(0.5, 1.0)
        moved = height * np.sin(2.0 * np.pi * np.arange(n) / period)
    else:
        turns = 8.0 * np.pi * np.arange(n) / n
        lines = (1, 2, 3, 5, 8, 13)
        moved = sum(np.sin(k * turns + rng.uniform(0.0, 2.0 * np.pi)) for k in lines)
        moved = moved / np.max(np.abs(moved))
    return LARGEST * np.concatenate([np.zeros(LEAD_IN), moved])


def recordings(seed: int) -> tuple[list[Recording], list[Recording]]:
    """What ``hwid order`` sees of plant number `seed`, and what scores its advice."""
    rng = np.random.default_rng([seed, 4711])
    nf = int(rng.integers(1, 5))
    numerator, denominator = linear_block(
        rng, nf, radii=(0.5, 0.97), angles=(0.02, 1.2), reals=(0.3, 0.97)
    )
    f = list(INPUT_MAPS.values())[rng.integers(len(INPUT_MAPS))]
    g = list(OUTPUT_MAPS.values())[rng.integers(len(OUTPUT_MAPS))]
    ripple = INPUT_NOISE * LARGEST * float(rng.random() < 0.5)
    rest = np.zeros(1)

    def response(u: np.ndarray) -> np.ndarray:
        w = f(u) - f(rest)
        return g(lfilter(np.r_[0.0, numerator], denominator, w)) - g(rest)

    def recorded(name: str, kind: str) -> Recording:
        u = excitation(kind, rng)
        y = response(u) + noise * rng.standard_normal(u.size)
        return Recording(
            f"{name} {kind}", u + ripple * rng.standard_normal(u.size), y, 1e-3
        )

    noise = OUTPUT_NOISE * np.std(response(excitation("multisine", rng)))
    own = [recorded("own", kind) for kind in OWN]
    return own, [recorded("fresh", kind) for kind in FRESH]


def fresh_factors(
    fits: Sequence[Sequence[Fit]],
    own: Sequence[Recording],
    fresh: Sequence[Recording],
    settings: RunSettings,
) -> np.ndarray:
    """Factor of each candidate to the best, on recordings that no rule has seen."""
    flat = [one for each in fits for one in each]
    grid = OrdersOptions(nb=(1,), nk=tuple(range(1, len(fits[0]) + 1)))
    rmsd = cross_validate(flat, fresh, grid, CrossvalOptions(), settings).rmsd[:, 0]
    names = [each[0].name for each in fits]
    found = scored(rmsd, names, [one.name for one in fresh], [*own, *fresh])
    if found is None:
        raise ValueError("no model at all")
    return smallest_good(found, np.ones(rmsd.shape[1]), 0.0).factors


def advised(seed: int) -> Advised:
    """What the advice for one plant is worth."""
    own, fresh = recordings(seed)
    settings = RunSettings(MemoryStore(), Workers(1))
    fits = identify_all(own, GRID, FitOptions(), settings)
    crossval = cross_validate(fits, own, GRID, CrossvalOptions(), settings)
    advice = recommend_orders(fits, crossval, own, GRID, OPTIONS)
    if advice is None:
        raise ValueError("no advice")
    grid = candidate_orders(GRID)
    place = [one[:2] for one in grid].index((advice.overall.nb, advice.overall.nk))
    by_recording = [fits[at : at + len(grid)] for at in range(0, len(fits), len(grid))]
    of_orders = fresh_factors(by_recording, own, fresh, settings)

    candidates = fit_maps(own, grid[place][2], MAPS, settings)
    maps = recommend_maps(candidates, own, own, OPTIONS.tolerance, settings)
    if maps is None:
        raise ValueError("no advice")
    of_maps = fresh_factors(candidates, own, fresh, settings)
    return Advised(of_orders[place], of_maps[place_of(maps.chosen)], of_maps[0])


def place_of(one: MapCandidate) -> int:
    """Number of a pair of maps among the candidates."""
    wanted = (one.input_map, one.input_units, one.output_map, one.output_units)
    listed = [
        (side.kind, side.units * (side.kind not in ("none", "polynomial")))
        for options in MAPS
        for side in (options.of_input, options.of_output)
    ]
    pairs = list(zip(listed[0::2], listed[1::2], strict=True))
    return pairs.index((wanted[:2], wanted[2:]))


def main() -> None:
    """Print how far recommended candidates are from the best ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=20)
    parser.add_argument("--first", type=int, default=REPORTING)
    parser.add_argument("--choose", action="store_true")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.plants)
    found = [advised(seed) for seed in (CHOOSING if given.choose else seeds)]
    print(
        f"\n{len(found)} plants, {len(candidate_orders(GRID))} orders, {len(MAPS)} pairs of "
        "maps: RMSD on fresh recordings over that of the best candidate"
    )
    print(
        f"{'':16}{'<= 1.05':>9}{'<= 1.2':>9}{'geo. mean':>11}{'largest':>10}  the others"
    )
    for name in ("orders", "maps", "default_maps"):
        values = np.sort([getattr(one, name) for one in found])[::-1]
        small, middle = (int(np.sum(values <= most)) for most in (1.05, 1.2))
        mean = float(np.exp(np.mean(np.log(values))))
        others = " ".join(f"{value:.2f}" for value in values[1:6])
        print(
            f"{name.replace('_', ' '):16}{small:9d}{middle:9d}{mean:11.3f}"
            f"{values[0]:10.2f}  {others} ..."
        )


if __name__ == "__main__":
    main()
