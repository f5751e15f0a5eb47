import numpy as np

from hwid_cli.model.maps.piecewise_linear import (
    columns_of_segments,
    piecewise_linear,
    piecewise_linear_jacobian,
    piecewise_linear_shares,
)
from hwid_cli.model.normal_equations import combined, scaled_equations

RNG = np.random.default_rng(8)


def test_scaled_equations_have_the_solution_of_the_given_ones():
    columns = RNG.standard_normal((40, 5)) * [1.0, 1e3, 1e-3, 7.0, 0.2]
    target = RNG.standard_normal(40)
    matrix, vector = columns.T @ columns, columns.T @ target
    scaled, right, scale = scaled_equations(matrix, vector, 1e-12)
    np.testing.assert_allclose(np.diag(scaled), 1.0, rtol=1e-13)
    expected = np.linalg.lstsq(columns, target, rcond=None)[0]
    np.testing.assert_allclose(scale * np.linalg.solve(scaled, right), expected)


def test_a_parameter_without_effect_is_not_divided_by():
    matrix = np.diag([4.0, 0.0])
    scaled, _, scale = scaled_equations(matrix, np.ones(2), 1e-12)
    assert scale[1] == 1.0 / np.sqrt(4e-12)
    assert scaled[1, 1] == 0.0


def test_products_of_combined_columns_are_those_of_their_sums():
    columns = RNG.standard_normal((30, 7))
    change = np.zeros((3, 2))
    change[0, 0], change[1, 1], change[2] = 2.0, -1.0, (0.5, 0.25)
    new = np.column_stack([columns[:, :4], columns[:, 4:6] @ change.T, columns[:, 6:]])
    found = combined(columns.T @ columns, change, 4)
    np.testing.assert_allclose(found, new.T @ new, atol=1e-12)


def test_columns_of_segments_give_the_derivatives_of_the_map():
    points, values = np.array([-1.0, 0.0, 0.5, 2.0]), np.array([0.0, 1.0, -1.0, 3.0])
    argument = RNG.uniform(-2.0, 3.0, 50)
    _, slope, segment = piecewise_linear(argument, points, values)
    expected = np.zeros((50, 8))
    piecewise_linear_jacobian(argument, points, (slope, segment), True, expected, 0)
    _, _, first, shares = piecewise_linear_shares(argument, points, values, 2)
    local = np.zeros((50, 6))
    at = np.arange(50)
    local[at, first], local[at, first + 1] = shares.T
    found = local @ columns_of_segments(points, values).T
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_equations_that_nothing_moves_are_no_division_by_zero():
    matrix, vector, scale = scaled_equations(np.zeros((3, 3)), np.zeros(3), 1e-12)

    assert not matrix.any()
    assert not vector.any()
    assert np.isfinite(scale).all()
