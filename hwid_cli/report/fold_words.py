"""Output maps that turn back, in words."""

import textwrap
from collections.abc import Sequence

from hwid_cli.records.model import Fit
from hwid_cli.records.units import behind
from hwid_cli.report.text_table import WIDTH

# Models that are named, and places of each.
_MOST_MODELS, _MOST_PLACES = 4, 2


def folds_note(fits: Sequence[Fit], *, nk_is_delay: bool = False) -> str:
    """Name the models whose output map turns back, and where.

    Parameters
    ----------
    fits : sequence of Fit
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
