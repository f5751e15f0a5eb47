import csv

import numpy as np
import pytest

from hwid_cli.files.csv_tables import (
    write_coverage_csv,
    write_crossval_csv,
    write_table_csv,
)
from hwid_cli.records.model import Orders
from hwid_cli.records.results import CrossValidation, ModelScore


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def test_crossval_table_has_a_row_for_each_model_and_judge(tmp_path):
    rmsd = np.array([[[[0.1, 1 / 3]], [[np.nan, 2.0]]]])
    status = np.where(np.isnan(rmsd), "no model", "ok")
    crossval = CrossValidation(
        ("a,b",), (1, 2), (4,), "poles", ("x", "y"), rmsd, status, "m", 0.01
    )
    write_crossval_csv(tmp_path / "crossval.csv", crossval)
    header, *rows = rows_of(tmp_path / "crossval.csv")
    assert header == ["identified_on", "nb", "nk", "validated_on", "rmsd", "status"]
    assert rows == [
        ["a,b", "1", "4", "x", "0.1", "ok"],
        ["a,b", "1", "4", "y", repr(1 / 3), "ok"],
        ["a,b", "2", "4", "x", "nan", "no model"],
        ["a,b", "2", "4", "y", "2.0", "ok"],
    ]


def test_coverage_table_keeps_the_order_of_the_scores(tmp_path):
    scores = [
        ModelScore("b", 2, 3, 0.1, 9, Orders(2, 3, 1)),
        ModelScore("a", 1, 1, 0.2, 4, Orders(1, 1, 1)),
    ]
    write_coverage_csv(tmp_path / "coverage.csv", scores, of=15)
    assert rows_of(tmp_path / "coverage.csv") == [
        ["identified_on", "nb", "nk", "coverage", "of"],
        ["b", "2", "3", "9", "15"],
        ["a", "1", "1", "4", "15"],
    ]


@pytest.mark.parametrize("cell", ["a;b", "a,b", 'say "so"', "two\nlines", "µ"])
def test_every_text_comes_back(tmp_path, cell):
    write_table_csv(tmp_path / "t.csv", ["x", "y"], [[cell, None]])
    assert rows_of(tmp_path / "t.csv") == [["x", "y"], [cell, ""]]


def test_lines_end_as_on_unix_and_without_byte_order_mark(tmp_path):
    write_table_csv(tmp_path / "t.csv", ["x"], [[1.0]])
    assert (tmp_path / "t.csv").read_bytes() == b"x\n1.0\n"
