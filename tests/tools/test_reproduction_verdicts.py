"""Every claim's definition: evidence on which it holds, and on which it does not."""

import numpy as np
import pytest

from tools import reproduction_verdicts as verdicts
from tools.reproduction_evidence import Counts, Matrix, SelfRmsd, own_cells
from tools.reproduction_verdicts import FAILS, HOLDS, IN_PART, NOT_JUDGED

GOOD, BAD = 0.001, 0.05


def matrix(names, rmsd, recordings=None):
    """Models on the recordings that they are named after, unless others are given."""
    rmsd = np.array(rmsd, dtype=float)
    if recordings is None:
        recordings = tuple(name for name in names if "+" not in name)
    own = own_cells(tuple(names), recordings)
    return Matrix(tuple(names), recordings, rmsd, rmsd < 0.01, own)


def chain(rmsd):
    """A chain on recordings that are none of its own."""
    rmsd = np.array(rmsd, dtype=float)
    names = tuple("+".join("abcdef"[: n + 1]) for n in range(len(rmsd)))
    return matrix(names, rmsd, tuple(f"r{n}" for n in range(rmsd.shape[1])))


@pytest.mark.parametrize(
    ("lowest", "answer"),
    [
        ([2e-4] * 10, HOLDS),
        ([2e-4] * 9 + [0.5e-4], HOLDS),
        ([2e-4] * 8 + [0.5e-4] * 2, IN_PART),
        ([2e-4] * 9 + [2e-3], IN_PART),
        ([2e-4] * 9 + [0.01], FAILS),
        ([2e-4] * 9 + [np.inf], FAILS),
    ],
)
def test_self_rmsd_holds_between_a_hundredth_and_a_tenth_of_the_threshold(
    lowest, answer
):
    found = SelfRmsd(("a",) * 10, np.array(lowest)[:, None], 0.01)
    assert verdicts.judge_self_rmsd(found).answer == answer


@pytest.mark.parametrize(("widest", "answer"), [(7, HOLDS), (14, HOLDS), (15, FAILS)])
def test_no_model_covers_all_fails_as_soon_as_one_does(widest, answer):
    verdict = verdicts.judge_none_covers_all(Counts((3, widest, 1), 15))
    assert verdict.answer == answer
    assert verdict.numbers == {"widest": widest, "of": 15}


@pytest.mark.parametrize(
    ("widest", "answer"),
    [(2, FAILS), (3, IN_PART), (4, HOLDS), (6, HOLDS), (7, IN_PART), (8, FAILS)],
)
def test_about_half_is_four_to_six_tenths(widest, answer):
    assert verdicts.judge_best_covers_half(Counts((1, widest), 10)).answer == answer


def test_one_recording_stands_alone_only_if_it_is_the_only_one():
    def verdict(rmsd):
        return verdicts.judge_one_stands_alone(matrix("abc", rmsd))

    friends = [[GOOD, GOOD, BAD], [GOOD, GOOD, BAD], [GOOD, BAD, GOOD]]
    loners = [[GOOD, BAD, BAD], [BAD, GOOD, BAD], [GOOD, BAD, GOOD]]
    # Its own model covers each recording, which must not count.
    assert verdict(friends).answer == HOLDS
    assert verdict(loners).answer == IN_PART
    assert verdict(np.full((3, 3), GOOD)).answer == FAILS


def test_nobody_covers_a_recording_that_only_its_own_models_cover():
    rmsd = [[GOOD, BAD], [BAD, GOOD], [GOOD, GOOD]]
    own_only = verdicts.judge_some_covered_by_nobody(matrix(("a", "b", "a+b"), rmsd))
    assert own_only.answer == HOLDS
    assert own_only.numbers["uncovered"] == 2
    others = [[GOOD, GOOD], [GOOD, GOOD]]
    assert verdicts.judge_some_covered_by_nobody(matrix("ab", others)).answer == FAILS


def hard_ones(n_poor):
    """Twelve recordings that help each other, four that nobody else covers."""
    names = tuple("abcdefghijklmnop")
    rmsd = np.full((16, 16), BAD)
    rmsd[:12, :12] = GOOD
    rmsd[12 + n_poor :, :12] = GOOD
    return matrix(names, rmsd)


@pytest.mark.parametrize(
    ("n_poor", "answer"), [(4, HOLDS), (3, HOLDS), (2, FAILS), (0, FAILS)]
)
def test_hard_recordings_give_narrow_models_if_most_of_theirs_cover_little(
    n_poor, answer
):
    verdict = verdicts.judge_hard_ones_cover_little(hard_ones(n_poor))
    assert verdict.answer == answer
    assert verdict.numbers["hard"] == 4
    assert verdict.numbers["poor"] == n_poor


def test_hard_recordings_are_not_judged_where_there_are_none():
    found = matrix("abc", np.full((3, 3), GOOD))
    assert verdicts.judge_hard_ones_cover_little(found).answer == NOT_JUDGED


@pytest.mark.parametrize(
    ("group", "answer"),
    [((GOOD, GOOD, GOOD), HOLDS), ((GOOD, GOOD, BAD), IN_PART), ((BAD,) * 3, FAILS)],
)
def test_groups_beat_singles_only_with_a_higher_count(group, answer):
    names = ("a", "b", "c", "a+b")
    rmsd = [[GOOD, GOOD, BAD], [BAD, GOOD, BAD], [BAD, BAD, GOOD], group]
    assert verdicts.judge_groups_beat_singles(matrix(names, rmsd)).answer == answer


