"""Sections about the final test: the chain, the coverage matrix, the assignment."""

import numpy as np

from hwid_cli.records.groups import FinalTest, Prediction
from hwid_cli.records.report import ChainOnTests, ReportContents, RmsdMatrix
from hwid_cli.report.figures.final_test import trend_figure
from hwid_cli.report.figures.matrices import rmsd_matrix_figure
from hwid_cli.report.page import Block, Cell, Figures, Folded, Section, Table, Text
from hwid_cli.report.sections.words import drawn, listed, simulation_note, with_unit
from hwid_cli.report.text_table import number

_NOT_RUN = Text("Not run yet: run 'hwid test CONFIG'.", is_note=True)
# Rows of a table that is shown open.
_MOST_OPEN = 15


def final_test_section(contents: ReportContents) -> Section:
    """Show the chain of groups on the test recordings and on all recordings."""
    trend, matrix = contents.trend, contents.chain_matrix
    blocks: list[Block] = []
    if trend is None or matrix is None:
        blocks.append(_NOT_RUN)
    elif not trend.models:
        blocks.append(Text("There is no chain of groups to test.", is_note=True))
    else:
        blocks += simulation_note(contents, is_validation=True)
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
        blocks.append(Figures((figure,), sentence))
    title = "Test: the chain of groups on recordings that nothing else has used"
    return Section("test", title, "Test", tuple(blocks))


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
    blocks: list[Block] = []
    if final is None or matrix is None:
        blocks.append(_NOT_RUN)
    else:
        blocks += simulation_note(contents, is_validation=True)
        alt = "Heat map of the RMSD of all models on all recordings"
        figure = drawn("coverage/matrix", rmsd_matrix_figure(matrix), alt)
        blocks.append(Figures((figure,), _matrix_sentence(matrix)))
        if len(final.uncovered) == len(final.recordings):
            covered = "No model covers any recording, not even its own."
        elif final.uncovered:
            covered = f"No model covers {listed(final.uncovered)}."
        else:
            covered = "Every recording is covered by some model."
        blocks.append(Text(covered))
        hard = [name for name in final.hard_to_cover if name not in final.uncovered]
        if hard:
            blocks.append(Text(f"Hardly any foreign model covers {listed(hard)}."))
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
    blocks: list[Block] = []
    if final is None:
        blocks.append(_NOT_RUN)
    else:
        blocks.append(Text(_smallest_set(final)))
        if final.smallest_set:
            blocks += simulation_note(contents, is_validation=True)
        blocks.append(_maybe_folded("The assignment", _assignment_table(final)))
        counts = contents.predictions
        if counts is not None and counts.total:
            text = (
                "Told from the input alone, by the model that serves the recording with "
                f"the most similar input, the choice is right for {counts.right} of "
                f"{counts.total} recordings; {counts.possible} are covered by some "
                "model that could have been chosen."
            )
            blocks.append(Text(text))
            blocks.append(_maybe_folded("The predictions", _prediction_table(final)))
    title = "Assignment: which model for which recording"
    return Section("assignment", title, "Assignment", tuple(blocks))


def _smallest_set(final: FinalTest) -> str:
    within = len(final.recordings) - len(final.uncovered)
    names = listed(final.smallest_set)
    which = f"the {within} of {len(final.recordings)} recordings that any model covers"
    if not final.smallest_set:
        return "No model covers any recording: there is no set of models to choose."
    if len(final.smallest_set) == 1:
        return f"One model, {names}, covers {which}."
    return f"{len(final.smallest_set)} models together cover {which}: {names}."


def _maybe_folded(what: str, table: Table) -> Block:
    if len(table.rows) <= _MOST_OPEN:
        return table
    return Folded(f"{what} of {len(table.rows)} recordings", (table,))


def _assignment_table(final: FinalTest) -> Table:
    rows = []
    for column, name in enumerate(final.recordings):
        best = _rmsd_cell(final, final.assigned[column], column)
        in_set = _rmsd_cell(final, final.assigned_in_set[column], column)
        rows.append(
            (name, final.assigned[column], best, final.assigned_in_set[column], in_set)
        )
    heads = (
        "recording",
        "best model",
        f"RMSD [{final.unit}]",
        "best of the smallest set",
        f"RMSD [{final.unit}]",
    )
    caption = f"Bold: below the threshold of {with_unit(final.threshold, final.unit)}"
    return Table(caption, heads, tuple(rows), text_columns=(0, 1, 3))


def _rmsd_cell(final: FinalTest, model: str, column: int) -> Cell:
    if model not in final.models:
        return Cell("-")
    value = final.rmsd[final.models.index(model), column]
    return Cell(number(value), is_marked=bool(value < final.threshold))


def _prediction_table(final: FinalTest) -> Table:
    heads = (
        "recording",
        "verdict",
        "most similar input",
        "distance [-]",
        "model told",
        f"RMSD [{final.unit}]",
        "best choice",
        f"RMSD [{final.unit}]",
    )
    rows = tuple(
        (
            one.recording,
            _verdict(one),
            one.nearest,
            f"{one.distance:.3g}",
            one.model,
            Cell(number(one.rmsd), is_marked=bool(one.rmsd < final.threshold)),
            one.best_model,
            Cell(
                number(one.best_rmsd), is_marked=bool(one.best_rmsd < final.threshold)
            ),
        )
        for one in final.predictions
    )
    caption = "The model for each recording, told from its input alone"
    return Table(caption, heads, rows, text_columns=(0, 1, 2, 4, 6))


def _verdict(one: Prediction) -> str:
    if one.is_right:
        return "right"
    return "wrong" if one.is_possible else "no choice covers it"
