import csv
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.groups import Group, GroupSearch, Join
from hwid_cli.store.group_results import read_group, write_group, write_groups_csv
from hwid_cli.store.result_files import Provenance, read_stage_key
from tests.store.record_examples import assert_same, example_fit, plant

PROVENANCE = Provenance(key="k1")
NAN = float("nan")


def search():
    """Two single recordings and the group of both, which no model passes."""
    return GroupSearch(
        groups=(
            Group(("a",), 2, 1, 3, 1e-3, 2e-3, 4, 3, 2, True),
            Group(("b 1",), 1, 2, 2, 2e-3, 4e-3, 4, 4, 4, False),
            Group(("a", "b 1"), 0, 0, 0, NAN, NAN, 4, 0, 0, False),
        ),
        joins=(
            Join(1, "a", "", "a"),
            Join(1, "b 1", "", "b 1"),
            Join(2, "a", "b 1", "a+b 1"),
        ),
        fits=(example_fit(), example_fit(), None),
        validated_on=("a", "b 1"),
        rmsd=np.array([[1e-3, 2e-3], [0.5, 1e-3], [NAN, NAN]]),
        chain=("a",),
        reason="the coverage falls from 2 to 0",
        join="experiments",
        unit="mm",
        threshold=0.01,
    )


@pytest.fixture
def path(tmp_path):
    return tmp_path / "out" / "results.h5"


def test_a_search_comes_back_bit_by_bit(path):
    write_group(path, search(), PROVENANCE)

    assert_same(read_group(path), search())
    assert read_stage_key(path, "group") == "k1"


def test_a_search_without_a_winner_comes_back_too(path):
    nothing = replace(search(), chain=(), fits=(None, None, None))
    write_group(path, nothing, PROVENANCE)

    assert_same(read_group(path), nothing)


def test_a_missing_stage_names_the_command_that_makes_it(path):
    with pytest.raises(CacheError, match="run 'hwid group'"):
        read_group(path)


@pytest.mark.parametrize(
    ("place", "values"),
    [
        ("chain", ["nobody"]),
        ("joins/group", ["a", "b 1", "nobody"]),
        ("joins/base", ["a", "b 1", "nobody"]),
    ],
)
def test_a_name_that_no_group_has_is_one_clear_line(path, place, values):
    write_group(path, search(), Provenance("k1"))
    plant(path, f"group/{place}", values)

    with pytest.raises(
        CacheError, match=rf"{place}: 'nobody' is none of .* run 'hwid group' again"
    ):
        read_group(path)


def test_a_negative_distance_is_one_clear_line(path):
    write_group(path, search(), Provenance("k1"))
    plant(path, "group/rmsd", -np.ones(search().rmsd.shape))

    with pytest.raises(CacheError, match=r"rmsd must be numbers >= 0, got -1\.0"):
        read_group(path)


def test_the_table_has_a_row_for_every_join(path):
    target = path.parent / "groups.csv"
    write_groups_csv(target, search())
    with target.open(newline="") as file:
        rows = list(csv.DictReader(file))

    first = ("level", "base", "add_on", "coverage", "nb", "nk", "kept")
    assert tuple(rows[0])[:7] == first
    assert [tuple(row[name] for name in first) for row in rows] == [
        ("1", "a", "", "2", "1", "3", "1"),
        ("1", "b 1", "", "1", "2", "2", "0"),
        ("2", "a", "b 1", "0", "", "", "0"),
    ]
    assert rows[2]["group"] == "a+b 1"
    assert (rows[0]["models"], rows[0]["self_passed"], rows[0]["cross_passed"]) == (
        "4",
        "3",
        "2",
    )
