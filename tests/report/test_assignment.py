from dataclasses import replace

import numpy as np

from hwid_cli.records.groups import Prediction
from hwid_cli.report.final_test import (
    prediction_sentence,
    prediction_table,
    smallest_set_table,
)
from hwid_cli.report.table import as_text
from tests.stages.final_test_examples import example_final_test

FINAL = example_final_test()


def rows_of(text):
    """Rows beneath the rule of a table, up to its legend and notes."""
    lines = text.splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("---")) + 1
    return lines[first:]


def test_the_smallest_set_serves_every_recording_once():
    text = as_text([smallest_set_table(FINAL)])
    number = len(FINAL.smallest_set)

    assert f"{number} of 38 models for 38 of 38 recordings" in " ".join(text.split())
    rows = rows_of(text)
    for model in FINAL.smallest_set:
        served = [
            name
            for name, chosen in zip(
                FINAL.recordings, FINAL.assigned_in_set, strict=True
            )
            if chosen == model
        ]
        row = next(line for line in rows if line.startswith(f"{model} "))
        assert row.split()[:2] == [model, str(len(served))]
        assert served[0] in row
    for name in FINAL.recordings:
        assert "\n".join(rows).count(f" {name}*") == 1
    assert max(map(len, text.splitlines())) <= 80


def test_what_the_set_serves_without_covering_bears_no_mark():
    last = FINAL.rmsd.copy()
    last[:, -1] = 0.5
    table = smallest_set_table(replace(FINAL, rmsd=last))
    served = " ".join(row[-1] for row in table.rows)

    assert "sine_23*" not in served
    assert "sine_22*" in served


def test_without_a_set_it_is_said_that_there_is_none():
    found = smallest_set_table(replace(FINAL, smallest_set=()))

    assert found.text == "No model covers any recording, so no set of models is of use."


def test_the_predictions_show_what_was_chosen_and_what_was_best():
    text = as_text([prediction_table(FINAL)])
    labels = {model: f"M{n}" for n, model in enumerate(FINAL.smallest_set, 1)}
    rows = {line.split()[0]: line for line in rows_of(text)[: len(FINAL.recordings)]}

    assert list(rows) == list(FINAL.recordings)
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
    used = {told.model for told in FINAL.predictions}
    for model in used:
        assert f"{labels[model]}: {model}" in text.splitlines()
    assert " ".join(text.split()).endswith(prediction_sentence(FINAL))


def test_a_page_says_of_each_prediction_how_it_went():
    right, wrong, without = FINAL.predictions[:3]
    told = (
        replace(right, is_right=True),
        replace(wrong, is_right=False, is_possible=True),
        replace(without, is_right=False, is_possible=False),
    )
    table = prediction_table(replace(FINAL, predictions=told))
    verdict = table.heads.index("verdict")

    assert [row[verdict] for row in table.rows] == [
        "right", "wrong", "no choice covers it",
    ]  # fmt: skip
    assert table.rows[0][5].text == right.model


def test_no_model_to_choose_from_is_a_dash():
    nothing = Prediction(
        "step_01", "", np.nan, "", np.nan, "", np.nan, is_right=False, is_possible=False
    )
    final = replace(FINAL, predictions=(nothing, *FINAL.predictions[1:]))
    row = rows_of(as_text([prediction_table(final)]))[0]

    assert row.split() == ["step_01", "-", "-", "-", "-", "-", "-"]


def test_how_often_the_choice_was_right_is_said_for_tests_apart():
    told = [
        replace(item, is_right=name in ("step_05", "step_01"), is_possible=True)
        for item, name in zip(FINAL.predictions, FINAL.recordings, strict=True)
    ]
    text = prediction_sentence(replace(FINAL, predictions=tuple(told)))

    assert "Right for 2 of 38 recordings (1 of 3 test recordings)" in text
    assert "covers 38 (3) of them" in text
