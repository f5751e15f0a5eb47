"""What fits leave of their recordings, as a table."""

from collections.abc import Sequence

from hwid_cli.records.residuals import ModelResiduals, ResidualTests
from hwid_cli.report.formats import MISSING, counted, with_unit
from hwid_cli.report.table import Column, Table, texts

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
    start = f"{colour} ({p_value(tests.with_itself.p_value)})"
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


def p_value(value: float) -> str:
    """Write a p value.

    Parameters
    ----------
    value : float, [-]

    Examples
    --------
    >>> p_value(0.0002), p_value(0.043), p_value(float("nan"))
    ('p < 0.001', 'p = 0.043', 'no test')
    """
    if value != value:
        return "no test"
    return "p < 0.001" if value < _LEAST_P else f"p = {value:.2g}"


def residual_table(found: Sequence[ModelResiduals]) -> Table:
    """Show what the tests say of the residuals of some models.

    Returns
    -------
    Table
        Beneath it stands what the recordings do not tell about the parameters.
    """
    rows = tuple(
        (
            one.model,
            one.recording,
            with_unit(one.rmsd, one.unit),
            f"{one.tests.ljung_box:.3g} ({one.tests.with_itself.lags.size})",
            p_value(one.tests.with_input.p_value),
            MISSING
            if one.tests.with_input.last_lag < 0
            else str(one.tests.with_input.last_lag),
            p_value(one.tests.with_square.p_value),
            residual_verdict(one.tests),
        )
        for one in found
    )
    columns = (
        *texts("model"),
        Column("recording", is_text=True, is_detail=True),
        Column("RMSD", is_detail=True),
        Column("Ljung-Box (lags)", is_detail=True),
        Column("follows input", is_detail=True),
        Column("last lag [samples]", is_detail=True),
        Column("follows its square", is_detail=True),
        *texts("residuals"),
    )
    caption = (
        "Residuals of the best model of each recording: white by the test of Ljung and Box "
        "(p: probability that chance alone gives correlations as large) or not, and what the "
        "model misses"
    )
    notes = _not_identifiable(found)
    return Table(caption, columns, rows, notes, is_validation=False)


def _not_identifiable(found: Sequence[ModelResiduals]) -> tuple[str, ...]:
    """Say what the recordings do not tell about the parameters of the first few models."""
    told = [one for one in found if one.flat]
    lines = []
    for one in told[:_MOST_SHOWN]:
        more = f" ({len(one.flat) - 1} more)" if len(one.flat) > 1 else ""
        lines.append(f"{one.model}: {one.flat[0]}{more}.")
    if len(told) > _MOST_SHOWN:
        more = counted(len(told) - _MOST_SHOWN, "more model")
        lines.append(
            f"Such directions in {more}: results.h5:/identify/fit/uncertainty/flat"
        )
    return tuple(lines)
