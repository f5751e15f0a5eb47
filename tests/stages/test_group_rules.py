"""The published search replayed on its tables, and each rule on its own."""

import csv
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.records.experiment import GroupOptions
from hwid_cli.records.groups import Group
from hwid_cli.stages.group_search import Level, kept, reason_to_stop, search_groups

REFERENCE = Path(__file__).parents[1] / "reference"
# T3.3.3-1: steps that identify and validate; 5, 10 and 11 are kept for the test.
TWELVE = ("1", "2", "3", "4", "6", "7", "8", "9", "12", "13", "14", "15")
# The seven columns of T3.3.3.1-2.
STARTS = ("6", "7", "8", "9", "12", "13", "14")
# Iteration 1 keeps 7 and more, iteration 2 keeps 8; the text calls it the most covered.
PUBLISHED = GroupOptions(
    start=STARTS,
    candidates=TWELVE,
    keep={"coverage_at_least": (7, 8)},
    max_level=9,
)


def published_iteration(number):
    with (REFERENCE / f"grouping_iteration_{number}.csv").open(newline="") as file:
        return [
            (row["base"], row["add_on"], int(row["coverage"]))
            for row in csv.DictReader(file)
            if row["coverage"]
        ]


def published_coverage():
    """Coverage of every group that the thesis tried, by its recordings in order."""
    table = {}
    with (REFERENCE / "cross_rmsd.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            table[(row["identified_on"],)] = int(row["printed_coverage"])
    for number in (1, 2, 3):
        for base, add_on, coverage in published_iteration(number):
            table[(*base.split("-"), add_on)] = coverage
    return table


def group(names, coverage, *, rmsd=np.nan):
    return Group(tuple(names), coverage, 1, 1, 0.0, rmsd, 1, 1, 1, False)


def replay(options):
    """Search on the published tables; asking for anything else is a KeyError."""
    table = published_coverage()
    return search_groups(
        options.start,
        TWELVE,
        options,
        lambda names: [group(one, table[one]) for one in names],
        n_validate=12,
        is_ordered=True,
    )


def unseen(name, coverage, unseen_coverage, unseen_rmsd):
    one = group(name, coverage, rmsd=0.01)
    return replace(one, unseen_coverage=unseen_coverage, unseen_rmsd=unseen_rmsd)


def winner(scores):
    """Search over two recordings with these results of the three groups."""
    options = GroupOptions(candidates=("a", "b"), keep={"best": True}, max_level=2)
    return search_groups(
        None,
        ("a", "b"),
        options,
        lambda names: [unseen(one, *scores["".join(one)]) for one in names],
        n_validate=5,
        is_ordered=False,
    ).chain[-1]


def test_the_winner_is_told_by_recordings_that_no_group_holds():
    # The group covers most, because it holds two; of the others it covers fewest.
    scores = {"a": (2, 1, 0.02), "b": (2, 2, 0.03), "ab": (3, 1, 0.01)}
    assert winner(scores) == "b"
    # Equally wide there: the lower RMSD, whatever the rest says.
    assert winner({**scores, "a": (2, 2, 0.02)}) == "a"
    # A group that covers nothing never wins.
    scores = {"a": (2, 0, 0.9), "b": (2, 0, 0.8), "ab": (0, 0, 0.001)}
    assert winner(scores) == "b"


def test_where_groups_may_hold_everything_the_widest_wins():
    none = (0, np.nan)
    scores = {"a": (2, *none), "b": (2, *none), "ab": (3, *none)}
    assert winner(scores) == "a+b"


def at_level(result, level):
    return [one for one in result.groups if one.level == level]


def names(groups):
    return {"-".join(one.recordings) for one in groups}


def test_iteration_1_gives_the_34_groups_of_iteration_2():
    result = replay(PUBLISHED)

    going_on = names(one for one in at_level(result, 2) if one.is_kept)
    assert len(going_on) == 34
    assert going_on == {base for base, _, _ in published_iteration(2)}


def test_iteration_2_gives_the_31_groups_of_iteration_3():
    result = replay(PUBLISHED)

    going_on = names(one for one in at_level(result, 3) if one.is_kept)
    assert len(going_on) == 31
    assert going_on == {base for base, _, _ in published_iteration(3)}


@pytest.mark.parametrize("iteration", [1, 2, 3])
def test_every_iteration_tries_exactly_the_published_groups(iteration):
    result = replay(PUBLISHED)

    tried = {
        (join.base.replace("+", "-"), join.add_on)
        for join in result.joins
        if join.level == iteration + 1
    }
    assert tried == {row[:2] for row in published_iteration(iteration)}


def test_iteration_3_stops_the_search_at_a_coverage_of_8():
    result = replay(PUBLISHED)

    assert max(one.level for one in result.groups) == 4
    best = {
        level: max(one.coverage for one in at_level(result, level))
        for level in (1, 2, 3, 4)
    }
    assert best == {1: 7, 2: 8, 3: 8, 4: 8}
    assert result.reason.startswith("the coverage stays at 8")


def test_the_number_of_widest_groups_alone_buys_the_level_after_the_second():
    result = replay(PUBLISHED)

    counts = Counter(one.level for one in result.groups if one.coverage == 8)
    assert counts == {2: 1, 3: 31, 4: 68}


def test_keeping_8_instead_of_7_is_another_search():
    mutated = GroupOptions(
        start=STARTS,
        candidates=TWELVE,
        keep={"coverage_at_least": (8, 8)},
        max_level=9,
    )
    table = published_coverage()
    result = search_groups(
        mutated.start,
        TWELVE,
        mutated,
        lambda tried: [group(one, table.get(one, 0)) for one in tried],
        n_validate=12,
        is_ordered=True,
    )

    assert names(one for one in at_level(result, 2) if one.is_kept) == {"7-9"}


@pytest.mark.parametrize(
    ("chain", "coverages"),
    [
        # T3.4.1-1 prints 6 for the single recording 6, T3.2.2.2-3 prints 7.
        (("6", "9", "1", "8"), (7, 7, 8, 8)),
        (("6", "8", "1", "12"), (7, 7, 8, 8)),
    ],
)
def test_the_published_chains_are_branches_of_the_search(chain, coverages):
    result = replay(PUBLISHED)
    by_name = {one.recordings: one for one in result.groups}

    found = [by_name[chain[: level + 1]] for level in range(4)]
    assert tuple(one.coverage for one in found) == coverages
    assert all(one.is_kept for one in found[:3])


def test_the_second_published_chain_grows_with_its_coverage():
    # T3.4.2-1 publishes the chain's own coverage only: the search may try other joins,
    # which cover nothing here, and must follow the chain to its end.
    with (REFERENCE / "model2_coverage.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = {tuple(row["group"].split("-")): row["coverage"] for row in rows}
    # 13 others as in T3.4.3-1; the cell of the first row is blank.
    scores = {names: int(value or 13) for names, value in table.items()}
    last = rows[-1]["group"].split("-")
    options = GroupOptions(start=("20",), keep={"best": True}, max_level=9)
    result = search_groups(
        ("20",),
        tuple(last),
        options,
        lambda tried: [group(one, scores.get(one, 0)) for one in tried],
        n_validate=38,
        is_ordered=True,
    )

    assert [name.replace("+", "-") for name in result.chain] == [
        row["group"] for row in rows
    ]


def test_the_winner_of_equally_wide_groups_has_the_lowest_validation_rmsd():
    rmsd = {("a",): 0.5, ("b",): 0.4, ("a", "b"): 0.3, ("b", "a"): 0.2}
    result = search_groups(
        ("a", "b"),
        ("a", "b"),
        GroupOptions(start=("a", "b"), keep={"best": True}),
        lambda tried: [group(one, 1, rmsd=rmsd[one]) for one in tried],
        n_validate=12,
        is_ordered=True,
    )

    assert result.chain == ("b", "b+a")


def test_without_order_permutations_are_one_group_with_two_joins():
    asked = []

    def score(tried):
        asked.extend(tried)
        return [group(one, len(one), rmsd=1.0) for one in tried]

    result = search_groups(
        ("b", "a"),
        ("a", "b", "c"),
        GroupOptions(start=("b", "a"), keep={"best": True}, max_level=2),
        score,
        n_validate=12,
        is_ordered=False,
    )

    assert asked == [("a",), ("b",), ("a", "b"), ("a", "c"), ("b", "c")]
    assert [(one.base, one.add_on) for one in result.joins if one.group == "a+b"] == [
        ("a", "b"),
        ("b", "a"),
    ]


def test_without_order_the_chain_goes_through_the_widest_base():
    coverage = {("a",): 1, ("b",): 2, ("a", "b"): 3}
    result = search_groups(
        ("a", "b"),
        ("a", "b"),
        GroupOptions(start=("a", "b"), keep={"best": True}, max_level=2),
        lambda tried: [group(one, coverage[one]) for one in tried],
        n_validate=12,
        is_ordered=False,
    )

    assert result.chain == ("b", "a+b")


def test_without_start_the_rule_chooses_among_single_recordings_too():
    coverage = {"a": 3, "b": 1, "c": 3}
    result = search_groups(
        None,
        ("a", "b", "c"),
        GroupOptions(keep={"best": True}, max_level=2),
        lambda tried: [group(one, coverage[one[0]] + len(one)) for one in tried],
        n_validate=12,
        is_ordered=True,
    )

    assert [one.name for one in result.groups if one.is_kept] == ["a", "c"]
    assert {one.base for one in result.joins if one.level == 2} == {"a", "c"}


LEVEL = [group("a", 5, rmsd=2.0), group("b", 7), group("c", 5, rmsd=1.0), group("d", 0)]


@pytest.mark.parametrize(
    ("keep", "expected"),
    [
        ({"top": 1}, "b"),
        ({"top": 2}, "bc"),
        ({"top": 3}, "abc"),
        # A group without a model that covers anything never goes on.
        ({"top": 9}, "abc"),
        ({"best": True}, "b"),
        ({"coverage_at_least": 5}, "abc"),
        ({"coverage_at_least": (7, 5)}, "b"),
        ({"coverage_at_least": 8}, ""),
    ],
)
def test_each_rule_keeps_what_it_says(keep, expected):
    flags = kept(LEVEL, keep, 0)

    found = [one.name for one, is_kept in zip(LEVEL, flags, strict=True) if is_kept]
    assert "".join(found) == expected


def test_the_last_number_of_a_list_holds_for_all_further_levels():
    keep = {"coverage_at_least": (9, 5)}

    assert [kept(LEVEL, keep, turn).count(True) for turn in (0, 1, 2, 7)] == [
        0,
        3,
        3,
        3,
    ]


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        ([(7, 5)], ""),
        ([(7, 5), (8, 1)], ""),
        ([(7, 5), (8, 1), (8, 31)], ""),
        ([(7, 5), (8, 1), (8, 31), (8, 68)], "the coverage stays at 8"),
        ([(7, 5), (8, 5), (8, 5)], "the coverage stays at 8"),
        ([(7, 5), (8, 5), (7, 9)], "the coverage falls from 8 to 7"),
        ([(7, 5), (7, 6), (8, 1), (8, 2)], ""),
        ([(7, 1), (7, 2)], ""),
        ([(7, 1), (7, 1)], "the coverage stays at 7"),
    ],
)
def test_the_search_goes_on_while_the_coverage_grows_or_once_more_groups_reach_it(
    levels, expected
):
    reason = reason_to_stop([Level(*one) for one in levels], max_level=9, n_validate=12)

    assert reason.startswith(expected)
    assert bool(reason) == bool(expected)


def test_the_largest_level_ends_the_search():
    reason = reason_to_stop([Level(1, 1), Level(2, 1)], max_level=2, n_validate=12)

    assert reason == "groups of 2 are the largest that group.max_level allows"


def test_a_search_ends_where_everything_is_covered():
    # More groups reach the maximum than before, but nothing is left to gain.
    reason = reason_to_stop([Level(11, 1), Level(12, 3)], max_level=9, n_validate=12)

    assert reason == "all 12 validation recordings are covered"
