import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.maths.model import static_map
from hwid_cli.maths.model.maps.piecewise_constant import edges_and_levels, ramps
from hwid_cli.records.maps import StaticMap
from tests.maths.model.plants import MAPS

ONE = MAPS["piecewise_constant"]
EDGES, LEVELS = edges_and_levels(ONE)
ARGUMENT = np.linspace(-4.0, 4.0, 801) + 0.0013


def with_ramps(one, half, argument):
    """The map with its jumps drawn out to ramps of given half widths."""
    edges, levels = edges_and_levels(one)
    shares = np.clip(0.5 + (argument[:, None] - edges) / (2.0 * half), 0.0, 1.0)
    return levels[0] + shares @ np.diff(levels)


def test_levels_hold_between_and_beyond_the_edges():
    argument = np.array([-99.0, -1.71, -1.7, -0.5, 0.0, 0.89, 0.9, 99.0])
    expected = LEVELS[[0, 0, 1, 1, 2, 2, 3, 3]]
    np.testing.assert_array_equal(static_map.evaluate(ONE, argument), expected)


def test_derivatives_by_the_levels_are_those_of_the_map():
    out = np.full((ARGUMENT.size, 7), np.nan)
    value, _ = static_map.differentiate(ONE, ARGUMENT, out, 0, with_positions=True)
    np.testing.assert_array_equal(value, static_map.evaluate(ONE, ARGUMENT))
    np.testing.assert_allclose(out[:, 3:] @ LEVELS, value, rtol=1e-15)


def test_slope_and_edges_are_searched_by_narrow_ramps():
    half = ramps(ONE)
    out = np.full((ARGUMENT.size, 7), np.nan)
    _, slope = static_map.differentiate(ONE, ARGUMENT, out, 0, with_positions=True)
    step = 1e-6
    above, below = (with_ramps(ONE, half, ARGUMENT + s) for s in (step, -step))
    # Rounding of values near 2 over a step of 1e-6 leaves about 1e-9.
    np.testing.assert_allclose(slope, (above - below) / (2 * step), atol=1e-8)
    for k in range(EDGES.size):
        change = np.zeros(7)
        change[k] = step
        above, below = (
            with_ramps(static_map.move(ONE, sign * change), half, ARGUMENT)
            for sign in (1.0, -1.0)
        )
        np.testing.assert_allclose(out[:, k], (above - below) / (2 * step), atol=1e-8)


def test_ramps_do_not_overlap_nor_does_a_single_edge_lack_one():
    assert (ramps(ONE)[1:] + ramps(ONE)[:-1] < np.diff(EDGES)).all()
    single = StaticMap("piecewise_constant", np.array([0.5, -1.0, 1.0]), (-1.0, 1.0))
    assert 0.0 < ramps(single)[0] < 1.0


@given(steps=st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3))
def test_edges_stay_in_order_whatever_the_step(steps):
    step = np.concatenate([steps, np.zeros(4)])
    edges, _ = edges_and_levels(static_map.move(ONE, step))
    assert (np.diff(edges) > 0.0).all()


def test_a_single_edge_may_move():
    single = StaticMap("piecewise_constant", np.array([0.5, -1.0, 1.0]), (-1.0, 1.0))
    moved = static_map.move(single, np.array([0.2, 0.0, 0.0]))
    assert moved.parameters[0] == pytest.approx(0.7)
