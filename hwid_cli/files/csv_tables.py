"""Tables for people and spreadsheets: CSV with commas, decimal points and a header."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from hwid_cli.files.atomic import replace_file
from hwid_cli.records.comparison import Comparison
from hwid_cli.records.results import CrossValidation, ModelScore

CROSSVAL_COLUMNS = ("identified_on", "nb", "nk", "validated_on", "rmsd", "status")
COMPARE_COLUMNS = (
    "recording",
    "model",
    "rmsd",
    "fit_percent",
    "unit",
    "identified_on_it",
    "initial_state",
)
COVERAGE_COLUMNS = ("identified_on", "nb", "nk", "coverage", "of")


def write_table_csv(
    path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]
) -> None:
    """Write a table as CSV, as a whole or not at all.

    Parameters
    ----------
    rows : iterable of sequences
        Floats are written with all their digits; None leaves a cell blank.

    Raises
    ------
    CacheError
        If it cannot be written; an old file is untouched then.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    replace_file(path, text.getvalue().encode("utf-8"))


def write_crossval_csv(path: Path, crossval: CrossValidation) -> None:
    """Write ``crossval.csv``: one row for each model and judging recording.

    Parameters
    ----------
    crossval : CrossValidation
        A missing RMSD is written as ``nan``.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    rows = (
        (
            crossval.identified_on[n],
            crossval.nb[b],
            crossval.nk[k],
            crossval.validated_on[m],
            float(crossval.rmsd[n, b, k, m]),
            str(crossval.status[n, b, k, m]),
        )
        for n, b, k, m in np.ndindex(*crossval.rmsd.shape)
    )
    write_table_csv(path, CROSSVAL_COLUMNS, rows)


def write_coverage_csv(path: Path, scores: Sequence[ModelScore], of: int) -> None:
    """Write ``coverage.csv``: how many recordings each model covers.

    Parameters
    ----------
    scores : sequence of ModelScore
        Written in this order.
    of : int, [-]
        Number of recordings that judged.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    rows = (
        (score.identified_on, score.nb, score.nk, score.coverage, of)
        for score in scores
    )
    write_table_csv(path, COVERAGE_COLUMNS, rows)


def write_compare_csv(path: Path, comparison: Comparison) -> None:
    """Write ``compare.csv``: one row for each recording and model.

    Parameters
    ----------
    comparison : Comparison
        Where a model diverges, ``nan`` is written.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    rows = (
        (
            recording,
            one.name,
            float(comparison.rmsd[n, m]),
            float(comparison.fit_percent[n, m]),
            comparison.output_unit,
            int(comparison.is_own[n, m]),
            one.model.initial_state,
        )
        for m, recording in enumerate(comparison.recordings)
        for n, one in enumerate(comparison.models)
    )
    write_table_csv(path, COMPARE_COLUMNS, rows)
