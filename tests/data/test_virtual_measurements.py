import csv
import logging
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.data.recordings import read_recordings
from hwid_cli.data.virtual_measurements import (
    read_virtual_key,
    write_virtual_measurements,
)
from hwid_cli.errors import CacheError
from hwid_cli.records.machines import VirtualMeasurement

CONFIG = """\
name: virtual
simulate: {kind: servo}
recordings:
  files: raw/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
calibrate: {step: [cut], sine: [cut]}
orders: {nb: 2, nk: 2}
"""


def measurements():
    rng = np.random.default_rng(4)
    return tuple(
        VirtualMeasurement(
            name,
            kind,
            0.005 * np.arange(90),
            rng.normal(size=n_input),
            rng.normal(size=n_output),
            plan,
        )
        for name, kind, n_input, n_output, plan in (
            ("step_01", "step", 90, 83, {"amplitude_A": 2.0, "damaged": "3 17"}),
            ("sine_01", "sine", 81, 90, {"amplitude_A": 1.0, "period": 7}),
        )
    )


def test_measurements_are_read_back_as_recordings(write_config, tmp_path):
    paths = write_virtual_measurements(tmp_path / "out", measurements(), key="k")
    assert [path.name for path in paths] == ["step_01.csv", "sine_01.csv"]
    experiment = load_experiment(write_config(CONFIG))
    found = {r.name: r for r in read_recordings(experiment, tmp_path / "out")}
    assert list(found) == ["step_01", "sine_01"]
    for measurement in measurements():
        recording = found[measurement.name]
        np.testing.assert_array_equal(recording.input, measurement.input)
        np.testing.assert_array_equal(recording.output, measurement.output)
        assert recording.kind == measurement.kind
        assert recording.sample_time_s == 0.005


def test_plan_has_a_row_for_each_measurement(tmp_path):
    write_virtual_measurements(tmp_path, measurements())
    with (tmp_path / "raw" / "plan.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["name", "kind", "amplitude_A", "damaged", "period"]
    assert list(rows[0].values()) == ["step_01", "step", "2.0", "3 17", ""]
    assert list(rows[1].values()) == ["sine_01", "sine", "1.0", "", "7"]


def test_rows_of_the_plan_may_be_given(tmp_path):
    write_virtual_measurements(tmp_path, measurements(), [{"x": 1}, {"x": 2}], "k")
    text = (tmp_path / "raw" / "plan.csv").read_text()
    assert text == "name,kind,x\nstep_01,step,1\nsine_01,sine,2\n"


def test_time_is_written_without_rounding_errors(tmp_path):
    write_virtual_measurements(tmp_path, measurements())
    lines = (tmp_path / "raw" / "step_01.csv").read_text().splitlines()
    assert lines[0] == "time_s,current_A,displacement_m"
    assert all(len(line.split(",")[0]) <= len("0.445") for line in lines[1:])
    assert lines[-1].endswith(",")


def test_same_measurements_make_the_same_bytes(tmp_path):
    for out in ("a", "b"):
        write_virtual_measurements(tmp_path / out, measurements(), key="k")
    for path in (tmp_path / "a" / "raw").iterdir():
        twin = tmp_path / "b" / "raw" / path.name
        assert path.read_bytes() == twin.read_bytes()


def test_key_is_read_back(tmp_path):
    assert read_virtual_key(tmp_path) is None
    write_virtual_measurements(tmp_path, measurements(), key="k1")
    assert read_virtual_key(tmp_path) == "k1"


@pytest.mark.parametrize("name", ["step_01.csv", "plan.csv", "simulate.json"])
@pytest.mark.parametrize("damage", ["change", "remove"])
def test_key_is_none_where_a_file_was_changed_or_removed(tmp_path, name, damage):
    write_virtual_measurements(tmp_path, measurements(), key="k1")
    path = tmp_path / "raw" / name
    path.write_text("x") if damage == "change" else path.unlink()
    assert read_virtual_key(tmp_path) is None


def test_files_of_an_earlier_plan_are_removed_and_others_kept(tmp_path, caplog):
    write_virtual_measurements(tmp_path, measurements(), key="k1")
    own = tmp_path / "raw" / "own.csv"
    own.write_text("t,u,y\n")
    renamed = replace(measurements()[1], name="sine_02")
    write_virtual_measurements(tmp_path, [renamed], key="k2")
    names = {path.name for path in (tmp_path / "raw").iterdir()}
    assert names == {"sine_02.csv", "own.csv", "plan.csv", "simulate.json"}
    assert read_virtual_key(tmp_path) == "k2"
    (tmp_path / "raw" / "sine_02.csv").write_text("changed by hand\n")
    with caplog.at_level(logging.WARNING):
        write_virtual_measurements(tmp_path, measurements()[:1], key="k3")
    assert (tmp_path / "raw" / "sine_02.csv").exists()
    assert "sine_02.csv: changed since it was simulated; not removed" in caplog.text


def test_folder_that_may_not_be_written_is_one_clear_line(tmp_path):
    (tmp_path / "raw").write_text("")
    with pytest.raises(CacheError, match=r"step_01.csv: cannot be written \("):
        write_virtual_measurements(tmp_path, measurements())
