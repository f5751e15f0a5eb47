from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from hwid_cli.model import static_map
from hwid_cli.model.fit import fit
from hwid_cli.model.maps.piecewise_constant import (
    edges_and_levels,
    nearest_steps,
    ramps,
)
from hwid_cli.model.placing import cut, finer, thinner
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import MAPS

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


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_steps_of_a_start_are_the_nearest_of_all(count, seed):
    values = np.cumsum(np.random.default_rng(seed).standard_normal(14))

    def error(cuts):
        return sum(piece.size * np.var(piece) for piece in np.split(values, cuts))

    every = (list(one) for one in combinations(range(1, values.size), count - 1))
    assert error(nearest_steps(values, count)) == pytest.approx(
        min(error(cuts) for cuts in every), rel=1e-2
    )


@pytest.mark.parametrize("values", [np.zeros(60), np.linspace(-1.0, 3.0, 60)])
def test_the_steps_of_a_straight_line_are_equal(values):
    np.testing.assert_array_equal(nearest_steps(values, 5), [12, 24, 36, 48])


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seeds", "sizes"),
    [
        ((20, 22), (5, 7, 12)),
        pytest.param(
            (20, 21, 22, 23), (5, 6, 7, 9, 12), marks=pytest.mark.slow, id="many"
        ),
    ],
)
def test_more_levels_than_a_plant_has_are_no_obstacle(seeds, sizes):
    reached = []
    for seed, units in product(seeds, sizes):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-2.4, 2.4, 70), rng.integers(3, 25, 70))
        y = lfilter([0.0, 0.05, 0.03], [1.0, -1.6, 0.68], np.round(u))
        noise = 0.01 * np.std(y)
        recording = Recording("r", u, y + noise * rng.standard_normal(u.size), 1e-3)
        asked = FitOptions(
            input_map="piecewise_constant", output_map="none", input_units=units
        )
        found = fit([recording], Orders(2, 2, 1), asked)
        reached.append(found.rmsd < 1.1 * noise)
    # Edges at equal distances that move by themselves reach it in half of them.
    assert sum(reached) >= len(reached) - 1


def test_new_edges_lie_between_samples():
    # On a sample, a change of units may put it on the other side of the edge.
    argument = np.repeat(np.array([-1.0, -0.4, 0.1, 0.3, 0.9, 1.3]), 20)
    for change in (finer, cut):
        edges, _ = edges_and_levels(change(ONE, argument))
        new = np.setdiff1d(edges, EDGES)
        assert new.size
        assert np.min(np.abs(new[:, None] - argument)) > 0.05


def test_cutting_and_merging_levels_gives_the_same_map():
    rng = np.random.default_rng(4)
    argument = rng.uniform(-3.0, 3.0, 500)
    fine = cut(ONE, argument)
    assert fine.parameters.size > ONE.parameters.size
    for one in (fine, thinner(fine, argument, LEVELS.size)):
        np.testing.assert_allclose(
            static_map.evaluate(one, argument), static_map.evaluate(ONE, argument)
        )
