import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hwid_cli.stages.coverage_matrix import (
    ScoredModels,
    are_hard_to_cover,
    assign,
    count_covered_by,
    count_covers,
    smallest_set,
)

# Models a, b, a+b on recordings a, b, c.
COVERED = np.array([[1, 1, 0], [0, 0, 0], [1, 1, 1]], dtype=bool)
IS_OWN = np.array([[1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=bool)


def test_own_recordings_are_left_out_of_both_counts():
    assert count_covers(COVERED, IS_OWN).tolist() == [1, 0, 1]
    assert count_covered_by(COVERED, IS_OWN).tolist() == [0, 1, 1]


@pytest.mark.thorough
@given(hnp.arrays(bool, (5, 7)), hnp.arrays(bool, (5, 7), elements=st.booleans()))
def test_both_counts_add_up_to_the_same(covered, is_own):
    covers, covered_by = (
        count(covered, is_own) for count in (count_covers, count_covered_by)
    )
    assert covers.sum() == covered_by.sum()


def test_hard_is_fewer_than_a_tenth_of_the_others():
    # Eleven models, one of them its own: one of the ten others is a tenth, not fewer.
    covered = np.zeros((11, 2), dtype=bool)
    is_own = np.zeros((11, 2), dtype=bool)
    is_own[0] = covered[0] = True
    covered[1, 1] = True

    assert are_hard_to_cover(covered, is_own).tolist() == [True, False]


def test_without_another_model_nothing_is_called_hard():
    own = np.ones((1, 1), dtype=bool)

    assert are_hard_to_cover(own, own).tolist() == [False]


def test_covered_is_strictly_below_the_threshold_and_never_missing():
    rmsd = np.array([[0.0099, 0.01, np.nan]])
    judged = ScoredModels(("a/1/1",), ("a", "b", "c"), rmsd, rmsd < 0, 0.01)

    assert judged.covered.tolist() == [[True, False, False]]


def test_each_recording_is_assigned_its_lowest_rmsd():
    rmsd = np.array([[0.3, np.nan, np.nan, 0.1], [0.2, 0.5, np.nan, 0.1]])

    assert assign(rmsd).tolist() == [1, 1, -1, 0]
    assert assign(np.zeros((0, 2))).tolist() == [-1, -1]


def test_the_smallest_set_counts_own_recordings_and_prefers_lower_rmsd():
    # The first two rows cover the same; the second does so more closely.
    rmsd = np.array([[0.004, 0.005, 9.0], [0.003, 0.005, np.nan], [9.0, 9.0, 0.009]])

    assert smallest_set(rmsd, 0.01).tolist() == [1, 2]
    assert smallest_set(rmsd, 0.001).tolist() == []
