"""What the report says where there is little to say."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from hwid_cli.records.groups import Group, GroupSearch, Join
from hwid_cli.records.model import Information
from hwid_cli.records.report import ReportContents
from hwid_cli.report.final_test import gap_sentences
from hwid_cli.report.page import Collapsible
from hwid_cli.report.sections.about import about_section
from hwid_cli.report.sections.calibrate import calibration_section
from hwid_cli.report.sections.crossval import crossval_section
from hwid_cli.report.sections.group import groups_section
from hwid_cli.report.sections.identify import recording_drawings
from hwid_cli.report.sections.models import model_drawings, models_section
from hwid_cli.report.sections.test import (
    assignment_section,
    coverage_section,
    final_test_section,
)
from hwid_cli.report.table import Heading, Table, Text
from hwid_cli.stages.report import report_contents
from tests.report.report_examples import (
    calibrated,
    calibrated_only,
    names,
    with_results,
)

# Figures of rare shapes are rendered in the tests without this mark.
blank = pytest.mark.usefixtures("blank_figures")


def inside(blocks):
    """Blocks with those that others hold, without what is folded."""
    for block in blocks:
        yield block
        if block.kind in ("row", "answer"):
            yield from inside(block.blocks)
        elif block.kind == "picker":
            for _, inner in block.items:
                yield from inside(inner)


def said(section):
    """Sentences of a section, those of its charts too, and why it shows nothing."""
    found = [section.missing]
    for block in inside(section.blocks):
        if isinstance(block, Text | Heading):
            found.append(block.text)
        elif block.kind in ("chart", "dots"):
            found.append(block.sentence)
    return re.sub(r"\s+", " ", unescape(" ".join(found))).strip()


def tables(section):
    found = []
    for block in section.blocks:
        found += block.blocks if isinstance(block, Collapsible) else [block]
    return [block for block in found if isinstance(block, Table)]


def one_level(coverage):
    """A search over three recordings that ends on its first level."""
    who = ("c", "a", "b")
    return GroupSearch(
        groups=tuple(
            Group((n,), coverage, 1, 1, 1e-3, 1e-2, 1, 1, 1, False) for n in who
        ),
        joins=tuple(Join(1, name, "", name) for name in who),
        fits=(None, None, None),
        validated_on=who,
        rmsd=np.full((3, 3), 1e-3),
        chain=("c",) if coverage else (),
        reason="no model covers any recording",
        join="experiments",
        unit="m",
        threshold=0.01,
    )


@pytest.fixture
def nothing_covered(contents):
    """Results of all stages among which no model covers anything."""
    stored, final = contents.stored, contents.stored.final_test
    final = replace(
        final,
        rmsd=np.full(final.rmsd.shape, 0.5),
        covers=0 * final.covers,
        covered_by=0 * final.covered_by,
        uncovered=final.recordings,
        hard_to_cover=final.recordings,
        chain=(),
        smallest_set=(),
        assigned_in_set=tuple("" for _ in final.recordings),
        predictions=(),
    )
    crossval = stored.crossval
    crossval = replace(crossval, rmsd=np.full(crossval.rmsd.shape, 0.5))
    search = one_level(0)
    return report_contents(
        with_results(stored, test=final, group=search, crossval=crossval)
    )


def test_without_a_chain_the_tree_says_that_nothing_is_covered(nothing_covered):
    text = said(groups_section(nothing_covered))

    assert "There is no chain: no group covers any recording." in text
    assert "raises" not in text
    assert "reach" not in text


@blank
def test_without_a_chain_no_command_is_asked_for_that_has_run(nothing_covered):
    text = said(models_section(nothing_covered))

    assert text == "no model is chosen: no group covers any recording."


def test_where_nothing_is_covered_no_model_is_the_widest(nothing_covered):
    assert " of " not in said(coverage_section(nothing_covered))
    assert "No model covers a foreign recording." in said(
        coverage_section(nothing_covered)
    )
    assert "No model covers any of the 5" in said(crossval_section(nothing_covered))
    last = said(about_section(nothing_covered, [models_section(nothing_covered)]))
    assert "Models: no model is chosen: no group covers any recording." in last


@blank
def test_where_nothing_is_covered_there_is_no_set_of_models(nothing_covered):
    text = said(assignment_section(nothing_covered))

    assert text == ("No model covers any recording, so no set of models is of use.")


def test_a_chain_of_one_neither_raises_nor_goes_anywhere(contents):
    trend = contents.trend
    short = replace(
        contents,
        trend=replace(
            trend,
            models=trend.models[:1],
            rmsd=trend.rmsd[:1],
            mean=trend.mean[:1],
            covers=trend.covers[:1],
        ),
        chain_matrix=replace(
            contents.chain_matrix,
            models=trend.models[:1],
            rmsd=contents.chain_matrix.rmsd[:1],
            is_own=contents.chain_matrix.is_own[:1],
            covers=contents.chain_matrix.covers[:1],
        ),
        stored=with_results(contents.stored, group=one_level(2)),
    )

    groups = said(groups_section(short))
    assert "The winner, c, covers 2 of 3." in groups
    assert "The best coverage is 2; 3 groups reach it." in groups
    tested = said(final_test_section(short))
    assert f"with {trend.models[0]}, which covers" in tested
    assert "the chain's model covers" in tested
    for text in (groups, tested):
        assert not re.search("goes from|raises|with the last", text)


@blank
@pytest.mark.parametrize(
    ("covers", "expected"),
    [
        ((1, 2), "raises the coverage from 1 to 2 of 5"),
        ((2, 2), "keeps the coverage at 2 of 5"),
        ((2, 1), "moves the coverage from 2 to 1 of 5"),
    ],
)
def test_the_chain_says_how_its_coverage_goes(contents, covers, expected):
    search = contents.stored.search
    of = dict(zip(search.chain, covers, strict=True))
    groups = tuple(
        replace(one, coverage=of.get(one.name, one.coverage)) for one in search.groups
    )
    stored = with_results(contents.stored, group=replace(search, groups=groups))

    assert expected in said(groups_section(replace(contents, stored=stored)))


@blank
def test_a_recording_that_nobody_covers_is_not_listed_twice(contents):
    assert contents.stored.final_test.hard_to_cover == ("step_01", "step_03")

    text = said(coverage_section(contents))
    assert text.count("step_03") == text.count("step_01") == 2
    assert "not even their own: step_03." in text
    assert "cover 1 of 6 recordings: step_01." in text
    # A tenth of a few models is none of them.
    final = contents.stored.final_test
    alone = replace(final, covered_by=0 * final.covered_by)
    assert "No other model covers 1 of 6 recordings: step_01." in [
        one.text for one in gap_sentences(alone)
    ]


@blank
def test_a_peak_at_the_lowest_frequency_drawn_has_no_place(contents):
    view = contents.models[0]
    magnitude = np.linspace(1.0, 0.1, view.response.magnitude.size)
    low = replace(view, response=replace(view.response, magnitude=magnitude))
    text = said(models_section(replace(contents, models=(low,))))

    assert "and passes low frequencies most." in text
    assert "passes most at" not in text


@blank
def test_a_chosen_model_says_what_weighs_its_fit_against_its_parameters(contents):
    known = Information(n_samples=100, n_parameters=7, aic=-12.4, bic=5.6, fpe=4e-4)
    view = replace(contents.models[0], information=known)
    text = said(models_section(replace(contents, models=(view,))))

    assert (
        "The data determine 7 parameters: AIC -12, BIC 6, root of the final prediction "
        "error (FPE) 0.02 m."
    ) in text
    unknown = replace(view, information=Information())
    assert "AIC" not in said(models_section(replace(contents, models=(unknown,))))


@blank
def test_add_ons_stand_in_the_order_of_the_experiment(contents):
    who = ("step_10", "sine_2", "step_9")
    pairs = [(a, b) for a in who for b in who if a != b]
    members = [(name,) for name in who] + pairs
    search = replace(
        contents.stored.search,
        groups=tuple(
            Group(one, 1, 1, 1, 1e-3, 1e-2, 1, 1, 1, False) for one in members
        ),
        joins=(
            *(Join(1, name, "", name) for name in who),
            *(Join(2, a, b, f"{a}+{b}") for a, b in pairs),
        ),
        fits=tuple(None for _ in members),
        rmsd=np.full((len(members), len(contents.stored.search.validated_on)), 1e-3),
        chain=("step_10",),
    )
    stored = with_results(contents.stored, group=search)
    joined = tables(groups_section(replace(contents, stored=stored)))[2]

    assert joined.heads == ("base", *who, "widest")


@blank
def test_figures_of_names_that_look_alike_are_files_of_their_own(contents):
    shown = contents.simulated[0]
    who = ("c#", "c_", "C#", "d", "d_detail")
    alike = replace(
        contents,
        simulated=tuple(
            replace(shown, recording=replace(shown.recording, name=name))
            for name in who
        ),
    )
    files = [
        one.file.casefold()
        for one in recording_drawings(alike)
        if one.file.startswith("recordings/")
    ]

    assert len(set(files)) == len(files) == 2 * len(who)


@blank
def test_figures_of_models_that_look_alike_are_files_of_their_own(contents):
    view = contents.models[0]
    alike = replace(
        contents,
        models=tuple(replace(view, model=name) for name in ("c#/1/2", "c_/1/2")),
    )
    files = [one.file for one in model_drawings(alike)]

    assert len(set(files)) == len(files) == 6


@pytest.mark.parametrize(("count", "is_folded"), [(12, False), (13, True)])
def test_a_long_calibration_table_is_folded(count, is_folded):
    stored = with_results(calibrated_only(), calibrate=calibrated(names(count)))
    first = calibration_section(ReportContents(stored)).blocks[0]

    assert isinstance(first, Collapsible) == is_folded


@blank
def test_what_each_level_of_the_chain_covers_is_said_in_words(contents):
    trend = replace(contents.trend, covers=np.array([0, 1]))
    tested = said(final_test_section(replace(contents, trend=trend)))

    assert (
        "From level 1 to 2 of the chain the models cover (RMSD below the threshold) 0 of 1, "
        "1 of 1 of these recordings."
    ) in tested


@blank
def test_the_chosen_models_begin_with_the_winner_of_the_chain(contents):
    *_, winner = contents.stored.search.chain
    section = models_section(contents)
    (picker,) = [one for one in section.blocks if one.kind == "picker"]
    assert len(picker.items) > 1
    assert picker.items[0][0] == contents.models[-1].model
    assert picker.items[0][0].startswith(winner)
    assert "The chain of groups, the winner first." in said(section)
