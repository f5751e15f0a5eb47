import subprocess
import sys

import numpy as np
import pytest
from scipy import signal

from hwid_cli.model import derivative_rows as row_kernels
from hwid_cli.model import linear_block
from hwid_cli.model.maps import bends, positions

POINTS = np.array([-3.0, -1.0, 0.5, 2.0, 3.0])
VALUES = np.array([-1.0, -0.5, 0.4, 2.0, 2.1])


@pytest.mark.parametrize("order", [0, 1, 4, 5, 9])
def test_all_pole_recursion_agrees_with_scipy(order):
    rng = np.random.default_rng(order)
    f = np.real(np.poly(rng.uniform(-0.9, 0.9, order))) if order else np.ones(1)
    taps = np.zeros(4 * max(1, (order + 3) // 4))
    taps[:order] = f[1:]
    columns = rng.standard_normal((101, 3))
    lines = np.concatenate([np.zeros((taps.size, 3)), columns])
    # In two parts, of even and odd length: the second goes on from the first.
    row_kernels.all_pole(lines, taps.size, 40, taps)
    row_kernels.all_pole(lines, taps.size + 40, 61, taps)
    expected = signal.lfilter([1.0], f, columns, axis=0)
    np.testing.assert_allclose(lines[taps.size :], expected, atol=1e-11)


def test_block_output_agrees_with_scipy_and_starts_as_told():
    rng = np.random.default_rng(0)
    w, b, f = rng.standard_normal(80), np.array([0.3, 0.1]), np.array([1.0, -1.4, 0.6])
    forced = signal.lfilter(np.r_[0.0, 0.0, b], f, w)
    free = signal.lfilter([1.0, -0.5, 0.2], f, np.r_[1.0, np.zeros(79)])
    states = np.array([1.0, -0.5, 0.2])
    got = linear_block.block_output(w, b, f, 2, states, False)
    np.testing.assert_allclose(got, forced + free, atol=1e-12)
    # In equilibrium with the first value: as if that value had been there for ever.
    long = signal.lfilter(np.r_[0.0, 0.0, b], f, np.r_[np.full(400, w[0]), w])
    got = linear_block.block_output(w, b, f, 2, np.zeros(0), True)
    np.testing.assert_allclose(got, long[400:], atol=1e-12)


def test_decaying_response_ends_in_zeros_instead_of_subnormal_numbers():
    pulse = np.zeros(4000)
    pulse[0] = 1.0
    pole = np.array([1.0, -0.5])
    out = linear_block.block_output(pulse, np.ones(1), pole, 0, np.zeros(0), False)
    small = np.abs(out[out != 0.0])
    assert small.min() > np.finfo(float).tiny
    assert out[-1] == 0.0


@pytest.mark.parametrize("with_positions", [True, False])
def test_bends_are_changes_of_slope_with_the_stated_derivatives(with_positions):
    bend, jacobian = bends.bends(POINTS, VALUES, with_positions)
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
        above, _ = bends.bends(moved[:5], moved[5:], with_positions)
        column = k if with_positions else k - 5
        if column >= 0:
            np.testing.assert_allclose(
                (above - bend) / step, jacobian[:, column], atol=1e-4
            )


@pytest.mark.parametrize("with_positions", [True, False])
def test_the_prior_and_its_gradient_are_of_one_function(with_positions):
    # A gradient of another function than the one that judges a step ends in a stall.
    parameters = np.r_[POINTS, VALUES]
    first = 0 if with_positions else 5
    matrix, vector = np.zeros((12, 12)), np.zeros(12)
    total = bends.add_bends(POINTS, VALUES, with_positions, 0.7, matrix, vector, 1)

    def judged(moved):
        return bends.squared_bends_after(*np.split(moved, 2), POINTS, VALUES)

    bend, _ = bends.bends(POINTS, VALUES, with_positions)
    assert total == pytest.approx(bend @ bend)
    assert total == pytest.approx(judged(parameters))

    for k in range(first, 10):
        step = 1e-6 * np.eye(10)[k]
        above, below = (judged(parameters + sign * step) for sign in (1.0, -1.0))
        slope = 0.7 * (above - below) / 2e-6
        assert vector[1 + k - first] == pytest.approx(-0.5 * slope, abs=1e-8)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-14)


def test_a_factor_on_a_map_or_on_its_argument_gains_nothing_from_the_prior():
    # Else every step makes a map smaller and the block larger, and nothing better.
    matrix, vector = np.zeros((10, 10)), np.zeros(10)
    bends.add_bends(POINTS, VALUES, True, 0.7, matrix, vector, 0)
    by_value, by_argument = np.r_[np.zeros(5), VALUES], np.r_[POINTS, np.zeros(5)]
    for direction in (by_value, by_argument):
        assert vector @ direction == pytest.approx(0.0, abs=1e-12)
        np.testing.assert_allclose(matrix @ direction, 0.0, atol=1e-10)
    grown = bends.growth(2.0 * POINTS, 0.1 * VALUES, POINTS, VALUES)
    assert grown == pytest.approx(0.05)


def test_sliding_an_end_along_its_line_does_not_make_a_map_steeper():
    points, values = POINTS.copy(), VALUES.copy()
    slope = (values[1] - values[0]) / (points[1] - points[0])
    points[0] -= 7.0
    values[0] -= 7.0 * slope
    assert bends.growth(points, values, POINTS, VALUES) == 1.0


def test_break_points_that_came_too_close_part_to_both_sides():
    old = np.array([0.0, 1.0, 2.0, 3.0])
    proposed = np.array([0.0, 1.6, 1.5, 3.0])
    positions.settled_break_points(old, proposed, 0.2, 1e-4)
    np.testing.assert_allclose(proposed, [0.0, 1.45, 1.65, 3.0])


def test_thinning_keeps_the_break_points_where_a_map_bends():
    points = np.linspace(0.0, 10.0, 31)
    values = np.interp(points, [0.0, 2.0, 7.0, 10.0], [0.0, 0.0, 5.0, 2.0])
    kept = positions.thinned_break_points(points, values, np.ones(31), 4)
    np.testing.assert_allclose(points[kept], [0.0, 2.0, 7.0, 10.0])


def test_thinning_heeds_where_the_samples_are():
    points = np.linspace(0.0, 10.0, 21)
    values = np.abs(points - 2.0) + np.abs(points - 8.0)
    weights = np.where(points < 5.0, 1.0, 1e-6)
    kept = positions.thinned_break_points(points, values, weights, 3)
    assert points[kept][1] == 2.0


COUNT = """
import numpy as np
from hwid_cli import FitOptions, Orders, Recording, fit
from hwid_cli.model import linear_block as kernels
from hwid_cli.model.regression import regression_columns
from hwid_cli.model.derivative_rows import derivative_rows
from hwid_cli.model.simulate import validation_output

u = np.random.default_rng(1).standard_normal(400)
one = Recording("one", u, np.convolve(np.tanh(u), [0.0, 0.5, 0.2])[:400], 1e-3)
found = fit([one], Orders(2, 2, 1), FitOptions(units=4))
validation_output(found.model, one)
for loop in (kernels.block_output, derivative_rows, regression_columns):
    print(len(loop.signatures))
"""


@pytest.mark.thorough
def test_a_fit_compiles_each_loop_once():
    """Read-only arguments would be compiled for again, which takes seconds."""
    done = subprocess.run(
        [sys.executable, "-c", COUNT], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1", "1", "1"]