def test_several_models_are_needed_where_one_alone_does_not_do():
    names = ("a", "b", "c")
    apart = matrix(names, np.where(np.eye(3), GOOD, BAD))
    everything = apart.part((0, 1, 2), apart.recordings)
    most = apart.part((0, 1), apart.recordings)
    single = apart.part((0,), apart.recordings)
    judge = verdicts.judge_several_models_needed
    assert judge(apart, everything).answer == HOLDS
    assert judge(apart, most).answer == IN_PART
    assert judge(apart, single).answer == FAILS
    universal = matrix(names, np.full((3, 3), GOOD))
    assert judge(universal, universal).answer == FAILS


@pytest.mark.parametrize(
    ("values", "answer"),
    [
        ((7, 8, 8), HOLDS),
        ((7, 8, 6), HOLDS),
        ((7, 7, 7), FAILS),
        ((12, 12), IN_PART),
        ((7,), NOT_JUDGED),
    ],
)
def test_grouping_raises_the_coverage_if_a_later_level_covers_more(values, answer):
    assert verdicts.judge_grouping_raises(Counts(values, 12)).answer == answer


@pytest.mark.parametrize(
    ("values", "answer"),
    [
        ((7, 8, 8), HOLDS),
        ((7, 8, 9), FAILS),
        ((7, 12, 12), IN_PART),
        ((7, 12), IN_PART),
        ((7,), NOT_JUDGED),
    ],
)
def test_coverage_saturates_if_the_last_level_gains_nothing(values, answer):
    assert verdicts.judge_saturates(Counts(values, 12)).answer == answer


@pytest.mark.parametrize(
    ("last", "answer"),
    [(23, HOLDS), (26, HOLDS), (27, IN_PART), (30, IN_PART), (31, FAILS), (15, FAILS)],
)
def test_about_23_of_38_is_within_a_tenth_of_all(last, answer):
    assert verdicts.judge_reaches_share(Counts((14, last), 38)).answer == answer


@pytest.mark.parametrize(
    ("rmsd", "answer"),
    [
        ([[0.3, 0.2], [0.2, 0.1], [0.1, 0.05]], HOLDS),
        ([[0.3, 0.2], [0.2, 0.1], [0.1, 0.1]], IN_PART),
        ([[0.3, 0.2], [0.2, 0.3], [0.1, 0.25]], IN_PART),
        ([[0.3, 0.2], [0.2, 0.1], [0.3, 0.2]], FAILS),
        ([[0.3, 0.2], [0.2, np.inf], [0.1, np.inf]], FAILS),
    ],
)
def test_rmsd_falls_along_the_chain_only_if_it_does_at_every_level(rmsd, answer):
    assert verdicts.judge_test_rmsd_falls(chain(rmsd)).answer == answer


@pytest.mark.parametrize(
    ("first", "last", "answer"),
    [
        ([BAD, BAD], [GOOD, BAD], HOLDS),
        ([GOOD, BAD], [BAD, GOOD], FAILS),
        ([GOOD, GOOD], [BAD, GOOD], FAILS),
        ([GOOD, GOOD], [GOOD, GOOD], IN_PART),
    ],
)
def test_the_test_shows_wider_coverage_only_with_more_recordings(first, last, answer):
    verdict = verdicts.judge_test_coverage_rises(chain([first, last]))
    assert verdict.answer == answer


@pytest.mark.parametrize(
    ("last", "answer"),
    [
        ([0.002, 0.002, 0.002, 0.002], HOLDS),
        ([0.002, 0.002, BAD, BAD], IN_PART),
        ([0.0005, 0.0005, 0.002, BAD], IN_PART),
        ([0.0005, 0.0005, BAD, BAD], FAILS),
    ],
)
def test_accuracy_is_traded_if_the_covered_pay_and_more_are_covered(last, answer):
    found = chain([[GOOD, GOOD, BAD, BAD], last])
    assert verdicts.judge_accuracy_is_traded(found).answer == answer


def test_accuracy_cannot_be_traded_where_there_was_none():
    found = chain([[BAD, BAD], [GOOD, GOOD]])
    assert verdicts.judge_accuracy_is_traded(found).answer == NOT_JUDGED


@pytest.mark.parametrize(
    ("n_better", "answer"), [(4, HOLDS), (3, HOLDS), (2, FAILS), (0, FAILS)]
)
def test_the_uncovered_gain_if_three_quarters_do(n_better, answer):
    last = np.full(5, 2 * BAD)
    last[1 : 1 + n_better] = BAD / 2
    # The first recording is covered and does not count.
    found = chain([[GOOD, *[BAD] * 4], last])
    verdict = verdicts.judge_uncovered_gain(found)
    assert verdict.answer == answer
    assert verdict.numbers == {"better": n_better, "uncovered_first": 4}


@pytest.mark.parametrize(
    ("medians", "answer"),
    [
        ((0.3, 0.2, 0.1), HOLDS),
        ((0.3, 0.1, 0.2), IN_PART),
        ((0.3, 0.1, 0.3), FAILS),
    ],
)
def test_accuracy_grows_only_if_the_median_falls_at_every_level(medians, answer):
    # The outer two of three recordings move against it and do not matter.
    found = chain([[0.01, value, 9.0 + n] for n, value in enumerate(medians)])
    assert verdicts.judge_accuracy_grows(found).answer == answer


def test_a_lost_number_takes_its_recording_out_of_the_comparison():
    found = chain([[0.3, 0.1], [0.2, np.nan], [0.1, 0.3]])
    assert verdicts.judge_accuracy_grows(found).answer == HOLDS
    nothing = chain([[np.nan], [0.2]])
    assert verdicts.judge_accuracy_grows(nothing).answer == NOT_JUDGED
