from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.model.turning_points import turning_points
from hwid_cli.records.model import FitOptions, StaticMap
from tests.model.plants import MAPS, ORDERS, measured, plant


def piecewise(points, values):
    points = np.array(points, dtype=float)
    return StaticMap("piecewise_linear", np.r_[points, values], (points[0], points[-1]))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([3, 0, 3, 6], [-1.0]),
        ([-3, 0, -3, -6], [-1.0]),
        ([0, 2, 1, 3], [-1.0, 1.0]),
        ([0, 1, 2, 3], []),
        ([3, 1, 0, -4], []),
        ([0, 0, 0, 0], []),
        # Turning back by 1 % of the range is the shape of a flat part.
        ([0, 1, 0.97, 3], []),
        # So is a short rise at the beginning.
        ([0, 0.03, 0, -3], []),
    ],
)
def test_folds_are_the_extremes_between_which_a_map_turns_back(values, expected):
    found = turning_points(piecewise([-3, -1, 1, 3], values))
    np.testing.assert_allclose(found, expected)


def test_folds_of_a_polynomial_are_the_roots_of_its_derivative():
    # T3 turns back at +-1/2; the curve has 221 points over 2.2.
    cubic = StaticMap("polynomial", np.array([0.0, 0, 0, 1]), (-1.0, 1.0))
    np.testing.assert_allclose(turning_points(cubic), [-0.5, 0.5], atol=0.01)
    assert turning_points(cubic, least=2.1).size == 0


@pytest.mark.parametrize("kind", ["none", "saturation", "dead_zone"])
def test_limits_and_nothing_at_all_never_fold(kind):
    assert turning_points(MAPS[kind]).size == 0


def test_a_rectifying_sensor_is_said_to_fold():
    true = plant("none", "none")
    recording = measured(true, noise=0.01)
    x = simulate(true, recording.input)
    rng = np.random.default_rng(3)
    y = np.abs(x + 0.3) + 0.01 * rng.standard_normal(x.size)
    result = fit([replace(recording, output=y)], ORDERS, FitOptions(input_map="none"))
    assert result.fit_percent > 95.0
    # The block's static gain is one, so that x is in the unit of the input.
    assert len(result.output_folds) == 1
    assert result.output_folds[0] == pytest.approx(-0.3, abs=0.1)


def test_noise_is_no_fold():
    true = plant("dead_zone", "saturation")
    for seed in range(4):
        result = fit([measured(true, seed=seed, noise=0.2)], ORDERS, FitOptions())
        assert result.output_folds == ()
