"""What short heads of tables mean, for the line beneath a table of the page."""

from hwid_cli.report.table import Table

_TERMS = {
    "covers": "covers: recordings on which the model's RMSD lies below the threshold",
    "covers others": (
        "covers others: recordings that the model's fit has not seen on which its RMSD lies "
        "below the threshold"
    ),
    "own RMSD": "own RMSD: on the recordings that the model was fitted to",
    "base": "base: the group that a recording joins, which stands above its column",
    "widest": "widest: the most recordings that one of these groups covers",
    "reach it": "reach it: groups that cover so many",
    "go on": "go on: groups that the next level grows from",
    "not self": (
        "not self: models left out because they miss the threshold on a recording of their "
        "own fit"
    ),
    "not cross": (
        "not cross: models left out because they lie below it on no validation recording"
    ),
    "nb": "nb: coefficients of the numerator",
}
# What the second order counts, by ``orders.nk_role``.
NK_WORDS = {"poles": "poles", "delay": "samples of delay"}


def explanation(table: Table, nk_role: str) -> str:
    """Explain the short heads of a table in one line.

    Parameters
    ----------
    nk_role : str
        What the second order counts.

    Returns
    -------
    str
        Empty where all heads speak for themselves.

    Examples
    --------
    >>> from hwid_cli.report.table import numbers
    >>> explanation(Table("", numbers("nb", "nk"), ()), "poles")
    'nb: coefficients of the numerator; nk: poles.'
    """
    terms = {**_TERMS, "nk": f"nk: {NK_WORDS.get(nk_role, nk_role)}"}
    heads = dict.fromkeys(column.head for column in table.columns)
    said = "; ".join(terms[head] for head in heads if head in terms)
    return f"{said}." if said else ""
