"""Long tables: what becomes of signals whose stamps differ, and of names that are not there."""

import numpy as np
import pytest

from hwid_cli.data.csv_files import list_csv_columns, read_csv_columns
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
