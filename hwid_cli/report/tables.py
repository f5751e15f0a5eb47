"""Results as plain text that reads well on a screen, in a file and through a pipe."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.records.results import CrossValidation, ModelScore

WIDTH = 80
_GAP = "  "
# Words for the statuses of fits.
_STATUS_WORDS = {
    "converged": "converged",
    "iteration_limit": "stopped at the iteration limit",
    "stalled": "stalled",
    "failed": "failed",
}


def thesis_name(identified_on: str, nb: int, nk: int, nf: int | None = None) -> str:
    """Name of a model in the form of the published tables.

    Parameters
    ----------
    identified_on : str
        Name of the recording, or of several joined by ``+``.
    nb, nk : int, [-]
        Its place in the order grid.
    nf : int or None, [-]
        Number of poles where ``nk`` is a delay; None where ``nk`` counts the poles.

    Returns
    -------
    str
        Ends with the orders ``[nb nf nk]``.

    Examples
    --------
    >>> thesis_name("step_06", 3, 7)
    'NLHW-Step-6-3-7-1'
    >>> thesis_name("step_06+step_09", 3, 7)
    'NLHW-Step-6-9-3-7-1'
    >>> thesis_name("run7b", 2, 3, nf=4)
    'NLHW-run7b-2-4-3'
    """
    parts = identified_on.split("+")
    numbered = [re.fullmatch(r"([A-Za-z]+)_0*(\d+)", part) for part in parts]
    who = identified_on
    if all(numbered):
        kinds = [match[1].capitalize() for match in numbered if match]
        numbers = [match[2] for match in numbered if match]
        who = "-".join(
            number if i and kinds[i] == kinds[i - 1] else f"{kinds[i]}-{number}"
            for i, number in enumerate(numbers)
        )
    orders = f"{nb}-{nk}-1" if nf is None else f"{nb}-{nf}-{nk}"
    return f"NLHW-{who}-{orders}"


def calibration_table(logs: Sequence[CalibrationLog]) -> str:
    """Show what calibration did, one line for each recording.

    Parameters
    ----------
    logs : sequence of CalibrationLog

    Returns
    -------
    str
    """
    rows = [
        (
            log.name,
            f"{log.n_raw_input}/{log.n_raw_output}",
            str(log.first_sample),
            str(log.n_samples),
            _number(log.input_offset) if "input_offset" in log.steps else "-",
            _number(log.output_offset) if "output_offset" in log.steps else "-",
            f"{log.period_samples:.2f}" if log.period_samples else "-",
            f"{len(log.repaired_input)}/{len(log.repaired_output)}",
        )
        for log in logs
    ]
    heads = (
        "recording",
        "raw in/out",
        "first",
        "kept",
        "in offset",
        "out offset",
        "period",
        "repaired",
    )
    return _table(
        "Calibration: samples, what was subtracted, samples repaired (in/out)",
        heads,
        rows,
        text_columns=(0,),
    )


def best_models_table(
    best: Sequence[Sequence[Fit]], unit: str, *, nk_is_delay: bool = False
) -> str:
    """Show the best models of each recording on that recording (as T3.2.2-1).

    Parameters
    ----------
    best : sequence of sequence of Fit
        As ``ranking.best_fits`` gives them.
    unit : str
        Of the output.
    nk_is_delay : bool
        Whether the grid's second axis is the delay.

    Returns
    -------
    str
    """
    rows = []
    for group in best:
        for fit in group:
            nk = fit.orders.nk if nk_is_delay else fit.orders.nf
            nf = fit.orders.nf if nk_is_delay else None
            rows.append(
                (
                    f"{fit.name}/{fit.orders.nb}/{nk}",
                    thesis_name(fit.name, fit.orders.nb, nk, nf),
                    _number(fit.rmsd),
                    _percent(fit.fit_percent),
                    _number(fit.linear_rmsd),
                )
            )
    heads = ("model", "thesis's name", "RMSD", "fit %", "linear RMSD")
    title = (
        f"Best models of each recording, RMSD [{unit}] on that recording; beside it the "
        "best\nlinear output-error model of the same orders (form of T3.2.2-1)"
    )
    return _table(title, heads, rows, text_columns=(0, 1))


def coverage_table(
    scores: Sequence[ModelScore],
    crossval: CrossValidation,
    *,
    nf: int | None = None,
    count: int = 15,
) -> str:
    """Show the models that cover the most recordings (as T3.2.2.2-2).

    Parameters
    ----------
    scores : sequence of ModelScore
        As ``ranking.score_models`` gives them.
    crossval : CrossValidation
    nf : int or None, [-]
        As for ``thesis_name``.
    count : int, [-]
        How many models to show.

    Returns
    -------
    str
    """
    rows = [
        (
            score.identified_on,
            str(score.nb),
            str(score.nk),
            f"{score.coverage} of {len(crossval.validated_on)}",
            _number(score.rmsd),
            thesis_name(score.identified_on, score.nb, score.nk, nf),
        )
        for score in scores[:count]
    ]
    heads = ("identified on", "nb", "nk", "covers", "own RMSD", "thesis's name")
    title = (
        f"Models that cover the most recordings: RMSD below {crossval.threshold:g} "
        f"{crossval.unit}\n(form of T3.2.2.2-2)"
    )
    return _table(title, heads, rows, text_columns=(0, 5))


def cross_table(
    best: Sequence[ModelScore], crossval: CrossValidation, *, width: int = WIDTH
) -> str:
    """Show the widest model of each recording on all recordings (as T3.2.2.2-3).

    Parameters
    ----------
    best : sequence of ModelScore
        As ``ranking.best_of_each`` gives them.
    crossval : CrossValidation
    width : int, [characters]
        Of the screen; more recordings than fit go into further blocks.

    Returns
    -------
    str
        An asterisk marks what is covered.
    """
    labels = [f"{score.identified_on}/{score.nb}/{score.nk}" for score in best]
    lines = [_cross_row(score, crossval) for score in best]
    heads = list(crossval.validated_on)
    column = max([8, *map(len, heads)]) + len(_GAP)
    room = width - max([5, *map(len, labels)]) - len("covers") - len(_GAP)
    per_block = max(1, room // column)
    blocks = []
    for first in range(0, len(heads), per_block):
        part = slice(first, first + per_block)
        rows = [
            (label, *row[part], str(score.coverage))
            for label, row, score in zip(labels, lines, best, strict=True)
        ]
        blocks.append(
            _table("", ("model", *heads[part], "covers"), rows, text_columns=(0,))
        )
    title = (
        f"Widest model of each recording on all recordings: RMSD [{crossval.unit}], "
        f"* below\n{crossval.threshold:g} (form of T3.2.2.2-3)"
    )
    return "\n\n".join([f"{title}\n{blocks[0]}", *blocks[1:]])


def _cross_row(score: ModelScore, crossval: CrossValidation) -> list[str]:
    values = crossval.rmsd[
        crossval.identified_on.index(score.identified_on),
        crossval.nb.index(score.nb),
        crossval.nk.index(score.nk),
    ]
    return [
        _number(value) + ("*" if value < crossval.threshold else " ")
        for value in values
    ]


def status_line(counts: Mapping[str, int]) -> str:
    """Say how the fits ended.

    Parameters
    ----------
    counts : mapping of str to int
        As ``ranking.count_statuses`` gives them.

    Returns
    -------
    str

    Examples
    --------
    >>> status_line({"converged": 98, "failed": 2})
    'Fits: 98 converged, 2 failed'
    """
    parts = [f"{n} {_STATUS_WORDS.get(status, status)}" for status, n in counts.items()]
    return f"Fits: {', '.join(parts) or 'none'}"


def _table(
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    text_columns: Sequence[int],
) -> str:
    """Columns as wide as their content; text left-aligned, numbers right."""
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    lines = [title] if title else []
    for row in (heads, ["-" * width for width in widths], *rows):
        cells = [
            cell.ljust(width) if number in text_columns else cell.rjust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(_GAP.join(cells).rstrip())
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.2e}" if np.isfinite(value) else "-"


def _percent(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "-"
