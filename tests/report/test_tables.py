import re
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.check import RecordingFacts
from hwid_cli.records.model import (
    Fit,
    FitOptions,
    HammersteinWiener,
    Information,
    Orders,
    StaticMap,
)
from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.records.results import CrossValidation, ModelScore
from hwid_cli.report.check_tables import recordings_table
from hwid_cli.report.fit_tables import best_models_table, failure_lines, status_line
from hwid_cli.report.tables import (
    calibration_table,
    coverage_table,
    cross_table,
    thesis_name,
)

NONE = StaticMap("none", np.zeros(0))
MODEL = HammersteinWiener(NONE, np.ones(1), np.array([1.0, -0.5]), 1, NONE, 1e-3)
NAMES = tuple(f"step_{n:02d}" for n in range(1, 16))
GENERATOR = np.random.default_rng(1)
CROSSVAL = CrossValidation(
    identified_on=NAMES,
    nb=(3, 10),
    nk=(7, 10),
    nk_role="poles",
    validated_on=NAMES,
    rmsd=GENERATOR.uniform(0.001, 0.1, (15, 2, 2, 15)),
    status=np.full((15, 2, 2, 15), "ok"),
    unit="m",
    threshold=0.01,
)
SCORES = tuple(
    ModelScore(name, 10, 10, 1.234e-4, 7, Orders(10, 10, 1)) for name in NAMES
)


def assert_fits_the_screen(text):
    assert max(map(len, text.splitlines())) <= 80


def test_the_best_models_carry_both_names_and_the_linear_rmsd():
    fit = Fit(
        ("step_06",),
        Orders(3, 7, 1),
        FitOptions(),
        MODEL,
        "converged",
        "",
        rmsd=1.06e-4,
        fit_percent=99.125,
        linear_rmsd=float("nan"),
        information=Information(7500, 41, bic=-12345.6),
    )
    text = best_models_table([(fit,)], "m")

    last = text.splitlines()[-1].split()
    assert last == [
        "step_06/3/7", "NLHW-Step-6-3-7-1", "1.06e-04", "99.12", "-", "41", "-12346",
    ]  # fmt: skip
    assert_fits_the_screen(text)


def test_output_maps_that_fold_are_named_below_the_best_models():
    fit = Fit(("step_06",), Orders(3, 7, 1), FitOptions(), MODEL, "converged", "")
    folded = replace(fit, output_folds=(0.25, 1.5, 3.0))

    assert "fold" not in best_models_table([(fit,)], "m")
    text = best_models_table([(fit, folded), (folded,) * 4], "m")
    note = " ".join(text[text.index("Output maps") :].split())
    assert note.startswith(
        "Output maps that fold, so that two positions give one output: "
        "step_06/3/7 (x = 0.25, 1.5, ... A); step_06/3/7"
    )
    assert note.endswith("1 more")
    assert_fits_the_screen(text)


def test_in_the_delay_reading_the_place_in_the_grid_is_the_delay():
    fit = Fit(("step_06",), Orders(3, 2, 7), FitOptions(), MODEL, "converged", "")
    last = best_models_table([(fit,)], "m", nk_is_delay=True).splitlines()[-1]

    assert last.split()[:2] == ["step_06/3/7", "NLHW-Step-6-3-2-7"]


def test_no_dash_of_a_dimensionless_output_stands_behind_a_number():
    cross = replace(CROSSVAL, unit="-")
    text = coverage_table(SCORES, cross, count=4, initial_state="zero")
    facts = RecordingFacts(
        "a", "step", 9, 9, 9, 1e-3, (-0.288, 0.129), (0.0, 2.0), "-", "V"
    )

    assert "RMSD below 0.01\n" in text
    assert re.search(r"-0\.288 to 0\.129  +0 to 2 V", recordings_table([facts]))


def test_the_delay_that_was_found_stands_in_the_name():
    found = [replace(SCORES[0], orders=Orders(10, 10, 3))]
    text = coverage_table(found, CROSSVAL, initial_state="estimated")
    assert text.splitlines()[-1].endswith("-10-10-3")


def test_the_coverage_table_shows_the_first_models_only():
    text = coverage_table(SCORES, CROSSVAL, count=4, initial_state="estimated")

    rows = text.splitlines()[5:]
    assert len(rows) == 4
    assert rows[3].split() == [
        "step_04", "10", "10", "7", "of", "15", "1.23e-04", "NLHW-Step-4-10-10-1",
    ]  # fmt: skip
    assert_fits_the_screen(text)


