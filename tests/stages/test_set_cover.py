from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hwid_cli.stages.set_cover import smallest_cover

SHAPES = st.tuples(st.integers(1, 7), st.integers(1, 6))


@st.composite
def tables(draw):
    shape = draw(SHAPES)
    covered = draw(hnp.arrays(bool, shape))
    # Whole numbers: their sums are exact, so that equal sums are seen as equal.
    costs = draw(hnp.arrays(np.float64, shape, elements=st.integers(0, 9)))
    return covered, costs


def cost_of(rows, covered, costs):
    """Sum over the covered columns of the cheapest row that covers each."""
    table = np.where(covered, costs, np.inf)[list(rows)]
    return table[:, covered.any(axis=0)].min(axis=0).sum()


def by_brute_force(covered, costs):
    """Size and cost of the best cover, of all sets that there are."""
    needed = covered.any(axis=0)
    if not needed.any():
        return 0, 0.0
    for size in range(1, len(covered) + 1):
        found = [
            cost_of(rows, covered, costs)
            for rows in combinations(range(len(covered)), size)
            if covered[list(rows)].any(axis=0)[needed].all()
        ]
        if found:
            return size, min(found)
    raise AssertionError("all rows together cover what any row covers")


@given(tables())
def test_no_set_of_all_that_there_are_is_smaller_or_cheaper(table):
    covered, costs = table
    chosen = smallest_cover(covered, costs)

    size, cost = by_brute_force(covered, costs)
    assert len(chosen) == size
    if size:
        assert (covered[chosen].any(axis=0) == covered.any(axis=0)).all()
        assert cost_of(chosen, covered, costs) == cost


def test_greed_would_need_one_more():
    # The widest row covers four of six; the two that make up the smallest set three each.
    covered = np.array(
        [[1, 1, 1, 1, 0, 0], [1, 1, 0, 0, 1, 0], [0, 0, 1, 1, 0, 1]], dtype=bool
    )

    assert smallest_cover(covered, np.ones((3, 6))).tolist() == [1, 2]


def test_fewer_rows_come_before_cheaper_ones():
    covered = np.array([[1, 1], [1, 0], [0, 1]], dtype=bool)
    costs = np.array([[9.0, 9.0], [0.0, 0.0], [0.0, 0.0]])

    assert smallest_cover(covered, costs).tolist() == [0]


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e6])
def test_small_differences_of_cost_count_whatever_the_unit(scale):
    # One part in 1e7 decides.
    costs = scale * np.array([[1.0], [1.0 - 1e-7], [1.0 + 1e-7]])

    assert smallest_cover(np.ones((3, 1), dtype=bool), costs).tolist() == [1]


def test_costs_where_nothing_is_covered_do_not_count():
    covered = np.array([[True, False], [True, False]])
    costs = np.array([[2.0, np.nan], [1.0, np.nan]])

    assert smallest_cover(covered, costs).tolist() == [1]


def test_where_nothing_is_covered_no_row_is_needed():
    assert smallest_cover(np.zeros((3, 2), dtype=bool), np.ones((3, 2))).size == 0
    assert smallest_cover(np.zeros((0, 2), dtype=bool), np.ones((0, 2))).size == 0
