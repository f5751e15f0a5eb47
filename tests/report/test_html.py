import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from hwid_cli.records.report import ReportContents, StoredResults
from hwid_cli.report.groups import chain_table
from hwid_cli.report.html import report_page
from hwid_cli.stages.report import report_contents
from hwid_cli.stages.table import STAGES
from tests.report.report_examples import (
    calibrated,
    calibrated_only,
    stages,
    with_results,
)

SECTIONS = [
    "summary",
    "calibration",
    "recordings",
    "residuals",
    "orders",
    "crossval",
    "models",
    "groups",
    "test",
    "coverage",
    "assignment",
    "diagnosis",
    "trust",
]
# Elements of HTML that have no end.
VOID = {"meta", "img", "wbr"}


class Reader(HTMLParser):
    """Elements of a page in their order, and whether all are closed in the right one."""

    def __init__(self, html):
        super().__init__()
        self.elements, self.open, self.text = [], [], ""
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def read(page):
    return Reader(page.html)


@pytest.fixture(scope="module")
def bare():
    """A report of calibration alone."""
    return Reader(report_page(report_contents(calibrated_only()), STAGES).html)


def test_every_section_is_there_and_linked_from_the_top(read):
    assert [one["id"] for one in read.all("section")] == SECTIONS
    assert [one["href"] for one in read.all("a")] == [f"#{name}" for name in SECTIONS]


def test_elements_are_closed_in_the_right_order(read):
    assert read.open == []


def test_headings_begin_with_one_and_leave_no_level_out(read):
    levels = [int(tag[1]) for tag, _ in read.elements if re.fullmatch(r"h\d", tag)]

    assert levels.count(1) == 1
    assert levels[0] == 1
    assert max(np.diff(levels)) == 1


def test_the_page_says_its_language_and_fits_a_phone(read):
    assert read.all("html")[0]["lang"] == "en"
    assert {"name": "viewport", "content": "width=device-width, initial-scale=1"} in (
        read.all("meta")
    )


def test_the_page_needs_nothing_but_itself(page, read):
    assert all(one["src"].startswith("data:image/png;") for one in read.all("img"))
    assert not re.search(r"https?:|@import|url\(|<link|src=\"(?!data:)", page.html)


def test_every_image_has_a_text_and_its_size(read):
    assert len(read.all("img")) > 20
    for one in read.all("img"):
        assert len(one["alt"]) > 10
        assert int(one["width"]) > 100
        assert int(one["height"]) > 100


def test_every_figure_is_a_png_file_too(page, read):
    assert len(page.figures) == len(read.all("img"))
    for name, png in page.figures.items():
        assert re.fullmatch(r"[a-z]+/[\w+. -]+\.png", name)
        assert png.startswith(b"\x89PNG")


def test_every_figure_has_one_sentence_of_its_own(page):
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", page.html)

    assert len(captions) == page.html.count("<figure>")
    assert all(caption.endswith(".") for caption in captions)
    assert len(set(captions)) == len(captions)


def test_the_summary_says_what_came_out(read, contents):
    winner = contents.stored.search.chain_groups[-1]
    assert "6 recordings and 20 fitted models (20 converged)." in read.text
    assert f"the group {winner.name} covers {winner.coverage} of 5" in read.text
    assert "On 1 test recording that nothing else has used" in read.text


def test_hashes_and_keys_are_short_and_whole_in_the_title(read, contents):
    titles = {one.get("title") for one in read.all("td")}

    assert contents.stored.recordings[3].sha256 in titles
    assert contents.stored.stages[0].key in titles


def test_a_missing_stage_is_one_line_with_the_command(bare):
    assert [one["id"] for one in bare.all("section")] == SECTIONS
    for stage in ("crossval", "group", "test"):
        assert f"run 'hwid {stage} CONFIG'" in bare.text
    assert bare.all("img") == []


@pytest.mark.usefixtures("blank_figures")
def test_a_tensor_of_other_models_is_called_outdated(contents):
    outdated = replace(contents, cross=None, outdated=("crossval",))
    text = Reader(report_page(small(outdated), STAGES).html).text

    assert "belongs to other models: run 'hwid crossval CONFIG'" in text
    assert "older than the models" in text


def test_settings_that_changed_since_are_named(contents):
    run = replace(stages("calibrate")[0], changed=("recordings", "calibrate"))
    stored = StoredResults("a", "{}", "poles", stages=(run,))

    text = Reader(report_page(ReportContents(stored), STAGES).html).text
    assert "other settings now: recordings and calibrate" in text


def test_unknown_seconds_and_versions_are_said_to_be_unknown():
    run = replace(stages("calibrate")[0], seconds=float("nan"), versions={})
    stored = StoredResults("a", "{}", "poles", stages=(run,))

    text = Reader(report_page(ReportContents(stored), STAGES).html).text
    assert text.count("unknown") == 2


def small(contents):
    """Contents without what takes long to draw."""
    return replace(
        contents,
        simulated=(),
        models=(),
        grid=None,
        trend=None,
        chain_matrix=None,
        full_matrix=None,
        stored=with_results(contents.stored, group=None, test=None),
    )


def test_names_cannot_become_elements_of_the_page(page):
    name = 'a<script>alert("x")</script>&$\\alpha'
    stored = replace(
        with_results(calibrated_only(), calibrate=calibrated((name,))),
        name=name,
        config='{"name": "<b>"}',
        diagnosis={"verdict": "<i>none</i>"},
        calibration_figures={name: next(iter(page.figures.values()))},
    )
    hostile = report_page(report_contents(stored), STAGES)
    read = Reader(hostile.html)

    assert len(read.all("script")) == 1
    assert read.all("b") == []
    assert read.all("i") == []
    assert name in read.text


def test_recordings_are_folded_after_the_first_four(page):
    folded = page.html[page.html.index("2 more recordings with their best models") :]

    assert folded[: folded.index("</details>")].count("<img") == 4


@pytest.mark.parametrize(
    ("diagnosis", "expected"),
    [
        ({"verdict": "none"}, "There is no gap beyond the noise."),
        ({"verdict": "named", "complete": False}, "Part of it stays unexplained."),
        ({"verdict": "ambiguous", "ambiguous_with": ["x"]}, "cannot tell it from x."),
        ({}, "Verdict: -."),
    ],
)
def test_a_diagnosis_may_hold_little(contents, diagnosis, expected):
    stored = StoredResults("a", "{}", "poles", diagnosis=diagnosis)
    html = report_page(ReportContents(stored), STAGES).html

    assert expected in Reader(html).text


@pytest.mark.usefixtures("blank_figures")
def test_what_the_thesis_calls_things_is_on_a_page_that_asks_for_it(contents, page):
    stored = with_results(contents.stored, diagnose=None)
    stored = replace(stored, thesis_names=True)
    few = replace(contents, stored=stored, simulated=(), models=())
    asked = report_page(few, STAGES).html

    for word in ("(form of T3.2.2.2-2)", "(form of T3.4.1-1", "NLHW-Step-1-"):
        assert word in asked
        assert word not in page.html


def test_a_page_shows_the_tables_of_the_screen_with_details_and_notes(page, contents):
    heads = re.findall(r'<th scope="col"[^>]*>(.*?)</th>', page.html)
    table = chain_table(contents.stored.search)

    assert {*table.heads, "reach it", "linear RMSD"} <= set(heads)
    # Only a page has room for these.
    assert {"verdict", "follows its square", "note"} <= set(heads)
    assert f'<p class="note">{table.notes[0]}</p>' in page.html
    assert re.search(r'<td class=" marked">\d\.\d\de', page.html)
