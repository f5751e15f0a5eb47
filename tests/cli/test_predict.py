import csv
import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli import load_model, simulate
from hwid_cli.cli.main import main
from hwid_cli.export.json_writer import write_json
from tests.export.model_examples import (
    example_input,
    example_model,
    exported_of,
)
from tests.export.test_json import exported_drive, with_trust


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "m.json"
    write_json(path, exported_of(example_model(1), input_range=(-9.0, 9.0)))
    return path


def write_input(path, u):
    lines = [f"{n / 1000!r},{value!r}" for n, value in enumerate(u.tolist())]
    path.write_text("\n".join(["time_s,current_A", *lines]) + "\n")
    return path


def predict(*arguments):
    return CliRunner().invoke(main, ["predict", *map(str, arguments)])


def predicted(path):
    with path.open(newline="") as file:
        return np.array([float(row["predicted"]) for row in csv.DictReader(file)])


@pytest.mark.parametrize("start", ["fitted", "steady", "empty"])
def test_a_prediction_is_what_simulate_gives(start, model, tmp_path):
    u = example_input(1)
    out = tmp_path / "p.csv"
    given = write_input(tmp_path / "u.csv", u)
    result = predict(model, given, "--out", out, "--initial-state", start)
    state = {"fitted": None, "steady": "steady", "empty": np.zeros(2)}[start]

    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    words = {
        "fitted": "that of the first recording of its fit",
        "steady": "steady at the first input",
        "empty": "zero",
    }[start]
    assert result.stdout == (
        f"{out}: 400 samples of step_06/3/7; time in s, predicted in m\n"
        f"Free-run simulation; initial state {words}.\n"
    )
    expected = simulate(load_model(model), u, initial_state=state)
    assert np.array_equal(predicted(out), expected)


@pytest.mark.parametrize("names", [("U_cmd", "t"), ("1", "0")])
def test_columns_may_have_other_names_than_in_the_models_files(names, model, tmp_path):
    given = write_input(tmp_path / "u.csv", example_input(1))
    expected = tmp_path / "expected.csv"
    assert predict(model, given, "--out", expected).exit_code == 0
    other = tmp_path / "other.csv"
    other.write_text(given.read_text().replace("time_s,current_A", "t,U_cmd"))

    refused = predict(model, other, "--out", tmp_path / "p.csv")
    assert refused.exit_code != 0
    assert (
        "call the input 'current_A': --input NAME says another name" in refused.stderr
    )
    found = predict(
        model,
        other,
        "--out",
        tmp_path / "p.csv",
        "--input",
        names[0],
        "--time",
        names[1],
    )
    assert found.exit_code == 0, found.stderr
    assert np.array_equal(predicted(tmp_path / "p.csv"), predicted(expected))


