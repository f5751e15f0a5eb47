import numpy as np
import pytest
from scipy import signal

from hwid_cli.maths.model import kernels
from hwid_cli.maths.model.maps import kernels as map_kernels

POINTS = np.array([-3.0, -1.0, 0.5, 2.0, 3.0])
VALUES = np.array([-1.0, -0.5, 0.4, 2.0, 2.1])


def test_filtered_columns_agree_with_scipy_in_the_columns_asked_for():
    rng = np.random.default_rng(0)
    columns, gain = rng.standard_normal((200, 3)), rng.standard_normal(200)
    b, f = np.array([0.3, 0.1]), np.array([1.0, -1.4, 0.6])
    out = np.full((200, 5), 7.0)
    zeros = np.zeros(3)
    kernels.filter_columns(columns, (b, f, 1), (zeros, zeros), gain, out, 1)
    expected = signal.lfilter(np.r_[0.0, b], f, columns, axis=0) * gain[:, None]
    np.testing.assert_allclose(out[:, 1:4], expected, atol=1e-12)
    np.testing.assert_array_equal(out[:, [0, 4]], 7.0)


def test_decaying_response_ends_in_zeros_instead_of_subnormal_numbers():
    pulse = np.zeros(4000)
    pulse[1] = 1.0
    out = np.zeros(4000)
    kernels.filter_signal(pulse, 1, np.ones(1), np.array([1.0, -0.5]), 0, out)
    small = np.abs(out[out != 0.0])
    assert small.min() > np.finfo(float).tiny
    assert out[-1] == 0.0


@pytest.mark.parametrize("with_positions", [True, False])
def test_bends_are_changes_of_slope_with_the_stated_derivatives(with_positions):
    bend, jacobian = map_kernels.bends(POINTS, VALUES, with_positions)
    size = np.ptp(VALUES) / np.ptp(POINTS)
    slopes = np.diff(VALUES) / np.diff(POINTS)
    np.testing.assert_allclose(bend, np.diff(slopes) / size, rtol=1e-13)
    step = 1e-6
    parameters = np.r_[POINTS, VALUES]
    # The mean slope counts as fixed: move only what leaves it.
    inner = [k for k in range(10) if k not in (0, 4, 5, 9)]
    for k in inner:
        moved = parameters.copy()
        moved[k] += step
        above, _ = map_kernels.bends(moved[:5], moved[5:], with_positions)
        column = k if with_positions else k - 5
        if column >= 0:
            np.testing.assert_allclose(
                (above - bend) / step, jacobian[:, column], atol=1e-4
            )


def test_thinning_keeps_the_break_points_where_a_map_bends():
    points = np.linspace(0.0, 10.0, 31)
    values = np.interp(points, [0.0, 2.0, 7.0, 10.0], [0.0, 0.0, 5.0, 2.0])
    kept = map_kernels.thinned_break_points(points, values, np.ones(31), 4)
    np.testing.assert_allclose(points[kept], [0.0, 2.0, 7.0, 10.0])


def test_thinning_heeds_where_the_samples_are():
    points = np.linspace(0.0, 10.0, 21)
    values = np.abs(points - 2.0) + np.abs(points - 8.0)
    weights = np.where(points < 5.0, 1.0, 1e-6)
    kept = map_kernels.thinned_break_points(points, values, weights, 3)
    assert points[kept][1] == 2.0
