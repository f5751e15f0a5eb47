import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from hwid_cli.model import static_map
from hwid_cli.model.map_curve import map_curve
from hwid_cli.records.maps import MapOptions
from tests.model.plants import MAPS

ONE = MAPS["cubic_spline"]
KNOTS = np.linspace(-3.0, 3.0, 5)


def test_between_its_ends_it_is_the_natural_spline_of_scipy():
    v = np.linspace(-3.0, 3.0, 101)
    expected = CubicSpline(KNOTS, ONE.parameters[2:], bc_type="natural")(v)
    np.testing.assert_allclose(static_map.evaluate(ONE, v), expected, atol=1e-13)


def test_beyond_its_ends_it_goes_on_straight_with_the_slope_there():
    spline = CubicSpline(KNOTS, ONE.parameters[2:], bc_type="natural")
    value = static_map.evaluate(ONE, np.array([-5.0, 7.0]))
    expected = [-2.0 - 2.0 * spline(-3.0, 1), 2.6 + 4.0 * spline(3.0, 1)]
    np.testing.assert_allclose(value, expected, rtol=1e-12)


@pytest.mark.parametrize("units", [2, 3])
def test_few_knots_are_enough(units):
    options = MapOptions("cubic_spline", units=units)
    one = static_map.identity("cubic_spline", options, np.array([-1.0, 1.0]))
    v = np.linspace(-2.0, 2.0, 9)
    np.testing.assert_allclose(static_map.evaluate(one, v), v, atol=1e-14)


@pytest.mark.parametrize("change", [-9.0, 9.0])
def test_first_knot_stays_before_the_last_one(change):
    step = np.zeros(ONE.parameters.size)
    step[:2] = change, -change
    first, last = static_map.move(ONE, step).parameters[:2]
    assert first < last


def test_knots_are_what_a_figure_marks():
    np.testing.assert_allclose(map_curve(ONE).corners, KNOTS)
