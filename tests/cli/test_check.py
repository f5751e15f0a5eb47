import json
import re

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.signal import lfilter

from hwid_cli.cli.main import main


def check(path, *options):
    return CliRunner().invoke(main, ["check", str(path), *options])


def snapshot(folder):
    return {
        path: (path.stat().st_mtime_ns, path.stat().st_size)
        for path in folder.rglob("*")
    }


@pytest.fixture
def simulated(after_run, config, out):
    """The tiny experiment with all of its results."""
    return config, out


def test_a_finished_experiment_is_all_in_the_cache(simulated):
    config, out = simulated
    result = check(config, "--out", str(out), "--no-timing", "--jobs", "1")

    assert result.exit_code == 0, result.output
    text = result.stdout
    assert "3 recordings x 2 orders = 6 fits" in text
    assert re.search(r"6 fits +6 of 6", text)
    assert "6 models on 3 recordings = 18 validations in 9 tasks" in text
    assert re.search(r"9 tasks +9 of 9", text)
    assert "to a factor of 2" in text
    assert re.search(r"sine_12 +sine +\d+/\d+ +400 ", text)


@pytest.mark.thorough
def test_nothing_is_written(simulated, tmp_path):
    config, out = simulated
    before = snapshot(tmp_path)
    assert check(config, "--out", str(out)).exit_code == 0
    assert check(config, "--out", str(tmp_path / "new")).exit_code == 0

    assert snapshot(tmp_path) == before


def test_a_damaged_entry_of_the_cache_stays_where_it_is(simulated, tmp_path):
    config, out = simulated
    entry = next(iter(sorted((out / "cache").rglob("*.h5"))))
    entry.write_bytes(entry.read_bytes()[:-40])
    before = snapshot(tmp_path)
    result = check(config, "--out", str(out), "--no-timing")

    assert result.exit_code == 0, result.output
    assert snapshot(tmp_path) == before


def test_what_is_missing_in_the_cache_is_counted(simulated):
    config, out = simulated
    next(filter(_is_smallest_fit, (out / "cache").rglob("*.h5"))).unlink()
    text = check(config, "--out", str(out), "--no-timing").stdout

    # What grows out of a missing fit is missing too.
    assert re.search(r"6 fits +4 of 6", text)
    assert re.search(r"9 tasks +0 of 9", text)


def _is_smallest_fit(path):
    """Of the grid, not one of the page's linear ones."""
    with h5py.File(path) as file:
        if file.attrs["record"] != "Fit":
            return False
        orders, options = file["record/orders"].attrs, file["record/options"].attrs
        return orders["nf"] == 1 and options["input_map"] != "none"


def test_one_of_a_kind_is_no_plural(simulated, edit):
    edit("nk: [1, 2]}", "nk: 1}")
    edit("identify: {}", "identify: {recordings: [step_02]}")
    edit("threshold: 0.01}", "threshold: 0.01, recordings: [step_02]}")
    config, out = simulated
    text = check(config, "--out", str(out), "--no-timing").stdout

    assert "1 recording x 1 order = 1 fit " in text
    assert "1 model on 1 recording = 1 validation in 1 task " in text


@pytest.mark.thorough
def test_a_timed_fit_is_named(simulated):
    config, out = simulated
    result = check(config, "--out", str(out))

    assert re.search(
        r"Scaled from one fit of \w+ with orders 1 2 1: 0\.\d+ s", result.stdout
    )


