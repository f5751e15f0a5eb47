"""Units beside numbers."""


def behind(unit: str) -> str:
    """Write a unit behind a number; the dash of a dimensionless one would be a minus.

    Examples
    --------
    >>> f"0.4{behind('m')} and 0.4{behind('-')}"
    '0.4 m and 0.4'
    """
    return "" if unit in ("", "-") else f" {unit}"


def as_percent(share: float, decimals: int = 0) -> str:
    """Write a share in percent, with a space as before any unit.

    Parameters
    ----------
    share : float, [-]

    Examples
    --------
    >>> as_percent(0.75), as_percent(0.1234, 1)
    ('75 %', '12.3 %')
    """
    return f"{100.0 * share:.{decimals}f} %"
