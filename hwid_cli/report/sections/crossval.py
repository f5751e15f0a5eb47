"""Section about cross-validation: what the models of single recordings cover."""

import numpy as np

from hwid_cli.records.report import ReportContents, RmsdMatrix
from hwid_cli.report.crossval import coverage_table, cross_table
from hwid_cli.report.figures.matrices import rmsd_matrix_figure
from hwid_cli.report.formats import counted, listed, with_unit
from hwid_cli.report.page import (
    Collapsible,
    Figures,
    PageBlock,
    Section,
    drawn,
    section_notes,
)
from hwid_cli.report.sections.models import models_section
from hwid_cli.report.table import Text


def crossval_section(contents: ReportContents) -> Section:
    """Show the widest model of each recording on all recordings."""
    matrix = contents.cross
    blocks: list[PageBlock] = []
    if "crossval" in contents.outdated:
        text = "The stored tensor belongs to other models: run 'hwid crossval CONFIG'."
        blocks.append(Text(text, is_note=True))
    elif matrix is None:
        blocks.append(Text("Not run yet: run 'hwid crossval CONFIG'.", is_note=True))
    else:
        blocks += section_notes(contents, is_validation=True)
        alt = "Heat map of the RMSD of each recording's widest model on all recordings"
        figure = drawn("crossval/matrix", rmsd_matrix_figure(matrix), alt)
        sentence = (
            f"{_coverage_sentence(matrix)} A dot marks an RMSD below "
            f"{with_unit(matrix.threshold, matrix.unit)}, a square the recording "
            "of the fit, the line in the colour bar the threshold."
        )
        blocks.append(Figures((figure,), sentence))
        widest = cross_table(matrix)
        blocks.append(
            Collapsible("The widest model of each recording as a table", (widest,))
        )
        if contents.scores and contents.stored.crossval is not None:
            found = contents.stored.crossval
            table = coverage_table(contents.scores, found)
            blocks.append(
                Collapsible("The models that cover the most recordings", (table,))
            )
    title = "Cross-validation: the widest model of each recording"
    return Section("crossval", title, "Cross-validation", tuple(blocks))


def _coverage_sentence(matrix: RmsdMatrix) -> str:
    row, column = int(matrix.covers.argmax()), int(matrix.covered_by.argmin())
    if not matrix.covers[row]:
        return f"No model covers any of the {len(matrix.recordings)}, not even its own."
    widest = (
        f"{matrix.models[row]} covers the most, {matrix.covers[row]} of "
        f"{len(matrix.recordings)} (its own among them)"
    )
    if not matrix.covered_by[column]:
        nobody = np.flatnonzero(matrix.covered_by == 0)
        names = listed([matrix.recordings[place] for place in nobody])
        return f"{widest}; none of these models covers {names}."
    return (
        f"{widest}; hardest to cover is {matrix.recordings[column]}, by "
        f"{counted(int(matrix.covered_by[column]), 'model')}."
    )


# Sections of the page, in their order.
SECTIONS = (crossval_section, models_section)