def test_prediction_csv_lies_here_unless_told(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_input(tmp_path / "u.csv", np.ones(3))

    assert predict("m.json", "u.csv").exit_code == 0
    assert (tmp_path / "prediction.csv").is_file()


@pytest.mark.parametrize("asked", [(), ("--input", "input")])
def test_a_proposed_input_is_read_as_it_is_written(tmp_path, asked):
    path, out = tmp_path / "m.json", tmp_path / "p.csv"
    write_json(path, exported_of(example_model(1), input_scale=0.001))
    u = example_input(1)
    proposed = write_input(tmp_path / "next.csv", u)
    text = proposed.read_text().replace("current_A", "input")
    proposed.write_text(text)

    assert predict(path, proposed, "--out", out, *asked).exit_code == 0
    # It is in the unit that the model takes, not in that of the files.
    assert predicted(out) == pytest.approx(simulate(load_model(path), u), abs=1e-12)


@pytest.mark.parametrize(("lost", "is_bridged"), [(2, True), (30, False)])
def test_a_sample_that_the_input_lacks_is_bridged_and_said(
    model, tmp_path, lost, is_bridged
):
    u = np.sin(np.arange(400) / 20.0)
    u[100 : 100 + lost] = np.nan
    given = write_input(tmp_path / "u.csv", u)
    result = predict(model, given, "--out", tmp_path / "p.csv")

    assert result.exit_code == (0 if is_bridged else 1)
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith(f"hwid: {given}, row 102: input 'current_A'")
    if is_bridged:
        assert "has no number (and 1 more); a straight line bridges it" in result.stderr
        line = np.interp([100, 101], [99, 102], u[[99, 102]])
        u[100:102] = line
        expected = simulate(load_model(model), u)
        assert predicted(tmp_path / "p.csv") == pytest.approx(expected, abs=1e-12)


def test_a_scale_of_the_configuration_is_applied(tmp_path):
    path = tmp_path / "m.json"
    write_json(path, exported_of(example_model(1), input_scale=0.001))
    u = example_input(1)
    write_input(tmp_path / "u.csv", u)
    out = tmp_path / "p.csv"
    predict(path, tmp_path / "u.csv", "--out", out)

    assert np.array_equal(predicted(out), simulate(load_model(path), u * 0.001))


def test_an_input_beyond_the_data_is_warned_of_in_one_line(tmp_path):
    path = tmp_path / "m.json"
    write_json(path, exported_of(example_model(1), input_range=(-1.0, 1.0)))
    given = write_input(tmp_path / "u.csv", np.array([0.0, 2.0, 0.5, -1.0]))
    result = predict(path, given, "--out", tmp_path / "p.csv")

    assert result.exit_code == 0
    assert result.stderr == (
        f"hwid: {given}: the input goes from -1 to 2 A; the model knows -1 to 1, so "
        "25.0 % of the samples are extrapolated\n"
    )


def test_a_simulation_predicts_too(tmp_path):
    path = tmp_path / "s.json"
    drive = exported_drive(effects={"coulomb_friction": {"force_N": 0.7}})
    write_json(path, drive)
    given = tmp_path / "u.csv"
    given.write_text("t,u\n0,1\n0.001,1\n0.002,1\n")
    out = tmp_path / "p.csv"

    assert predict(path, given, "--out", out).exit_code == 0
    assert np.allclose(predicted(out), 1e-3, rtol=1e-12)
    result = predict(path, given, "--out", out, "--initial-state", "empty")
    assert result.exit_code == 1
    assert "starts at rest; expected steady" in result.stderr


def test_a_fault_is_one_line_and_leaves_an_old_prediction(model, tmp_path):
    out = tmp_path / "p.csv"
    out.write_text("old")
    result = predict(model, tmp_path / "no.csv", "--out", out)

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "no.csv: no such file" in result.stderr
    assert out.read_text() == "old"


@pytest.mark.parametrize("name", ["u.csv", "m.json", "link.csv"])
def test_what_is_read_is_never_written(name, model, tmp_path):
    given = write_input(tmp_path / "u.csv", np.ones(3))
    (tmp_path / "link.csv").symlink_to(given)
    before = (tmp_path / name).read_bytes()
    result = predict(model, given, "--out", tmp_path / name, "--force")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert f"--out: found {tmp_path / name}, which is read" in result.stderr
    assert (tmp_path / name).read_bytes() == before


def test_only_predictions_are_replaced_unless_forced(model, tmp_path):
    given = write_input(tmp_path / "u.csv", np.ones(3))
    out = tmp_path / "other.csv"
    out.write_text("time_s,current_A,displacement_m\n0,1,2\n")
    refused = predict(model, given, "--out", out)

    assert refused.exit_code == 1
    assert refused.stderr.count("\n") == 1
    assert "an existing file that is no prediction" in refused.stderr
    assert out.read_text().startswith("time_s,current_A,displacement_m")
    assert predict(model, given, "--out", out, "--force").exit_code == 0
    first = predicted(out)
    write_input(given, np.full(3, 2.0))
    assert predict(model, given, "--out", out).exit_code == 0
    assert not np.array_equal(predicted(out), first)


def test_a_missing_folder_is_said_and_not_made(model, tmp_path):
    given = write_input(tmp_path / "u.csv", np.ones(3))
    result = predict(model, given, "--out", tmp_path / "deep" / "p.csv")

    assert result.exit_code == 1
    assert f"there is no folder {tmp_path / 'deep'};" in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "deep").exists()


HOSTILE = [
    ("name", "step\x1b[2J\x1b[1;31mall is lost/1/2", "text without control characters"),
    ("units.output", "m\r\nhwid: done", "text without control characters"),
    ("units.input", "A\u202e", "text without control characters"),
    ("columns.input", "current\x07", "text without control characters"),
    ("linear_block.numerator.0", 1e308, "expected finite numbers"),
]


@pytest.mark.parametrize(("place", "value", "says"), HOSTILE)
def test_a_hostile_model_is_one_plain_line(model, tmp_path, place, value, says):
    content = json.loads(model.read_text())
    *keys, last = [int(key) if key.isdigit() else key for key in place.split(".")]
    part = content
    for key in keys:
        part = part[key]
    part[last] = value
    model.write_text(json.dumps(content))
    out = tmp_path / "p.csv"
    given = write_input(tmp_path / "u.csv", np.linspace(-8.0, 8.0, 400))
    result = predict(model, given, "--out", out)

    assert result.exit_code == 1, result.output
    (line,) = result.stderr.splitlines()
    assert line.isprintable()
    assert says in line
    assert str(model) in line
    assert "\x1b" not in result.stdout
    assert not out.exists()


