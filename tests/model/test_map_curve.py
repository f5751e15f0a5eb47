import numpy as np

from hwid_cli.model.map_curve import map_curve
from hwid_cli.records.model import StaticMap

POINTS = np.array([-3.0, -1.0, 0.0, 2.0, 9.0])
VALUES = np.array([0.0, 1.0, 1.5, 4.0, 5.0])
BROKEN = StaticMap("piecewise_linear", np.append(POINTS, VALUES), (-1.5, 3.0))


def test_corners_that_no_sample_reached_are_left_out():
    curve = map_curve(BROKEN)

    np.testing.assert_array_equal(curve.corners, [-1.0, 0.0, 2.0])
    np.testing.assert_allclose(curve.corner_values, [1.0, 1.5, 4.0])


def test_corners_lie_on_the_curve():
    curve = map_curve(BROKEN)
    at = np.searchsorted(curve.argument, curve.corners)

    np.testing.assert_array_equal(curve.argument[at], curve.corners)
    np.testing.assert_allclose(curve.value[at], curve.corner_values)


def test_a_curve_reaches_a_little_beyond_the_range_of_the_fit():
    curve = map_curve(BROKEN)

    assert -2.0 < curve.argument[0] < -1.5
    assert 3.0 < curve.argument[-1] < 3.5


def test_a_smooth_map_has_no_corners():
    smooth = StaticMap("polynomial", np.array([0.0, 1.0, 0.2]), (-1.0, 1.0))

    assert map_curve(smooth).corners.size == 0
