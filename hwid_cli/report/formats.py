"""How numbers, counts and lists are written."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.records.units import as_percent, behind

# Shown where there is no number.
MISSING = "-"
_MOST_NAMED = 8
# Keeps a number and its unit on one line.
_GLUE = "\N{NO-BREAK SPACE}"


def number(value: float) -> str:
    """Show a number with three digits.

    Parameters
    ----------
    value : float, [-]
        Of any unit.

    Returns
    -------
    str
        A dash where the value is not finite.

    Examples
    --------
    >>> number(0.00123), number(float("nan"))
    ('1.23e-03', '-')
    """
    return f"{value:.2e}" if np.isfinite(value) else MISSING


def decimals(value: float, count: int) -> str:
    """Show a number with a fixed count of decimals.

    Parameters
    ----------
    value : float, [-]
        Of any unit.
    count : int, [-]

    Examples
    --------
    >>> decimals(99.125, 1), decimals(float("nan"), 1)
    ('99.1', '-')
    """
    return f"{value:.{count}f}" if np.isfinite(value) else MISSING


def with_unit(value: float, unit: str) -> str:
    """Write a number with three digits and its unit.

    Parameters
    ----------
    value : float, [unit]

    Examples
    --------
    >>> with_unit(0.0012345, "m").split(), with_unit(float("nan"), "m")
    (['0.00123', 'm'], '-')
    >>> with_unit(0.0012345, "-")
    '0.00123'
    """
    known = f"{value:.3g}{behind(unit).replace(' ', _GLUE)}"
    return known if np.isfinite(value) else MISSING


def percent(value: float) -> str:
    """Write a percentage with two decimals.

    Parameters
    ----------
    value : float, [%]
    """
    return f"{value:.2f}{_GLUE}%" if np.isfinite(value) else MISSING


def share_text(share: float, decimals: int = 0) -> str:
    """Write a share in percent.

    Parameters
    ----------
    share : float, [-]
    """
    return as_percent(share, decimals).replace(" ", _GLUE)


def counted(count: int, one: str, many: str = "") -> str:
    """Write a number of things.

    Parameters
    ----------
    count : int, [-]
    one : str
        The thing.
    many : str
        Its plural; an s is added unless given.

    Examples
    --------
    >>> counted(1, "fit"), counted(2, "fit"), counted(0, "entry", "entries")
    ('1 fit', '2 fits', '0 entries')
    """
    return f"{count} {one if count == 1 else many or one + 's'}"


def listed(names: Sequence[str], most: int = _MOST_NAMED) -> str:
    """Write names one after the other.

    Parameters
    ----------
    most : int, [-]
        More are counted only.

    Examples
    --------
    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], most=2)
    ('a, b and c', 'a, b and 1 more')
    """
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def as_sentence(clause: str) -> str:
    """A clause as a sentence of its own.

    Examples
    --------
    >>> as_sentence("joining recordings helps")
    'Joining recordings helps.'
    """
    return f"{clause[:1].upper()}{clause[1:]}."
