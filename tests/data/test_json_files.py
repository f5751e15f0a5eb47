"""Files of JSON in the ways in which devices and scripts write them."""

import json

import numpy as np
import pytest

from hwid_cli.data.formats import list_columns, read_columns
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns

N = 60
T, U = 0.02 * np.arange(N), np.round(np.sin(np.arange(N)), 6)
Y = np.round(np.cos(np.arange(N) / 3), 6)
WANTED = Columns(time="ts", input="drive.i", output="p")


def records():
    rows = zip(T.tolist(), U.tolist(), Y.tolist(), strict=True)
    return [{"ts": t, "drive": {"i": u, "state": "ok"}, "p": y} for t, u, y in rows]


def lines(path):
    """A record in each line, below one that says what they are."""
    about = {
        "type": "meta",
        "units": {"drive.i": "mA", "p": "bar", "ts": "s", "z": "m"},
    }
    path.write_text("\n".join(json.dumps(one) for one in (about, *records())) + "\n")


def one_list(path):
    path.write_text(json.dumps(records(), indent=1))


def inside(path):
    path.write_text(json.dumps({"run": 7, "units": {"p": "bar"}, "samples": records()}))


def by_name(path):
    lists = {"ts": T.tolist(), "drive": {"i": U.tolist()}, "p": Y.tolist(), "name": "x"}
    path.write_text(json.dumps({**lists, "units": {"p": "bar"}}))


@pytest.mark.parametrize("write", [lines, one_list, inside, by_name])
def test_numbers_are_the_writers(tmp_path, write):
    path = tmp_path / "run.jsonl"
    write(path)
    read = read_columns(path, WANTED)

    np.testing.assert_array_equal(read.time.values, T)
    np.testing.assert_array_equal(read.input.values, U)
    np.testing.assert_array_equal(read.output.values, Y)
    assert read.output.unit == ("" if write is one_list else "bar")
    assert {one.title for one in list_columns(path)} == {"ts", "drive.i", "p"}


def test_times_may_be_stamps_and_a_number_may_be_missing(tmp_path):
    path = tmp_path / "run.ndjson"
    rows = records()
    for number, row in enumerate(rows):
        row["ts"] = f"2024-05-01T07:59:{number // 50:02d}.{number % 50 * 20:03d}Z"
    rows[7]["p"] = None
    del rows[9]["drive"]
    path.write_text("\n".join(map(json.dumps, rows)))
    read = read_columns(path, WANTED)

    np.testing.assert_allclose(np.diff(read.time.values), 0.02, atol=1e-9)
    assert np.flatnonzero(np.isnan(read.output.values)).tolist() == [7]
    assert np.flatnonzero(np.isnan(read.input.values)).tolist() == [9]


@pytest.mark.parametrize("text", ["{", '{"ts": 1}\n{"ts": ', "[1, 2", "5"])
def test_what_is_no_table_is_said_in_a_line(tmp_path, text):
    path = tmp_path / "run.json"
    path.write_text(text)
    with pytest.raises(MeasurementError, match=r"run\.json: "):
        read_columns(path, WANTED)
