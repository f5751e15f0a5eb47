import base64
import hashlib
import json
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

# Sections of results that only calibration has given.
OF_CALIBRATION = ["summary", "recordings", "calibration", "about"]
# Elements of HTML that have no end.
VOID = {"meta", "wbr"}
JSON = "application/json"


class Reader(HTMLParser):
    """Elements of a page in their order, and whether all are closed in the right one."""

    def __init__(self, html):
        super().__init__()
        self.elements, self.open, self.text, self.data = [], [], "", []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("script", "style"):
            self.data.append((self.open[-1], self.elements[-1][1], data))
        else:
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


def test_every_section_is_there_and_linked_from_the_top(read, section_ids):
    assert [one["id"] for one in read.all("section")] == section_ids
    assert [one["href"] for one in read.all("a")] == [f"#{one}" for one in section_ids]


def test_answers_stand_before_what_they_rest_on(read):
    ids = [one["id"] for one in read.all("section")]
    told = ["summary", "diagnosis", "test", "crossval", "calibration", "about"]

    # One section of each end and of some stages; others may stand between them.
    assert [one for one in ids if one in told] == told


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
    assert read.all("link") == read.all("iframe") == read.all("object") == []
    assert read.all("img") == []
    assert [one for one in read.all("script") if "src" in one] == []
    texts = [data for tag, _, data in read.data if tag == "style"]
    assert not re.search(r"@import|url\(", "".join(texts))
    beside = page.html
    for _, _, data in read.data:
        beside = beside.replace(data, "")
    assert not re.search(r"https?:|src=", beside)


def policy_of(read):
    (text,) = [
        one["content"]
        for one in read.all("meta")
        if one.get("http-equiv") == "Content-Security-Policy"
    ]
    return dict(part.strip().split(" ", 1) for part in text.split(";"))


def test_the_policy_allows_the_script_and_the_style_of_the_page_and_no_others(read):
    policy = policy_of(read)

    def allowed(tag, attributes):
        texts = [
            data for name, of, data in read.data if name == tag and of == attributes
        ]
        digest = hashlib.sha256("".join(texts).encode()).digest()
        return f"'sha256-{base64.b64encode(digest).decode()}'"

    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == allowed("script", {})
    assert policy["style-src"] == allowed("style", {})
    assert policy["img-src"] == "blob:"


def test_nothing_on_the_page_needs_what_the_policy_forbids(read):
    for _, attributes in read.elements:
        assert "style" not in attributes
        assert not [name for name in attributes if name.startswith("on")]


def test_the_licence_of_the_plotting_library_is_in_the_page(read):
    (script,) = [data for _, of, data in read.data if not of and "uPlot=" in data]

    assert "The MIT License" in script
    assert "Copyright (c) 2022 Leon Sorokin" in script


def charts_of(read):
    return [json.loads(data) for _, of, data in read.data if of.get("class") == "data"]


def test_every_chart_has_data_of_one_length_and_a_text_for_those_who_do_not_see_it(
    read,
):
    charts = charts_of(read)
    figures = [one for one in read.all("figure") if "chart" in one.get("class", "")]

    assert len(charts) == len(figures) > 20
    assert all(len(one["data-alt"]) > 20 for one in figures)
    for chart in charts:
        n_points = sum(run[2] for run in chart.get("runs", [])) or size(chart["x"])
        for panel in chart["panels"]:
            assert re.search(r"\[.+\]$", panel["yl"])
            for curve in panel["curves"]:
                for name in {"y", "low", "high"} & set(curve):
                    assert size(curve[name]) == n_points


def size(packed):
    return len(packed if isinstance(packed, list) else packed["d"])


def test_every_drawing_has_a_text_for_those_who_do_not_see_it(read):
    drawings = [one for one in read.all("svg") if one.get("role") == "img"]

    assert len(drawings) > 3
    assert all(len(one["aria-label"]) > 20 for one in drawings)


def test_figures_are_png_files_beside_the_page(page):
    names = [one.file for one in page.drawings]

    assert len(set(names)) == len(names) > 20
    for one in page.drawings:
        assert re.fullmatch(r"[a-z]+/[\w+. -]+\.png", one.file)
    assert page.drawings[-1].png.startswith(b"\x89PNG")


def test_every_chart_has_one_sentence_of_its_own(page):
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", page.html)

    assert len(captions) == page.html.count("<figure")
    assert all(caption.rstrip().endswith(".") for caption in captions)


def test_the_answers_come_first_the_diagnosis_before_the_model(read, page):
    first = page.html[page.html.index("<main>") :]

    assert first.index("What does the simulation lack?") < first.index(
        "Which model describes the drive"
    )
    assert first.index("The simulation lacks Coulomb friction") < first.index(
        "A linear model is better"
    )
    # Hashes, versions and the configuration are folded at the end.
    for word in ("SHA-256", "Computed with", "&#34;name&#34;"):
        assert first.index(word) > first.index('<section id="about"')
        assert first.index(word) > first.rindex("<details", 0, first.index(word))


def test_the_end_says_how_much_was_fitted(read):
    assert "6 recordings and 20 fitted models (20 converged)." in read.text


def test_hashes_and_keys_are_short_and_whole_in_the_title(read, contents):
    titles = {one.get("title") for one in read.all("td")}

    assert contents.stored.recordings[3].sha256 in titles
    assert contents.stored.stages[0].key in titles


def test_a_missing_stage_is_one_line_with_the_command(bare):
    assert [one["id"] for one in bare.all("section")] == OF_CALIBRATION
    before, _, after = bare.text.partition("About these results")
    for stage in ("identify", "crossval", "group", "test", "diagnose"):
        assert f"run 'hwid {stage} CONFIG'" in after
    assert "not run yet" not in before


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
    )
    hostile = report_page(report_contents(stored), STAGES)
    read = Reader(hostile.html)

    # One program, and data that are no program.
    assert [one for one in read.all("script") if one.get("type") != JSON] == [{}]
    assert read.all("b") == []
    assert read.all("i") == []
    assert name in read.text
    assert name in {one.get("data-name") for one in read.all("figure")}


def test_each_recording_can_be_picked_where_recordings_differ(read, contents):
    pickers = [one for one in read.all("div") if one.get("class") == "picker"]
    kinds = [one["data-kind"] for one in pickers]
    names = [one["value"] for one in read.all("option")]

    # Recordings, residuals, orders and calibration.
    assert kinds.count("recording") == 4
    assert kinds.count("model") == 1
    for one in contents.stored.recordings:
        assert names.count(one.name) >= 2


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
