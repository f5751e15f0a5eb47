"""The rules of the final test, replayed on the published tables of sections 3.4.1 to 3.4.3.

Recordings 1 to 15 are steps; 16 to 38 are sines 1 to 23.
"""

import csv
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.stages.coverage_matrix import (
    are_hard_to_cover,
    assign,
    count_covered_by,
    count_covers,
)
from hwid_cli.stages.set_cover import smallest_cover

REFERENCE = Path(__file__).parents[1] / "reference"
THRESHOLD = 0.01
# The test steps of section 3.3; the other twelve validate.
TEST_STEPS = (5, 10, 11)


def table(name):
    """Row names and numbers of a published table; a blank or a dash is NaN."""
    with (REFERENCE / f"{name}.csv").open(newline="") as file:
        _, *rows = csv.reader(file)
    cells = [[np.nan if c in ("", "-") else float(c) for c in row[1:]] for row in rows]
    return [row[0] for row in rows], np.array(cells)


def chain_rmsd(model):
    """RMSD of a combination model's levels on all 38 recordings."""
    groups, steps = table(f"{model}_step_rmsd")
    also, sines = table(f"{model}_sine_rmsd")
    assert groups == also
    rmsd = np.hstack([steps, sines])
    if model == "model1":
        # From sine 13 on this row stands one place too far left.
        rmsd[groups.index("6-9-1"), 15 + 12 :] = np.nan
    return groups, rmsd


@pytest.fixture(scope="module")
def singles():
    """The matrix of 38 models on 38 recordings, and its printed sums of rows."""
    _, cells = table("coverage_matrix_38")
    return cells[:, :-1] == 1, np.eye(38, dtype=bool), cells[:, -1]


def test_every_model_covers_what_is_printed(singles):
    covered, is_own, printed = singles

    assert count_covers(covered, is_own).tolist() == printed.tolist()


def test_every_recording_is_covered_as_often_as_is_printed(singles):
    covered, is_own, _ = singles

    assert count_covered_by(covered, is_own).tolist() == [
        10, 3, 1, 2, 0, 13, 7, 11, 3, 1, 12, 7, 5, 4, 0,
        10, 18, 19, 14, 9, 9, 15, 11, 8, 9, 8, 6, 1, 0, 0, 9, 0, 0, 5, 2, 0, 14, 0,
    ]  # fmt: skip


def test_the_recordings_that_are_hard_to_cover_are_those_of_the_text(singles):
    covered, is_own, _ = singles
    found = set((np.flatnonzero(are_hard_to_cover(covered, is_own)) + 1).tolist())

    of_text = {2, 3, 4, 5, 9, 10}
    of_text |= {15 + sine for sine in (13, 14, 15, 17, 18, 19, 20, 21, 23)}
    # The text forgets step 15, which no other model covers and which section 3.2.2
    # itself calls unique; and it names sine 19, which five models cover, more than step
    # 14, which it leaves out.
    assert found == (of_text | {15}) - {15 + 19}


def test_eleven_of_the_single_models_cover_all_and_ten_do_not(singles):
    covered, is_own, _ = singles
    covered = covered | is_own
    chosen = smallest_cover(covered, np.zeros(covered.shape))

    assert len(chosen) == 11
    assert covered[chosen].any(axis=0).all()
    # Eight recordings are covered by their own model only, which every set must hold;
    # what these leave open cannot be covered by any two models more.
    forced = np.flatnonzero(covered.sum(axis=0) == 1)
    assert len(forced) == 8
    left = ~covered[forced].any(axis=0)
    assert not any(
        (covered[one] | covered[two])[left].all()
        for one, two in combinations(range(38), 2)
    )


def test_without_own_recordings_thirty_can_be_covered_by_seven_models(singles):
    covered, _, _ = singles
    chosen = smallest_cover(covered, np.zeros(covered.shape))

    assert covered.any(axis=0).sum() == covered[chosen].any(axis=0).sum() == 30
    assert len(chosen) == 7


