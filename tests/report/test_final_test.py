import re
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.groups import ChainTrend, SingleModels
from hwid_cli.report.final_test import (
    chain_coverage_table,
    chain_on_tests_table,
    chain_tables,
    coverage_matrix_table,
    gap_sentences,
    joining_clause,
    trend_sentence,
)
from hwid_cli.report.formats import as_sentence
from hwid_cli.report.table import as_text
from hwid_cli.stages.test import chain_trend
from tests.stages.final_test_examples import KINDS, example_final_test

FINAL = example_final_test()
TREND = chain_trend(FINAL, KINDS)
# A chain's last name alone takes 35 characters.
WINNER = "step_06+step_09+step_01+step_08/7/7"


def widest_line(text):
    return max(map(len, text.splitlines()))


def test_the_chain_on_the_tests_shows_each_rmsd_and_the_mean():
    table = chain_on_tests_table(FINAL, TREND)
    text = as_text([table], thesis_names=True)
    last = next(line for line in text.splitlines() if line.startswith(WINNER))

    values = FINAL.rmsd[-1][[FINAL.recordings.index(n) for n in FINAL.tested_on]]
    shown = last.replace("*", "").split()
    assert shown == [WINNER, *(f"{v:.2e}" for v in [*values, np.mean(values)])]
    joined = joining_clause(TREND.tested_rmsd[-1], TREND.singles, FINAL.unit)
    said = " ".join([trend_sentence(TREND), as_sentence(joined)])
    assert " ".join(text.split()).endswith(" ".join(said.split()))
    alone = next(line for line in text.splitlines() if line.startswith("step_11/4/7"))
    assert alone.split()[-1] == f"{TREND.singles.chosen_rmsd:.2e}"
    assert "form of T3.3.3.4-1" in text
    assert widest_line(text) <= 80


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((0.3, 0.2, 0.1), "falls at every level."),
        # The published chain: steps 5, 10 and 11.
        ((0.0879, 0.0525, 0.0549, 0.0338), "falls, but not at every level."),
        ((0.1, 0.05, 0.1), "does not fall."),
        ((0.1, 0.2), "does not fall."),
        ((0.1, float("nan")), "is not known at every level."),
        ((0.1,), "so there is no trend."),
    ],
)
def test_the_trend_is_told_in_words(values, expected):
    names = tuple(map(str, range(len(values))))
    trend = ChainTrend(names, values, ("step",), np.zeros((len(values), 1), dtype=int))

    assert trend_sentence(trend).endswith(expected)


def test_the_chain_covers_kind_by_kind():
    table = chain_coverage_table(FINAL, TREND, {WINNER: "W"})
    steps, sines = TREND.coverage[-1]
    counts = [WINNER, str(steps), str(sines), str(steps + sines)]

    lines = as_text([table]).splitlines()
    assert lines[1].split() == ["model", "step", "sine", "all"]
    assert lines[-1].split() == counts
    asked = as_text([table], thesis_names=True)
    assert asked.splitlines()[-1].split() == [*counts, "W"]
    assert asked.splitlines()[-2].split()[-1] == "-"
    assert widest_line(asked) <= 80


def test_the_chain_is_shown_on_every_recording_once():
    tables = chain_tables(FINAL, TREND, KINDS)
    text = as_text(tables, thesis_names=True)

    for name in FINAL.recordings:
        assert text.count(f" {name}") == 1
    for value in FINAL.rmsd[-4:].ravel():
        mark = "*" if value < FINAL.threshold else " "
        assert f"{value:.2e}{mark}" in text
    assert "kind step" in text
    assert "(form of T3.4.1-3)" in " ".join(text.split())


def matrix_text(final, width=80):
    return as_text([coverage_matrix_table(final)], width=width)


def matrix_lines(final):
    """Lines of the matrix beneath its caption."""
    lines = matrix_text(final).splitlines()
    return lines[next(n for n, line in enumerate(lines) if line.startswith(" ")) :]


def matrix_rows(text):
    """Cells of each row, blocks joined, by the row's label; spaces taken out."""
    rows = {}
    for block in text.split("\n\n"):
        for line in block.splitlines():
            found = re.fullmatch(r"(\S+/\d+/\d+) {2}(.*?) +(\d+)", line)
            if found:
                cells, covers = rows.get(found[1], ("", ""))
                assert covers in ("", found[3])
                rows[found[1]] = (cells + found[2].replace(" ", ""), found[3])
    return rows


