from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.next import InputMap, NextRecordings, ProposedRecording
from hwid_cli.records.report import ReportContents, StoredResults
from hwid_cli.records.trust import RecordingTrust, ShownBand, TrustOnTests
from hwid_cli.report.bands import band_chart
from hwid_cli.report.figures.next import band_figure, visited_figure
from hwid_cli.report.sections.next import (
    trust_drawings,
    trust_section,
    visited_chart,
)
from hwid_cli.report.table import Table, Text
from tests.report.diagnosis_examples import named
from tests.report.report_examples import crossval, final_test

TIME = np.linspace(0.0, 1.0, 50)
ROW = RecordingTrust("a/1/2", "step_14", 0.9, 0.8, 0.7, 0.6, 0.93, 0.04, 0.01)
SHOWN = ShownBand(
    "a/1/2", "step_14", TIME, np.sin(TIME), np.sin(TIME) + 0.01, np.sin(TIME) - 0.02,
    np.sin(TIME) + 0.04, TIME < 0.5, "m",
)  # fmt: skip


def input_map():
    visited = np.outer(np.linspace(1.0, 0.1, 11), np.ones(12))
    octaves = 500.0 / 2.0 ** np.arange(11)
    edges = np.linspace(-1.0, 1.0, 13)
    return InputMap(octaves, edges, visited, 1.5 * visited, 2.0 * visited)


def found(**changes):
    proposal = ProposedRecording(
        "step_p100",
        "a positive step",
        np.ones(5),
        0.2,
        "share visited",
        "visits 20 % more",
    )
    return replace(
        NextRecordings(
            "coverage", ("a",), 0.5, "visited", False, "50 % visited", (proposal,),
            input_map(), 20, 0.01, "A",
        ),
        **changes,
    )  # fmt: skip


def contents_of(**results):
    return ReportContents(StoredResults("a", "{}", "poles", results=results))


def section(final=None, proposed=None):
    return trust_section(contents_of(test=final, next=proposed))


def words(blocks):
    return " ".join(one.text for one in blocks if isinstance(one, Text))


def test_without_results_the_section_says_what_to_run():
    missing = section().missing

    assert "run 'hwid test CONFIG'" in missing
    assert "'hwid next CONFIG'" in missing


@pytest.mark.usefixtures("blank_figures")
def test_bands_of_a_simulation_and_of_validated_models_are_shown():
    bands = TrustOnTests(
        (replace(ROW, model="simulation"),), replace(SHOWN, model="simulation")
    )
    contents = contents_of(
        diagnose=replace(named(), bands=bands),
        crossval=replace(crossval(), bands=TrustOnTests((ROW,))),
    )

    heading, chart, table, folded, note = trust_section(contents).blocks
    assert heading.text == "The simulation on recordings that were held out"
    assert note.text.startswith("value, rate, frequency: share of the samples")
    assert (table.notes, folded.blocks[0].notes) == ((), ())
    assert folded.blocks[0].rows[0][0] == "a/1/2"
    assert "recordings of others" in folded.blocks[0].caption
    files = [one.file for one in trust_drawings(contents)]
    assert files == ["next/simulation_band.png"]
    assert chart.name.startswith("simulation on ")
    assert "holds 93\N{NO-BREAK SPACE}% of what was measured" in chart.sentence
    assert table.rows[0][0] == "simulation"
    assert "the simulation may be trusted" in table.caption


@pytest.mark.usefixtures("blank_figures")
def test_bands_and_proposals_are_tables_with_a_figure_each():
    final = replace(final_test(), trust=TrustOnTests((ROW,), SHOWN))
    blocks = section(final, found(changed="new: b")).blocks

    tables = [one for one in blocks if isinstance(one, Table)]
    assert tables[0].rows[0][:2] == ("a/1/2", "step_14")
    assert tables[1].rows[0][1] == "step_p100"
    assert "New: b." in words(blocks)
    chart, visited = [one for one in blocks if one.kind == "chart"]
    assert visited.name == "visited"
    assert "holds 93\N{NO-BREAK SPACE}% of what was measured" in chart.sentence
    assert (
        "the values of 90\N{NO-BREAK SPACE}% of the samples, the rates of 80\N{NO-BREAK SPACE}% and"
        in chart.sentence
    )
    assert "the frequencies of 70\N{NO-BREAK SPACE}%" in chart.sentence
    assert words(blocks).count("one octave of the input is stronger") == 1


