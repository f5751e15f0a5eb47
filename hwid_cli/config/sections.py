"""Sections of a configuration as the records of ``records``, read by pydantic.

The annotations of the dataclasses are the schema: a field is a key, with its type, its
default and its rules. Nothing is converted that a typing error may have caused: ``true`` is
no number and ``"3"`` is none. A single value may stand for a list, and a section without a
body has its defaults.
"""

import re
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    NotRequired,
    Required,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from pydantic import (
    AfterValidator,
    AllowInfNan,
    BeforeValidator,
    ConfigDict,
    PlainValidator,
    Strict,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
)

# Those of the library itself are refused by pydantic before Python 3.12.
from typing_extensions import TypedDict

from hwid_cli.config.faults import Fault, missing, refused, unknown_key, wrong
from hwid_cli.config.own_functions import OwnFunctionFile, read_own_function
from hwid_cli.files.messages import is_plain
from hwid_cli.records.axis import check_axis
from hwid_cli.records.experiment import SimulationOptions
from hwid_cli.records.model import FitOptions
from hwid_cli.records.rules import OtherForm, Refusal, Refused, Rule, StandsFor

# A path of Linux has no more; a text of a configuration needs no more.
_LONGEST_TEXT = 4096
# As many languages write it.
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
# As a number with its unit, or in quotes, does.
_BEGINS_WITH_NUMBER = re.compile(r"\s*[-+]?\.?\d")
# What 64 bits hold.
_LARGEST_INTEGER = 2**63 - 1
_WORDS: dict[Any, str] = {
    str: "text",
    bool: "true or false",
    int: "an integer",
    float: "a finite number",
}
# What pydantic calls a value of another type, and what was expected then.
_EXPECTED = {
    "string_type": _WORDS[str],
    "bool_type": _WORDS[bool],
    "int_type": _WORDS[int],
    "float_type": _WORDS[float],
    "finite_number": _WORDS[float],
    "dict_type": "a section with keys",
}
# The same of a key: one that is no text, one that no screen can show, one too many.
_UNKNOWN_KEY = ("invalid_key", "string_unicode", "extra_forbidden")


def read_section(
    record_type: type, content: Mapping[Any, Any], source: str
) -> tuple[Any, list[Fault]]:
    """Record that a section describes, or all that is wrong with it.

    Parameters
    ----------
    record_type : type
        A dataclass.
    content : mapping
        As YAML gives it.
    source : str
        The file; paths in it are relative to its folder.

    Returns
    -------
    record : object or None
    faults : list of Fault
        Unknown keys first; empty where there is a record.
    """
    try:
        return _adapter(record_type).validate_python(content, context=source), []
    except ValidationError as error:
        found = error.errors(include_url=False)
        found.sort(key=lambda one: one["type"] not in _UNKNOWN_KEY)
        return None, [_fault(record_type, content, one) for one in found]


@cache
def _adapter(hint: Any) -> TypeAdapter:
    return TypeAdapter(_readable(hint))


def _readable(hint: Any) -> Any:
    """The annotation by which pydantic reads what a field's annotation asks for."""
    origin, args = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _ruled(args[0], args[1:])
    if origin in (Union, UnionType):
        return Annotated[Any, PlainValidator(partial(_read_union, args))]
    if is_dataclass(hint):
        return _section(hint)
    if origin is tuple:
        item: Any = _readable(args[0])
        listed = BeforeValidator(partial(_as_list, hint))
        return Annotated[tuple[item, ...], listed]
    if origin is dict:
        inner: Any = _readable(args[1])
        sections = dict[Annotated[str, Strict()], inner]
        return Annotated[sections, BeforeValidator(_as_section)]
    return _SCALARS[hint]


def _ruled(hint: Any, rules: tuple[Any, ...]) -> Any:
    """A type and what must hold for its values."""
    readable = _readable(hint)
    for rule in rules:
        if isinstance(rule, StandsFor):
            readable = Annotated[readable | None, BeforeValidator(rule.read)]
        elif isinstance(rule, OtherForm):
            readable = Annotated[readable, BeforeValidator(rule.read)]
        elif isinstance(rule, Rule):
            readable = Annotated[readable, AfterValidator(rule.read)]
    return readable


