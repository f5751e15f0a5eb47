"""Section about cross-validation: what the models of single recordings cover."""

from functools import partial

import numpy as np

from hwid_cli.records.report import ReportContents, RmsdMatrix
from hwid_cli.report.crossval import coverage_table, cross_table
from hwid_cli.report.figures.matrices import rmsd_matrix_figure
from hwid_cli.report.formats import counted, listed
from hwid_cli.report.matrices import rmsd_matrix_table
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Section,
    section_notes,
)
from hwid_cli.report.sections.models import model_drawings, models_section
from hwid_cli.report.table import Text


def crossval_section(contents: ReportContents) -> Section:
    """Show the widest model of each recording on all recordings."""
    matrix = contents.cross
    blocks: list[PageBlock] = []
    missing = ""
    if "crossval" in contents.outdated:
        missing = (
            "the stored tensor belongs to other models: run 'hwid crossval CONFIG'."
        )
    elif matrix is None:
        missing = "not run yet: run 'hwid crossval CONFIG'."
    else:
        blocks += section_notes(contents, is_validation=True)
        blocks += [Text(_coverage_sentence(matrix)), rmsd_matrix_table(matrix)]
        widest = cross_table(matrix)
        blocks.append(Collapsible("The same as a table", (widest,)))
        if contents.scores and contents.stored.crossval is not None:
            found = contents.stored.crossval
            table = coverage_table(contents.scores, found)
            blocks.append(
                Collapsible("The models that cover the most recordings", (table,))
            )
    title = "Cross-validation: for each recording its model that covers most"
    return Section("crossval", title, "Cross-validation", tuple(blocks), missing)


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


def crossval_drawings(contents: ReportContents) -> tuple[Drawing, ...]:
    """The heat map as a file."""
    if contents.cross is None:
        return ()
    draw = partial(rmsd_matrix_figure, contents.cross)
    return (Drawing("crossval/matrix.png", draw),)


# Sections of the page, in their order, and figures beside it.
SECTIONS = (models_section, crossval_section)
DRAWINGS = (crossval_drawings, model_drawings)
