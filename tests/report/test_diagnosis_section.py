from dataclasses import replace

import pytest

from hwid_cli.records.report import ReportContents, StoredResults
from hwid_cli.report.diagnosis import diagnosis_blocks
from hwid_cli.report.page import Collapsible
from hwid_cli.report.sections.diagnose import diagnosis_drawings, diagnosis_section
from hwid_cli.report.sections.diagnosis_answer import overlay_chart
from hwid_cli.report.table import Heading, Table, Text
from tests.conftest import leave_figures_blank
from tests.report.diagnosis_examples import NAN, named, nothing_missing, unknown
from tests.report.report_examples import DIAGNOSIS

# What the figures show is the matter of tests/report/figures.
blank = pytest.mark.usefixtures("blank_figures")


def contents_of(record=None, diagnosis=None):
    results = {"diagnose": record}
    stored = StoredResults("a", "{}", "poles", results=results, diagnosis=diagnosis)
    return ReportContents(stored)


def section_of(record=None, diagnosis=None):
    return diagnosis_section(contents_of(record, diagnosis))


def texts(section):
    return [one.text for one in section.blocks if isinstance(one, Text)]


def headings(section):
    return [one.text for one in section.blocks if isinstance(one, Heading)]


def sentences(section):
    return [one.sentence for one in section.blocks if one.kind == "dots"]


def tables(section):
    return [one for one in section.blocks if isinstance(one, Table)]


@pytest.fixture(scope="module")
def of_nine():
    """Dry friction found in nine recordings."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        return section_of(named())


def test_the_summary_comes_first_and_the_effects_follow(of_nine):
    found = of_nine
    effect = named().effects[0]

    assert texts(found)[0] == named().summary
    assert texts(found)[1:3] == [
        f"{effect.id}: {effect.sentence}",
        f"Law of {effect.id}: {effect.equation}",
    ]
    assert tables(found)[0].rows[0][0] == "coulomb_friction"
    assert headings(found) == [
        "The gap",
        "Measured and simulated",
        "Where the error sits",
        "Parameters of the simulation",
        "Candidates",
    ]


def test_every_figure_lies_in_its_folder():
    files = [one.file for one in diagnosis_drawings(contents_of(named()))]

    assert files == [
        f"diagnosis/{name}.png"
        for name in ("gap", "overlay", "force", "ranking", "where")
    ]


def test_each_recording_of_the_overlay_can_be_picked(of_nine):
    (picker,) = [one for one in of_nine.blocks if one.kind == "picker"]

    assert [name for name, _ in picker.items] == [one.name for one in named().overlays]
    chart = picker.items[0][1][0]
    assert [one.label for one in chart.panels] == ["output y [m]", "residual e [m]"]


def test_a_command_that_is_compared_is_called_so():
    of_loop = replace(named(), compared="command u", output_unit="A")
    chart = overlay_chart(of_loop.overlays[0], of_loop)

    assert [one.label for one in chart.panels] == ["command u [A]", "residual e [A]"]


def with_gaps_alone(**changes):
    """That diagnosis with one figure to draw."""
    return replace(
        named(), overlays=(), places=(), latent_force=(), candidates=(), **changes
    )


@blank
def test_the_worst_held_out_recordings_are_called_out():
    found = with_gaps_alone()
    rms = {"step_03": 9e-4, "step_00": 8e-4, "sine_01": 1.0}
    gaps = [
        replace(one, rms_after=rms.get(one.name, one.rms_after)) for one in found.gaps
    ]
    sentence = sentences(section_of(replace(found, gaps=tuple(gaps))))[0]

    told = sentence.replace("\N{NO-BREAK SPACE}", " ")
    assert "left in step_03 (0.0009 m), step_00 (0.0008 m) and step_06" in told
    assert "sine_01" not in told


@blank
def test_without_numbers_no_recording_is_the_worst():
    found = with_gaps_alone()
    gaps = tuple(replace(one, rms_after=NAN) for one in found.gaps)

    assert sentences(section_of(replace(found, gaps=gaps)))[0].endswith("the noise.")


@blank
def test_long_tables_are_folded():
    folded = [
        one for one in section_of(named(43)).blocks if isinstance(one, Collapsible)
    ]

    assert [one.summary for one in folded] == [
        "The gap in 43 recordings as a table",
        "12 candidates as a table",
    ]
    assert [len(one.blocks[0].rows) for one in folded] == [43, 12]


@blank
def test_where_nothing_is_missing_the_section_is_short():
    found = section_of(nothing_missing())

    assert texts(found)[0] == "Nothing is missing."
    assert headings(found) == ["The gap", "Parameters of the simulation"]
    assert len(diagnosis_drawings(contents_of(nothing_missing()))) == 1


@blank
def test_an_unknown_gap_shows_the_force_without_a_law():
    found = section_of(unknown())

    assert "The force that the simulation lacks follows velocity most." in texts(found)
    (row,) = [one for one in found.blocks if one.kind == "row"]
    labels = [curve.label for curve in row.blocks[0].panels[0].curves]
    assert labels == ["spread, \N{PLUS-MINUS SIGN}1 sd", "from measurements"]
    assert "coulomb_friction" not in str(tables(found))


@blank
def test_the_record_goes_before_the_file():
    found = section_of(with_gaps_alone(), {"verdict": "none"})

    assert "There is no gap beyond the noise." not in texts(found)


def test_older_results_have_the_file_alone():
    found = section_of(diagnosis=DIAGNOSIS)

    assert texts(found)[0] == "The gap between simulation and measurement has a name."
    assert "Near standstill." in texts(found)
    effects, gap = tables(found)
    assert effects.rows[0][2:] == ("force_N", "0.81", "0.79 to 0.83")
    assert gap.rows[1] == ("with the effects", "2e-05", "2.2e-05", "1")


@blank
@pytest.mark.parametrize("count", [1, 43])
def test_counts_are_told(count):
    found = replace(named(count), overlays=(), places=(), latent_force=())
    remark = " ".join(texts(section_of(found)))
    held_out = "1 recording held out" if count == 1 else "15 recordings held out"

    assert held_out in remark


DOUBT = "force_constant_N_per_A was 3.34 and is fitted as 0.41: check its value"


@blank
def test_a_warning_stands_right_behind_the_summary_on_page_and_screen():
    found = replace(named(), warnings=(DOUBT,))
    assert texts(section_of(found))[1] == f"Warning: {DOUBT}."
    shown = [one.text for one in diagnosis_blocks(found) if isinstance(one, Text)]
    assert shown[1:3] == [found.summary, f"Warning: {DOUBT}."]


def test_a_page_from_the_json_file_alone_has_the_warning_too():
    section = section_of(diagnosis={**DIAGNOSIS, "warnings": [DOUBT]})
    assert f"Warning: {DOUBT}." in texts(section)
