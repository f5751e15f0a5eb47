"""Clocks and units that files of LabVIEW and MATLAB state beside their numbers."""

import numpy as np
import pytest
import scipy.io

from hwid_cli.data.column_clocks import guess_time
from hwid_cli.data.formats import list_columns

N = 200
FIRST = np.datetime64("2024-03-01T10:00:00")


def tdms(path, starts):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject(
                    group, "signal", np.arange(float(N)),
                    {"wf_increment": 0.01, "wf_start_offset": 0.0, "wf_start_time": start},
                )
                for group, start in starts.items()
            ]
        )  # fmt: skip
    return {one.title: one.values for one in list_columns(path)}


@pytest.mark.parametrize(
    ("wait", "begins"),
    [(50, 0.05), (0, 0.0), (10**8, 0.0)],
    ids=["later", "together", "a program's default"],
)
def test_channels_of_tdms_begin_when_they_say(tmp_path, wait, begins):
    starts = {"drive": FIRST, "laser": FIRST + np.timedelta64(wait, "ms")}
    found = tdms(tmp_path / "run.tdms", starts)
    assert found["drive/time"][0] == 0.0
    assert found["laser/time"][0] == pytest.approx(begins)
    assert np.diff(found["laser/time"]) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("unit", "step_s"), [("milliseconds", 0.005), ("minutes", 300.0), ("seconds", 5.0)]
)
def test_an_iddata_saved_as_a_structure_says_its_units(tmp_path, unit, step_s):
    path = tmp_path / "run.mat"
    data = {
        "OutputData": np.sin(np.arange(N)), "InputData": np.cos(np.arange(N)), "Ts": 5.0,
        "TimeUnit": unit, "InputUnit": "V", "OutputUnit": "mm", "InputName": "valve",
        "OutputName": "stroke",
    }  # fmt: skip
    scipy.io.savemat(path, {"data": data})
    columns = list_columns(path)
    assert guess_time(columns).sample_time_s == pytest.approx(step_s)
    units = {one.title: one.unit for one in columns if one.values.size == N}
    assert units == {"valve": "V", "stroke": "mm"}


def test_a_cover_of_a_workbook_is_no_table(tmp_path):
    """It holds a date and a setting, which are numbers, too."""
    import datetime as dt

    import openpyxl

    from hwid_cli.data.formats import read_columns
    from hwid_cli.records.experiment import Columns

    book = openpyxl.Workbook()
    cover = book.active
    for row in (("bench 7",), ("date", dt.datetime(2024, 3, 11)), ("step", 20, "ms")):
        cover.append(row)
    data = book.create_sheet("data")
    data.append(("t [s]", "u [V]", "y [mm]"))
    for n in range(N):
        data.append((0.02 * n, n % 7, n % 5))
    path = tmp_path / "run.xlsx"
    book.save(path)
    assert {one.variable for one in list_columns(path)} == {None}
    found = read_columns(path, Columns(time="t [s]", input="u [V]", output="y [mm]"))
    assert found.output.values.size == N


def test_titles_of_blocks_are_no_names(tmp_path):
    """As gnuplot takes them: names once, then recordings between blank lines."""
    lines = ["# slide rig", "# columns: time(s) volt(V) pos(cm)"]
    for run in range(2):
        lines += [f"# run {run + 1}: step"]
        lines += [f"{0.01 * n:g} {n % 7} {n % 5}" for n in range(N)]
        lines += ["", ""]
    path = tmp_path / "all.dat"
    path.write_text("\n".join(lines))
    found = {one.title: one.values for one in list_columns(path)}
    assert list(found) == ["time(s)", "volt(V)", "pos(cm)"]
    assert found["pos(cm)"].size == 2 * N


@pytest.mark.parametrize("names", [("Exp1", "Exp2", "slow"), ("a", "a", "a")])
def test_experiments_of_a_merged_iddata_are_recordings(tmp_path, names):
    rng = np.random.default_rng(2)
    u = [rng.standard_normal((80 + 5 * k, 1)) for k in range(3)]

    def cells(values):
        found = np.empty((1, 3), dtype=object)
        found[0, :] = values
        return found

    z = {
        "OutputData": cells([2 * one for one in u]),
        "InputData": cells(u),
        "OutputName": cells(["pos"])[:, :1],
        "OutputUnit": cells(["mm"])[:, :1],
        "Ts": cells([0.005] * 3),
        "TimeUnit": "milliseconds",
        "ExperimentName": cells(names),
    }
    path = tmp_path / "z.mat"
    scipy.io.savemat(path, {"z": z})
    # Names that are not unique are numbered.
    table = names[2] if len(set(names)) == 3 else "Exp3"
    columns = {one.key: one for one in list_columns(path)}
    output = columns[f"z.{table}.OutputData"]
    np.testing.assert_array_equal(output.values, 2 * u[2][:, 0])
    assert (output.unit, output.title) == ("mm", "pos")
    assert columns[f"z.{table}.Ts"].unit == "milliseconds"
