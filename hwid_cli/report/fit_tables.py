"""The fits of single recordings as text: the best ones, and how all ended.

Output maps that turn back, in words.
"""

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from hwid_cli.records.model import Fit
from hwid_cli.records.units import behind
from hwid_cli.report.simulation_words import HUBER_WORDS, simulation_words
from hwid_cli.report.tables import thesis_name_of
from hwid_cli.report.text_table import MISSING, WIDTH, number, text_table

# Models that are named, and places of each.
_MOST_MODELS, _MOST_PLACES = 4, 2


def folds_note(fits: Sequence[Fit], *, nk_is_delay: bool = False) -> str:
    """Name the models whose output map turns back, and where.

    Parameters
    ----------
    nk_is_delay : bool
        Whether the grid's second axis is the delay.

    Returns
    -------
    str
        Lines that fit the screen; empty if there are none.
    """
    folded = []
    for fit in fits:
        if fit.output_folds and fit.model is not None:
            nk = fit.orders.nk if nk_is_delay else fit.orders.nf
            places = ", ".join(f"{x:.3g}" for x in fit.output_folds[:_MOST_PLACES])
            more = ", ..." if len(fit.output_folds) > _MOST_PLACES else ""
            where = f"x = {places}{more}{behind(fit.model.input_unit)}"
            folded.append(f"{fit.name}/{fit.orders.nb}/{nk} ({where})")
    if not folded:
        return ""
    rest = len(folded) - _MOST_MODELS
    shown = "; ".join(folded[:_MOST_MODELS]) + (f"; {rest} more" if rest > 0 else "")
    text = f"Output maps that fold, so that two positions give one output: {shown}"
    return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


# Words for the statuses of fits.
_STATUS_WORDS = {
    "converged": "converged",
    "iteration_limit": "stopped at the iteration limit",
    "stalled": "stalled",
    "failed": "failed",
}
# Reasons of failed fits that are shown, the most frequent ones.
_SHOWN_REASONS = 3


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
    """
    rows = []
    for group in best:
        for fit in group:
            nk = fit.orders.nk if nk_is_delay else fit.orders.nf
            rows.append(
                (
                    f"{fit.name}/{fit.orders.nb}/{nk}",
                    thesis_name_of(fit.name, fit.orders),
                    number(fit.rmsd),
                    _percent(fit.fit_percent),
                    number(fit.linear_rmsd),
                    str(fit.information.n_parameters or MISSING),
                    _criterion(fit.information.bic),
                )
            )
    if not rows:
        return "No fit gave a model."
    heads = (
        "model",
        "thesis's name",
        "RMSD",
        "fit %",
        "linear RMSD",
        "par.",
        "BIC",
    )
    started = sorted({fit.options.initial_state for group in best for fit in group})
    title = (
        f"Best models of each recording, RMSD [{unit}] on that recording; beside it the "
        "best\nlinear output-error model of the same orders, the parameters that the "
        "data\ndetermine, and BIC (form of T3.2.2-1)"
    )
    if any(fit.options.loss == "huber" for group in best for fit in group):
        title += (
            f"\n{HUBER_WORDS}\nThe best have the lowest FPE, which leaves outliers out."
        )
    for one in started:
        title += f"\n{simulation_words(one, is_validation=False)}"
    table = text_table(title, heads, rows, text_columns=(0, 1))
    note = folds_note([fit for group in best for fit in group], nk_is_delay=nk_is_delay)
    return f"{table}\n{note}" if note else table


def status_line(counts: Mapping[str, int]) -> str:
    """Say how the fits ended.

    Parameters
    ----------
    counts : mapping of str to int
        As ``ranking.count_statuses`` gives them.

    Examples
    --------
    >>> status_line({"converged": 98, "failed": 2})
    'Fits: 98 converged, 2 failed'
    """
    parts = [f"{n} {_STATUS_WORDS.get(status, status)}" for status, n in counts.items()]
    return f"Fits: {', '.join(parts) or 'none'}"


def failure_lines(fits: Sequence[Fit]) -> str:
    """Say why fits failed, each reason once.

    Returns
    -------
    str
        A line for each of the most frequent reasons; empty where none failed.
    """
    counts = Counter(fit.message for fit in fits if fit.status == "failed")
    lines = [
        f"Failed, {count} fit{'s' * (count != 1)}: {reason}"
        for reason, count in counts.most_common(_SHOWN_REASONS)
    ]
    if len(counts) > _SHOWN_REASONS:
        lines.append("More reasons: results.h5:/identify/fit/message")
    return "\n".join(lines)


def _criterion(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else MISSING


def _percent(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "-"
