"""Known Hammerstein-Wiener plants and inputs for the tests of the model."""

import numpy as np

from hwid_cli.model.simulate import simulate
from hwid_cli.model.static_map import RULES
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Recording

POLES = 0.9 * np.exp(np.array([0.3j, -0.3j]))
ORDERS = Orders(nb=2, nf=2, nk=2)

SOFT_LIMIT = OwnFunction(
    "soft_limit",
    """
import numpy as np
from hwid_cli import MapFunction

def value(v, p):
    return p[0] * np.tanh(v / p[0]) + p[1]

def by_argument(v, p):
    return 1.0 / np.cosh(v / p[0]) ** 2

def by_parameters(v, p):
    bent = np.tanh(v / p[0])
    return np.stack([bent - v / p[0] * (1.0 - bent**2), np.ones_like(v)], axis=1)

soft_limit = MapFunction(
    value, by_argument, by_parameters, start=[3.0, 0.0], names=["limit", "offset"]
)
""",
)

# One for every kind: the laws of all maps, of exports and of fits are tested on them.
MAPS = {
    "none": StaticMap("none", np.zeros(0), (-3.0, 3.0)),
    "saturation": StaticMap("saturation", np.array([-1.4, 1.1]), (-3.0, 3.0)),
    "dead_zone": StaticMap("dead_zone", np.array([-0.4, 0.6]), (-3.0, 3.0)),
    "polynomial": StaticMap("polynomial", np.array([0.1, 1.5, 0.2, 0.15]), (-3.0, 3.0)),
    "piecewise_linear": StaticMap(
        "piecewise_linear",
        np.array([-3.0, -0.8, 0.7, 3.0, -2.0, -1.2, 0.4, 2.6]),
        (-3.0, 3.0),
    ),
    "sigmoid_network": StaticMap(
        "sigmoid_network",
        np.array([-1.2, 0.1, 1.5, 0.3, 0.2, 0.5, 1.5, -0.8, 2.0, -1.0, 1.2]),
        (-3.0, 3.0),
    ),
    "wavelet_network": StaticMap(
        "wavelet_network",
        np.array([-1.0, 0.3, 1.6, 0.9, 0.5, 0.4, 0.8, -0.5, 0.6, -2.0, 2.2]),
        (-3.0, 3.0),
    ),
    "cubic_spline": StaticMap(
        "cubic_spline", np.array([-3.0, 3.0, -2.0, -1.5, 0.3, 0.5, 2.6]), (-3.0, 3.0)
    ),
    "piecewise_constant": StaticMap(
        "piecewise_constant",
        np.array([-1.7, -0.4, 0.9, -2.0, -0.7, 0.8, 2.4]),
        (-3.0, 3.0),
    ),
    "own_function": StaticMap(
        "own_function", np.array([1.3, 0.2]), (-3.0, 3.0), SOFT_LIMIT
    ),
}
# What has no slope is searched by a stand-in, which is no derivative of its values.
WITHOUT_SLOPE = tuple(kind for kind, rule in RULES.items() if not rule.has_slope)
# Kinds that cannot pass a signal on unchanged.
NO_IDENTITY = ("piecewise_constant", "own_function")


def level_input(n_samples: int, seed: int) -> np.ndarray:
    """Random levels held for ten samples, with a little noise on top."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(-3.0, 3.0, n_samples // 10 + 1), 10)[:n_samples]
    return levels + 0.2 * rng.standard_normal(n_samples)


def plant(
    input_map: str = "none", output_map: str = "none", initial_state: str = "zero"
) -> HammersteinWiener:
    """Resonant second-order block with static gain one between two maps."""
    denominator = np.real(np.poly(POLES))
    numerator = np.array([0.75, 0.25]) * denominator.sum()
    free = np.array([0.5, -0.3, 0.2]) if initial_state == "estimated" else np.zeros(0)
    return HammersteinWiener(
        MAPS[input_map],
        numerator,
        denominator,
        ORDERS.nk,
        MAPS[output_map],
        sample_time_s=1e-3,
        initial_state=initial_state,
        free_response=free,
    )


def measured(
    model: HammersteinWiener,
    n_samples: int = 1500,
    seed: int = 1,
    noise: float = 0.0,
) -> Recording:
    """Recording of a plant; noise is a share of the output's standard deviation."""
    u = level_input(n_samples, seed)
    y = simulate(model, u)
    rng = np.random.default_rng(seed + 1000)
    y = y + noise * np.std(y) * rng.standard_normal(n_samples)
    return Recording(f"r{seed}", u, y, model.sample_time_s)


def options(
    input_map: str, output_map: str, initial_state: str = "zero", **others: object
) -> FitOptions:
    """Options whose maps are as large as those of the plants."""
    return FitOptions(
        input_map=input_map,
        output_map=output_map,
        units=2,
        degree=3,
        initial_state=initial_state,
        input_function=MAPS[input_map].function,
        output_function=MAPS[output_map].function,
        **others,
    )
