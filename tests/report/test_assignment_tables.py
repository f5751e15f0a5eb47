from dataclasses import replace

import numpy as np

from hwid_cli.records.groups import Prediction
from hwid_cli.report.final_test_tables import (
    prediction_line,
    prediction_table,
    smallest_set_table,
)
from tests.stages.final_test_examples import example_final_test

FINAL = example_final_test()


def test_the_smallest_set_serves_every_recording_once():
    text = smallest_set_table(FINAL, initial_state="estimated")

    assert f"{len(FINAL.smallest_set)} of 38 models\nfor 38 of 38 recordings" in text
    listed = text.split("\n", 5)[5]
    for number, model in enumerate(FINAL.smallest_set, 1):
        served = [
            name
            for name, chosen in zip(
                FINAL.recordings, FINAL.assigned_in_set, strict=True
            )
            if chosen == model
        ]
        row = next(line for line in listed.splitlines() if f" {model} " in line)
        assert row.split()[:3] == [f"M{number}", model, str(len(served))]
        assert served[0] in row
    for name in FINAL.recordings:
        assert listed.count(f" {name}*") == 1
    assert max(map(len, text.splitlines())) <= 80


def test_what_the_set_serves_without_covering_bears_no_mark():
    last = FINAL.rmsd.copy()
    last[:, -1] = 0.5
    text = smallest_set_table(replace(FINAL, rmsd=last), initial_state="estimated")

    assert "sine_23*" not in text
    assert "sine_22*" in text


def test_without_a_set_it_is_said_that_there_is_none():
    text = smallest_set_table(
        replace(FINAL, smallest_set=()), initial_state="estimated"
    )

    assert text == "No model covers any recording, so no set of models is of use."


def test_the_predictions_show_what_was_chosen_and_what_was_best():
    text = prediction_table(FINAL, initial_state="estimated")
    rows = {line.split()[0]: line for line in text.splitlines()[5:-2]}

    assert list(rows) == list(FINAL.recordings)
    labels = {model: f"M{n}" for n, model in enumerate(FINAL.smallest_set, 1)}
    for told in FINAL.predictions:
        shown = rows[told.recording].replace("test", " ").split()
        assert shown == [
            told.recording,
            told.nearest,
            f"{told.distance:.3f}",
            labels[told.model],
            f"{told.rmsd:.2e}" + "*" * told.is_right,
            labels[told.best_model],
            f"{told.best_rmsd:.2e}" + "*" * told.is_possible,
        ]
    assert [name for name, row in rows.items() if " test " in row] == [
        "step_05", "step_10", "sine_03",
    ]  # fmt: skip
    assert text.endswith(prediction_line(FINAL))


def test_no_model_to_choose_from_is_a_dash():
    nothing = Prediction(
        "step_01", "", np.nan, "", np.nan, "", np.nan, is_right=False, is_possible=False
    )
    final = replace(FINAL, predictions=(nothing, *FINAL.predictions[1:]))
    row = prediction_table(final, initial_state="estimated").splitlines()[5]

    assert row.split() == ["step_01", "-", "-", "-", "-", "-", "-"]


def test_how_often_the_choice_was_right_is_said_for_tests_apart():
    told = [
        replace(item, is_right=name in ("step_05", "step_01"), is_possible=True)
        for item, name in zip(FINAL.predictions, FINAL.recordings, strict=True)
    ]
    text = prediction_line(replace(FINAL, predictions=tuple(told)))

    assert "Right for 2 of 38 recordings (1 of 3 test recordings)" in text
    assert "covers 38 (3) of them" in text
