"""Tables of all models on all recordings (section 3.4.3)."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.records.groups import FinalTest
from tools.reproduction_evidence import Matrix
from tools.reproduction_here import Results
from tools.reproduction_markdown import (
    counted,
    group_label,
    kinds_of,
    name_list,
    paragraph,
    short_number,
    table,
)
from tools.reproduction_published import published_assignment
from tools.reproduction_tables_models import in_order, model_label

# Characters between two spaces in a row of covered recordings.
_STRIDE = 5


def margins_table(published: Matrix, here: Matrix | None) -> str:
    """T3.4.3-1: what each recording's model covers, and how many models cover it.

    Parameters
    ----------
    published : Matrix
    here : Matrix or None

    Returns
    -------
    str
        Models of single recordings only; a model and its own recording are left out.
    """
    theirs = _margins(published)
    ours = ({}, {}) if here is None else _margins(here)
    rows = []
    for name in in_order([*theirs[1], *ours[1]]):
        cells = [theirs[0], ours[0], theirs[1], ours[1]]
        values = [str(counts.get(name, "-")) for counts in cells]
        rows.append((group_label(name), *values))
    heads = (
        "recording",
        "covers, published",
        "covers, here",
        "covered by, published",
        "covered by, here",
    )
    return table(heads, rows)


def _margins(matrix: Matrix) -> tuple[dict[str, int], dict[str, int]]:
    singles = matrix.part(matrix.singles, matrix.recordings)
    others = singles.covered & ~singles.is_own
    covers = dict(zip(singles.models, map(int, others.sum(axis=1)), strict=True))
    covered_by = dict(
        zip(singles.recordings, map(int, others.sum(axis=0)), strict=True)
    )
    return covers, covered_by


def covered_rows(labels: Sequence[str], matrix: Matrix) -> str:
    """T3.4.3-1(2) and (3): which recordings each model of a chain covers.

    Parameters
    ----------
    labels : sequence of str
    matrix : Matrix

    Returns
    -------
    str
        One character for each recording, kind by kind: 1 covered, a point not.
    """
    kinds = kinds_of(matrix.recordings)
    heads, width = [], max(map(len, labels))
    rows: list[list[str]] = [[] for _ in labels]
    for kind, names in kinds.items():
        columns = [matrix.recordings.index(name) for name in names]
        cells = [
            _spaced("".join("1" if value else "." for value in covered[columns]))
            for covered in matrix.covered
        ]
        # A head longer than its few recordings pushes them apart.
        size = max(len(kind), len(cells[0]))
        heads.append(kind.ljust(size))
        for row, cell in zip(rows, cells, strict=True):
            row.append(cell.ljust(size))
    lines = [f"{'':{width}}  {'   '.join(heads)}  covers"]
    for label, row, count in zip(labels, rows, matrix.counts.values, strict=True):
        lines.append(f"{label:{width}}  {'   '.join(row)}  {count:6d}")
    return "\n".join(["```", *lines, "```"])


def _spaced(text: str) -> str:
    return " ".join(text[i : i + _STRIDE] for i in range(0, len(text), _STRIDE))


def assignment_table(results: Results) -> str:
    """T3.4.3-2: which model serves each recording, side by side.

    Parameters
    ----------
    results : Results

    Returns
    -------
    str
        Here once from the two chains, as in the thesis, once from the smallest set of
        models that covers whatever can be covered.
    """
    theirs = published_assignment()
    finals = [
        final for final in (results.final_1, results.final_2) if final is not None
    ]
    chains = _best_of_chains(finals)
    two = results.final_2
    chosen = (
        {} if two is None else dict(zip(two.recordings, _set_cells(two), strict=True))
    )
    rows = [
        (
            group_label(name),
            group_label(theirs[name]) if name in theirs else "-",
            chains.get(name, "-"),
            chosen.get(name, "-"),
        )
        for name in in_order([*theirs, *chains, *chosen])
    ]
    heads = (
        "recording",
        "published",
        "here, of the chains",
        "here, of the smallest set",
    )
    text = table(heads, rows, text_columns=(0, 1, 2, 3))
    if two is not None:
        names = "; ".join(model_label(model) for model in two.smallest_set) or "none"
        text += "\n\n" + paragraph(
            f"Smallest set of Combination Model 2's run, "
            f"{counted(len(two.smallest_set), 'model')}: {names}. Covered by no model at all: {name_list(two.uncovered)}."
        )
    return text


def _best_of_chains(finals: Sequence[FinalTest]) -> dict[str, str]:
    """Lowest RMSD among the models of all chains, by recording."""
    best: dict[str, tuple[float, str]] = {}
    for final in finals:
        first = len(final.models) - len(final.chain)
        for row, model in enumerate(final.models[first:], start=first):
            for name, rmsd in zip(final.recordings, final.rmsd[row], strict=True):
                if np.isfinite(rmsd) and rmsd < best.get(name, (np.inf, ""))[0]:
                    is_covered = bool(rmsd < final.threshold)
                    best[name] = (float(rmsd), _served(model, float(rmsd), is_covered))
    return {name: cell for name, (_, cell) in best.items()}


def _set_cells(final: FinalTest) -> list[str]:
    cells = []
    for column, model in enumerate(final.assigned_in_set):
        if not model:
            cells.append("-")
            continue
        rmsd = float(final.rmsd[final.models.index(model), column])
        cells.append(_served(model, rmsd, rmsd < final.threshold))
    return cells


def _served(model: str, rmsd: float, is_covered: bool) -> str:
    return f"{model_label(model)}: {short_number(rmsd)}{'*' if is_covered else ''}"
