"""Tables of single recordings' models (section 3.2), and RMSDs of any models."""

from collections import Counter
from collections.abc import Sequence

from hwid_cli.records.model import Fit
from hwid_cli.stages.ranking import best_fits, score_models
from tools.reproduction_evidence import Counts, Matrix, SelfRmsd
from tools.reproduction_here import Results, identified_on
from tools.reproduction_markdown import (
    group_label,
    kind_and_number,
    kinds_of,
    paragraph,
    short_number,
    table,
    wide_table,
)
from tools.reproduction_published import read_rows, recording_name

N_WIDEST = 15


def in_order(recordings: Sequence[str]) -> tuple[str, ...]:
    """Recordings once each, kind by kind as the kinds first occur, by number within.

    Parameters
    ----------
    recordings : sequence of str

    Returns
    -------
    tuple of str
    """
    found = kinds_of(tuple(dict.fromkeys(recordings)))
    return tuple(name for names in found.values() for name in sorted(names))


def self_rmsd_table(published: SelfRmsd, results: Results) -> str:
    """T3.2.2-1: the three lowest RMSD of each recording's models, side by side.

    Parameters
    ----------
    published : SelfRmsd
    results : Results

    Returns
    -------
    str
    """
    theirs = dict(zip(published.recordings, published.lowest, strict=True))
    by_delay = results.crossval is not None and results.crossval.nk_role == "delay"
    ours = {
        best[0].name: [_fit_cell(fit, by_delay) for fit in best]
        for best in best_fits(results.fits, published.lowest.shape[1])
        if best
    }
    count = published.lowest.shape[1]
    blank = ["-"] * count
    rows = []
    for name in in_order([*theirs, *ours]):
        left = (
            [short_number(value, 4) for value in theirs[name]]
            if name in theirs
            else blank
        )
        right = [*ours.get(name, []), *blank][:count]
        rows.append((group_label(name), *left, *right))
    heads = ("recording", *["published", "", ""][:count], *["here", "", ""][:count])
    return table(heads, rows)


def _fit_cell(fit: Fit, by_delay: bool) -> str:
    nk = fit.orders.nk if by_delay else fit.orders.nf
    return f"{short_number(fit.rmsd, 4)} ({fit.orders.nb}/{nk})"


def widest_models_table(singles: Counts | None, results: Results) -> str:
    """T3.2.2.2-2: the models that cover the most recordings, side by side.

    Parameters
    ----------
    singles : Counts or None
        Of all models here.
    results : Results

    Returns
    -------
    str
    """
    theirs = [
        (
            f"{published_number(int(row['identified_on']))} {row['nb']}/{row['nk']}",
            row["coverage"],
        )
        for row in read_rows("coverage_by_model")
    ]
    ours = []
    if results.crossval is not None and results.fits:
        for score in score_models(results.fits, results.crossval)[:N_WIDEST]:
            label = f"{group_label(score.identified_on)} {score.nb}/{score.nk}"
            ours.append((label, str(score.coverage), short_number(score.rmsd, 4)))
    rows = []
    for place in range(max(min(N_WIDEST, len(theirs)), len(ours))):
        left = theirs[place] if place < len(theirs) else ("-", "-")
        right = ours[place] if place < len(ours) else ("-", "-", "-")
        rows.append((str(place + 1), *left, *right))
    heads = ("rank", "published", "covers", "here", "covers", "own RMSD")
    parts = [
        table(heads, rows, text_columns=(1, 3)),
        paragraph(
            f"Published: {_histogram([int(count) for _, count in theirs])}, of 15."
        ),
    ]
    if singles is not None:
        parts.append(paragraph(f"Here: {_histogram(singles.values)}, of {singles.of}."))
    return "\n\n".join(parts)


def _histogram(counts: Sequence[int]) -> str:
    found = Counter(counts)
    return ", ".join(
        f"{found[count]} {'model covers' if found[count] == 1 else 'models cover'} {count}"
        for count in sorted(found, reverse=True)
    )


def matrix_table(labels: Sequence[str], matrix: Matrix, decimals: int = 3) -> str:
    """RMSD of models on recordings, one block for each kind; an asterisk is covered.

    Parameters
    ----------
    labels : sequence of str
        One for each model.
    matrix : Matrix
    decimals : int, [-]
        Of an RMSD that is neither very small nor very large.

    Returns
    -------
    str
    """
    blocks = []
    for kind, names in kinds_of(matrix.recordings).items():
        columns = [matrix.recordings.index(name) for name in names]
        rows = [
            [
                *(
                    short_number(rmsd, decimals) + ("*" if is_covered else " ")
                    for rmsd, is_covered in zip(
                        values[columns], covered[columns], strict=True
                    )
                ),
                str(int(covered[columns].sum())),
            ]
            for values, covered in zip(matrix.rmsd, matrix.covered, strict=True)
        ]
        heads = [kind_and_number(name)[1] or name for name in names]
        blocks.append(wide_table(kind, labels, [*heads, "covers"], rows))
    return "\n\n".join(blocks)


def model_label(model: str) -> str:
    """Name of a model for people.

    Parameters
    ----------
    model : str

    Returns
    -------
    str

    Examples
    --------
    >>> model_label("step_06+step_09/3/7")
    'step 6-9 3/7'
    """
    name = identified_on(model)
    return f"{group_label(name)} {model[len(name) + 1 :]}"


def published_number(number: int) -> str:
    """Label of a recording that the thesis knows by its number.

    Parameters
    ----------
    number : int, [-]
        1 to 38.

    Returns
    -------
    str

    Examples
    --------
    >>> published_number(20)
    'sine 5'
    """
    return group_label(recording_name(number))