@pytest.mark.parametrize("width", [80, 40])
def test_the_matrix_holds_every_pair_and_fits_the_screen(width):
    text = matrix_text(FINAL, width)
    rows = matrix_rows(text)

    assert widest_line(text) <= width
    labels = list(rows)
    assert labels[0] == FINAL.models[0]
    # The chain's first model has its own name; those above it are what they add.
    assert labels[-4:] == [
        "step_06/4/7",
        "+step_09/5/7",
        "+step_01/6/7",
        "+step_08/7/7",
    ]
    for number, (cells, covers) in enumerate(rows.values()):
        covered = FINAL.rmsd[number] < FINAL.threshold
        others = ~FINAL.is_own[number]
        assert cells == "".join("1" if it else "." for it in covered[others])
        assert covers == str(FINAL.covers[number])


def test_recordings_names_run_downwards_over_their_column():
    lines = matrix_lines(FINAL)
    heads = [line.ljust(80) for line in lines[:7]]
    row = next(line for line in lines if line.startswith("sine_23"))
    # The only blank cell of this row that is no gap is its own, the last one.
    column = max(
        place
        for place in range(80)
        if "".join(line[place] for line in heads) == "sine_23"
    )

    assert row.ljust(80)[column] == " "
    assert row[column - 1] in "1."


def test_counts_above_nine_run_downwards_too():
    counts = np.full(38, 12)
    tens, units = matrix_text(replace(FINAL, covered_by=counts)).splitlines()[-2:]

    assert tens.split(maxsplit=2)[2].replace(" ", "") == "1" * 38
    assert units.replace(" ", "") == "2" * 38


def test_long_names_are_never_cut():
    names = tuple(f"idf_neg_0.045_{n}" for n in range(38))
    final = replace(FINAL, recordings=names)
    lines = matrix_lines(final)
    height = max(map(len, names))
    columns = {"".join(letters).strip() for letters in zip(
        *(line.ljust(80) for line in lines[:height]), strict=True
    )}  # fmt: skip

    assert set(names) <= {name.removeprefix("model") for name in columns}


def test_a_model_of_another_family_keeps_its_whole_name():
    # Joined in another order than the level before: nothing to shorten.
    names = (*FINAL.models[:-1], "step_09+step_06+step_01+step_08/7/7")
    final = replace(FINAL, models=names, chain=names[-4:])

    assert names[-1] in matrix_text(final)


def test_gaps_are_named_and_counted():
    hard = ("step_05", "step_01", "sine_02")
    final = replace(FINAL, uncovered=("step_05",), hard_to_cover=hard)

    assert [one.text for one in gap_sentences(final)] == [
        "No model covers 1 of 38 recordings, not even their own: step_05.",
        "Fewer than a tenth of the other models cover 2 of 38 recordings: step_01, "
        "sine_02.",
    ]
    nothing = gap_sentences(replace(FINAL, uncovered=FINAL.recordings))
    assert nothing[0].text == "No model covers any recording, not even its own."
    everything = gap_sentences(replace(FINAL, uncovered=(), hard_to_cover=()))
    assert [one.text for one in everything] == [
        "Every recording is covered by some model."
    ]


def test_long_names_of_groups_stand_beneath_the_table_once():
    longer = {
        name: name.replace("step_", "idf_neg_0.045_step_") for name in FINAL.chain
    }
    final = replace(
        FINAL,
        models=tuple(longer.get(name, name) for name in FINAL.models),
        chain=tuple(longer.values()),
    )
    trend = chain_trend(final, KINDS)
    table = chain_on_tests_table(final, trend)
    lines = as_text([table]).splitlines()

    assert f"C1: {final.chain[0]}" in lines
    assert sum(final.chain[-1] in line for line in lines) == 1
    # All test recordings stand in one block.
    assert sum(line.startswith("model") for line in lines) == 1
    tables = chain_tables(final, trend, KINDS)
    assert "\nC1 " in as_text(tables)
    # A page has room for the names themselves.
    assert tables[0].rows[0][0].text == final.chain[0]


def test_joining_is_said_to_help_only_where_it_does():
    singles = SingleModels(FINAL.models[0], 0.2, FINAL.models[0], 0.2)
    tested = (*TREND.tested_rmsd[:-1], 0.1)
    group = replace(TREND, tested_rmsd=tested, singles=singles)
    assert "+" in group.models[-1]

    def said(trend):
        return " ".join(chain_on_tests_table(FINAL, trend).notes)

    assert f"Joining recordings helps here: {FINAL.models[0]}, " in said(group)
    assert "Joining recordings does not help here: " in said(
        replace(group, singles=replace(singles, chosen_rmsd=0.05))
    )
    alone = replace(group, models=(*TREND.models[:-1], "step_06/3/7"))
    assert "Joining" not in said(alone)
    assert "Joining" not in said(replace(group, singles=None))
    unknown = replace(singles, chosen_rmsd=float("nan"))
    assert joining_clause(0.1, unknown, "m") == ""
