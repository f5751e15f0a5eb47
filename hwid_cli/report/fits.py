"""The fits of single recordings: the best ones as a table, and how all ended."""

from collections import Counter
from collections.abc import Mapping, Sequence

from hwid_cli.records.model import Fit
from hwid_cli.records.units import behind
from hwid_cli.report.formats import MISSING, counted, decimals, number
from hwid_cli.report.simulation_note import HUBER_NOTE, simulation_note
from hwid_cli.report.table import Column, Table, Text, numbers, texts
from hwid_cli.report.thesis_names import thesis_name_of

# Words for the statuses of fits.
_STATUSES = {
    "converged": "converged",
    "iteration_limit": "stopped at the iteration limit",
    "stalled": "stalled",
    "failed": "failed",
}
# Reasons of failed fits that are shown, the most frequent ones.
_SHOWN_REASONS = 3
# Models whose output map is told not to be monotonic, and places of each.
_MOST_MODELS, _MOST_PLACES = 4, 2


def best_models_table(
    best: Sequence[Sequence[Fit]], unit: str, *, nk_is_delay: bool
) -> Table | Text:
    """Show the best models of each recording on that recording.

    Parameters
    ----------
    best : sequence of sequence of Fit
        As ``ranking.best_fits`` gives them.
    unit : str
        Of the output.
    nk_is_delay : bool
        Whether the grid's second axis is the delay.
    """
    fits = [fit for group in best for fit in group]
    if not fits:
        return Text("No fit gave a model.")
    rows = tuple(
        (
            _name(fit, nk_is_delay=nk_is_delay),
            thesis_name_of(fit.name, fit.orders),
            number(fit.rmsd),
            decimals(fit.fit_percent, 2),
            number(fit.linear_rmsd),
            str(fit.information.n_parameters or MISSING),
            decimals(fit.information.bic, 0),
        )
        for fit in fits
    )
    columns = (
        *texts("model"),
        Column("thesis's name", is_text=True, is_thesis=True),
        *numbers("RMSD", "fit %", "linear RMSD", "par.", "BIC"),
    )
    caption = (
        f"Best models of each recording, RMSD [{unit}] on that recording; beside it the "
        "best linear output-error model of the same orders, the parameters that the data "
        "determine, and BIC"
    )
    how = []
    if any(fit.options.loss == "huber" for fit in fits):
        how += [HUBER_NOTE, "The best have the lowest FPE, which leaves outliers out."]
    how += [
        simulation_note(rule, is_validation=False)
        for rule in sorted({fit.options.initial_state for fit in fits})
    ]
    notes = _not_monotonic(fits, nk_is_delay=nk_is_delay)
    return Table(caption, columns, rows, notes, tuple(how), published="T3.2.2-1")


def _name(fit: Fit, *, nk_is_delay: bool) -> str:
    nk = fit.orders.nk if nk_is_delay else fit.orders.nf
    return f"{fit.name}/{fit.orders.nb}/{nk}"


def _not_monotonic(fits: Sequence[Fit], *, nk_is_delay: bool) -> tuple[str, ...]:
    """Name the models whose output map turns back, and where."""
    found = []
    for fit in fits:
        if fit.output_folds and fit.model is not None:
            places = ", ".join(f"{x:.3g}" for x in fit.output_folds[:_MOST_PLACES])
            more = ", ..." if len(fit.output_folds) > _MOST_PLACES else ""
            where = f"x = {places}{more}{behind(fit.model.input_unit)}"
            found.append(f"{_name(fit, nk_is_delay=nk_is_delay)} ({where})")
    if not found:
        return ()
    rest = len(found) - _MOST_MODELS
    shown = "; ".join(found[:_MOST_MODELS]) + (f"; {rest} more" if rest > 0 else "")
    start = "Output maps that are not monotonic, so that two positions give one output"
    return (f"{start}: {shown}",)


def fits_status(counts: Mapping[str, int]) -> str:
    """Say how fits ended.

    Parameters
    ----------
    counts : mapping of str to int
        As ``ranking.count_statuses`` gives them.

    Examples
    --------
    >>> fits_status({"converged": 98, "failed": 2})
    '98 converged, 2 failed'
    """
    return ", ".join(f"{n} {_STATUSES.get(one, one)}" for one, n in counts.items())


def fits_ended(counts: Mapping[str, int], fits: Sequence[Fit]) -> tuple[Text, ...]:
    """Say how fits ended, and why some failed, each of the most frequent reasons once.

    Parameters
    ----------
    counts : mapping of str to int
        As ``ranking.count_statuses`` gives them.
    """
    lines = [f"Fits: {fits_status(counts) or 'none'}"]
    reasons = Counter(fit.message for fit in fits if fit.status == "failed")
    lines += [
        f"Failed, {counted(count, 'fit')}: {reason}"
        for reason, count in reasons.most_common(_SHOWN_REASONS)
    ]
    if len(reasons) > _SHOWN_REASONS:
        lines.append("More reasons: results.h5:/identify/fit/message")
    return tuple(map(Text, lines))
