"""An output in a file of its own: its place, its changes, what is said without it."""

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.config.load import load_experiment
from hwid_cli.data.folder import guess_layout, list_measurements
from hwid_cli.data.recordings import check_unchanged, read_recordings
from hwid_cli.data.split_files import split_recordings
from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.records.starter import FoundColumn, FoundFile

CONFIG = """
name: apart
recordings:
  files: ["*_u.csv"]
  columns: {time: t, input: value, output: value, output_file: [_u, _y]}
  kind: {random: ["*"]}
orders: {nb: [1], nk: [1]}
"""


@pytest.fixture
def experiment(tmp_path):
    rng = np.random.default_rng(2)
    for name in ("a", "b"):
        for side in "uy":
            rows = [
                f"{0.01 * k:.2f},{v!r}" for k, v in enumerate(rng.random(200).tolist())
            ]
            path = tmp_path / f"{name}_{side}.csv"
            path.write_text("\n".join(["t,value", *rows]) + "\n")
    (tmp_path / "experiment.yaml").write_text(CONFIG)
    return load_experiment(tmp_path / "experiment.yaml")


def test_both_files_make_one_recording(experiment, tmp_path):
    raws = read_recordings(experiment, tmp_path)

    assert [one.name for one in raws] == ["a_u", "b_u"]
    for raw, name in zip(raws, "ab", strict=True):
        for side, values in (("u", raw.input), ("y", raw.output)):
            table = np.loadtxt(
                tmp_path / f"{name}_{side}.csv", delimiter=",", skiprows=1
            )
            np.testing.assert_array_equal(values, table[:, 1])


def test_a_change_of_the_output_s_file_is_noticed(experiment, tmp_path):
    raw = read_recordings(experiment, tmp_path)[0]
    digests = {raw.source: raw.sha256}
    check_unchanged(digests, experiment.recordings.columns)
    path = tmp_path / "a_y.csv"
    path.write_text(path.read_text().replace("0.50,", "0.50,9"))

    assert read_recordings(experiment, tmp_path)[0].sha256 != raw.sha256
    with pytest.raises(MeasurementError, match="changed while this run"):
        check_unchanged(digests, experiment.recordings.columns)


def test_a_missing_file_of_an_output_is_named(experiment, tmp_path):
    (tmp_path / "b_y.csv").unlink()
    with pytest.raises(MeasurementError, match=r"b_u.csv: .*b_y.csv, is not there"):
        read_recordings(experiment, tmp_path)


def test_the_same_text_twice_is_refused(tmp_path):
    path = tmp_path / "experiment.yaml"
    path.write_text(CONFIG.replace("[_u, _y]", "[_u, _u]"))
    with pytest.raises(ConfigError, match=r"output_file: found .*two different texts"):
        load_experiment(path)


def found(names):
    values = np.random.default_rng(1).random(100)
    return [FoundFile(one, (FoundColumn("value", "value", values),)) for one in names]


@pytest.mark.parametrize(
    ("names", "change"),
    [
        (("r1_current.csv", "r1_speed.csv", "r2_current.csv", "r2_speed.csv"),
         ("current", "speed")),
        (("F0000CH1.CSV", "F0000CH2.CSV", "F0001CH1.CSV", "F0001CH2.CSV"),
         ("CH1", "CH2")),
        (("a/u.csv", "a/y.csv", "b/u.csv", "b/y.csv"), ("u", "y")),
        (("current_1.csv", "current_2.csv", "speed_1.csv", "speed_2.csv"),
         ("current", "speed")),
    ],
)  # fmt: skip
def test_names_tell_which_files_belong_together(names, change):
    split = next(split_recordings(found(names)))

    assert split.change == change
    assert len(split.files) == 2


def test_names_that_differ_in_folder_and_file_do_not():
    assert not list(split_recordings(found(("a/u.csv", "b/y.csv"))))


def topics(folder, states):
    """What is told to a joint in one file of each run, its states in another one."""
    rng = np.random.default_rng(4)
    t = 0.005 * np.arange(400)
    for run in (1, 2, 3):
        command = np.repeat(rng.uniform(-2, 2, 20), 20)
        speed = lfilter([0.1], [1, -0.9], command)
        columns = {"position": 0.005 * np.cumsum(speed), "velocity": speed}
        told = {"time": t, ".data": command}
        told_of = {"time": t + 0.001} | {f".{one}": columns[one] for one in states}
        for name, table in (("joint1_command", told), ("joint_states", told_of)):
            path = folder / f"bag{run}" / f"{name}.csv"
            path.parent.mkdir(exist_ok=True)
            np.savetxt(
                path, np.column_stack(list(table.values())),
                delimiter=",", header=",".join(table), comments="",
            )  # fmt: skip


@pytest.mark.parametrize("states", [("position", "velocity"), ("velocity",)])
def test_a_command_in_a_file_of_its_own_is_the_input_of_a_joint(tmp_path, states):
    topics(tmp_path, states)
    layout = guess_layout(list_measurements(tmp_path))

    assert (layout.input.key, layout.output.key) == (".data", f".{states[0]}")
    assert layout.output_file == ("joint1_command", "joint_states")


def test_a_file_that_names_its_own_input_needs_no_other_one(tmp_path):
    topics(tmp_path, ("position", "velocity"))
    for path in tmp_path.glob("*/joint_states.csv"):
        path.write_text(path.read_text().replace(".velocity", ".current"))
    layout = guess_layout(list_measurements(tmp_path))

    assert (layout.input.key, layout.output_file) == (".current", None)


def test_a_library_that_is_missing_is_named_before_a_note_beside_the_files():
    lacks = (
        "is read by python-calamine, which is missing; run: pip install 'hwid[formats]'"
    )
    note = FoundFile("NOTES.txt", (FoundColumn("m", "m", np.arange(3.0)),))
    with pytest.raises(MeasurementError, match=r"^run\.xlsx: .*pip install") as told:
        guess_layout([note, FoundFile("run.xlsx", (), lacks, lacks_library=True)])
    assert str(told.value).endswith("'hwid[formats]'")