@pytest.mark.usefixtures("blank_figures")
def test_the_band_lies_beside_the_page_as_a_file():
    stored = StoredResults(
        *("a", "{}", "poles"),
        results={
            "test": replace(final_test(), trust=TrustOnTests((ROW,), SHOWN)),
            "next": found(),
        },
    )
    drawing, visited = trust_drawings(ReportContents(stored))
    assert (drawing.file, visited.file) == ("next/band.png", "next/visited.png")
    assert visited.draw().axes[0].get_ylabel() == "largest amplitude [A]"
    assert drawing.draw().axes[0].get_title(loc="left") == "a/1/2 on step_14"
    assert trust_drawings(ReportContents(replace(stored, results={}))) == []


def test_the_chart_shades_what_rests_on_data_and_says_where_nothing_does():
    chart = band_chart(SHOWN, "How it did.")
    panel, beneath, strip = chart.panels
    assert panel.spans == beneath.spans
    (on_data,) = strip.curves
    np.testing.assert_array_equal(on_data.upper, SHOWN.is_inside)
    assert panel.spans == ((0.0, pytest.approx(TIME[SHOWN.is_inside][-1])),)
    band, measured, predicted = panel.curves
    np.testing.assert_array_equal(band.values, SHOWN.lower)
    np.testing.assert_array_equal(band.upper, SHOWN.upper)
    np.testing.assert_array_equal(measured.values, SHOWN.measured)
    np.testing.assert_array_equal(predicted.values, SHOWN.output)
    assert "Shaded, and in the strip: rests on data" in chart.sentence
    # What is left of the measurement, and the same band about zero.
    band, left = beneath.curves
    np.testing.assert_allclose(left.values, -0.01, rtol=1e-12)
    np.testing.assert_allclose(band.values, -0.03, rtol=1e-12)
    np.testing.assert_allclose(band.upper, 0.03, rtol=1e-12)

    nothing = band_chart(replace(SHOWN, is_inside=TIME < 0), "How it did.")
    assert nothing.panels[0].spans == ()
    assert not nothing.panels[2].curves[0].upper.any()
    assert "nothing is shaded" in nothing.sentence


def test_a_long_prediction_keeps_its_single_peak():
    n_samples = 50_000
    peaked = np.zeros(n_samples)
    peaked[31_007] = 5.0
    flat = np.zeros(n_samples)
    time = 1e-3 * np.arange(n_samples)
    shown = ShownBand("a", "b", time, peaked, flat, flat, flat, flat == 0, "m")
    chart = band_chart(shown, "")

    measured = chart.panels[0].curves[1].values
    assert measured.size < 4100
    assert measured.max() == 5.0
    # A bin holds 25 samples.
    assert chart.at[measured.argmax()] == pytest.approx(31.007, abs=0.025)
    assert "thinned" in chart.sentence


def test_the_visited_octaves_are_steps_from_low_to_high():
    chart = visited_chart(input_map(), "A")
    on_offer, proposed, visited = chart.panels[0].curves

    assert chart.is_log
    assert (np.diff(chart.at) >= 0).all()
    # The highest octave ends at Nyquist's frequency, where the first row of the map is.
    assert chart.at[-2:].tolist() == [250.0, 500.0]
    assert visited.values[-2:].tolist() == [1.0, 1.0]
    np.testing.assert_allclose(proposed.values, 1.5 * visited.values)
    np.testing.assert_allclose(on_offer.values, 2.0 * visited.values)


def test_many_short_stretches_are_cut_to_the_longest():
    flags = np.arange(2000) % 4 != 0
    flags[500:600] = True
    many = replace(
        SHOWN,
        time_s=np.arange(2000.0),
        **{name: np.zeros(2000) for name in ("measured", "output", "lower", "upper")},
        is_inside=flags,
    )
    spans = band_chart(many, "").panels[0].spans
    assert len(spans) == 60
    assert (497.0, 599.0) in spans


def test_enough_is_said_without_a_table():
    blocks = section(
        None, found(proposals=(), is_enough=True, sentence="enough")
    ).blocks

    assert "Enough." in words(blocks)
    assert not [one for one in blocks if isinstance(one, Table)]


def test_the_strip_is_green_where_the_prediction_rests_on_data():
    figure = band_figure(SHOWN)
    strip = figure.axes[1]
    first, second = (one.get_paths()[0].get_extents() for one in strip.collections)

    # Green over the first half, red over the second.
    assert first.x1 <= 0.55
    assert second.x0 >= 0.45


def test_the_map_draws_visited_below_proposed_below_on_offer():
    axes = visited_figure(input_map(), "A").axes[0]
    heights = [line.get_ydata().max() for line in axes.lines]

    assert heights == [2.0, 1.5, 1.0]
