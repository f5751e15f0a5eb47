"""Units beside numbers."""


def behind(unit: str) -> str:
    """Write a unit behind a number; the dash of a dimensionless one would be a minus.

    Examples
    --------
    >>> f"0.4{behind('m')} and 0.4{behind('-')}"
    '0.4 m and 0.4'
    """
    return "" if unit in ("", "-") else f" {unit}"
