"""Fields of a JSON file, each checked when it is read: one line says what is wrong."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hwid_cli.errors import ModelFileError
from hwid_cli.files.messages import did_you_mean

_LONGEST_SHOWN = 60


@dataclass(frozen=True)
class Fields:
    """One object of a JSON file and its place.

    Parameters
    ----------
    path : Path
        For messages.
    place : str
        Key of the object with a dot at its end; empty at the top.
    """

    path: Path
    place: str
    values: Mapping[str, Any]


def read_json(path: Path) -> Fields:
    """Read a JSON file that holds one object.

    Raises
    ------
    ModelFileError
        If it is missing, no JSON, holds something else or numbers that are not finite.
    """
    try:
        text = path.read_bytes().decode("utf-8-sig")
        values = json.loads(
            text, parse_constant=_no_constant, object_pairs_hook=_without_repeats
        )
    except FileNotFoundError:
        raise ModelFileError(
            f"{path}: no such file; expected a model that 'hwid export' wrote; correct "
            "the path"
        ) from None
    except OSError as error:
        raise ModelFileError(
            f"{path}: cannot be read ({error.strerror or error}); expected a model that "
            "'hwid export' wrote"
        ) from error
    except (ValueError, RecursionError) as error:
        said = " ".join(str(error).split())[:120]
        raise ModelFileError(
            f"{path}: is no JSON ({said}); expected a model that 'hwid export --format "
            "json' wrote; export it again"
        ) from error
    if not isinstance(values, dict):
        raise ModelFileError(
            f"{path}: holds {_kind(values)}; expected an object; export the model again"
        )
    return Fields(path, "", values)


def _no_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number")


def _without_repeats(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"key {twice!r} occurs twice")
    return values


def refuse(fields: Fields, key: str, found: object, expected: str) -> NoReturn:
    """End with a message about one key.

    Parameters
    ----------
    found : object
        Shown, shortened.
    expected : str
        What was expected, and the next step where there is a better one.

    Raises
    ------
    ModelFileError
    """
    text = found if isinstance(found, str) else repr(found)
    if len(text) > _LONGEST_SHOWN:
        text = f"{text[:_LONGEST_SHOWN]}..."
    raise ModelFileError(
        f"{fields.path}: {fields.place}{key}: found {text}; expected {expected}; export "
        "the model again or correct the file"
    )


def check_keys(
    fields: Fields, required: Iterable[str], optional: Iterable[str] = ()
) -> None:
    """Refuse an object with a missing or an unknown key.

    Raises
    ------
    ModelFileError
    """
    needed = list(required)
    known = [*needed, *optional]
    for key in fields.values:
        if key not in known:
            raise ModelFileError(
                f"{fields.path}: {fields.place}{key}: unknown key; "
                f"{did_you_mean(key, known)}"
            )
    for key in needed:
        if key not in fields.values:
            refuse(fields, key, "nothing", "this key")


def section(fields: Fields, key: str) -> Fields:
    """Object below a key.

    Raises
    ------
    ModelFileError
    """
    value = fields.values.get(key)
    if not isinstance(value, dict):
        refuse(fields, key, _kind(value), "an object")
    return Fields(fields.path, f"{fields.place}{key}.", value)


def text(fields: Fields, key: str) -> str:
    """Text below a key.

    Raises
    ------
    ModelFileError
    """
    value = fields.values.get(key)
    if not isinstance(value, str):
        refuse(fields, key, value, "text")
    return value


def choice(fields: Fields, key: str, allowed: Sequence[str]) -> str:
    """One of some words below a key.

    Raises
    ------
    ModelFileError
    """
    value = fields.values.get(key)
    if value not in allowed:
        refuse(fields, key, value, f"one of {', '.join(allowed)}")
    return str(value)


def number(
    fields: Fields, key: str, *, above: float = -math.inf, least: float = -math.inf
) -> float:
    """Finite number below a key.

    Parameters
    ----------
    above, least : float
        It must be larger than the one and not smaller than the other.

    Raises
    ------
    ModelFileError
    """
    value = _float(fields.values.get(key))
    if value is None or value <= above or value < least:
        limits = ("", f" above {above:g}")[above > -math.inf]
        limits += ("", f" of at least {least:g}")[least > -math.inf]
        refuse(fields, key, fields.values.get(key), f"a finite number{limits}")
    return value


def integer(fields: Fields, key: str, least: int, most: int) -> int:
    """Integer below a key.

    Raises
    ------
    ModelFileError
    """
    value = fields.values.get(key)
    is_integer = isinstance(value, int) and not isinstance(value, bool)
    if not is_integer or not least <= value <= most:  # type: ignore[operator]
        refuse(fields, key, value, f"an integer from {least} to {most}")
    return int(value)  # type: ignore[arg-type]


def vector(fields: Fields, key: str, *, most: int) -> np.ndarray:
    """List of finite numbers below a key.

    Parameters
    ----------
    most : int
        Largest length.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    ModelFileError
    """
    values = fields.values.get(key)
    if not isinstance(values, list):
        refuse(fields, key, values, "a list of numbers")
    if len(values) > most:
        refuse(fields, key, f"{len(values)} numbers", f"at most {most}")
    numbers = [_float(value) for value in values]
    if None in numbers:
        at = numbers.index(None)
        refuse(fields, f"{key}[{at}]", values[at], "a finite number")
    return np.array(numbers, dtype=np.float64)


def _float(value: object) -> float | None:
    """The finite number that a value is, or None."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        found = float(value)
    except OverflowError:
        return None
    return found if math.isfinite(found) else None


def _kind(value: object) -> str:
    names = {dict: "an object", list: "a list", str: "text", type(None): "nothing"}
    return names.get(type(value), repr(value)[:_LONGEST_SHOWN])
