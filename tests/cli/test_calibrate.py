import pytest

from hwid_cli.store.results import read_calibrated


def test_calibrated_recordings_and_a_figure_of_each_are_written(hwid, out):
    result = hwid("calibrate")

    assert result.exit_code == 0, result.output
    calibrated = read_calibrated(out / "calibrated.h5")
    assert [r.name for r in calibrated.recordings] == ["step_02", "step_12", "sine_12"]
    figures = sorted(path.name for path in (out / "figures" / "calibrate").iterdir())
    assert figures == ["sine_12.png", "step_02.png", "step_12.png"]
    assert "step_02" in result.stdout
    assert "first" in result.stdout


def test_measurements_are_simulated_where_they_are_missing(hwid):
    assert "simulate: 3 measurements computed" in hwid("calibrate").stderr


@pytest.mark.thorough
def test_an_unchanged_calibration_is_not_repeated(after_run, hwid, out):
    figure = out / "figures" / "calibrate" / "step_02.png"
    before = figure.stat().st_mtime_ns
    result = hwid("calibrate")

    assert "calibrate: 3 recordings from the cache" in result.stderr
    assert figure.stat().st_mtime_ns == before


@pytest.mark.thorough
def test_a_missing_figure_is_drawn_again(after_run, hwid, out):
    figure = out / "figures" / "calibrate" / "step_02.png"
    figure.unlink()
    hwid("calibrate")

    assert figure.is_file()


@pytest.mark.thorough
def test_another_recipe_calibrates_again(after_run, hwid, edit, out):
    edit("samples: 400\norders", "samples: 300\norders")
    result = hwid("calibrate")

    assert "calibrate: 3 recordings done" in result.stderr
    lengths = [r.n_samples for r in read_calibrated(out / "calibrated.h5").recordings]
    assert max(lengths) == 300


def test_without_a_recipe_recordings_are_left_as_they_are_and_not_drawn(
    hwid, tmp_path, out
):
    path = tmp_path / "own.yaml"
    path.write_text(
        "name: own\n"
        "recordings: {files: a.csv, columns: {time: t, input: u, output: y}}\n"
        "orders: {nb: 1, nk: 1}\n"
    )
    rows = [f"{n},{n % 7},{n % 5}" for n in range(100)]
    (tmp_path / "a.csv").write_text("\n".join(["t,u,y", *rows]))
    result = hwid("calibrate", path=path)

    assert "1 recording done, left as they are" in result.stderr
    assert not (out / "figures").exists()

    path.write_text(f"{path.read_text()}calibrate: {{repair: true, step: [cut]}}\n")
    result = hwid("calibrate", path=path)
    assert "not repaired either (calibrate: has no recipe for other)" in result.stderr


def test_a_step_that_cannot_work_names_the_recording(hwid, edit):
    edit("step: [cut, output_offset]", "step: [cut, output_offset]\n  rest_samples: 5")
    result = hwid("calibrate")

    assert result.exit_code == 1
    assert "calibrate.rest_samples: 5; expected at least 20" in result.stderr


@pytest.fixture
def own_data(tmp_path):
    """A folder with a configuration and no measurements."""
    path = tmp_path / "own.yaml"
    path.write_text(
        "name: own\n"
        "recordings:\n"
        "  files: data/*.csv\n"
        "  columns: {time: t, input: u, output: y}\n"
        "  optional: OPTIONAL\n"
    )
    return path


def test_missing_measurements_are_an_error_that_says_where_they_belong(own_data, hwid):
    own_data.write_text(own_data.read_text().replace("OPTIONAL", "false"))
    result = hwid("calibrate", path=own_data)

    assert result.exit_code == 1
    assert "no file matches 'data/*.csv'" in result.stderr


def test_missing_optional_measurements_are_skipped_with_the_same_advice(own_data, hwid):
    own_data.write_text(own_data.read_text().replace("OPTIONAL", "true"))
    for command in ("calibrate", "identify", "crossval"):
        result = hwid(command, path=own_data)

        assert result.exit_code == 0
        assert result.stdout.startswith("skipped: ")
        assert result.stdout.count("\n") == 1
        assert "no file matches 'data/*.csv'" in result.stdout
