"""Which files the recordings of an experiment are; the rest is in test_recordings."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.config.load import load_experiment
from hwid_cli.data.recording_files import (
    FilePart,
    find_files,
    missing_files_message,
    parts_of_tables,
    recordings_base,
)
from hwid_cli.data.recordings import read_recordings
from hwid_cli.errors import ConfigError, MeasurementError

BY_COLUMNS = "{time: t, input: u, output: y}"


def read(experiment, out="out"):
    return read_recordings(experiment, Path(out))


def test_files_come_in_natural_order_without_plan_and_excluded(tiny, write_csv):
    for name in ("run_10", "run_2", "run_1", "bad_1", "spare"):
        write_csv(f"{name}.csv")
    write_csv("plan.csv", header="name,kind,x")
    experiment = tiny(more="exclude: [bad_*, spare.csv]")
    paths = find_files(experiment, Path(experiment.source).parent)
    assert [path.stem for path in paths] == ["run_1", "run_2", "run_10"]


def test_list_of_files_and_folders_is_read(tiny, write_csv):
    for name in ("b.csv", "a.csv", "deep/er/c.csv"):
        write_csv(name)
    names = [r.name for r in read(tiny(files="[b.csv, ./b.csv, a.csv, '**/c.csv']"))]
    assert names == ["a", "b", "c"]


def test_plain_name_with_brackets_is_found(tiny, write_csv):
    write_csv("run[1].csv")
    assert [r.name for r in read(tiny(files="'run[1].csv'"))] == ["run[1]"]


def test_files_of_a_folder_with_brackets_are_found(tmp_path, write_csv, monkeypatch):
    write_csv("data [1]/run.csv")
    path = tmp_path / "data [1]" / "tiny.yaml"
    columns = "{time: t, input: u, output: y}"
    path.write_text(
        f"name: a\nrecordings: {{files: '*.csv', columns: {columns}}}\n"
        "orders: {nb: 2, nk: 2}\n"
    )
    assert [r.name for r in read(load_experiment(path))] == ["run"]
    monkeypatch.setenv("HWID_REALDATA", str(tmp_path / "data [1]"))
    path.write_text(path.read_text().replace("'*.csv'", "'${HWID_REALDATA}/*.csv'"))
    assert [r.name for r in read(load_experiment(path))] == ["run"]


def test_paths_are_relative_to_the_yaml_file_not_to_the_caller(
    tiny, write_csv, tmp_path, monkeypatch
):
    write_csv("run.csv")
    experiment = tiny()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert [r.name for r in read(experiment)] == ["run"]


def test_simulated_measurements_lie_below_the_results(tiny, write_csv, tmp_path):
    write_csv("results/raw/run.csv")
    experiment = tiny(files="raw/*.csv", sections="simulate: {kind: servo}\n")
    out = tmp_path / "results"
    assert recordings_base(experiment, out) == out
    assert [r.name for r in read(experiment, out)] == ["run"]
    with pytest.raises(
        MeasurementError, match=r"run 'hwid simulate .*tiny.yaml' first"
    ):
        read(experiment, tmp_path / "nowhere")


def test_variable_in_a_path_is_replaced(tiny, write_csv, monkeypatch, tmp_path):
    write_csv("there/run.csv")
    monkeypatch.setenv("HWID_REALDATA", str(tmp_path / "there"))
    assert [r.name for r in read(tiny(files="'${HWID_REALDATA}/*.csv'"))] == ["run"]


def test_real_data_lie_beside_the_project_where_nothing_else_is_said(
    write_csv, monkeypatch, tmp_path
):
    monkeypatch.delenv("HWID_REALDATA", raising=False)
    write_csv("shared/realdata/set/run.csv")
    config = tmp_path / "project" / "configs" / "a.yaml"
    config.parent.mkdir(parents=True)
    config.write_text(
        "name: a\norders: {nb: 2, nk: 2}\nrecordings:\n"
        "  files: ${HWID_REALDATA}/set/*.csv\n"
        f"  columns: {BY_COLUMNS}\n"
    )
    assert [r.name for r in read(load_experiment(config))] == ["run"]
    monkeypatch.chdir(tmp_path / "project")
    (recording,) = read(load_experiment(Path("configs/a.yaml")))
    assert recording.name == "run"


def test_unset_variable_in_a_path_is_refused(tiny, monkeypatch):
    monkeypatch.delenv("NO_SUCH_FOLDER", raising=False)
    with pytest.raises(ConfigError, match=r"variable NO_SUCH_FOLDER, which is not set"):
        read(tiny(files="'${NO_SUCH_FOLDER}/*.csv'"))


def test_pattern_that_matches_nothing_is_refused_with_the_place(tiny, tmp_path):
    message = (
        rf"tiny.yaml: recordings.files: no file matches 'raw/\*.csv'; expected "
        rf"{tmp_path}/raw/\*.csv; put the files there or correct recordings.files$"
    )
    with pytest.raises(MeasurementError, match=message):
        read(tiny(files="raw/*.csv"))


def test_second_pattern_must_match_too(tiny, write_csv):
    write_csv("run.csv")
    with pytest.raises(MeasurementError, match=r"no file matches 'none_\*.csv'"):
        read(tiny(files="[run.csv, none_*.csv]"))


def test_excluding_everything_is_refused(tiny, write_csv):
    write_csv("run.csv")
    with pytest.raises(MeasurementError, match=r"recordings.exclude leaves no file"):
        read(tiny(more="exclude: '*'"))


def test_folder_with_nothing_but_a_plan_holds_no_recording(tiny, write_csv):
    write_csv("plan.csv")
    with pytest.raises(MeasurementError, match=r"no file matches '\*.csv'"):
        read(tiny())


def test_optional_recordings_may_be_missing(tiny, monkeypatch, tmp_path):
    monkeypatch.setenv("HWID_REALDATA", str(tmp_path / "nowhere"))
    experiment = tiny(files="'${HWID_REALDATA}/*.mat'", more="optional: true")
    assert read(experiment) == []
    message = missing_files_message(experiment, recordings_base(experiment, tmp_path))
    assert str(tmp_path / "nowhere" / "*.mat") in message
    assert "put the data there, or set HWID_REALDATA" in message
    assert "\n" not in message


def test_experiment_without_recordings_is_refused(write_config):
    experiment = load_experiment(write_config("name: a\n"))
    with pytest.raises(ConfigError, match=r"recordings: missing; expected which files"):
        read(experiment)


@pytest.mark.parametrize(
    ("tables", "names"),
    [
        (["01_steps", "02_sine_0.5Hz"], ["01_steps", "02_sine_0_5Hz"]),
        (["log.run1", "log.run2"], ["run1", "run2"]),
        (["a/x", "b/x"], ["a_x", "b_x"]),
    ],
)
def test_a_point_in_a_number_does_not_part_the_name_of_a_table(tables, names):
    part = FilePart(Path("log.xlsx"), "log", "", 0, None)
    found = parts_of_tables([part], tables, is_only_file=True)
    assert [one.name for one in found] == names


def test_a_pattern_of_a_kind_that_no_recording_has_is_named_by_check(tmp_path, caplog):
    for n in range(3):
        rows = np.random.default_rng(n).normal(size=(300, 2))
        np.savetxt(tmp_path / f"step_{n}.csv", rows, delimiter=",")
    config = tmp_path / "e.yaml"
    config.write_text(
        "name: e\nrecordings: {files: ['*.csv'], sample_time_s: 0.01,\n"
        "  columns: {input: 0, output: 1}, kind: {step: ['step_0', 'stp_*', 'step_2']},\n"
        "  exclude: [step_2]}\n"
        "orders: {nb: [1], nk: [1]}\n"
    )
    CliRunner().invoke(main, ["check", str(config), "--no-timing"])
    said = caplog.text
    assert "recordings.kind.step: 'stp_*' matches no recording" in said
    assert "'step_0' matches" not in said
    # Left out on purpose.
    assert "'step_2' matches" not in said
