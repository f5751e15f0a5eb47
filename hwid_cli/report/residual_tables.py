"""What fits leave of their recordings, as text."""

import textwrap
from collections.abc import Sequence

from hwid_cli.records.residuals import ModelResiduals, ResidualTests
from hwid_cli.report.sections.words import counted
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import WIDTH, text_table

# Below this a p value says no more, and models whose flat directions are shown.
_LEAST_P, _MOST_SHOWN = 1e-3, 5


def residual_verdict(tests: ResidualTests) -> str:
    """Say in a few words what residuals show.

    Returns
    -------
    str
        The p value is that of Ljung and Box.
    """
    colour = "white" if tests.is_white else "not white"
    start = f"{colour} ({p_words(tests.with_itself.p_value)})"
    if tests.follows_input:
        left = f"misses dynamics up to lag {tests.with_input.last_lag}"
        left += " and a nonlinearity" if tests.follows_square else ""
    elif tests.follows_square:
        left = "misses a nonlinearity"
    elif tests.is_white:
        left = "nothing left to model"
    else:
        left = "coloured, not by the input or its square"
    return f"{start}: {left}{'; input follows them' if tests.leads_input else ''}"


def p_words(p_value: float) -> str:
    """Write a p value.

    Parameters
    ----------
    p_value : float, [-]

    Examples
    --------
    >>> p_words(0.0002), p_words(0.043), p_words(float("nan"))
    ('p < 0.001', 'p = 0.043', 'no test')
    """
    if p_value != p_value:
        return "no test"
    return "p < 0.001" if p_value < _LEAST_P else f"p = {p_value:.2g}"


def residual_table(found: Sequence[ModelResiduals], initial_state: str) -> str:
    """Show the verdict on the best model of each recording.

    Parameters
    ----------
    initial_state : str
        Rule of the fits.

    Returns
    -------
    str
        Beneath the table stands what the recordings do not tell about the parameters.
    """
    rows = [(one.model, residual_verdict(one.tests)) for one in found]
    title = (
        "Residuals of the best model of each recording: white by the test of Ljung and\n"
        "Box (p) or not, and what the model misses\n"
        f"{simulation_words(initial_state, is_validation=False)}"
    )
    table = text_table(title, ("model", "residuals"), rows, text_columns=(0, 1))
    return "\n".join([table, *flat_lines(found)])


def flat_lines(found: Sequence[ModelResiduals]) -> list[str]:
    """Say what the recordings do not tell about the parameters of models.

    Returns
    -------
    list of str
        The first sentence of each model that has one, for the first few models.
    """
    told = [one for one in found if one.flat]
    lines = []
    for one in told[:_MOST_SHOWN]:
        more = f" ({len(one.flat) - 1} more)" if len(one.flat) > 1 else ""
        lines += textwrap.wrap(
            f"{one.model}: {one.flat[0]}{more}.", WIDTH, subsequent_indent="  "
        )
    if len(told) > _MOST_SHOWN:
        more = counted(len(told) - _MOST_SHOWN, "more model")
        lines.append(
            f"Such directions in {more}: results.h5:/identify/fit/uncertainty/flat"
        )
    return lines
