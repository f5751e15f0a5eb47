from hwid_cli.files.results import read_fits


def test_models_are_written_and_the_best_are_shown(hwid, out):
    result = hwid("identify")

    assert result.exit_code == 0, result.output
    names = [fit.name for fit in read_fits(out / "results.h5")]
    assert names == 2 * ["step_02"] + 2 * ["step_12"] + 2 * ["sine_12"]
    assert "identify: 0 fits from the cache, 6 computed" in result.stdout
    assert "NLHW-Step-2-1-2-1" in result.stdout


def test_a_second_run_answers_from_the_cache(after_run, hwid):
    result = hwid("identify")

    assert "identify: 6 fits from the cache, 0 computed" in result.stdout


def test_force_computes_this_stage_again_and_no_other(after_run, hwid):
    result = hwid("identify", "--force")

    assert "calibrate: 3 recordings from the cache" in result.stdout
    assert "identify: 0 fits from the cache, 6 computed" in result.stdout


def test_another_order_is_fitted_and_the_others_are_not(after_run, hwid, edit):
    edit("nk: [1, 2]", "nk: [1, 3]")
    result = hwid("identify")

    assert "identify: 6 fits from the cache, 3 computed" in result.stdout


def test_one_changed_recording_is_fitted_again_and_the_others_are_not(
    after_run, hwid, edit, out
):
    edit("sine_12]}", "sine_12]}\n  current_limit_A: 3.9")
    result = hwid("identify")

    # Only the steps of 4 A feel the limit; the sine of 2 A stays as it was.
    assert "identify: 2 fits from the cache, 4 computed" in result.stdout


def test_an_unknown_recording_is_refused(after_run, hwid, edit):
    edit("identify: {}", "identify: {recordings: [step_2]}")
    result = hwid("identify")

    assert result.exit_code == 1
    assert "identify.recordings: no recording 'step_2'; did you mean" in result.stderr


def test_recordings_of_the_final_test_are_left_out(after_run, hwid, edit, out):
    edit("identify: {}", "test: {recordings: [step_12]}")
    hwid("identify")

    assert {fit.name for fit in read_fits(out / "results.h5")} == {"sine_12", "step_02"}


def test_quiet_says_nothing(after_run, hwid):
    result = hwid("identify", "--quiet")

    assert (result.exit_code, result.output) == (0, "")
