import csv
from dataclasses import replace

import h5py
import numpy as np
import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.groups import FinalTest, Prediction
from hwid_cli.store.final_test_results import (
    read_final_test,
    write_assignment_csv,
    write_coverage_matrix_csv,
    write_final_test,
    write_test_csv,
)
from hwid_cli.store.result_files import Provenance, read_stage_key
from tests.store.record_examples import assert_same, plant

MODELS = ("a/1/2", "b/1/1", "a+b/2/2")
THIRD = 1 / 3
NAN = float("nan")


def final_test(**changes):
    told = [
        Prediction("a", "b", 0.1, "b/1/1", 0.7, "b/1/1", 0.7, False, False),
        Prediction("b", "a", 0.1, "", NAN, "", NAN, False, False),
        Prediction("µ", "a", THIRD, "a+b/2/2", 0.2, "b/1/1", THIRD, True, True),
    ]
    final = FinalTest(
        models=MODELS,
        chain=MODELS[2:],
        recordings=("a", "b", "µ"),
        tested_on=("µ",),
        rmsd=np.array([[0.1, 0.6, 0.7], [0.7, 0.2, THIRD], [0.3, 0.4, NAN]]),
        is_own=np.array([[1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=bool),
        covers=np.array([0, 1, 0]),
        covered_by=np.array([0, 0, 1]),
        uncovered=(),
        hard_to_cover=("a", "b"),
        assigned=("a/1/2", "b/1/1", "b/1/1"),
        smallest_set=MODELS[1:],
        assigned_in_set=("a+b/2/2", "b/1/1", "b/1/1"),
        predictions=tuple(told),
        unit="mm",
        threshold=0.5,
    )
    return replace(final, **changes)


EMPTY = {
    "chain": (),
    "tested_on": (),
    "smallest_set": (),
    "assigned_in_set": ("", "", ""),
    "predictions": tuple(
        Prediction(name, "", NAN, "", NAN, "", NAN, False, False)
        for name in ("a", "b", "µ")
    ),
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "results.h5"


@pytest.mark.parametrize("changes", [{}, EMPTY], ids=["full", "empty"])
def test_a_final_test_comes_back_bit_by_bit(path, changes):
    write_final_test(path, final_test(**changes), Provenance("k1"))

    assert_same(read_final_test(path), final_test(**changes))
    assert read_stage_key(path, "test") == "k1"


def test_the_tables_carry_their_axes_and_unit(path):
    write_final_test(path, final_test(), Provenance("k1"))

    with h5py.File(path) as file:
        rmsd = file["test/rmsd"]
        assert (rmsd.dtype, rmsd.shape) == (np.float64, (3, 3))
        assert [axis.label for axis in rmsd.dims] == ["models", "recordings"]
        assert rmsd.dims[0]["models"].asstr()[2] == "a+b/2/2"
        assert rmsd.dims[1][0].asstr()[2] == "µ"
        assert rmsd.attrs["unit"] == "mm"
        assert file["test/is_own"].dims[0].label == "models"
        assert file["test/predictions/is_right"][:].tolist() == [False, False, True]


def test_a_missing_stage_names_the_command_that_makes_it(path):
    with pytest.raises(CacheError, match="expected the results of test; run 'hwid tes"):
        read_final_test(path)


def test_a_damaged_stage_is_one_clear_line(path):
    write_final_test(path, final_test(), Provenance("k1"))
    with h5py.File(path, "r+") as file:
        del file["test/predictions/rmsd"]

    with pytest.raises(CacheError, match=r"cannot be read \(.*run 'hwid test' again"):
        read_final_test(path)


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


PLANTED = {
    "smallest_set": ("b/1/1", "nobody"),
    "assigned": ("a/1/2", "b/1/1", "nobody"),
    "assigned_in_set": ("a+b/2/2", "b/1/1", "a/1/2"),
    "chain": ("nobody",),
    "tested_on": ("nobody",),
    "uncovered": ("nobody",),
    "hard_to_cover": ("nobody",),
    "predictions/recording": ("a", "b", "nobody"),
}


@pytest.mark.parametrize("place", PLANTED)
def test_a_name_that_nobody_has_is_one_clear_line(path, place):
    write_final_test(path, final_test(), Provenance("k1"))
    plant(path, f"test/{place}", list(PLANTED[place]))

    unknown = "a/1/2" if place == "assigned_in_set" else "nobody"
    with pytest.raises(
        CacheError, match=rf"{place}: '{unknown}' is none of .* run 'hwid test' again"
    ):
        read_final_test(path)


@pytest.mark.parametrize(
    ("place", "values", "says"),
    [
        ("assigned", ["a/1/2"], "assigned must be 3 names, got 1"),
        ("covers", [0, 1], r"covers \(2,\) and covered_by \(3,\) must have shapes"),
        ("covers", ["0", "1", "0"], "covers must be integers, got '"),
        ("is_own", np.ones((3, 3)), "is_own must be truth values, got 'float64'"),
        ("rmsd", -np.ones((3, 3)), "rmsd must be numbers >= 0, got -1.0"),
    ],
)
def test_a_planted_table_is_one_clear_line(path, place, values, says):
    write_final_test(path, final_test(), Provenance("k1"))
    plant(path, f"test/{place}", values)

    with pytest.raises(CacheError, match=f"{says}.* run 'hwid test' again"):
        read_final_test(path)


def test_the_long_table_has_a_row_for_each_model_and_recording(tmp_path):
    write_test_csv(tmp_path / "test.csv", final_test())
    header, *rows = rows_of(tmp_path / "test.csv")

    assert header == ["model", "level", "recording", "is_test", "rmsd", "covered"]
    assert len(rows) == 9
    assert rows[0] == ["a/1/2", "1", "a", "0", "0.1", "1"]
    assert rows[5] == ["b/1/1", "1", "µ", "1", repr(THIRD), "1"]
    assert rows[8] == ["a+b/2/2", "2", "µ", "1", "nan", "0"]


def test_the_assignment_has_a_row_for_each_recording(tmp_path):
    write_assignment_csv(tmp_path / "assignment.csv", final_test())
    header, *rows = rows_of(tmp_path / "assignment.csv")

    assert header[:2] == ["recording", "model"]
    assert [dict(zip(header, row, strict=True)) for row in rows[:2]] == [
        {
            "recording": "a",
            "model": "a/1/2",
            "rmsd": "0.1",
            "covered": "1",
            "model_of_set": "a+b/2/2",
            "rmsd_of_set": "0.3",
            "nearest": "b",
            "distance": "0.1",
            "predicted_model": "b/1/1",
            "predicted_rmsd": "0.7",
            "is_right": "0",
        },
        {
            "recording": "b",
            "model": "b/1/1",
            "rmsd": "0.2",
            "covered": "1",
            "model_of_set": "b/1/1",
            "rmsd_of_set": "0.2",
            "nearest": "a",
            "distance": "0.1",
            "predicted_model": "",
            "predicted_rmsd": "nan",
            "is_right": "0",
        },
    ]
    assert rows[2][-1] == "1"


def test_an_empty_set_leaves_its_columns_blank(tmp_path):
    changes = {**EMPTY, "predictions": final_test().predictions}
    write_assignment_csv(tmp_path / "assignment.csv", final_test(**changes))
    _, first, *_ = rows_of(tmp_path / "assignment.csv")

    assert first[4:6] == ["", "nan"]


def test_the_matrix_has_the_form_of_the_published_one(tmp_path):
    write_coverage_matrix_csv(tmp_path / "matrix.csv", final_test())

    assert rows_of(tmp_path / "matrix.csv") == [
        ["model", "a", "b", "µ", "covers"],
        ["a/1/2", "", "0", "0", "0"],
        ["b/1/1", "0", "", "1", "1"],
        ["a+b/2/2", "", "", "0", "0"],
        ["covered_by", "0", "0", "1", ""],
    ]
