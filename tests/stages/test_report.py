from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.scores import rmsd
from hwid_cli.records.report import StoredResults
from hwid_cli.stages.report import changed_sections, report_contents, report_key
from tests.report.report_examples import (
    THRESHOLD,
    calibrated_only,
    everything,
    fit,
    with_results,
)


@pytest.fixture(scope="module")
def stored():
    return everything(6)


@pytest.fixture(scope="module")
def contents(stored):
    return report_contents(stored)


def test_nothing_stored_gives_nothing_to_show():
    contents = report_contents(StoredResults("empty", "{}", "poles"))

    assert contents.simulated == ()
    assert contents.grid is None
    assert contents.cross is None
    assert contents.trend is None


def test_a_change_of_any_source_gives_the_page_another_key(stored, monkeypatch):
    key = report_key(stored)
    assert report_key(stored) == key

    monkeypatch.setattr("hwid_cli.stages.report.checksum_of_folder", lambda: "other")
    assert report_key(stored) != key


def test_recordings_without_any_model_are_named():
    contents = report_contents(calibrated_only())

    assert contents.without_model == ("step_01", "step_02")


def test_each_recording_is_shown_with_its_own_best_model(contents, stored):
    shown = contents.simulated[1]

    own = [one for one in stored.fits if one.name == "step_02"]
    best = min(own, key=lambda one: one.rmsd)
    assert shown.choice == "own"
    assert shown.model == f"step_02/{best.orders.nb}/{best.orders.nf}"


def test_residual_and_rmsd_belong_to_what_is_shown(contents):
    shown = contents.simulated[0]

    np.testing.assert_array_equal(shown.residual, shown.recording.output - shown.output)
    assert shown.rmsd == rmsd(shown.recording.output, shown.output)
    first, end = shown.detail
    assert 0 <= first < end <= shown.recording.n_samples


def test_a_test_recording_is_shown_with_the_model_assigned_to_it(contents, stored):
    shown = contents.simulated[-1]

    assert shown.recording.name == "step_06"
    assert shown.choice == "assigned"
    assert shown.model == stored.final_test.assigned[-1]


def test_a_recording_that_only_judges_is_shown_with_the_best_of_the_tensor(stored):
    without = tuple(one for one in stored.fits if one.name != "step_05")
    tensor = stored.crossval
    smaller = replace(
        tensor,
        identified_on=tensor.identified_on[:4],
        rmsd=tensor.rmsd[:4],
        status=tensor.status[:4],
    )
    contents = report_contents(
        with_results(stored, identify=without, crossval=smaller, test=None)
    )
    shown = contents.simulated[4]

    assert (shown.recording.name, shown.choice) == ("step_05", "crossval")
    n, b, k = np.unravel_index(
        np.nanargmin(smaller.rmsd[..., 4]), smaller.rmsd.shape[:3]
    )
    assert shown.model == f"{tensor.identified_on[n]}/{tensor.nb[b]}/{tensor.nk[k]}"


def test_a_tensor_of_other_models_is_not_mixed_with_these(stored):
    contents = report_contents(
        with_results(stored, identify=(*stored.fits, fit(("late",))))
    )

    assert contents.outdated == ("crossval",)
    assert contents.cross is None


def test_a_failed_fit_is_missing_in_the_grid(stored):
    failed = replace(stored.fits[0], model=None, status="failed", rmsd=float("nan"))
    contents = report_contents(
        with_results(stored, identify=(failed, *stored.fits[1:]))
    )

    assert np.isnan(contents.grid.rmsd[0, 0, 0])
    assert np.isfinite(contents.grid.rmsd[1:]).all()


def test_the_grid_takes_the_delay_where_it_is_the_second_axis(stored):
    contents = report_contents(
        replace(with_results(stored, identify=stored.fits[:1]), nk_role="delay")
    )

    assert contents.grid.nk == (1,)


def test_the_matrix_holds_the_widest_model_of_each_recording(contents, stored):
    matrix = contents.cross

    counts = np.sum(stored.crossval.rmsd < THRESHOLD, axis=-1)
    np.testing.assert_array_equal(matrix.covers, counts.max(axis=(1, 2)))
    np.testing.assert_array_equal(
        matrix.covered_by, np.sum(matrix.rmsd < THRESHOLD, axis=0)
    )
    np.testing.assert_array_equal(matrix.is_own, np.eye(5, dtype=bool))


def test_the_chain_of_groups_is_shown_from_all_sides(contents, stored):
    chain = stored.search.chain_groups

    assert [view.model for view in contents.models] == [g.model_name for g in chain]
    assert [view.coverage for view in contents.models] == [g.coverage for g in chain]
    assert contents.models[0].covers_of == len(stored.search.validated_on)


def test_without_groups_the_three_widest_models_are_shown(stored):
    contents = report_contents(with_results(stored, group=None))

    widest = sorted(contents.cross.covers)[-3:]
    assert sorted(view.coverage for view in contents.models) == widest


def test_the_trend_is_that_of_the_chain_on_the_test_recordings(contents, stored):
    final, trend = stored.final_test, contents.trend

    assert trend.models == final.chain
    assert trend.recordings == final.tested_on
    last = final.models.index(final.chain[-1])
    assert trend.rmsd[-1, 0] == final.rmsd[last, -1]
    assert trend.mean[-1] == pytest.approx(trend.rmsd[-1].mean())


def test_the_coverage_matrix_leaves_own_recordings_out(contents, stored):
    matrix, final = contents.full_matrix, stored.final_test

    np.testing.assert_array_equal(matrix.covers, final.covers)
    np.testing.assert_array_equal(matrix.covered_by, final.covered_by)


def test_right_predictions_are_counted(contents, stored):
    predictions = stored.final_test.predictions

    assert contents.predictions.total == 6
    assert contents.predictions.right == sum(one.is_right for one in predictions)


def test_only_settings_that_matter_to_a_stage_count_as_changed():
    now = {"orders": {"nb": (1, 2)}, "crossval": {"threshold": 0.1}, "group": None}
    stored = {"orders": {"nb": [1, 2]}, "crossval": {"threshold": 0.2}, "group": {}}

    assert changed_sections("identify", now, stored) == ()
    assert changed_sections("crossval", now, stored) == ("crossval",)
    assert changed_sections("group", now, stored) == ("crossval", "group")


def test_a_setting_that_an_older_program_did_not_know_is_no_change():
    now = {"fit": {"units": 10, "new": 1}}

    assert changed_sections("identify", now, {"fit": {"units": 10}}) == ()
    assert changed_sections("identify", now, {"fit": {"units": 9}}) == ("fit",)


def test_a_diagnosis_builds_on_the_calibration_and_not_on_the_models():
    now = {"calibrate": 1, "fit": 1, "group": 1, "test": 1, "simulation": 1}
    stored = dict.fromkeys(now, 2)

    assert changed_sections("diagnose", now, stored) == ("calibrate", "simulation")
    assert "simulation" not in changed_sections("test", now, stored)
