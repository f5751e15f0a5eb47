"""Plain data to frozen dataclasses, checked field by field; knows no key by name.

The annotations of the dataclasses are the schema: a field added there is a key of the
configuration, with its type and default.

Single values of a configuration: text, truth values and numbers, each checked.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from hwid_cli.config.place import Place
from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import did_you_mean, is_plain, shown

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


Record = TypeVar("Record")

# Reads one field in its own way: value and place in, checked value out.
Reader = Callable[[Any, Place], Any]


def build(
    record_type: type[Record],
    content: Any,
    place: Place,
    *,
    readers: Mapping[tuple[type, str], Reader],
    given: Mapping[str, Any] | None = None,
) -> Record:
    """Record of a dataclass type from the keys of a section.

    Parameters
    ----------
    record_type : type
        A dataclass; its annotations say what each key must hold.
    content : dict or None
        The section as YAML gives it; None (a section without a body) sets no key.
    place : Place
        For messages.
    readers : mapping of (type, field name) to callable
        Fields that are not read by their annotation.
    given : mapping, optional
        Fields that the program sets; they are no keys of the file.

    Raises
    ------
    ConfigError
        If a key is unknown or missing, has another type, or the record refuses it.
    """
    content = {} if content is None else content
    if not isinstance(content, dict):
        raise ConfigError(
            f"{place}: found {shown(content)}; expected a section with keys"
        )
    given = dict(given or {})
    # mypy has no public name for "a class that is a dataclass".
    schema = {field.name: field for field in fields(record_type)}  # type: ignore[arg-type]
    keys = [name for name in schema if name not in given]
    for key in content:
        if key not in keys:
            raise ConfigError(
                f"{place.below(key)}: unknown key; {did_you_mean(key, keys)}"
            )
    hints = get_type_hints(record_type)
    for name in keys:
        at = place.below(name)
        if name not in content:
            _require_default(schema[name], hints[name], at)
        elif (record_type, name) in readers:
            given[name] = readers[record_type, name](content[name], at)
        else:
            given[name] = convert(content[name], hints[name], at, readers=readers)
    try:
        return record_type(**given)
    except ValueError as error:
        raise ConfigError(_refusal(place, error, keys)) from None


def convert(
    value: Any, hint: Any, place: Place, *, readers: Mapping[tuple[type, str], Reader]
) -> Any:
    """Value of an annotated type.

    Parameters
    ----------
    value : object
        As YAML gives it.
    hint : type
        Scalar, tuple, dict, dataclass or a union of them.
    readers : mapping
        As for ``build``.

    Raises
    ------
    ConfigError
        If the value does not fit.
    """
    origin = get_origin(hint)
    if origin in (Union, UnionType):
        return _convert_union(value, get_args(hint), place, readers)
    if isinstance(hint, type) and is_dataclass(hint):
        return build(hint, value, place, readers=readers)
    if origin is tuple:
        return _convert_tuple(value, get_args(hint), place, readers)
    if origin is dict:
        return _convert_dict(value, get_args(hint)[1], place, readers)
    return convert_scalar(value, hint, place)


def expected(hint: Any) -> str:
    """Put in words what an annotation asks for.

    Examples
    --------
    >>> expected(tuple[int, ...] | None)
    'a list (each an integer), or nothing'
    >>> expected(str | int)
    'text or an integer'
    """
    origin, args = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        words = " or ".join(expected(part) for part in args if part is not NoneType)
        return f"{words}, or nothing" if NoneType in args else words
    if origin is tuple:
        return f"a list (each {expected(args[0])})"
    if origin is dict or is_dataclass(hint):
        return "a section with keys"
    return SCALARS[hint]


def _require_default(field: Field, hint: Any, place: Place) -> None:
    if field.default is MISSING and field.default_factory is MISSING:
        raise ConfigError(
            f"{place}: missing; expected {expected(hint)}; add the key "
            "(configs/README.md explains it)"
        )


def _refusal(place: Place, error: ValueError, keys: list[str]) -> str:
    """Message of a record's own check, led by the key that it names."""
    said = str(error)
    named = said.split(" ", 1)[0]
    if named in keys:
        return f"{place.below(named)}: {said.split(' ', 1)[1]}"
    return f"{place}: {said}"


def _convert_tuple(
    value: Any,
    args: tuple[Any, ...],
    place: Place,
    readers: Mapping[tuple[type, str], Reader],
) -> tuple[Any, ...]:
    if isinstance(value, dict) or value is None:
        found = "no value" if value is None else shown(value)
        raise ConfigError(
            f"{place}: found {found}; expected a list (each {expected(args[0])})"
        )
    items = value if isinstance(value, list) else [value]
    is_open = len(args) == 2 and args[1] is Ellipsis
    if not is_open and len(items) != len(args):
        raise ConfigError(
            f"{place}: found {len(items)} values; expected {len(args)} of them"
        )
    hints = [args[0]] * len(items) if is_open else list(args)
    return tuple(
        convert(item, hint, place.below(number), readers=readers)
        for number, (item, hint) in enumerate(zip(items, hints, strict=True))
    )


def _convert_dict(
    value: Any, hint: Any, place: Place, readers: Mapping[tuple[type, str], Reader]
) -> dict[str, Any]:
    value = {} if value is None else value
    if not isinstance(value, dict):
        raise ConfigError(
            f"{place}: found {shown(value)}; expected a section with keys"
        )
    for key in value:
        if not isinstance(key, str):
            raise ConfigError(
                f"{place.below(key)}: the key is {shown(key)}; expected text; "
                "put it in quotes"
            )
    return {
        key: convert(item, hint, place.below(key), readers=readers)
        for key, item in value.items()
    }


def _convert_union(
    value: Any,
    members: tuple[Any, ...],
    place: Place,
    readers: Mapping[tuple[type, str], Reader],
) -> Any:
    records = [member for member in members if is_dataclass(member)]
    others = [m for m in members if m is not NoneType and m not in records]
    if records and (not others or isinstance(value, dict)):
        return build(_by_kind(value, records, place), value, place, readers=readers)
    if value is None and NoneType in members:
        return None
    # bool before int: YAML's true is an int to Python.
    others.sort(key=lambda member: member is not bool)
    for member in others:
        if _is_of(value, member):
            return convert(value, member, place, readers=readers)
    if len(others) == 1:
        return convert(value, others[0], place, readers=readers)
    words = " or ".join(expected(member) for member in others)
    raise ConfigError(f"{place}: found {shown(value)}; expected {words}")


def _is_of(value: Any, member: Any) -> bool:
    """Whether a union's member is the one that a value was meant for."""
    if isinstance(value, bool | str):
        return member is type(value)
    if isinstance(value, int | float):
        is_whole = isinstance(value, int) or value.is_integer()
        return member is float or (member is int and is_whole)
    return (isinstance(value, list) and get_origin(member) is tuple) or (
        isinstance(value, dict) and get_origin(member) is dict
    )


def _by_kind(value: Any, records: list[Any], place: Place) -> Any:
    """Dataclass of a union that the section's ``kind`` names."""
    if len(records) == 1:
        return records[0]
    kinds = {record.__dataclass_fields__["kind"].default: record for record in records}
    found = value.get("kind") if isinstance(value, dict) else None
    if isinstance(found, str) and found in kinds:
        return kinds[found]
    if found is None:
        raise ConfigError(
            f"{place.below('kind')}: missing; expected one of {', '.join(kinds)}"
        )
    raise ConfigError(
        f"{place.below('kind')}: found {shown(found)}; {did_you_mean(found, kinds)}"
    )
