"""What a value of a configuration must hold, refused in one line where it does not."""

from collections.abc import Iterable, Mapping
from typing import Any

from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import did_you_mean, shown


def require(holds: bool, place: str, found: object, expected: str) -> None:
    """Refuse a value for which a condition does not hold.

    Parameters
    ----------
    place : str
        File and key.

    Raises
    ------
    ConfigError
    """
    if not holds:
        raise ConfigError(f"{place}: found {shown(found)}; expected {expected}")


def require_known(
    found: Iterable[str] | Mapping[str, Any], known: Iterable[str], place: str
) -> None:
    """Refuse names that are not among the known ones.

    Parameters
    ----------
    place : str
        File and key.

    Raises
    ------
    ConfigError
        For the first such name, with the nearest known one.
    """
    for name in found:
        if name not in known:
            raise ConfigError(
                f"{place}: found {shown(name)}; {did_you_mean(name, known)}"
            )


def require_distinct(values: tuple[Any, ...], place: str) -> None:
    """Refuse a list in which a value comes twice.

    Parameters
    ----------
    place : str
        File and key.

    Raises
    ------
    ConfigError
        For the first such value.
    """
    seen = set()
    for value in values:
        if value in seen:
            raise ConfigError(
                f"{place}: {shown(value)} is listed twice; expected every value once; "
                "remove one"
            )
        seen.add(value)