def _section(record_type: Any) -> Any:
    hints = get_type_hints(record_type, include_extras=True)
    keys = {}
    for name, field in _keys(record_type).items():
        hint = hints[name]
        if record_type is FitOptions and name in ("input_map", "output_map"):
            hint = hint | OwnFunctionFile
        marked: Any = Required if _is_required(field) else NotRequired
        keys[name] = marked[_readable(hint)]
    # Made while the program runs, which the type checker does not follow.
    make: Any = TypedDict
    section = make(record_type.__name__, keys)
    section.__pydantic_config__ = ConfigDict(extra="forbid")
    built = AfterValidator(partial(_build, record_type))
    return Annotated[section, BeforeValidator(_as_section), built]


def _keys(record_type: Any) -> dict[str, Field]:
    """Fields that are keys of a configuration."""
    found = fields(record_type)
    return {one.name: one for one in found if one.metadata.get("is_key", True)}


def _is_required(field: Field) -> bool:
    return field.default is MISSING and field.default_factory is MISSING


def _build(record_type: Any, values: dict[str, Any], info: ValidationInfo) -> Any:
    if record_type is FitOptions:
        values = _with_functions(values, Path(str(info.context)).parent)
    if record_type is SimulationOptions:
        # The record cannot tell what is stated from its defaults.
        check_axis(values)
    if "source" in record_type.__dataclass_fields__:
        values = {**values, "source": info.context}
    return record_type(**values)