def test_model_1_covers_what_its_matrix_says():
    groups, rmsd = chain_rmsd("model1")
    also, matrix = table("model1_coverage_38")
    assert groups == also

    usable = np.isfinite(rmsd)
    assert (~usable).sum() == 11
    assert ((rmsd < THRESHOLD) == (matrix == 1))[usable].all()


def test_model_1_covers_as_many_steps_as_is_printed_with_one_exception():
    groups, rmsd = chain_rmsd("model1")
    also, printed = table("model1_step_coverage")
    assert groups == also
    validation = [step - 1 for step in range(1, 16) if step not in TEST_STEPS]
    counted = np.sum(rmsd[:, validation] < THRESHOLD, axis=1)

    # The third level needs step 14 for its 8; its printed RMSD there is 0.011065.
    assert printed.ravel().tolist() == [6, 7, 8, 8]
    assert counted.tolist() == [6, 7, 7, 8]
    assert rmsd[2, 13] == 0.011065


def test_model_2_covers_what_its_matrix_says_but_for_rounding():
    groups, rmsd = chain_rmsd("model2")
    also, matrix = table("model2_coverage_38")
    assert groups == also

    # Rounded to three decimals, 0.01 may lie on either side of the threshold; that is
    # the only number about which the two tables differ.
    differs = (rmsd < THRESHOLD) != (matrix == 1)
    assert set(rmsd[differs]) == {0.01}
    least, most = np.sum(rmsd < THRESHOLD, axis=1), np.sum(rmsd <= THRESHOLD, axis=1)
    assert least.tolist() == [13, 14, 16, 16, 20, 20]
    assert matrix.sum(axis=1).tolist() == [14, 14, 19, 17, 21, 22]
    assert most.tolist() == [14, 14, 19, 17, 22, 23]


def test_the_printed_coverage_of_model_2_is_possible_with_one_exception():
    _, rmsd = chain_rmsd("model2")
    groups, printed = table("model2_coverage")
    least, most = np.sum(rmsd < THRESHOLD, axis=1), np.sum(rmsd <= THRESHOLD, axis=1)
    is_printed = np.isfinite(printed[:, 0])
    is_possible = (least <= printed[:, 0]) & (printed[:, 0] <= most)

    # At 20-16-9-5 19 is printed; its row of RMSDs has 17 at most, and so has the matrix.
    impossible = [groups[n] for n in np.flatnonzero(is_printed & ~is_possible)]
    assert impossible == ["20-16-9-5"]
    assert is_printed.sum() == 5


@pytest.mark.parametrize(
    ("name", "columns", "agree", "agree_of_named"),
    [
        # Among all ten models, the published choice has the lowest RMSD for one step
        # only: mostly it is the last level of a chain, though a shorter group is
        # closer (step 6 goes to 6-9 at 0.0024, with 6 at 0.0001). Among the models that
        # the table itself uses it is the lowest for 5 of 15.
        ("model_to_step", slice(0, 15), 1, 5),
        # Sines at three decimals often tie; a tie counts as agreement. Two of the 23 go to
        # 6-9-1, whose row of sines cannot be used there.
        ("model_to_sine", slice(15, 38), 12, 14),
    ],
)
def test_the_published_assignment_is_seldom_the_lowest_rmsd(
    name, columns, agree, agree_of_named
):
    groups_1, rmsd_1 = chain_rmsd("model1")
    groups_2, rmsd_2 = chain_rmsd("model2")
    groups = groups_1 + groups_2
    rmsd = np.vstack([rmsd_1, rmsd_2])[:, columns]
    named, marks = table(name)
    published = [groups.index(named[row]) for row in marks.argmax(axis=0)]

    assert count_agreeing(rmsd, published) == agree
    only_named = np.full(rmsd.shape, np.nan)
    rows = [groups.index(group) for group in named]
    only_named[rows] = rmsd[rows]
    assert count_agreeing(only_named, published) == agree_of_named


def count_agreeing(rmsd, published):
    """Columns where the published row is as low as the row that is assigned."""
    places = np.arange(rmsd.shape[1])
    return int(np.sum(rmsd[published, places] == rmsd[assign(rmsd), places]))
