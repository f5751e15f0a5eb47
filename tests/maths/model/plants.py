"""Known Hammerstein-Wiener plants and inputs for the tests of the model."""

import numpy as np

from hwid_cli.maths.model.simulate import simulate
from hwid_cli.records.model import (
    FitOptions,
    HammersteinWiener,
    Orders,
    StaticMap,
)
from hwid_cli.records.recordings import Recording

POLES = 0.9 * np.exp(np.array([0.3j, -0.3j]))
ORDERS = Orders(nb=2, nf=2, nk=2)

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
}


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
        **others,
    )
