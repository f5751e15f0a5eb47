"""Long tables: what becomes of signals whose stamps differ, and of names that are not there."""

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from hwid_cli.data.csv_files import list_csv_columns, read_csv_columns
from hwid_cli.data.formats import list_columns, read_columns, tables_of
from hwid_cli.errors import MissingColumnError
from hwid_cli.records.experiment import Columns


def written(path, signals, runs=("a",)):
    """A row for each number: one signal below the other."""
    lines = ["time;channel;value;run"]
    for run in runs:
        for name, (times, values) in signals.items():
            rows = zip(times, values, strict=True)
            lines += [f"{float(t)!r};{name};{float(v)!r};{run}" for t, v in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


T = 0.01 * np.arange(100)
U, Y = np.sin(T), 10.0 + np.cos(T)


def test_a_number_that_a_signal_lacks_is_missing_in_its_row(tmp_path):
    keep = np.arange(100) != 40
    path = written(tmp_path / "a.csv", {"u": (T, U), "y": (T[keep], Y[keep])})
    read = dict(read_csv_columns(path, Columns(input="u", output="y", time="time")))

    np.testing.assert_array_equal(read["time"].values, T)
    np.testing.assert_array_equal(read["input"].values, U)
    assert np.flatnonzero(np.isnan(read["output"].values)).tolist() == [40]


def test_signals_with_stamps_of_their_own_keep_them(tmp_path):
    late = T + 0.0037
    path = written(tmp_path / "a.csv", {"u": (T, U), "y": (late, Y)})
    found = {one.key: one.values for one in list_csv_columns(path)}
    wanted = Columns(input="u", output="y", time="time", output_time="time of y")
    read = dict(read_csv_columns(path, wanted))

    assert list(found) == ["time", "u", "time of y", "y"]
    np.testing.assert_allclose(read["output_time"].values, late)
    np.testing.assert_array_equal(read["output"].values, Y)


def test_a_column_of_words_tells_recordings_apart(tmp_path):
    path = written(tmp_path / "a.csv", {"u": (T, U), "y": (T, Y)}, runs=("a", "b"))
    tables = {one.variable for one in list_csv_columns(path)}

    assert tables == {"a", "b"}
    with pytest.raises(MissingColumnError, match=r"holds 2 recordings.*variable"):
        read_csv_columns(path, Columns(input="u", output="y", variable="c"))


def test_a_signal_that_is_not_there_is_named(tmp_path):
    path = written(tmp_path / "a.csv", {"u_cmd": (T, U), "y": (T, Y)})
    with pytest.raises(MissingColumnError, match=r"no signal 'u_cnd'.*did you mean"):
        read_csv_columns(path, Columns(input="u_cnd", output="y"))


def test_a_table_whose_head_names_what_is_asked_for_is_no_long_one(tmp_path):
    lines = [f"{t},{u},{y},run" for t, u, y in zip(T, U, Y, strict=True)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time,u,value,name", *lines]) + "\n")
    read = dict(read_csv_columns(path, Columns(input="u", output="value", time="time")))

    np.testing.assert_allclose(read["output"].values, Y)


def test_a_unit_of_the_clock_is_not_that_of_a_signal_whose_name_begins_alike(tmp_path):
    """A clock t beside a torque, each signal with stamps of its own."""
    lines = ["t [ms];channel;value"]
    for shift, name, values in ((0.0, "torque [N m]", U), (0.3, "theta [deg]", Y)):
        lines += [
            f"{1e3 * k + shift};{name};{v!r}" for k, v in enumerate(values.tolist())
        ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    clock = "t [ms] of theta [deg]"
    wanted = Columns(
        input="torque [N m]", output="theta [deg]", time="t [ms]", output_time=clock
    )
    read = {role: one.unit for role, one in read_csv_columns(path, wanted)}

    assert {one.key: one.unit for one in list_csv_columns(path)} == {
        "t [ms]": "ms", "torque [N m]": "", clock: "ms", "theta [deg]": "",
    }  # fmt: skip
    assert read == {
        "time": "ms", "input": "N m", "output": "deg", "output_time": "ms",
    }  # fmt: skip


def rows_of(runs=(1, 2)):
    """As a historian exports them: stamps, names, values and the number of the run."""
    begun = datetime(2024, 5, 6, 7, 8, 9)
    return [
        (begun + timedelta(hours=run, seconds=float(t)), name, run * float(v), run)
        for run in runs
        for name, values in (("u", U), ("y", Y))
        for t, v in zip(T, values, strict=True)
    ]


def as_csv(path, rows):
    lines = [f"{a.isoformat()},{b},{c!r},{d}" for a, b, c, d in rows]
    path.write_text("\n".join(["timestamp,tag,value,run", *lines]) + "\n")


def as_xlsx(path, rows, sheets=("export",)):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name in sheets:
        sheet = book.create_sheet(name)
        sheet.append(["timestamp", "tag", "value", "run"])
        for row in rows:
            sheet.append(list(row))
    book.save(path)


def as_parquet(path, rows, words=False):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    names, columns = ("timestamp", "tag", "value", "run"), zip(*rows, strict=True)
    table = {
        name: pa.array(list(cells)) for name, cells in zip(names, columns, strict=True)
    }
    if words:
        table["tag"] = table["tag"].dictionary_encode()
    pq.write_table(pa.table(table), path)


def as_feather(path, rows):
    feather = pytest.importorskip("pyarrow.feather")
    pq = pytest.importorskip("pyarrow.parquet")
    as_parquet(path, rows, words=True)
    feather.write_feather(pq.read_table(path), str(path))


WRITERS = {"csv": as_csv, "xlsx": as_xlsx, "parquet": as_parquet, "feather": as_feather}


@pytest.mark.parametrize("suffix", WRITERS)
def test_files_of_every_kind_may_hold_a_long_table(tmp_path, suffix):
    path = tmp_path / f"export.{suffix}"
    WRITERS[suffix](path, rows_of())
    wanted = Columns(input="u", output="y", time="timestamp", variable="*")

    # A table's name may stand in front, as that of a group does.
    listed = {one.title.rpartition("/")[2] for one in list_columns(path)}
    assert listed == {"timestamp", "u", "y"}
    assert tables_of(path, wanted) == ("1", "2")
    for run in ("1", "2"):
        read = read_columns(path, replace(wanted, variable=run))
        np.testing.assert_allclose(read.input.values, int(run) * U)
        np.testing.assert_allclose(read.output.values, int(run) * Y)
        np.testing.assert_allclose(np.diff(read.time.values), 0.01, atol=2e-6)


def test_sheets_of_long_tables_name_their_recordings(tmp_path):
    path = tmp_path / "export.xlsx"
    as_xlsx(path, rows_of(), sheets=("Monday", "Tuesday"))
    wanted = Columns(input="u", output="y", time="timestamp", variable="*/2")
    names = tables_of(path, wanted)
    read = read_columns(path, replace(wanted, variable=names[1]))

    assert names == ("Monday/2", "Tuesday/2")
    np.testing.assert_allclose(read.output.values, 2 * Y)


def test_a_parquet_file_of_one_recording_needs_no_name_of_it(tmp_path):
    path = tmp_path / "export.parquet"
    as_parquet(path, rows_of(runs=(1,)))
    wanted = Columns(input="u", output="y", time="timestamp")
    read = read_columns(path, wanted)

    np.testing.assert_allclose(read.output.values, Y)
    assert read.time.unit == "s"
