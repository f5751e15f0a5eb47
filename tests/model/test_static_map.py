import importlib
import pkgutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.model import maps, static_map
from hwid_cli.records.maps import MAP_KINDS, MapOptions, StaticMap
from tests.model.plants import MAPS, NO_IDENTITY, SOFT_LIMIT, WITHOUT_SLOPE

ARGUMENT = np.linspace(-4.0, 4.0, 81)
WITH_FREE_GAIN = [kind for kind in MAP_KINDS if static_map.RULES[kind].size]
WITH_FREE_SHAPE = [kind for kind in MAP_KINDS if static_map.has_free_shape(kind)]


def wanted(kind):
    function = SOFT_LIMIT if kind == "own_function" else None
    return MapOptions(kind, units=4, degree=3, function=function)


def derivatives(one, argument, with_positions=True):
    active = static_map.active_parameters(one, with_positions=with_positions)
    out = np.full((argument.size, 1 + active.stop - active.start), np.nan)
    value, slope = static_map.differentiate(
        one, argument, out, 1, with_positions=with_positions
    )
    return value, slope, out[:, 1:]


def test_every_module_that_gives_a_rule_is_a_kind_that_options_allow():
    modules = [one.name for one in pkgutil.iter_modules(maps.__path__)]
    giving = {
        name
        for name in modules
        if hasattr(importlib.import_module(f"{maps.__name__}.{name}"), "RULE")
    }
    assert giving == set(MAP_KINDS) == set(MAPS)


def test_dead_zone_is_zero_inside_its_band_and_has_slope_one_outside():
    one = MAPS["dead_zone"]
    inside = np.array([-0.4, 0.0, 0.6])
    np.testing.assert_array_equal(static_map.evaluate(one, inside), 0.0)
    np.testing.assert_allclose(
        static_map.evaluate(one, np.array([-1.4, 1.6])), [-1.0, 1.0], rtol=1e-15
    )


def test_saturation_has_slope_one_between_its_limits():
    one = MAPS["saturation"]
    argument = np.array([-9.0, -1.0, 1.0, 9.0])
    np.testing.assert_array_equal(
        static_map.evaluate(one, argument), [-1.4, -1.0, 1.0, 1.1]
    )


def test_piecewise_linear_interpolates_like_numpy_inside_its_break_points():
    one = MAPS["piecewise_linear"]
    inside = np.linspace(-3.0, 3.0, 50)
    expected = np.interp(inside, one.parameters[:4], one.parameters[4:])
    # Two ways to write the same line differ by rounding.
    np.testing.assert_allclose(static_map.evaluate(one, inside), expected, atol=1e-14)


def test_piecewise_linear_goes_on_with_its_outermost_slopes():
    one = MAPS["piecewise_linear"]
    left_slope, right_slope = 0.8 / 2.2, 2.2 / 2.3
    value = static_map.evaluate(one, np.array([-5.0, 5.0]))
    np.testing.assert_allclose(value, [-2.0 - 2 * left_slope, 2.6 + 2 * right_slope])


def test_polynomial_equals_its_power_form():
    one = StaticMap("polynomial", np.array([0.5, -1.0, 2.0]), (-1.0, 1.0))
    expected = 0.5 - ARGUMENT + 2.0 * (2.0 * ARGUMENT**2 - 1.0)
    np.testing.assert_allclose(static_map.evaluate(one, ARGUMENT), expected)


@pytest.mark.parametrize("kind", [k for k in MAP_KINDS if k not in WITHOUT_SLOPE])
def test_derivatives_agree_with_central_differences(kind):
    one = MAPS[kind]
    # Off the break-points and limits, where a derivative exists.
    argument = ARGUMENT + 0.013
    value, slope, jacobian = derivatives(one, argument)
    np.testing.assert_allclose(value, static_map.evaluate(one, argument), atol=1e-14)
    step = 1e-6
    around = [static_map.evaluate(one, argument + s) for s in (step, -step)]
    # Rounding of values near 10 over a step of 1e-6 leaves about 1e-9.
    np.testing.assert_allclose(slope, (around[0] - around[1]) / (2 * step), atol=1e-8)
    for k in range(one.parameters.size):
        change = np.zeros(one.parameters.size)
        change[k] = step
        above, below = (
            static_map.evaluate(static_map.move(one, sign * change), argument)
            for sign in (1.0, -1.0)
        )
        np.testing.assert_allclose(
            jacobian[:, k], (above - below) / (2 * step), atol=1e-8
        )


def test_without_positions_only_the_values_of_break_points_move():
    one = MAPS["piecewise_linear"]
    _, _, all_columns = derivatives(one, ARGUMENT)
    _, _, values_only = derivatives(one, ARGUMENT, with_positions=False)
    np.testing.assert_array_equal(values_only, all_columns[:, 4:])
    moved = static_map.move(one, np.ones(4))
    np.testing.assert_array_equal(moved.parameters[:4], one.parameters[:4])


@given(steps=st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4))
def test_break_points_stay_in_order_whatever_the_step(steps):
    one = MAPS["piecewise_linear"]
    step = np.concatenate([steps, np.zeros(4)])
    points = static_map.move(one, step).parameters[:4]
    assert (np.diff(points) > 0.0).all()


@pytest.mark.parametrize("kind", MAP_KINDS)
@given(factor=st.floats(1e-3, 1e3))
def test_stretching_changes_the_unit_of_argument_and_value(kind, factor):
    one = MAPS[kind]
    stretched = static_map.stretch(one, factor)
    np.testing.assert_allclose(
        static_map.evaluate(stretched, ARGUMENT * factor),
        static_map.evaluate(one, ARGUMENT) * factor,
        rtol=1e-9,
        atol=1e-12 * factor,
    )


