"""Checks that a record's numbers lie where they make sense."""

import math


def require_positive(record: object, *names: str) -> None:
    """Refuse fields that are not finite and above 0.

    Parameters
    ----------
    *names : str
        Fields to check.

    Raises
    ------
    ValueError
        Naming the first field that is out of range, and its value.
    """
    for name in names:
        value = getattr(record, name)
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive, got {value!r}")


def require_not_negative(record: object, *names: str) -> None:
    """Refuse fields that are not finite and at least 0.

    Parameters
    ----------
    *names : str
        Fields to check.

    Raises
    ------
    ValueError
        Naming the first field that is out of range, and its value.
    """
    for name in names:
        value = getattr(record, name)
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{name} must not be negative, got {value!r}")


def require_share(record: object, *names: str) -> None:
    """Refuse fields that do not lie between 0 and 1.

    Parameters
    ----------
    *names : str
        Fields to check.

    Raises
    ------
    ValueError
        Naming the first field that is out of range, and its value.
    """
    for name in names:
        value = getattr(record, name)
        if not 0 <= value <= 1:
            raise ValueError(f"{name} must lie between 0 and 1, got {value!r}")
