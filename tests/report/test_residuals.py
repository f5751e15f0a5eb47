from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.residual_tests import residual_tests
from hwid_cli.records.residuals import ModelResiduals
from hwid_cli.report.figures.residuals import residuals_figure
from hwid_cli.report.residuals import residual_table, residual_verdict
from hwid_cli.report.sections.identify import residuals_section
from hwid_cli.report.simulation_note import simulation_note
from hwid_cli.report.table import Table, as_text

RNG = np.random.default_rng(4)
INPUT, NOISE = RNG.normal(size=(2, 600))
WHITE = residual_tests(NOISE, INPUT)


def left(model, flat):
    return ModelResiduals(model, WHITE, flat, model.split("/")[0], 1e-3, "m")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "nothing left to model"),
        ({"is_white": False}, "coloured, not by the input or its square"),
        ({"follows_square": True}, "misses a nonlinearity"),
        ({"leads_input": True}, "nothing left to model; input follows them"),
    ],
)
def test_each_verdict_has_its_words(changes, expected):
    verdict = residual_verdict(replace(WHITE, **changes))

    assert verdict.partition(": ")[2] == expected


def test_a_missing_lag_is_named():
    late = np.roll(INPUT, 7)
    verdict = residual_verdict(residual_tests(NOISE + late, INPUT))

    assert verdict.endswith("misses dynamics up to lag 7")
    strong = residual_tests(np.convolve(NOISE, np.ones(9))[:600], INPUT)
    assert residual_verdict(strong).startswith("not white (p < 0.001): coloured")


def test_the_table_says_what_is_not_identifiable_and_how_fits_start():
    flat = ("not identifiable: b[0], because of this", "another")
    found = [left("step_06/3/7", flat)]
    lines = as_text([residual_table(found)], initial_state="steady").splitlines()

    assert lines[-1].endswith("because of this (1 more).")
    assert lines[-2].startswith("step_06/3/7  white (p = ")
    assert simulation_note("steady", is_validation=False) in " ".join(lines)
    assert max(map(len, lines)) <= 80


def test_only_a_few_models_tell_what_is_not_identifiable():
    found = [left(f"s{n}/1/1", ("flat: b",)) for n in range(9)]
    text = " ".join(residual_table(found).notes)

    assert text.count("flat: b") == 5
    assert "in 4 more models" in text
    assert "in 1 more model:" in str(residual_table(found[:6]).notes)


@pytest.mark.usefixtures("blank_figures")
def test_the_section_has_a_row_and_a_figure_for_each_recording(contents):
    section = residuals_section(contents)
    (table,) = [one for one in section.blocks if isinstance(one, Table)]

    assert [row[1] for row in table.rows] == [
        one.recording.name for one in contents.simulated
    ]
    assert len(table.heads) == len(table.rows[0])


def test_the_figure_marks_what_is_beyond_its_band(contents):
    one = contents.simulated[0]
    shown = replace(one, tests=residual_tests(NOISE + np.roll(INPUT, 7), INPUT))
    _, with_input, _ = residuals_figure(shown).axes

    marked = with_input.lines[-1].get_xdata()
    assert marked.tolist() == [7]
    assert with_input.get_xlabel() == "lag [samples]"


def test_a_figure_without_tests_is_refused(contents):
    with pytest.raises(ValueError, match="no tests"):
        residuals_figure(replace(contents.simulated[0], tests=None))
