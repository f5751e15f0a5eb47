"""Plants that the benchmarks fit: random ones made here, and public ones where they lie.

The public ones are looked for in a folder ``peers`` beside the measured data.
"""

import numpy as np
from scipy.signal import lfilter

from hwid_cli.model.maps.positions import thinned_break_points
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders, StaticMap
from tests.benchmarks.real_data import folder

N_SAMPLES = 2000
NOISE = 0.01
INPUT_MAPS = (
    lambda u: u - np.clip(u, -0.6, 0.4),
    lambda u: np.clip(u, -1.2, 1.6),
    lambda u: np.tanh(0.8 * u) + 0.15 * u,
    lambda u: u + 0.3 * np.abs(u),
)
OUTPUT_MAPS = (
    lambda x: 2.0 * np.tanh(0.6 * x),
    lambda x: np.clip(x, -1.0, 0.8) + 0.1 * x,
    lambda x: x + 0.12 * x**2 + 0.08 * x**3,
    lambda x: x,
)


def linear_block(rng, nf, radii=(0.6, 0.98), angles=(0.03, 1.2), reals=(0.4, 0.97)):
    """B and F of nf random poles and at most as many coefficients, static gain one."""
    poles = []
    while len(poles) < nf:
        if nf - len(poles) > 1 and rng.random() < 0.7:
            pole = rng.uniform(*radii) * np.exp(1j * rng.uniform(*angles))
            poles += [pole, pole.conjugate()]
        else:
            poles.append(rng.uniform(*reals))
    denominator = np.real(np.poly(poles))
    nb = int(rng.integers(1, nf + 1))
    numerator = np.atleast_1d(np.real(np.poly(rng.uniform(-0.9, 0.9, nb - 1))))
    return numerator * (denominator.sum() / numerator.sum()), denominator


def random_plant(seed, samples=N_SAMPLES):
    """Training and test data of a plant of orders up to 6 and delays up to 3."""
    rng = np.random.default_rng([seed, 77])
    (f, g), numerator, denominator, nk = _drawn(rng)
    data = []
    for _ in range(2):
        held = np.repeat(rng.uniform(-2.8, 2.8, samples // 15 + 1), 15)[:samples]
        u = held + 0.2 * rng.standard_normal(samples)
        y = g(lfilter(np.r_[np.zeros(nk), numerator], denominator, f(u)))
        data += [u, y + NOISE * np.std(y) * rng.standard_normal(samples)]
    return Orders(numerator.size, denominator.size - 1, nk), *data


def true_random_plant(seed):
    """The plant of `random_plant`, its maps cut to as many break-points as a fit has."""
    curves, numerator, denominator, nk = _drawn(np.random.default_rng([seed, 77]))
    _, u, *_ = random_plant(seed)
    x = lfilter(np.r_[np.zeros(nk), numerator], denominator, curves[0](u))
    return cut_model(curves, (u, x), numerator, denominator, nk)


def cut_model(curves, reached, numerator, denominator, nk):
    """A plant with as many break-points as a fit has, over what reaches its two maps."""
    maps = []
    for curve, signal in zip(curves, reached, strict=True):
        points = np.linspace(signal.min(), signal.max(), 120)
        values = curve(points)
        units = FitOptions().units + 2
        kept = thinned_break_points(points, values, np.ones(points.size), units)
        parameters = np.concatenate([points[kept], values[kept]])
        maps.append(StaticMap("piecewise_linear", parameters, (points[0], points[-1])))
    first, second = maps
    return HammersteinWiener(
        first, numerator, denominator, nk, second, 1.0, "estimated"
    )


def _drawn(rng):
    """Maps, B, F and delay of a plant of orders up to 6 and delays up to 3."""
    nf, nk = int(rng.integers(2, 7)), int(rng.integers(1, 4))
    numerator, denominator = linear_block(rng, nf)
    curves = [maps[rng.integers(4)] for maps in (INPUT_MAPS, OUTPUT_MAPS)]
    return curves, numerator, denominator, nk


def public_plants():
    """Plants of the public suite, if it is there."""
    path = folder().parent / "peers" / "hw_suite.npz"
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


def grid_plant():
    """Name and data of the plant of the order grid: the public one, else a random one."""
    path = folder().parent / "peers" / "hw_synth.npz"
    if not path.exists():
        return "a random plant", random_plant(0)[1:]
    data = np.load(path)
    names = ("u_train", "y_train", "u_test", "y_test")
    return path.name, tuple(data[name] for name in names)
