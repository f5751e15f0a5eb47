from dataclasses import replace

import numpy as np

from hwid_cli.records.comparison import Comparison, NamedModel, ShownRecording
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.report.comparison import comparison_tables
from hwid_cli.report.figures.comparison import comparison_figure
from hwid_cli.report.table import as_text

NONE = StaticMap("none", np.zeros(0))


def model(rule):
    return HammersteinWiener(NONE, [0.5], [1.0, -0.5], 1, NONE, 1e-3, rule)


def comparison(rules=("zero", "steady")):
    time = np.arange(4.0)
    return Comparison(
        models=tuple(NamedModel(f"m{n}/1/1", model(r)) for n, r in enumerate(rules)),
        recordings=("step_1", "step_2"),
        is_own=np.array([[True, False], [False, False]]),
        rmsd=np.array([[0.3, 0.4], [0.1, np.nan]]),
        fit_percent=np.array([[70.0, 60.0], [90.0, np.nan]]),
        input_unit="A",
        output_unit="m",
        shown=ShownRecording(
            "step_1", time, time, time, np.array([time, np.full(4, np.inf)])
        ),
    )


def comparison_text(compared):
    return as_text(comparison_tables(compared))


def test_rules_that_differ_are_each_said():
    text = comparison_text(comparison())
    assert "A: Free-run simulation, no prediction; initial state zero." in text
    assert "B: Free-run simulation, no prediction; initial state steady" in text


def test_the_best_own_recordings_and_pooled_numbers_are_shown():
    rows = [line.split() for line in comparison_text(comparison()).splitlines()]
    assert ["step_1", "3.00e-01'", "1.00e-01", "B"] in rows
    # A model that diverges somewhere wins nothing there, and not over all.
    assert ["step_2", "4.00e-01", "-", "A"] in rows
    assert ["all", "3.54e-01", "-", "A"] in rows
    assert ["all", "65.00", "-", "A"] in rows


def test_a_tie_in_the_printed_digits_has_no_winner():
    tied = replace(
        comparison(),
        rmsd=np.array([[0.3, 0.4], [0.300000001, 0.5]]),
        fit_percent=np.array([[70.0, 60.0], [70.001, 50.0]]),
    )
    rows = [line.split() for line in comparison_text(tied).splitlines()]

    assert ["step_1", "3.00e-01'", "3.00e-01", "="] in rows
    assert ["step_1", "70.00", "70.00", "="] in rows
    assert ["step_2", "60.00", "50.00", "A"] in rows


def alone(compared):
    """Compare with nothing, on one recording."""
    return replace(
        compared,
        models=compared.models[:1],
        recordings=compared.recordings[:1],
        is_own=compared.is_own[:1, :1],
        rmsd=compared.rmsd[:1, :1],
        fit_percent=compared.fit_percent[:1, :1],
        shown=replace(compared.shown, simulated=compared.shown.simulated[:1]),
    )


def test_a_single_model_wins_nothing():
    text = comparison_text(alone(comparison()))
    assert "best" not in text
    assert ["step_1", "70.00"] in [line.split() for line in text.splitlines()]


def test_a_single_recording_is_only_drawn_in_full():
    figure = comparison_figure(alone(comparison()))
    middle, lower = figure.axes
    (legend,) = figure.legends

    assert middle.get_ylabel() == "output y [m]"
    assert lower.get_ylabel() == "y - yh [m]"
    assert [text.get_text() for text in legend.get_texts()] == [
        "A: m0/1/1, RMSD 3.00e-01 m"
    ]


def test_the_figure_names_models_units_and_the_recording():
    upper, middle, lower = comparison_figure(comparison()).axes
    assert upper.get_ylabel() == "RMSD [m]"
    assert "step_1" in middle.get_title(loc="left")
    assert lower.get_xlabel() == "time t [s]"
    assert len(middle.lines) == 3
