import logging

import numpy as np
import pytest

from hwid_cli.data.columns import FileColumns, MeasuredColumn, array_column
from hwid_cli.data.formats import read_columns
from hwid_cli.data.missing_samples import bridge_missing, missing
from hwid_cli.records.experiment import Columns


def columns(output, texts=None):
    rows = np.arange(output.size)
    return FileColumns(
        array_column("input 'u'", np.sin(rows)),
        MeasuredColumn("output 'y'", output, rows, texts=texts or {}),
    )


def line(size, *lost):
    values = np.arange(float(size))
    values[list(lost)] = np.nan
    return values


def test_single_samples_are_bridged_and_said(caplog):
    with caplog.at_level(logging.WARNING):
        found, places = bridge_missing("run.csv", columns(line(400, 7, 90)))

    np.testing.assert_array_equal(found.output.values, np.arange(400.0))
    assert places == {"output": (7, 90)}
    assert "run.csv, row 7" in caplog.text
    assert "output 'y' has no number (and 1 more); a straight line" in caplog.text


@pytest.mark.parametrize(
    "lost",
    [tuple(range(7, 18)), (0,), (1999,), tuple(range(10, 1900, 50))],
    ids=["eleven together", "the first", "the last", "more than 1 %"],
)
def test_more_than_a_few_samples_are_left_as_they_are(lost):
    found, places = bridge_missing("run.csv", columns(line(2000, *lost)))

    assert places == {}
    assert np.isnan(found.output.values).sum() == len(lost)


def test_text_that_means_something_else_is_not_bridged():
    for text, is_lost in (("", True), ("n/a", True), ("NaN", True), ("off", False)):
        found = columns(line(400, 7), {7: text})
        assert missing(found.output)[7] == is_lost
        assert bool(bridge_missing("run.csv", found)[1]) == is_lost


def test_a_file_says_where_samples_are_missing(tmp_path):
    rows = [f"{k},{k},{k * k}" for k in range(50)]
    rows[20] = "20,#N/A,400"
    (tmp_path / "run.csv").write_text("\n".join(["t,u,y", *rows]))
    found = read_columns(tmp_path / "run.csv", Columns(time="t", input="u", output="y"))
    bridged, places = bridge_missing(tmp_path / "run.csv", found)

    assert places == {"input": (20,)}
    assert bridged.input.values[20] == 20.0


def test_ten_in_a_row_are_bridged_by_one_line():
    found, places = bridge_missing("run.csv", columns(line(2000, *range(7, 17))))

    assert places == {"output": tuple(range(7, 17))}
    np.testing.assert_allclose(found.output.values, np.arange(2000.0))


def test_only_one_sample_out_of_range_is_bridged():
    """A line over several would cut the top of a motion off."""
    one = columns(line(2000, 7), {7: "OVERFLOW"})
    two = columns(line(2000, 7, 8), {7: "", 8: "-∞"})

    assert bridge_missing("run.csv", one)[1] == {"output": (7,)}
    assert bridge_missing("run.csv", two)[1] == {}


@pytest.mark.parametrize(
    ("usual", "code", "is_none"),
    [
        *((2800.0, -9999.0, True), (2800.0, 9999.0, True), (6000.0, -9999.0, False)),
        # catman's word for overflow, and a logger's for a wire that is broken.
        *((120.0, 1e6, True), (7e5, 1e6, False), (22.0, 7.77777e99, True)),
        # All others are as large: a unit that nobody expects.
        (5e37, 9.9e37, False),
    ],
)
def test_a_number_far_from_all_others_is_a_loggers_word_for_none(usual, code, is_none):
    output = usual * np.sin(np.arange(500) / 40.0)
    output[[120, 300]] = code
    found, places = bridge_missing("run.csv", columns(output))
    assert places == ({"output": (120, 300)} if is_none else {})
    assert (float(np.abs(found.output.values).max()) < 1.01 * usual) is is_none