def _with_functions(values: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Options of a fit in which maps are functions that Python files define."""
    values = dict(values)
    for side in ("input", "output"):
        named = values.get(f"{side}_map")
        if isinstance(named, OwnFunctionFile):
            try:
                function = read_own_function(folder / named.file, named.name)
            except Refused as error:
                raise error.below(f"{side}_map") from None
            values[f"{side}_map"] = "own_function"
            values[f"{side}_function"] = function
    return values


def _as_section(value: Any) -> Any:
    return {} if value is None else value


def _as_list(hint: Any, value: Any) -> Any:
    if value is None or isinstance(value, dict):
        raise Refused(Refusal(value, expected(hint)))
    return tuple(value) if isinstance(value, list) else (value,)


def _read_union(members: tuple[Any, ...], value: Any, info: ValidationInfo) -> Any:
    member = _member_for(value, members)
    if member is NoneType:
        return None
    if get_origin(member) is Literal:
        return value
    return _adapter(member).validate_python(value, context=info.context)


def _member_for(value: Any, members: tuple[Any, ...]) -> Any:
    """The type of a union that a value was meant for."""
    records = [member for member in members if is_dataclass(member)]
    others = [m for m in members if m is not NoneType and m not in records]
    if records and (not others or isinstance(value, dict)):
        return _of_kind(value, records)
    if value is None and NoneType in members:
        return NoneType
    for member in others:
        if _is_of(value, member):
            return member
    others = [member for member in others if get_origin(member) is not Literal]
    if len(others) == 1:
        return others[0]
    raise Refused(Refusal(value, " or ".join(map(expected, others))))


def _is_of(value: Any, member: Any) -> bool:
    if get_origin(member) is Literal:
        return isinstance(value, str) and value in get_args(member)
    if isinstance(value, bool | str):
        return member is type(value)
    if isinstance(value, int | float):
        is_whole = isinstance(value, int) or value.is_integer()
        return member is float or (member is int and is_whole)
    return isinstance(value, list) and get_origin(member) is tuple


def _of_kind(value: Any, records: list[Any]) -> Any:
    """The record of a union that the section's ``kind`` names."""
    if len(records) == 1:
        return records[0]
    kinds = {record.__dataclass_fields__["kind"].default: record for record in records}
    found = value.get("kind") if isinstance(value, dict) else None
    if isinstance(found, str) and found in kinds:
        return kinds[found]
    usual = [record for record in records if getattr(record, "IS_USUAL", False)]
    if usual and (value is None or (isinstance(value, dict) and "kind" not in value)):
        return usual[0]
    said = "missing" if found is None else "found {}"
    expected = f"one of {', '.join(kinds)}" if found is None else ""
    raise Refused(Refusal(found, expected, ("kind",), said=said, known=tuple(kinds)))


def _whole(value: Any) -> Any:
    """Integers may be written with a point: 3.0."""
    is_whole = isinstance(value, float) and value.is_integer()
    return int(value) if is_whole else value


def _check_size(value: int) -> int:
    if abs(value) > _LARGEST_INTEGER:
        step = "correct the key"
        raise Refused(Refusal(value, "an integer of at most 18 digits", step=step))
    return value


def _check_text(value: str) -> str:
    if len(value) > _LONGEST_TEXT:
        said, most = f"found {{}}, {len(value)} characters", f"at most {_LONGEST_TEXT}"
        raise Refused(Refusal(value, most, said=said, step="shorten it"))
    if not is_plain(value):
        expected, step = "text without control characters", "remove them"
        raise Refused(Refusal(value, expected, step=step))
    return value


_SCALARS: dict[Any, Any] = {
    str: Annotated[str, Strict(), AfterValidator(_check_text)],
    bool: Annotated[bool, Strict()],
    int: Annotated[int, Strict(), BeforeValidator(_whole), AfterValidator(_check_size)],
    float: Annotated[float, Strict(), AllowInfNan(False)],
}


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
    if origin is Annotated:
        return expected(args[0])
    if origin in (Union, UnionType):
        words = " or ".join(expected(part) for part in args if part is not NoneType)
        return f"{words}, or nothing" if NoneType in args else words
    if origin is tuple:
        return f"a list (each {expected(args[0])})"
    if origin is Literal:
        return " or ".join(args)
    if origin is dict or is_dataclass(hint):
        return "a section with keys"
    return _WORDS[hint]


def _fault(record_type: Any, content: Any, error: Any) -> Fault:
    """What pydantic says of a value, as a fault."""
    place: tuple[Any, ...] = tuple(error["loc"])
    kind, value = error["type"], error["input"]
    if kind == "value_error":
        return refused(place, error["ctx"]["error"].refusal)
    if kind in _UNKNOWN_KEY:
        # Where a key is no plain text, the value is that key.
        section = place if kind == "string_unicode" else place[:-1]
        key = place[-1] if kind == "extra_forbidden" else value
        return _unknown_key((*section, key), record_type, content)
    if kind == "missing":
        holder = _record_at(place[:-1], record_type, content)
        hint = get_type_hints(holder, include_extras=True)[place[-1]]
        step = "add the key (configs/README.md explains it)"
        return missing(place, expected(hint), step)
    if place[-1] == "[key]":
        place = (*place[:-2], value)
        return Fault(place, f"the key is {value!r}", "text", "put it in quotes")
    return wrong(place, value, _EXPECTED[kind], _step(kind, value))


def _step(kind: str, value: Any) -> str:
    """What to do about a value of another type; empty where what is expected says it."""
    if kind == "string_type" and value is not None:
        return "" if isinstance(value, list | dict) else "put it in quotes"
    is_number = _EXPECTED[kind] in (_WORDS[int], _WORDS[float])
    if is_number and isinstance(value, str) and _DECIMAL_COMMA.fullmatch(value):
        return f"write {value.replace(',', '.')}, with a decimal point"
    if is_number and isinstance(value, str) and _BEGINS_WITH_NUMBER.match(value):
        return "write the number alone, without quotes or a unit"
    return ""


def _unknown_key(place: tuple[Any, ...], record_type: Any, content: Any) -> Fault:
    if isinstance(place[-1], int):
        # What {threshold: 0,7} is to YAML.
        step = "with a decimal comma? Write a point, as in 0.7 for 0,7"
        return Fault(place, "unknown key", step=step)
    elsewhere = [
        repr(f"{section}.{place[-1]}")
        for section, keys in _sections(record_type).items()
        if len(place) == 2 and section != place[0] and place[-1] in keys
    ]
    if 1 <= len(elsewhere) <= 2:
        # The key of another section is no slip of the pen.
        step = f"did you mean {' or '.join(elsewhere)}?"
        return Fault(place, "unknown key", step=step)
    return unknown_key(place, _keys(_record_at(place[:-1], record_type, content)))


def _sections(record_type: Any) -> dict[str, set[str]]:
    """Names of the keys of each section of a record."""
    hints = get_type_hints(record_type)
    return {
        name: {key for one in _records_of(hints[name]) for key in _keys(one)}
        for name in _keys(record_type)
    }


def _records_of(hint: Any) -> list[Any]:
    return [one for one in get_args(hint) or (hint,) if is_dataclass(one)]


def _record_at(place: tuple[Any, ...], record_type: Any, content: Any) -> Any:
    """The record whose keys stand at a place."""
    hint: Any = record_type
    for key in place:
        content = content[key]
        if get_origin(hint) is dict:
            # A section whose keys are names: what stands under each is of one type.
            hint = get_args(hint)[1]
        else:
            holder, hint = hint, get_type_hints(hint)[key]
            if holder is FitOptions and key in ("input_map", "output_map"):
                hint = OwnFunctionFile
        if get_origin(hint) is not dict:
            hint = _of_kind(content, _records_of(hint))
    return hint
