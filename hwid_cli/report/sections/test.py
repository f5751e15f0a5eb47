"""Sections about the final test: the chain, the coverage matrix, the assignment."""

import numpy as np

from hwid_cli.records.report import ChainOnTests, ReportContents, RmsdMatrix
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
from hwid_cli.report.page import (
    Collapsible,
    Figures,
    PageBlock,
    Section,
    collapsed_beyond,
    drawn,
    section_notes,
)
from hwid_cli.report.table import Text
from hwid_cli.report.thesis_names import names_of_groups

_NOT_RUN = Text("Not run yet: run 'hwid test CONFIG'.", is_note=True)
# Rows of a table that is shown open.
_MOST_OPEN = 15


def final_test_section(contents: ReportContents) -> Section:
    """Show the chain of groups on the test recordings and on all recordings."""
    trend, matrix = contents.trend, contents.chain_matrix
    blocks: list[PageBlock] = []
    if trend is None or matrix is None:
        blocks.append(_NOT_RUN)
    elif not trend.models:
        blocks.append(Text("There is no chain of groups to test.", is_note=True))
    else:
        blocks += section_notes(contents, is_validation=True)
        if trend.recordings:
            alt = "RMSD on the test recordings along the chain of groups"
            figure = drawn("test/trend", trend_figure(trend), alt)
            blocks.append(Figures((figure,), _trend_sentence(trend)))
        alt = "Heat map of the RMSD of the chain's models on all recordings"
        figure = drawn("test/chain", rmsd_matrix_figure(matrix), alt)
        covers = ", ".join(map(str, matrix.covers))
        is_one = len(matrix.models) == 1
        ways = ("model covers", "its") if is_one else ("models cover", "their")
        sentence = (
            f"On all {len(matrix.recordings)} recordings the chain's {ways[0]} "
            f"{covers}, {ways[1]} own left out."
        )
        blocks += [Figures((figure,), sentence), *_chain(contents)]
    title = "Test: the chain of groups on recordings that nothing else has used"
    return Section("test", title, "Test", tuple(blocks))


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
    covers = f"{', '.join(map(str, trend.covers))} of {len(trend.recordings)}"
    if len(trend.models) == 1:
        return f"{start} is {first} with {trend.models[0]}, which covers {covers}."
    return (
        f"{start} goes from {first} with {trend.models[0]} to {last} with "
        f"{trend.models[-1]}; the models cover {covers}."
    )


def coverage_section(contents: ReportContents) -> Section:
    """Show all models of the final test on all recordings."""
    final, matrix = contents.stored.final_test, contents.full_matrix
    blocks: list[PageBlock] = []
    if final is None or matrix is None:
        blocks.append(_NOT_RUN)
    else:
        blocks += section_notes(contents, is_validation=True)
        alt = "Heat map of the RMSD of all models on all recordings"
        figure = drawn("coverage/matrix", rmsd_matrix_figure(matrix), alt)
        blocks.append(Figures((figure,), _matrix_sentence(matrix)))
        blocks += gap_sentences(final)
        table = coverage_matrix_table(final)
        blocks.append(Collapsible("The coverage as a table", (table,)))
    title = "Coverage: all models on all recordings"
    return Section("coverage", title, "Coverage", tuple(blocks))


def _matrix_sentence(matrix: RmsdMatrix) -> str:
    row = int(np.argmax(matrix.covers))
    most = (
        f"{matrix.models[row]} covers the most foreign recordings, "
        f"{matrix.covers[row]} of {len(matrix.recordings)}."
        if matrix.covers[row]
        else "No model covers a foreign recording."
    )
    return (
        f"{most} A dot marks an RMSD below "
        f"{with_unit(matrix.threshold, matrix.unit)}, a square the recordings of the "
        "fit, which the counts leave out."
    )


def assignment_section(contents: ReportContents) -> Section:
    """Show which model serves which recording, and how well inputs tell it."""
    final = contents.stored.final_test
    blocks: list[PageBlock] = []
    if final is None:
        blocks.append(_NOT_RUN)
    else:
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
    return Section("assignment", title, "Assignment", tuple(blocks))


# Sections of the page, in their order.
SECTIONS = (final_test_section, coverage_section, assignment_section)
