"""Speed and accuracy of the fit against what a user would write by hand.

``make bench`` runs this file; it asserts nothing and times nothing in the test suite. The
baseline is scipy's ``least_squares`` with finite differences over ``lfilter`` and two
piecewise linear maps, once with fixed and once with free break-points. Both see the same
plants in the same run: random ones made here, and the public suite where it lies beside
the measured data.
"""

import os
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from hwid_cli.maths import scores
from hwid_cli.maths.model.fit import fit
from hwid_cli.maths.model.simulate import simulate
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording

UNITS = 10
N_RANDOM = 20
N_SAMPLES = 2000
NOISE = 0.01


def random_plant(seed):
    """Training and test data of a plant of orders up to 6 and delays up to 3."""
    rng = np.random.default_rng([seed, 77])
    nf, nk = int(rng.integers(2, 7)), int(rng.integers(1, 4))
    poles = []
    while len(poles) < nf:
        if nf - len(poles) > 1 and rng.random() < 0.7:
            pole = rng.uniform(0.6, 0.98) * np.exp(1j * rng.uniform(0.03, 1.2))
            poles += [pole, pole.conjugate()]
        else:
            poles.append(rng.uniform(0.4, 0.97))
    denominator = np.real(np.poly(poles))
    nb = int(rng.integers(1, nf + 1))
    numerator = np.atleast_1d(np.real(np.poly(rng.uniform(-0.9, 0.9, nb - 1))))
    numerator *= denominator.sum() / numerator.sum()
    numerator = np.r_[np.zeros(nk), numerator]
    input_maps = (
        lambda u: u - np.clip(u, -0.6, 0.4),
        lambda u: np.clip(u, -1.2, 1.6),
        lambda u: np.tanh(0.8 * u) + 0.15 * u,
        lambda u: u + 0.3 * np.abs(u),
    )
    output_maps = (
        lambda x: 2.0 * np.tanh(0.6 * x),
        lambda x: np.clip(x, -1.0, 0.8) + 0.1 * x,
        lambda x: x + 0.12 * x**2 + 0.08 * x**3,
        lambda x: x,
    )
    f, g = (maps[rng.integers(4)] for maps in (input_maps, output_maps))
    data = []
    for _ in range(2):
        held = np.repeat(rng.uniform(-2.8, 2.8, N_SAMPLES // 15 + 1), 15)[:N_SAMPLES]
        u = held + 0.2 * rng.standard_normal(N_SAMPLES)
        y = g(lfilter(numerator, denominator, f(u)))
        data += [u, y + NOISE * np.std(y) * rng.standard_normal(N_SAMPLES)]
    return Orders(nb, nf, nk), *data


def public_plants():
    """Plants of the public suite, if it is there."""
    folder = Path(os.environ.get("HWID_REALDATA", "../shared/realdata")).parent
    path = folder / "peers" / "hw_suite.npz"
    if not path.exists():
        print(f"{path} not found: public suite left out")
        return []
    suite = np.load(path)
    return [
        (
            Orders(*suite[f"meta_{k}"][:3].astype(int)),
            *(suite[f"{name}_{k}"] for name in ("u_train", "y_train")),
            *(suite[f"{name}_{k}"] for name in ("u_test", "y_test")),
        )
        for k in range(20)
    ]


def extrapolated(argument, points, values):
    """Straight lines between and beyond the break-points."""
    result = np.interp(argument, points, values)
    for end, inner in ((0, 1), (-1, -2)):
        slope = (values[inner] - values[end]) / (points[inner] - points[end])
        outside = argument < points[0] if end == 0 else argument > points[-1]
        result[outside] = values[end] + slope * (argument[outside] - points[end])
    return result


def by_hand(orders, u, y, u_test, *, free):
    """What a user would write: ARX start, then least squares on everything."""
    n, lag = y.size, max(orders.nf, orders.nb + orders.nk - 1)
    rows = [-y[lag - j : n - j] for j in range(1, orders.nf + 1)]
    rows += [u[lag - orders.nk - i : n - orders.nk - i] for i in range(orders.nb)]
    start = np.linalg.lstsq(np.column_stack(rows), y[lag:], rcond=None)[0]
    f, b = start[: orders.nf], start[orders.nf :]
    u_points = np.linspace(u.min(), u.max(), UNITS)
    x = lfilter(np.r_[np.zeros(orders.nk), b], np.r_[1.0, f], u)
    x_points = np.linspace(x.min(), x.max(), UNITS)
    sizes = [UNITS, orders.nb, orders.nf, UNITS] + [UNITS, UNITS] * free
    cuts = np.cumsum(sizes)[:-1]

    def model(parameters, signal):
        values, b, f, y_values, *points = np.split(parameters, cuts)
        p, q = (np.sort(one) for one in points) if free else (u_points, x_points)
        w = extrapolated(signal, p, values)
        with np.errstate(all="ignore"):
            x = lfilter(np.r_[np.zeros(orders.nk), b], np.r_[1.0, f], w)
        x = np.clip(np.nan_to_num(x, nan=1e6), -1e6, 1e6)
        return extrapolated(x, q, y_values)

    first = np.concatenate([u_points, b, f, x_points] + [u_points, x_points] * free)
    found = least_squares(
        lambda parameters: model(parameters, u) - y, first, x_scale="jac", max_nfev=100
    )
    return model(found.x, u_test)


def by_hwid(orders, u, y, u_test):
    """The fit of this project with its defaults."""
    result = fit([Recording("r", u, y, 1.0)], orders, FitOptions())
    return simulate(result.model, u_test)


METHODS = {
    "by hand, fixed break-points": lambda *data: by_hand(*data, free=False),
    "by hand, free break-points": lambda *data: by_hand(*data, free=True),
    "hwid": by_hwid,
}


def compare(title, plants):
    """Print one row for each method."""
    print(f"\n{title}: {len(plants)} plants, noise floor 99.00 % test fit")
    print(f"{'method':30} {'s/plant':>8} {'median %':>9} {'worst %':>8} {'>= 98 %':>8}")
    for name, method in METHODS.items():
        seconds, percent = [], []
        for orders, u, y, u_test, y_test in plants:
            begun = time.perf_counter()
            simulated = method(orders, u, y, u_test)
            seconds.append(time.perf_counter() - begun)
            percent.append(scores.fit_percent(y_test, simulated))
        print(
            f"{name:30} {np.median(seconds):8.3f} {np.median(percent):9.2f} "
            f"{np.min(percent):8.2f} {np.sum(np.array(percent) >= 98.0):8d}"
        )


def main():
    """Compare on random plants and on the public suite."""
    by_hwid(*random_plant(0)[:4])  # compiled loops are built once, outside the clock
    compare("random plants", [random_plant(seed) for seed in range(N_RANDOM)])
    plants = public_plants()
    if plants:
        compare("public suite", plants)


if __name__ == "__main__":
    main()
