"""Which parts of the search matter: each is left out in turn, and two starts are added.

``make bench-starts``: the public suite where it lies beside the measured data, random
plants, and plants of many kinds (`bench_wide`) against fits that begin at the true
plant. Everything is changed from outside; the project has no switches for it.
"""

import argparse
import time
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np

from hwid_cli.model import initial_candidates, phases, scores, screening, search, starts
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from tests.benchmarks.bench_wide import true_model, wide_plant
from tests.benchmarks.other_starts import by_instruments, by_reduction
from tests.benchmarks.plants import public_plants, random_plant

N_RANDOM, MOST_SAMPLES = 20, 10_000


@contextmanager
def nothing():
    """Change nothing."""
    yield


def added(route):
    """Steiglitz-McBride iterations from one more denominator."""
    own = starts._iterations

    def iterations(problem, denominator, count):
        found = own(problem, denominator, count)
        is_first = denominator.size == problem.orders.nf + 1
        if is_first and not denominator[1:].any() and not problem.is_expanded:
            more = route(problem)
            found += own(problem, more, count) if more is not None else []
        return found

    return patch.object(starts, "_iterations", iterations)


def all_poles(orders):
    """Prefilters without the one of fewer poles."""
    return [np.eye(1, orders.nf + 1)[0]]


VARIANTS = {
    "everything": nothing,
    "- input expanded into hats": lambda: patch.object(
        initial_candidates, "has_free_shape", lambda _: False
    ),
    "- iterations: ARX only": lambda: patch.object(starts, "_ITERATIONS", 1),
    "- starts of fewer poles": lambda: patch.object(starts, "_prefilters", all_poles),
    "- output curve of a start": lambda: patch.object(
        screening, "_with_output_curve", lambda candidate, *_: candidate
    ),
    "- placing break-points": lambda: patch.object(
        phases, "_is_placed", lambda _: False
    ),
    "- re-estimated linear blocks": lambda: patch.object(
        search, "reestimate_block", lambda best, *_: best
    ),
    "- restarts": lambda: patch.object(search, "leaves_structure", lambda *_: False),
    "- restarts without input maps": lambda: patch.object(
        search, "starts_without_input_maps", lambda *_: []
    ),
    # Further restarts have nothing but the found block to begin with.
    "- maps anew": lambda: patch.multiple(
        search, starts_with_new_maps=lambda *_: [], _MOST_RESTARTS=1
    ),
    "- cutting found maps": lambda: patch.object(
        search, "refine", lambda found, *_: found
    ),
    "+ instrumental variables": lambda: added(by_instruments),
    "+ reduced FIR": lambda: added(by_reduction),
}


def suites(plants):
    """Test fits in per cent, and seconds."""
    begun = time.process_time()
    found = []
    for orders, u, y, u_test, y_test in plants:
        model = fit([Recording("r", u, y, 1.0)], orders, FitOptions()).model
        found.append(scores.fit_percent(y_test, simulate(model, u_test)))
    return np.array(found), time.process_time() - begun


def wide(plants, possible):
    """Points of the training fit that are missing, and seconds."""
    begun = time.process_time()
    found = [fit([one.recording], one.orders).fit_percent for one in plants]
    return possible - np.array(found), time.process_time() - begun


def main():
    """Print one line for each variant."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wide", type=int, default=80, help="plants of many kinds")
    n_wide = parser.parse_args().wide
    known = [*public_plants(), *(random_plant(seed) for seed in range(N_RANDOM))]
    every = [wide_plant(seed) for seed in range(n_wide)]
    many = [one for one in every if one.recording.n_samples <= MOST_SAMPLES]
    possible = np.array(
        [
            fit([one.recording], one.orders, starts=[true_model(one)]).fit_percent
            for one in many
        ]
    )
    fit([many[0].recording], many[0].orders)
    print(f"{len(known)} plants, noise floor 99 %, and {len(many)} of many kinds")
    print(
        f"{'':28}{'median %':>9}{'worst %':>9}{'< 98.5':>8}{'> 0.05 short':>14}"
        f"{'> 0.3 short':>13}{'time':>7}"
    )
    usual = None
    for name, variant in VARIANTS.items():
        with variant():
            percent, seconds = suites(known)
            missing, more = wide(many, possible)
        usual = usual or seconds + more
        print(
            f"{name:28}{np.median(percent):9.2f}{percent.min():9.2f}"
            f"{np.sum(percent < 98.5):8d}{np.sum(~(missing <= 0.05)):14d}"
            f"{np.sum(~(missing <= 0.3)):13d}{(seconds + more) / usual:7.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
