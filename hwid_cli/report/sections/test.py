"""Sections about the final test: the chain, the coverage matrix, the assignment."""

from functools import partial

import numpy as np

from hwid_cli.records.report import ChainOnTests, ReportContents, RmsdMatrix
from hwid_cli.report.dots import Dot, DotGroup, DotRow, Dots
from hwid_cli.report.figures.final_test import trend_figure
from hwid_cli.report.figures.matrices import rmsd_matrix_figure
from hwid_cli.report.final_test import (
    assignment_table,
    chain_coverage_table,
    chain_on_tests_table,
    chain_tables,
    coverage_matrix_table,
    gap_sentences,
    prediction_table,
    smallest_set_table,
)
from hwid_cli.report.formats import counted, listed, with_unit
from hwid_cli.report.matrices import rmsd_matrix_table
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Section,
    collapsed_beyond,
    section_notes,
)
from hwid_cli.report.table import Text
from hwid_cli.report.thesis_names import names_of_groups

_NOT_RUN = "not run yet: run 'hwid test CONFIG'."
# Rows of a table that is shown open.
_MOST_OPEN = 15


def final_test_section(contents: ReportContents) -> Section:
    """Show the chain of groups on the test recordings and on all recordings."""
    trend, matrix = contents.trend, contents.chain_matrix
    blocks: list[PageBlock] = []
    missing = ""
    if trend is None or matrix is None:
        missing = _NOT_RUN
    elif not trend.models:
        missing = (
            "no chain of groups was tested; what the models do on the test recordings "
            "stands under Coverage."
        )
    else:
        blocks += section_notes(contents, is_validation=True)
        if trend.recordings:
            blocks += [Text(_trend_sentence(trend)), _trend_dots(trend)]
        covers = ", ".join(map(str, matrix.covers))
        is_one = len(matrix.models) == 1
        ways = ("model covers", "its") if is_one else ("models cover", "their")
        sentence = (
            f"On all {len(matrix.recordings)} recordings the chain's {ways[0]} "
            f"{covers}, {ways[1]} own left out."
        )
        blocks += [
            Text(sentence),
            rmsd_matrix_table(matrix, "covers others"),
            *_chain(contents),
        ]
    title = "Test: the chain of groups on recordings that nothing else has used"
    return Section("test", title, "Test", tuple(blocks), missing)


def _chain(contents: ReportContents) -> list[PageBlock]:
    """The chain's numbers as tables."""
    final, trend, stored = contents.stored.final_test, contents.chain, contents.stored
    if final is None or trend is None:
        return []
    kinds = {one.name: one.kind for one in stored.recordings}
    names = names_of_groups(stored.search)
    tables = (
        chain_on_tests_table(final, trend),
        *chain_tables(final, trend, kinds),
    )
    return [
        chain_coverage_table(final, trend, names),
        Collapsible("The RMSD along the chain as tables", tables),
    ]


def _trend_sentence(trend: ChainOnTests) -> str:
    first, last = (with_unit(trend.mean[place], trend.unit) for place in (0, -1))
    start = f"The mean RMSD on {listed(trend.recordings)}"
    counts = [f"{one} of {len(trend.recordings)}" for one in trend.covers]
    covers = ", ".join(counts)
    if len(trend.models) == 1:
        return f"{start} is {first} with {trend.models[0]}, which covers {covers}."
    return (
        f"{start} goes from {first} with {trend.models[0]} to {last} with "
        f"{trend.models[-1]}. From level 1 to {len(trend.models)} of the chain the models "
        f"cover (RMSD below the threshold) {covers} of these recordings."
    )


def _trend_dots(trend: ChainOnTests) -> Dots:
    """The chain's models on the test recordings, beside the threshold."""
    groups = []
    for row, model in enumerate(trend.models):
        rows = [
            DotRow(name, (Dot(float(value), "taken", with_unit(value, trend.unit)),))
            for name, value in zip(trend.recordings, trend.rmsd[row], strict=True)
        ]
        groups.append(DotGroup(model, tuple(rows)))
    threshold = with_unit(trend.threshold, trend.unit)
    return Dots(
        label=f"RMSD [{trend.unit}]",
        groups=tuple(groups),
        sentence=f"RMSD of each model on each test recording; the dashed line is the threshold, {threshold}.",
        alt="RMSD of the chain's models on the test recordings, with the threshold",
        reference=(trend.threshold, f"threshold {threshold}"),
        is_log=True,
    )


def coverage_section(contents: ReportContents) -> Section:
    """Show all models of the final test on all recordings."""
    final, matrix = contents.stored.final_test, contents.full_matrix
    blocks: list[PageBlock] = []
    missing = ""
    if final is None or matrix is None:
        missing = _NOT_RUN
    else:
        blocks += section_notes(contents, is_validation=True)
        blocks += [
            Text(_matrix_sentence(matrix)),
            rmsd_matrix_table(matrix, "covers others"),
        ]
        blocks += gap_sentences(final)
        table = coverage_matrix_table(final)
        blocks.append(Collapsible("The coverage as a table", (table,)))
    title = "Coverage: all models on all recordings"
    return Section("coverage", title, "Coverage", tuple(blocks), missing)


def _matrix_sentence(matrix: RmsdMatrix) -> str:
    row = int(np.argmax(matrix.covers))
    return (
        f"{matrix.models[row]} covers the most foreign recordings, "
        f"{matrix.covers[row]} of {len(matrix.recordings)}."
        if matrix.covers[row]
        else "No model covers a foreign recording."
    )


def assignment_section(contents: ReportContents) -> Section:
    """Show which model serves which recording, and how well inputs tell it."""
    final = contents.stored.final_test
    blocks: list[PageBlock] = []
    missing = _NOT_RUN if final is None else ""
    if final is not None:
        if final.smallest_set:
            blocks += section_notes(contents, is_validation=True)
        blocks.append(smallest_set_table(final))
        of = counted(len(final.recordings), "recording")
        table = assignment_table(final)
        blocks.append(collapsed_beyond(_MOST_OPEN, table, f"The assignment of {of}"))
        counts = contents.predictions
        if counts is not None and counts.total:
            text = (
                "Told from the input alone, by the model that serves the recording with "
                f"the most similar input, the choice is right for {counts.right} of "
                f"{counts.total} recordings; {counts.possible} are covered by some "
                "model that could have been chosen."
            )
            blocks.append(Text(text))
            table = prediction_table(final)
            blocks.append(
                collapsed_beyond(_MOST_OPEN, table, f"The predictions of {of}")
            )
    title = "Assignment: which model for which recording"
    return Section("assignment", title, "Assignment", tuple(blocks), missing)


def final_drawings(contents: ReportContents) -> tuple[Drawing, ...]:
    """Figures of the final test as files."""
    trend, matrix = contents.trend, contents.chain_matrix
    found = []
    if trend is not None and matrix is not None and trend.models:
        if trend.recordings:
            found.append(Drawing("test/trend.png", partial(trend_figure, trend)))
        found.append(Drawing("test/chain.png", partial(rmsd_matrix_figure, matrix)))
    full = contents.full_matrix
    if contents.stored.final_test is not None and full is not None:
        draw = partial(rmsd_matrix_figure, full)
        found.append(Drawing("coverage/matrix.png", draw))
    return tuple(found)


# Sections of the page, in their order, and figures beside it.
SECTIONS = (final_test_section, coverage_section, assignment_section)
DRAWINGS = (final_drawings,)