@pytest.mark.thorough
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a system without pipes")
@pytest.mark.parametrize("kind", ["pipe", "/dev/zero", "large", "pipe as input"])
def test_a_file_without_an_end_is_one_line(model, tmp_path, kind):
    place, given = model, write_input(tmp_path / "u.csv", example_input(1))
    if kind == "pipe":
        place = tmp_path / "pipe"
        os.mkfifo(place)
    elif kind == "/dev/zero":
        place = Path(kind)
    elif kind == "large":
        with place.open("r+b") as file:
            file.truncate(2**36)
    else:
        given = tmp_path / "pipe"
        os.mkfifo(given)
    command = [sys.executable, "-m", "hwid_cli", "predict", place, given]
    done = subprocess.run(
        [*command, "--out", tmp_path / "p.csv"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2**32, 2**32)),
    )

    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert str(given if "input" in kind else place) in done.stderr


def test_a_band_adds_its_limits_and_what_rests_on_data(tmp_path):
    u = example_input(1)
    # Farther than the recordings of the model.
    u[-20:] = 5.0 * np.abs(u).max()
    path, out = tmp_path / "m.json", tmp_path / "p.csv"
    write_json(path, with_trust(exported_of(example_model(1))))
    given = write_input(tmp_path / "u.csv", u)

    result = predict(path, given, "--out", out, "--band")

    assert result.exit_code == 0, result.output
    assert "the band of 90 % is" in result.stdout
    assert "of the samples rest on data in every respect" in result.stdout
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    known = ["value_known", "rate_known", "frequency_known"]
    assert list(rows[0])[2:] == ["predicted", "lower", "upper", *known]
    rests = np.array([[int(row[name]) for name in known] for row in rows])
    assert set(rests.ravel()) == {0, 1}
    assert not rests[-20:, 0].any()
    share = f"(value {100 * rests[:, 0].mean():.0f} %"
    assert share in " ".join(result.stdout.split())
    low, high = (np.array([float(row[k]) for row in rows]) for k in ("lower", "upper"))
    # Never narrower than the noise: 1.7 standard deviations of 0.02 to either side.
    assert (high - low >= 2 * 1.7 * 0.02 * (1 - 1e-9)).all()
    middle = (low + high) / 2
    assert np.allclose(middle, simulate(load_model(path), u), atol=1e-9)
    # A prediction with a band may be replaced by the next one.
    assert predict(path, given, "--out", out).exit_code == 0


@pytest.mark.parametrize("value", [1e308, -1e308, 1e61])
@pytest.mark.parametrize(
    "place",
    [
        ("noise_rms",),
        ("scale",),
        ("scatter",),
        ("steps", 0, -1),
        ("visited", "input", "edges", -1),
        ("visited", "inner", "lowest_rate", 0),
    ],
)
def test_a_band_of_numbers_that_no_signal_has_is_refused(tmp_path, place, value):
    path, out = tmp_path / "m.json", tmp_path / "p.csv"
    write_json(path, with_trust(exported_of(example_model(1))))
    content = json.loads(path.read_text())
    inner = content["trust"]
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    path.write_text(json.dumps(content))
    given = write_input(tmp_path / "u.csv", example_input(1))

    result = predict(path, given, "--out", out, "--band")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert f"{path}: trust.{place[0]}" in result.stderr
    assert not out.exists()


def test_a_model_of_an_earlier_version_has_no_band_and_says_what_to_do(model, tmp_path):
    out = tmp_path / "p.csv"
    given = write_input(tmp_path / "u.csv", example_input(1))

    result = predict(model, given, "--out", out, "--band")

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert f"{model}: trust: found nothing; expected the covariance" in result.stderr
    assert "export the model again" in result.stderr
    assert not out.exists()


def test_a_physics_simulation_whose_errors_nobody_said_has_no_band(tmp_path):
    path = tmp_path / "s.json"
    write_json(path, exported_drive())
    given = tmp_path / "u.csv"
    given.write_text("t,u\n0,1\n0.001,1\n")

    result = predict(path, given, "--out", tmp_path / "p.csv", "--band")

    assert result.exit_code == 1
    assert f"{path}: trust: found nothing; expected the covariance" in result.stderr