def test_every_problem_of_the_configuration_is_one_line(tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(
        "name: bad\n"
        "recordings: {files: no/*.csv, columns: {input: u, output: 3.5}}\n"
        "orders: {nb: [3, 1], nkk: 2}\n"
        "crossval: {threshold: -1}\n"
        "colour: red\n"
    )
    result = check(path)

    assert result.exit_code == 1
    lines = result.stderr.splitlines()
    assert all(line.startswith(f"hwid: {path}: ") for line in lines)
    places = {line.removeprefix(f"hwid: {path}: ").split(":")[0] for line in lines}
    assert places >= {
        "recordings.columns.output",
        "orders.nb",
        "orders.nkk",
        "crossval.threshold",
        "colour",
    }
    assert len(lines) == len(set(lines))
    assert result.stdout == ""


def test_every_bad_file_and_every_bad_name_is_one_line(tmp_path):
    for number in range(4):
        rows = [f"{k},{(k * (number + 3)) % 7}" for k in range(120)]
        if number == 1:
            rows[40] = "40,x"
        if number == 2:
            rows = [f"{k},1" for k in range(120)]
        (tmp_path / f"run{number}.csv").write_text("u,y\n" + "\n".join(rows))
    path = tmp_path / "mine.yaml"
    path.write_text(
        "name: mine\n"
        "recordings: {files: run*.csv, columns: {input: u, output: y}, sample_time_s: 1}\n"
        "identify: {recordings: [run0, run9]}\n"
        "test: {recordings: [rum3]}\n"
        "diagnose:\n"
    )
    result = check(path, "--out", str(tmp_path / "out"))

    assert result.exit_code == 1
    lines = result.stderr.splitlines()
    assert len(lines) == 5, result.stderr
    said = "\n".join(lines)
    for words in (
        "run1.csv, row 42",
        "run2.csv: output 'y' is 1",
        "identify.recordings: no recording 'run9'",
        "test.recordings: no recording 'rum3'; did you mean 'run3'?",
        "simulation: missing",
    ):
        assert words in said
    # The good ones are shown all the same.
    assert "run0" in result.stdout
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("count", "says"),
    [
        (1, r"run00\.csv: has 60 samples; expected more than 110 .* or lower orders"),
        (
            3,
            r"3 recordings have too few samples, run00\.csv \(60\), run01\.csv \(61\), "
            r"run02\.csv \(62\); expected more than 110 for orders up to nb 30 and nk 30.*",
        ),
        (12, r"12 recordings have too few .*run09\.csv \(69\) and 2 more; expected .*"),
    ],
)
def test_orders_too_high_for_many_recordings_are_one_line(tmp_path, count, says):
    for number in range(count):
        rows = [f"{k % 5},{k % 7}" for k in range(60 + number)]
        (tmp_path / f"run{number:02}.csv").write_text("u,y\n" + "\n".join(rows))
    path = tmp_path / "mine.yaml"
    path.write_text(
        "name: mine\n"
        "recordings: {files: run*.csv, columns: {input: u, output: y}, sample_time_s: 1}\n"
        "orders: {nb: [1, 30], nk: [1, 30]}\n"
    )
    result = check(path, "--out", str(tmp_path / "out"))

    assert result.exit_code == 1
    assert re.fullmatch(rf"hwid: {tmp_path}(/|: ){says}\n", result.stderr), (
        result.stderr
    )


def test_measurements_that_are_still_to_be_simulated_are_no_fault(config, tmp_path):
    result = check(config, "--out", str(tmp_path / "new"))

    assert result.exit_code == 0
    assert "not simulated yet" in result.stdout


def test_missing_measurements_are_one_problem(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "name: mine\n"
        "recordings: {files: no/*.csv, columns: {input: u, output: y}, sample_time_s: 1}\n"
        "identify:\n"
    )
    result = check(path)

    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "no file matches" in result.stderr


def test_a_level_that_steps_alone_would_lose_is_told(tmp_path):
    rest, rng = np.full(100, 50.0), np.random.default_rng(3)
    inputs = {
        "step_1": np.r_[rest, np.full(400, 60.0)],
        "random_1": np.r_[rest, 50.0 + np.repeat(rng.normal(0, 9, 40), 10)],
    }
    for name, u in inputs.items():
        oven = 98.0 + lfilter([0.02], [1, -0.98], 1.4 * (u - 50.0))
        np.savetxt(
            tmp_path / f"{name}.csv", np.c_[u, oven], delimiter=",", header="u,y"
        )
    text = (
        "name: oven\nrecordings: {files: '*.csv', columns: {input: u, output: y}, "
        "sample_time_s: 1, kind: {step: 'step*', random: 'random*'}}\n"
        "calibrate: {step: [cut, output_offset], random: []}\n"
    )
    (tmp_path / "oven.yaml").write_text(text)
    said = check(tmp_path / "oven.yaml").stderr
    expected = (
        "the kind random keep the level at which they rest (98 m), others lose it"
    )
    assert expected in said
    (tmp_path / "oven.yaml").write_text(text.replace(", output_offset", ""))
    assert "keep the level" not in check(tmp_path / "oven.yaml").stderr


def test_an_experiment_that_only_simulates_is_sound(tmp_path):
    path = tmp_path / "servo.yaml"
    path.write_text("name: servo\nsimulate: {kind: servo}\n")
    result = check(path)

    assert result.exit_code == 0
    assert "simulates and does nothing else" in result.stdout


def test_time_that_cannot_be_estimated_is_said_to_be_left_out(simulated):
    config, out = simulated
    text = config.read_text() + "simulation: {mass_kg: 1.0}\ndiagnose:\n"
    config.write_text(text)
    result = check(config, "--out", str(out), "--no-timing")

    text = " ".join(result.stdout.split())
    assert "start of the program and diagnose apart" in text


def test_programs_read_the_plan_from_stdout_and_people_from_stderr(simulated):
    config, out = simulated
    result = CliRunner().invoke(
        main, ["check", str(config), "--out", str(out), "--no-timing", "--json"]
    )
    document = json.loads(result.stdout)

    assert "What would run" in result.stderr
    stages = {one["stage"]: one for one in document["stages"]}
    assert stages["identify"]["cached"] == stages["identify"]["tasks"] > 0
    assert all(one["seconds"] <= one["most_seconds"] for one in stages.values())
    assert document["recordings"][0]["n_used"] > 0
