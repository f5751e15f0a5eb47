"""Linear and nonlinear fits of plants with poles on, or next to, the unit circle.

``python -m tests.benchmarks.bench_integrators [--plants N] [--first SEED]``: single and
double integrators, poles within 1e-3 to 1e-6 of the circle, undamped modes, beside up to three other poles; recordings
of 400 to 4000 samples with 0.1 to 5 % noise, half of them moving at the start. The
yardstick is another program's: scipy's least squares on the output error of the same
orders, begun at the true plant.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.plants import linear_block

KINDS = ("integrator", "double", "near", "near_double", "mode", "integrator_mode")
LINEAR = FitOptions(input_map="none", output_map="none")
WITH_MAP = FitOptions(input_map="piecewise_linear", output_map="none")
# Deviation, as a multiple of what scipy reaches, from which on a fit counts as missed.
MISSED = 1.05
LEAD_IN = 200


@dataclass(frozen=True, eq=False)
class Integrating:
    """A plant with poles on the circle and its recording."""

    kind: str
    recording: Recording
    orders: Orders
    numerator: np.ndarray
    denominator: np.ndarray
    noise: float


def poles_on_circle(kind, rng):
    """Poles on the circle, or within 1e-3 to 1e-6 of it."""
    near = 1.0 - 10.0 ** -rng.uniform(3.0, 6.0)
    mode = np.exp(1j * rng.uniform(0.05, 1.5))
    return {
        "integrator": [1.0],
        "double": [1.0, 1.0],
        "near": [near],
        "near_double": [near, near],
        "mode": [mode, mode.conjugate()],
        "integrator_mode": [1.0, mode, mode.conjugate()],
    }[kind]


def integrating_plant(seed, bent=False):
    """Plant number `seed` and a noisy recording of it."""
    rng = np.random.default_rng([seed, 90210])
    kind = KINDS[seed % len(KINDS)]
    others = int(rng.integers(0, 4))
    denominator = np.real(np.poly(poles_on_circle(kind, rng)))
    if others:
        _, rest = linear_block(rng, others)
        denominator = np.convolve(denominator, rest)
    nf, nk = denominator.size - 1, int(rng.integers(1, 3))
    nb = int(rng.integers(1, min(nf, 3) + 1))
    numerator = np.atleast_1d(np.real(np.poly(rng.uniform(-0.8, 0.8, nb - 1))))
    n = int(np.exp(rng.uniform(np.log(400), np.log(4000))))
    noise = float(np.exp(rng.uniform(np.log(0.001), np.log(0.05))))
    first = LEAD_IN if rng.random() < 0.5 else 0
    held = np.repeat(rng.uniform(-1.0, 1.0, (n + LEAD_IN) // 10 + 1), 10)
    u = held[: n + LEAD_IN] + 0.1 * rng.standard_normal(n + LEAD_IN)
    w = u - np.clip(u, -0.3, 0.2) if bent else u
    x = lfilter(np.r_[np.zeros(nk), numerator], denominator, w)[first:][:n]
    u = u[first:][:n]
    numerator = numerator / np.std(x)
    size = noise * np.std(x)
    y = (x + size * rng.standard_normal(n)) / np.std(x)
    recording = Recording(f"plant_{seed}", u, y, 1.0)
    return Integrating(
        kind, recording, Orders(nb, nf, nk), numerator, denominator, noise
    )


def by_scipy(plant):
    """RMSD of the output error that scipy reaches from the truth, states included."""
    one, orders = plant.recording, plant.orders
    u, y = one.input, one.output
    pulse = np.eye(1, y.size)[0]
    past = np.zeros(orders.nk)

    def residual(parameters):
        b, f, c = np.split(parameters, np.cumsum([orders.nb, orders.nf]))
        f = np.r_[1.0, f]
        with np.errstate(all="ignore"):
            x = lfilter(np.r_[past, b], f, u) + lfilter(c, f, pulse)
        return np.clip(np.nan_to_num(x - y, nan=1e6), -1e6, 1e6)

    # The initial state that belongs to the true plant: linear least squares.
    columns = np.column_stack(
        [
            lfilter(np.eye(1, i + 1, i)[0], plant.denominator, pulse)
            for i in range(orders.n_state)
        ]
    )
    x = lfilter(np.r_[past, plant.numerator], plant.denominator, u)
    c = np.linalg.lstsq(columns, y - x, rcond=None)[0]
    begin = np.concatenate([plant.numerator, plant.denominator[1:], c])
    found = least_squares(residual, begin, x_scale="jac", method="trf", max_nfev=60)
    return float(np.sqrt(np.mean(found.fun**2)))


def main():
    """Fit every plant and count what stays above the yardstick."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=120)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--show", action="store_true")
    asked = parser.parse_args()
    for title, bent in (("linear", False), ("dead zone at the input", True)):
        ratios = {kind: [] for kind in KINDS}
        begun = time.perf_counter()
        for seed in range(asked.first, asked.first + asked.plants):
            plant = integrating_plant(seed, bent)
            options = WITH_MAP if bent else LINEAR
            found = fit([plant.recording], plant.orders, options)
            best = plant.noise if bent else by_scipy(plant)
            ratio = found.rmsd / best
            ratios[plant.kind].append(ratio)
            if asked.show and not ratio <= MISSED:
                print(
                    f"  {seed} {plant.kind} {plant.orders} noise {plant.noise:.4f} "
                    f"{ratio:.3f} times, {found.status}, {np.abs(found.poles)[:3]}"
                )
        seconds = (time.perf_counter() - begun) / asked.plants
        print(f"{title}: {asked.plants} plants, {seconds:.2f} s each")
        for kind, found in ratios.items():
            each = np.array(found)
            print(
                f"  {kind:16} missed {np.mean(~(each <= MISSED)):4.0%}, "
                f"worst {np.nanmax(each):8.2f} times"
            )


if __name__ == "__main__":
    main()