def test_the_cross_table_holds_every_value_once_and_marks_what_is_covered():
    text = cross_table(SCORES, CROSSVAL, initial_state="estimated")

    for row in CROSSVAL.rmsd[:, 1, 1]:
        for value in row:
            mark = "*" if value < 0.01 else " "
            assert f"{value:.2e}{mark}" in text + " "
    blocks = text.split("\n\n")
    assert len(blocks) == 3
    assert all(block.count("step_15/10/10") == 1 for block in blocks)
    assert_fits_the_screen(text)


def test_a_missing_rmsd_is_a_dash():
    crossval = CrossValidation(
        **{**CROSSVAL.__dict__, "rmsd": np.full((15, 2, 2, 15), np.nan)}
    )
    row = (
        cross_table(SCORES[:1], crossval, initial_state="estimated")
        .splitlines()[-1]
        .split()
    )

    assert set(row[1:-1]) == {"-"}


def test_long_names_take_more_blocks_and_are_never_cut():
    names = tuple(f"idf_neg_0.045_{n}" for n in range(12))
    crossval = CrossValidation(
        identified_on=names,
        nb=(1,),
        nk=(1,),
        nk_role="poles",
        validated_on=names,
        rmsd=np.ones((12, 1, 1, 12)),
        status=np.full((12, 1, 1, 12), "ok"),
        unit="rad",
        threshold=0.1,
    )
    scores = [ModelScore(name, 1, 1, 1.0, 0, Orders(1, 1, 1)) for name in names]
    text = cross_table(scores, crossval, initial_state="estimated")

    assert all(f" {name}" in text for name in names)
    assert_fits_the_screen(text)


def test_the_calibration_table_says_what_was_done():
    log = CalibrationLog(
        name="sine_01",
        steps=("cut", "input_offset", "recut"),
        first_sample=248,
        n_samples=7490,
        n_raw_input=7929,
        n_raw_output=7784,
        input_offset=0.00666,
        period_samples=12.566,
        repaired_input=(3, 5),
    )
    text = calibration_table([log])

    assert text.splitlines()[-1].split() == [
        "sine_01", "7929/7784", "248", "7490", "6.66e-03", "-", "12.57", "2/0",
    ]  # fmt: skip
    assert_fits_the_screen(text)


def test_the_status_line_counts_in_words():
    assert (
        status_line({"iteration_limit": 3}) == "Fits: 3 stopped at the iteration limit"
    )
    assert status_line({}) == "Fits: none"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("step_06", "NLHW-Step-6-3-7-1"),
        ("sine_23", "NLHW-Sine-23-3-7-1"),
        ("step_06+step_09+sine_01", "NLHW-Step-6-9-Sine-1-3-7-1"),
        ("idf_neg_0.04_1", "NLHW-idf_neg_0.04_1-3-7-1"),
    ],
)
def test_models_are_named_as_in_the_published_tables(name, expected):
    assert thesis_name(name, 3, 7) == expected


def test_failed_fits_say_why_each_reason_once():
    failed = Fit(("a",), Orders(1, 1, 1), FitOptions(), None, "failed", "too short")
    other = replace(failed, message="the input is constant at 3")
    done = Fit(("a",), Orders(1, 1, 1), FitOptions(), MODEL, "converged", "")

    assert failure_lines([failed, done, other, failed]).splitlines() == [
        "Failed, 2 fits: too short",
        "Failed, 1 fit: the input is constant at 3",
    ]
    assert failure_lines([done]) == ""
    many = [replace(failed, message=str(number)) for number in range(5)]
    assert failure_lines(many).splitlines()[-1].startswith("More reasons: results.h5")
    assert best_models_table([], "m") == "No fit gave a model."


def test_a_robust_loss_is_told_beside_the_numbers_that_it_does_not_change():
    fit = Fit(("a",), Orders(1, 1, 1), FitOptions(loss="huber"), MODEL, "converged", "")
    assert "Huber's loss" in best_models_table([(fit,)], "m")
    plain = replace(fit, options=FitOptions())
    assert "Huber" not in best_models_table([(plain,)], "m")
