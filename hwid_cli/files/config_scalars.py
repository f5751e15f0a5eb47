"""Single values of a configuration: text, truth values and numbers, each checked."""

import math
from typing import Any

from hwid_cli.errors import ConfigError
from hwid_cli.files.config_place import Place
from hwid_cli.files.plain_text import is_plain, shown

# A path of Linux has no more; a text of a configuration needs no more.
_LONGEST_TEXT = 4096
# What 64 bits hold.
_LARGEST_INTEGER = 2**63 - 1

SCALARS: dict[type, str] = {
    str: "text",
    bool: "true or false",
    int: "an integer",
    float: "a finite number",
}


def convert_scalar(value: Any, hint: Any, place: Place) -> Any:
    """Value of an annotated scalar type.

    Parameters
    ----------
    value : object
        As YAML gives it.
    hint : type
        One of ``SCALARS``.
    place : Place

    Returns
    -------
    object

    Raises
    ------
    ConfigError
        If it is of another type, too large or too long, or no plain text.
    """
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if hint is float and is_number and _is_finite(value):
        return float(value)
    if hint is int and is_number and _is_finite(value) and value == int(value):
        _check_size(int(value), place)
        return int(value)
    if hint in (str, bool) and isinstance(value, hint):
        if isinstance(value, str):
            _check_text(value, place)
        return value
    hint_to_quote = (
        "; put it in quotes"
        if hint is str and value is not None and not isinstance(value, list | dict)
        else ""
    )
    found = "no value" if value is None else shown(value)
    raise ConfigError(
        f"{place}: found {found}; expected {SCALARS[hint]}{hint_to_quote}"
    )


def _is_finite(value: float) -> bool:
    """Whether a number is finite as a float; an integer may be too large for one."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _check_size(value: int, place: Place) -> None:
    if abs(value) > _LARGEST_INTEGER:
        raise ConfigError(
            f"{place}: found {shown(value)}; expected an integer of at most 18 digits; "
            "correct the key"
        )


def _check_text(value: str, place: Place) -> None:
    if len(value) > _LONGEST_TEXT:
        raise ConfigError(
            f"{place}: found {shown(value)}, {len(value)} characters; expected at most "
            f"{_LONGEST_TEXT}; shorten it"
        )
    if not is_plain(value):
        raise ConfigError(
            f"{place}: found {shown(value)}; expected text without control characters; "
            "remove them"
        )
