from pathlib import Path

import pytest

from hwid_cli.store.results import read_fits


def test_models_are_written_and_the_best_are_shown(hwid, out):
    result = hwid("identify")

    assert result.exit_code == 0, result.output
    names = [fit.name for fit in read_fits(out / "results.h5")]
    assert names == 2 * ["step_02"] + 2 * ["step_12"] + 2 * ["sine_12"]
    assert "identify: 0 fits from the cache, 6 computed" in result.stderr
    assert "\nstep_02/1/2  " in result.stdout


def test_a_second_run_answers_from_the_cache(after_run, hwid):
    result = hwid("identify")

    assert "identify: 6 fits from the cache, 0 computed" in result.stderr


@pytest.mark.thorough
def test_force_computes_this_stage_again_and_no_other(after_run, hwid):
    result = hwid("identify", "--force")

    assert "calibrate: 3 recordings from the cache" in result.stderr
    assert "identify: 0 fits from the cache, 6 computed" in result.stderr


@pytest.mark.thorough
def test_another_order_is_fitted_and_the_others_are_not(after_run, hwid, edit):
    edit("nk: [1, 2]", "nk: [1, 3]")
    result = hwid("identify")

    assert "identify: 6 fits from the cache, 3 computed" in result.stderr


@pytest.mark.thorough
def test_one_changed_recording_is_fitted_again_and_the_others_are_not(
    after_run, hwid, edit, out
):
    edit("sine_12]}", "sine_12]}\n  current_limit_A: 3.9")
    result = hwid("identify")

    # Only the steps of 4 A feel the limit; the sine of 2 A stays as it was.
    assert "identify: 2 fits from the cache, 4 computed" in result.stderr


def test_an_unknown_recording_is_refused(after_run, hwid, edit):
    edit("identify: {}", "identify: {recordings: [step_2]}")
    result = hwid("identify")

    assert result.exit_code == 1
    assert "identify.recordings: no recording 'step_2'; did you mean" in result.stderr


@pytest.mark.thorough
def test_recordings_of_the_final_test_are_left_out(after_run, hwid, edit, out):
    edit("identify: {}", "test: {recordings: [step_12]}")
    hwid("identify")

    assert {fit.name for fit in read_fits(out / "results.h5")} == {"sine_12", "step_02"}


def test_quiet_says_nothing(after_run, hwid):
    result = hwid("identify", "--quiet")

    assert (result.exit_code, result.output) == (0, "")


README = Path(__file__).parents[2] / "configs" / "README.md"
OWN_MAP = README.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]


@pytest.fixture
def own_map(config, edit):
    """Let the input map be the example of configs/README.md."""
    edit("fit: {", "fit: {input_map: {file: my_map.py, name: friction_curve}, ")
    path = config.parent / "my_map.py"
    path.write_text(OWN_MAP, encoding="utf-8")
    return path


@pytest.mark.thorough
def test_a_map_of_ones_own_is_fitted_and_kept(own_map, hwid, edit, out):
    edit("nk: [1, 2]", "nk: 1")
    assert hwid("identify").exit_code == 0
    fit = read_fits(out / "results.h5")[0]

    assert fit.model.input_map.function.source == OWN_MAP
    assert "input_map.loss" in fit.uncertainty.names
    own_map.write_text(OWN_MAP.replace("start=[0.3", "start=[0.4"), encoding="utf-8")
    assert "0 fits from the cache, 3 computed" in hwid("identify").stderr


@pytest.mark.thorough
def test_a_map_of_ones_own_that_contradicts_itself_is_one_line(own_map, hwid):
    own_map.write_text(OWN_MAP.replace("1.0 - p[0]", "1.0 + p[0]"), encoding="utf-8")
    result = hwid("identify")

    assert result.exit_code == 1
    assert (
        "tiny.yaml: fit.input_map: friction_curve: by_argument: found" in result.stderr
    )
    assert len(result.stderr.splitlines()) == 1
