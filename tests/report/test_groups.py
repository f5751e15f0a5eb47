import numpy as np

from hwid_cli.records.groups import Group, GroupSearch, Join
from hwid_cli.report.groups import chain_table, join_table, levels_table
from hwid_cli.report.table import as_text

NAN = float("nan")
RULE = "estimated"


def group(names, coverage, *, is_kept, passed=(2, 2)):
    place = (3, 7) if coverage else (0, 0)
    rmsd = (1e-3, 2e-2) if coverage else (NAN, NAN)
    return Group(tuple(names.split("+")), coverage, *place, *rmsd, 4, *passed, is_kept)


def search(**changes):
    values = {
        "groups": (
            group("s1", 1, is_kept=False),
            group("s2", 2, is_kept=True),
            group("s3", 2, is_kept=True),
            group("s2+s1", 0, is_kept=False, passed=(1, 0)),
            group("s2+s3", 3, is_kept=False),
            group("s3+s1", 2, is_kept=False),
            group("s3+s2", 3, is_kept=False, passed=(4, 3)),
        ),
        "joins": (
            *(Join(1, name, "", name) for name in ("s1", "s2", "s3")),
            Join(2, "s2", "s1", "s2+s1"),
            Join(2, "s2", "s3", "s2+s3"),
            Join(2, "s3", "s1", "s3+s1"),
            Join(2, "s3", "s2", "s3+s2"),
        ),
        "fits": (None,) * 7,
        "validated_on": ("s1", "s2", "s3"),
        "rmsd": np.full((7, 3), NAN),
        "chain": ("s2", "s2+s3"),
        "reason": "groups of 2 are the largest that group.max_level allows",
        "join": "concatenate",
        "unit": "m",
        "threshold": 0.01,
    }
    return GroupSearch(**(values | changes))


def cells(line):
    return line.split()


def test_a_level_is_shown_base_by_add_on():
    lines = as_text(
        [join_table(search(), 2)], initial_state=RULE, thesis_names=True
    ).splitlines()

    assert "of 3" in lines[0]
    assert "T3.3.3.1-2" in lines[1]
    assert cells(lines[3]) == ["base", "s1", "s2", "s3", "widest"]
    assert cells(lines[5]) == ["s2", "0", "-", "3", "3"]
    assert cells(lines[6]) == ["s3", "2", "3", "-", "3"]


def test_a_wide_level_is_shown_in_blocks():
    lines = as_text(
        [join_table(search(), 2)], initial_state=RULE, width=22
    ).splitlines()

    assert [cells(line) for line in lines if line.startswith("base")] == [
        ["base", "s1", "s2", "widest"],
        ["base", "s3", "widest"],
    ]


def test_an_asterisk_marks_what_goes_on():
    kept = search()
    groups = (*kept.groups[:-1], group("s3+s2", 3, is_kept=True))
    text = as_text([join_table(search(groups=groups), 2)])

    assert text.count("3*") == 1


def test_each_level_counts_what_was_fitted_filtered_and_kept():
    lines = as_text(
        [levels_table(search())], initial_state=RULE, thesis_names=True
    ).splitlines()

    assert cells(lines[-2]) == [
        *("1", "3", "3", "12", "6", "0", "2", "of", "3", "2", "2"),
    ]
    # 16 models: 2 + 1 + 2 + 2 + 4 pass on their own recordings, all but two on another.
    assert cells(lines[-1]) == [
        *("2", "4", "4", "16", "7", "2", "3", "of", "3", "2", "0"),
    ]


def test_the_chain_is_shown_with_the_reason_to_stop():
    text = as_text([chain_table(search())], width=200)

    assert "s2/3/7" in text
    assert "s2+s3/3/7" in text
    assert "3 of 3" in text
    assert text.endswith(
        "The search stopped: groups of 2 are the largest that group.max_level allows."
    )


def test_a_search_that_found_nothing_says_so():
    found = chain_table(search(chain=(), reason="no group passes group.keep"))

    assert found.text == "No group covers anything: no group passes group.keep."