@pytest.mark.parametrize("kind", WITH_FREE_GAIN)
@pytest.mark.parametrize("factor", [2.5, -0.4])
def test_gain_can_move_to_either_side_of_a_map_with_a_free_gain(kind, factor):
    one = MAPS[kind]
    rule = static_map.RULES[kind]
    value = static_map.evaluate(one, ARGUMENT)
    amplified = static_map.evaluate(rule.amplify(one, factor), ARGUMENT)
    np.testing.assert_allclose(amplified, factor * value, rtol=1e-12, atol=1e-14)
    # Off the edges of a piecewise constant map, where rounding decides.
    argument = ARGUMENT + 0.013
    value = static_map.evaluate(one, argument)
    compressed = static_map.evaluate(rule.compress(one, factor), argument / factor)
    np.testing.assert_allclose(compressed, value, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("kind", WITH_FREE_GAIN)
def test_size_grows_with_the_values_and_has_the_stated_gradient(kind):
    one, rule = MAPS[kind], static_map.RULES[kind]
    size, gradient = rule.size(one)
    assert rule.size(rule.amplify(one, -3.0))[0] == pytest.approx(3.0 * size)
    step = 1e-6
    for k in range(one.parameters.size):
        change = np.zeros(one.parameters.size)
        change[k] = step
        above = rule.size(static_map.move(one, change))[0]
        # One-sided difference of a nearly linear function.
        assert (above - size) / step == pytest.approx(gradient[k], abs=1e-5)


@pytest.mark.parametrize("kind", MAP_KINDS)
def test_another_domain_leaves_the_values(kind):
    one = static_map.with_domain(MAPS[kind], np.array([-7.0, 1.0, 9.0]))
    assert one.domain == (-7.0, 9.0)
    np.testing.assert_allclose(
        static_map.evaluate(one, ARGUMENT),
        static_map.evaluate(MAPS[kind], ARGUMENT),
        atol=1e-11,
    )


@pytest.mark.parametrize("kind", WITH_FREE_SHAPE)
def test_the_first_start_of_a_kind_with_a_free_shape_follows_it(kind):
    one, *_ = static_map.starting_maps(
        kind, wanted(kind), -1.0, 2.0, shape=lambda v: 2.0 * v + 1.0
    )
    # Half a cell of a piecewise constant map; the others describe a line exactly.
    inside = ARGUMENT[(ARGUMENT > -1.0) & (ARGUMENT < 2.0)]
    at, tolerance = (
        (inside, 0.75 + 1e-12) if kind in WITHOUT_SLOPE else (ARGUMENT, 1e-11)
    )
    np.testing.assert_allclose(
        static_map.evaluate(one, at), 2.0 * at + 1.0, atol=tolerance
    )


def test_starting_limits_lie_inside_the_range_so_that_they_can_move():
    for kind in ("saturation", "dead_zone"):
        for one in static_map.starting_maps(kind, wanted(kind), -1.0, 2.0):
            assert (one.parameters > -1.0).all()
            assert (one.parameters < 2.0).all()


def test_starting_map_over_an_empty_range_is_usable():
    kind = "piecewise_linear"
    (one,) = static_map.starting_maps(kind, wanted(kind), 2.0, 2.0)
    assert (np.diff(one.parameters[:4]) > 0.0).all()


@pytest.mark.parametrize("kind", MAP_KINDS)
def test_every_parameter_has_a_name(kind):
    assert len(static_map.parameter_names(MAPS[kind])) == MAPS[kind].parameters.size


@pytest.mark.parametrize("kind", [k for k in MAP_KINDS if k not in NO_IDENTITY])
def test_identity_passes_on_what_lies_in_its_range(kind):
    argument = np.linspace(-2.0, 5.0, 30)
    one = static_map.identity(kind, wanted(kind), argument)
    np.testing.assert_allclose(static_map.evaluate(one, argument), argument, atol=1e-14)


def test_ends_that_slid_away_along_their_line_come_back_to_the_data():
    points, values = np.array([-90.0, -1.0, 0.5, 1.0, 40.0]), np.arange(5.0) ** 2
    far = StaticMap("piecewise_linear", np.concatenate([points, values]), (-90.0, 40.0))
    argument = np.linspace(-2.0, 3.0, 101)
    one = static_map.with_domain(far, argument)

    assert one.parameters[:5].tolist() == [-2.0, -1.0, 0.5, 1.0, 3.0]
    assert one.domain == (-2.0, 3.0)
    np.testing.assert_allclose(
        static_map.evaluate(one, argument), static_map.evaluate(far, argument)
    )


def test_ends_within_the_data_come_to_its_ends():
    near = StaticMap(
        "piecewise_linear", np.array([-1.0, 0.0, 1.0, 0.0, 2.0, 3.0]), (0.0, 1.0)
    )
    one = static_map.with_domain(near, np.array([-2.0, 2.0]))
    assert one.parameters.tolist() == [-2.0, 0.0, 2.0, -2.0, 2.0, 4.0]
    at = np.linspace(-3.0, 3.0, 25)
    np.testing.assert_allclose(
        static_map.evaluate(one, at), static_map.evaluate(near, at), atol=1e-14
    )
    # Below the second break-point the first segment would have no width.
    above = static_map.with_domain(near, np.array([0.5, 2.0]))
    assert above.parameters[:3].tolist() == [-1.0, 0.0, 2.0]
