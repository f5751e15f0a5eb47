"""Clocks and units that files of LabVIEW and MATLAB state beside their numbers."""

import numpy as np
import pytest
import scipy.io

from hwid_cli.data.column_roles import guess_time
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
