import itertools

import numpy as np
import pytest
from scipy import signal

from hwid_cli.model import static_map
from hwid_cli.model.fit import fit
from hwid_cli.model.maps.piecewise_linear import break_points_and_values
from hwid_cli.records.model import FitOptions, Orders, StaticMap
from hwid_cli.records.recordings import Recording
from tests.model.plants import MAPS

LEVELS = np.array([-2.0, -0.5, 0.4, 1.8])
CURVES = {
    "tanh": np.tanh,
    "dead_zone": lambda v: v - np.clip(v, -0.6, 0.3),
    "bent": lambda v: v + 0.3 * np.abs(v),
}
F = np.real(np.poly([0.9 * np.exp(0.2j), 0.9 * np.exp(-0.2j)]))


def steps(curve, levels, noise, seed):
    """Random steps between four levels."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice(levels, 40), 30)
    y = signal.lfilter([0.0, F.sum()], F, CURVES[curve](u))
    y = np.clip(y, -1.0, 0.8) + 0.1 * y
    return Recording("r", u, y + noise * np.std(y) * rng.standard_normal(u.size), 1e-3)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("levels", [LEVELS, np.arange(4.0)], ids=["apart", "even"])
@pytest.mark.parametrize("curve", CURVES)
def test_steps_between_four_levels_leave_no_swings_between_them(curve, levels, noise):
    recording = steps(curve, levels, noise, seed=len(curve))
    options = FitOptions(initial_state="zero")
    model = fit([recording], Orders(1, 2, 1), options).model
    points, _ = break_points_and_values(model.input_map)
    low, high = model.input_map.domain
    assert np.all(np.diff(points) > 0.0)
    assert points[0] > low - 0.02 * (high - low)
    assert points[-1] < high + 0.02 * (high - low)
    visited = static_map.evaluate(model.input_map, levels)
    for left, right in itertools.pairwise(levels):
        between = static_map.evaluate(model.input_map, np.linspace(left, right, 301))
        ends = np.array([between[0], between[-1]])
        beyond = max(between.max() - ends.max(), ends.min() - between.min())
        assert beyond < 0.03 * np.ptp(visited)


def test_a_map_stays_where_samples_are():
    rng = np.random.default_rng(1)
    one = StaticMap(
        "piecewise_linear", np.r_[np.linspace(-3, 3, 12), rng.normal(size=12)]
    )
    argument = np.r_[rng.choice(LEVELS, 50), rng.uniform(1.0, 2.9, 50)]
    found = static_map.straightened(one, argument)
    np.testing.assert_allclose(
        static_map.evaluate(found, argument),
        static_map.evaluate(one, argument),
        atol=1e-5,
    )
    assert not np.array_equal(found.parameters, one.parameters)
    np.testing.assert_array_equal(found.parameters[:12], one.parameters[:12])


def test_of_all_maps_through_the_levels_the_least_bent_one_is_taken():
    rng = np.random.default_rng(2)
    points = np.linspace(-3.0, 3.0, 8)
    one = StaticMap("piecewise_linear", np.r_[points, rng.normal(size=8)])
    found = static_map.straightened(one, LEVELS)

    def bending(values):
        return float(np.sum(np.diff(np.diff(values) / np.diff(points)) ** 2))

    least = bending(found.parameters[8:])
    rows = np.array([np.interp(LEVELS, points, unit) for unit in np.eye(8)]).T
    _, _, directions = np.linalg.svd(rows)
    for unseen in directions[4:]:
        for size in (-1e-3, 1e-3):
            assert bending(found.parameters[8:] + size * unseen) > least


@pytest.mark.parametrize("kind", [kind for kind in MAPS if kind != "piecewise_linear"])
def test_other_kinds_stay_as_they_are(kind):
    assert static_map.straightened(MAPS[kind], LEVELS) is MAPS[kind]


def test_a_map_with_samples_everywhere_is_the_same_object():
    one = MAPS["piecewise_linear"]
    assert static_map.straightened(one, np.linspace(-3.0, 3.0, 50)) is one
