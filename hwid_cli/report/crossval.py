"""What the models of single recordings cover, as tables."""

from collections.abc import Sequence

from hwid_cli.records.report import RmsdMatrix
from hwid_cli.records.results import CrossValidation, ModelScore
from hwid_cli.records.units import behind
from hwid_cli.report.formats import number
from hwid_cli.report.table import Cell, Column, Row, Table, numbers, texts
from hwid_cli.report.thesis_names import thesis_name_of

# Models that are shown, the widest ones; coverage.csv has all.
_SHOWN = 15


def coverage_table(scores: Sequence[ModelScore], crossval: CrossValidation) -> Table:
    """Show the models that cover the most recordings.

    Parameters
    ----------
    scores : sequence of ModelScore
        As ``ranking.score_models`` gives them.
    """
    rows = tuple(
        (
            score.identified_on,
            str(score.nb),
            str(score.nk),
            f"{score.coverage} of {len(crossval.validated_on)}",
            number(score.rmsd),
            thesis_name_of(score.identified_on, score.orders),
        )
        for score in scores[:_SHOWN]
    )
    columns = (
        *texts("identified on"),
        *numbers("nb", "nk", "covers", "own RMSD"),
        Column("thesis's name", is_text=True, is_thesis=True),
    )
    caption = (
        f"Models that cover the most recordings: RMSD below {crossval.threshold:g}"
        f"{behind(crossval.unit)}"
    )
    return Table(caption, columns, rows, is_validation=True, published="T3.2.2.2-2")


def cross_table(matrix: RmsdMatrix) -> Table:
    """Show the widest model of each recording on all recordings.

    Returns
    -------
    Table
        What is covered is marked.
    """
    rows: tuple[Row, ...] = tuple(
        (
            model,
            *(Cell(number(one), is_marked=bool(one < matrix.threshold)) for one in row),
            str(covers),
        )
        for model, row, covers in zip(
            matrix.models, matrix.rmsd, matrix.covers, strict=True
        )
    )
    columns = (*texts("model"), *numbers(*matrix.recordings))
    caption = (
        f"For each recording its model that covers most: RMSD [{matrix.unit}], * below "
        f"{matrix.threshold:g}"
    )
    return Table(
        caption,
        (*columns, Column("covers", stays=True)),
        rows,
        is_validation=True,
        published="T3.2.2.2-3",
    )
