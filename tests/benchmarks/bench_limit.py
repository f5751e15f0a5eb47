"""Time of a Levenberg-Marquardt iteration against the least that it can take.

An iteration needs at least one pass of the recursions over all samples (the rows of
derivatives, without writing them) and the product ``J' J`` of all its columns. Both are
measured here, on the same data, as medians; the search is `minimise` with its tries,
simulations and solutions. Below one means that it avoids part of that product: the
columns of an output map of straight lines are zero nearly everywhere.
"""

import time

import numpy as np
from scipy.linalg.blas import dsyrk

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData, columns
from hwid_cli.model.derivative_rows import derivative_rows
from hwid_cli.model.fit import fit
from hwid_cli.model.levenberg_marquardt import minimise
from hwid_cli.model.points import point_of
from hwid_cli.model.sensitivities import simulated
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.tasks.task import one_thread
from tests.benchmarks.plants import random_plant

N_SAMPLES = 7500
ORDERS = tuple(Orders(nb, nf, 1) for nb, nf in ((2, 2), (3, 4), (5, 5), (10, 10)))
OPTIONS = FitOptions()
ITERATIONS, REPEATS = 15, 7


def median_s(function) -> float:
    """Median seconds of several calls after a first one."""
    function()
    seconds = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - begun)
    return float(np.median(seconds))


def start(orders: Orders, u, y) -> Candidate:
    """The linear model with maps of ten points that pass everything on."""
    linear = FitOptions(input_map="none", output_map="none")
    model = fit([Recording("r", u, y, 1.0)], orders, linear).model
    maps = [
        static_map.identity("piecewise_linear", one, signal)
        for one, signal in ((OPTIONS.of_input, u), (OPTIONS.of_output, y))
    ]
    full = HammersteinWiener(
        maps[0],
        model.numerator,
        model.denominator,
        orders.nk,
        maps[1],
        1.0,
        initial_state="estimated",
    )
    return Candidate(full, model.free_response[None, :])


def recursions(candidate: Candidate, one: FitData, *, free: bool):
    """Pass of the recursions that writes a single row."""
    point = point_of(candidate)
    place = columns(candidate, with_positions=free)
    found = simulated(point, [one])
    before = static_map.derivatives(point.input_map, one.input, with_positions=free)
    width = place.denominator.stop - place.input_map.start + before.count
    row = np.empty((1, width))

    def run() -> None:
        derivative_rows(
            found.signals[0],
            (point.numerator, point.denominator, point.delay),
            (before.first, before.shares, before.count),
            (False, place.n_state, 0, place.n_state),
            np.ones(1),
            np.zeros(1, dtype=np.int64),
            row,
        )

    return run


def measure(orders: Orders, u, y, *, free: bool) -> None:
    """Print one row."""
    candidate, one = start(orders, u, y), FitData(u, y)
    done = []

    def search() -> None:
        found = minimise(
            candidate,
            [one],
            with_positions=free,
            max_iterations=ITERATIONS,
            least_gain=0.0,
        )
        done.append(found.iterations)

    search_s = median_s(search) / done[-1]
    recursions_s = median_s(recursions(candidate, one, free=free))
    width = columns(candidate, with_positions=free).total + 1
    dense = np.random.default_rng(0).standard_normal((u.size, width))
    product_s = median_s(lambda: dsyrk(1.0, dense.T))
    floor = recursions_s + product_s
    print(
        f"[{orders.nb:2} {orders.nf:2} {orders.nk}]  "
        f"{'free ' if free else 'fixed'}{width - 1:13}{done[-1]:12}"
        f"{1e3 * search_s:14.2f}{1e3 * recursions_s:14.2f}{1e3 * product_s:12.2f}"
        f"{search_s / floor:8.2f}"
    )


def main() -> None:
    """Several orders, with fixed and free break-points."""
    _, u, y, *_ = random_plant(3, N_SAMPLES)
    u, y = u / np.max(np.abs(u)), y / np.std(y)
    print(f"\none iteration at {N_SAMPLES} samples, one thread")
    print(
        f"{'orders':11}{'points':6}{'parameters':>12}{'iterations':>12}"
        f"{'iteration ms':>14}{'recursions ms':>14}{'product ms':>12}{'ratio':>8}"
    )
    with one_thread():
        for orders in ORDERS:
            for free in (False, True):
                measure(orders, u, y, free=free)


if __name__ == "__main__":
    main()
