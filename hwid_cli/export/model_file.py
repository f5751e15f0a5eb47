"""A model's JSON file as plain data that ``model.schema.json`` describes.

What the schema says is checked here and nowhere else; one line says what is wrong.
"""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NoReturn

from hwid_cli.config.faults import Fault, unknown_key
from hwid_cli.errors import ModelFileError
from hwid_cli.files.messages import escaped
from hwid_cli.files.small_files import read_small_file

_LONGEST_SHOWN = 60
# The largest that hwid writes, a model of 1000 units at either side, has 1 MB.
_MOST_BYTES = 32 * 2**20
_STEP = "export the model again or correct the file"
_KINDS = {dict: "an object", list: "a list", str: "text", type(None): "nothing"}
_TYPES = {
    "object": "an object",
    "array": "a list of numbers",
    "string": "text",
    "integer": "an integer",
    "number": "a finite number",
    "null": "null",
}


def read_model_file(path: Path) -> dict[str, Any]:
    """Content of a JSON file that the schema describes, its numbers finite.

    Raises
    ------
    ModelFileError
        If the file is missing, is no JSON, of another version or not as described.
    """
    content = _read_json(path)
    _check_format(path, content)
    errors = list(_validator().iter_errors(content))
    if errors:
        raise ModelFileError(_fault(_nearest(errors)).message(path))
    for place, value in _numbers(content):
        if not _is_finite(value):
            refuse(path, place, value, "a finite number")
    return content


def refuse(
    path: Path, place: Iterable[str | int], found: object, expected: str
) -> NoReturn:
    """End with a message about one key.

    Parameters
    ----------
    place : iterable of str or int
        Keys from the top of the file down; numbers count items of lists.
    found : object
        Shown, shortened.

    Raises
    ------
    ModelFileError
    """
    raise ModelFileError(_wrong(place, found, expected).message(path))


def _wrong(place: Iterable[str | int], found: object, expected: str) -> Fault:
    text = escaped(found if isinstance(found, str) else repr(found))
    if len(text) > _LONGEST_SHOWN:
        text = f"{text[:_LONGEST_SHOWN]}..."
    return Fault(_keys(place), f"found {text}", expected, _STEP)


def _keys(place: Iterable[str | int]) -> tuple[str, ...]:
    """Keys of a place; items of lists are ``numerator[0]``."""
    keys: list[str] = []
    for key in place:
        if isinstance(key, int):
            keys[-1] += f"[{key}]"
        else:
            keys.append(key)
    return tuple(keys)


def _read_json(path: Path) -> dict[str, Any]:
    wanted = "expected a model that 'hwid export"
    try:
        text = read_small_file(path, most_bytes=_MOST_BYTES).decode("utf-8-sig")
        values = json.loads(
            text, parse_constant=_no_constant, object_pairs_hook=_without_repeats
        )
    except FileNotFoundError:
        raise ModelFileError(
            f"{path}: no such file; {wanted}' wrote; correct the path"
        ) from None
    except OSError as error:
        raise ModelFileError(
            f"{path}: cannot be read ({error.strerror or error}); {wanted}' wrote"
        ) from error
    except (ValueError, RecursionError) as error:
        if path.suffix.lower() in (".yaml", ".yml"):
            raise ModelFileError(
                f"{path}: is a configuration; expected a model; 'hwid export {path}' "
                "writes those of its results"
            ) from error
        said = " ".join(str(error).split())[:120]
        raise ModelFileError(
            f"{path}: is no JSON ({said}); {wanted} --format json' wrote; export it again"
        ) from error
    if not isinstance(values, dict):
        raise ModelFileError(
            f"{path}: holds {_kind(values)}; expected an object; export the model again"
        )
    return values


def _no_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number")


def _without_repeats(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"key {twice!r} occurs twice")
    return values


def _check_format(path: Path, content: dict[str, Any]) -> None:
    wanted = _schema()["oneOf"][0]["properties"]
    found = [content.get(key) for key in ("format", "schema_version")]
    expected = [wanted[key]["const"] for key in ("format", "schema_version")]
    if found[0] is None:
        raise ModelFileError(
            f"{path}: holds no key 'format'; expected a model that 'hwid export --format "
            "json' wrote; correct the path"
        )
    if found != expected:
        name, version = (escaped(str(one)[:40]) for one in found)
        raise ModelFileError(
            f"{path}: format {name}, schema_version {version}; expected {expected[0]} "
            f"{expected[1]}; export the model again with this version of hwid"
        )


@cache
def _schema() -> dict[str, Any]:
    return json.loads((files("hwid_cli.export") / "model.schema.json").read_text())


@cache
def _validator() -> Any:
    # Loaded only where a model is read.
    from jsonschema import Draft202012Validator  # noqa: PLC0415, RUF100

    return Draft202012Validator(_schema())


def _nearest(errors: Sequence[Any]) -> Any:
    """The error to tell: an unknown key before what follows from it."""
    told = [one for one in errors if one.validator == "additionalProperties"]
    error = (told or list(errors))[0]
    if error.validator != "oneOf":
        return error
    # The branch that was meant is the one of that kind.
    others = {one.schema_path[0] for one in error.context if list(one.path) == ["kind"]}
    meant = [one for one in error.context if one.schema_path[0] not in others]
    return _nearest(meant) if meant else error


def _fault(error: Any) -> Fault:
    """What jsonschema says of a value, as a fault."""
    place, found, rule = list(error.absolute_path), error.instance, error.validator
    limit, schema = error.validator_value, error.schema
    if rule == "additionalProperties":
        known = schema["properties"]
        key = next(key for key in found if key not in known)
        return unknown_key((*_keys(place), key), known)
    if rule == "required":
        key = next(key for key in limit if key not in found)
        return _wrong((*place, key), "nothing", "this key")
    if rule == "oneOf":
        kinds = [one["properties"]["kind"]["const"] for one in limit]
        kind = found.get("kind", "nothing")
        return _wrong((*place, "kind"), kind, f"one of {', '.join(kinds)}")
    if rule == "maxItems" or found == []:
        found = f"{len(found) or 'no'} numbers"
    if rule == "type" and limit == "object":
        found = _kind(found)
    return _wrong(place, found, _expected(schema, rule))


def _kind(value: object) -> str:
    return _KINDS.get(type(value), repr(value)[:_LONGEST_SHOWN])


def _expected(schema: dict[str, Any], rule: str) -> str:
    """What a part of the schema asks for, in words."""
    if rule in ("minItems", "maxItems"):
        is_exact = schema.get("minItems") == schema.get("maxItems")
        most = "at least" if rule == "minItems" else "at most"
        return f"{schema[rule]} numbers" if is_exact else f"{most} {schema[rule]}"
    if "const" in schema:
        return repr(schema["const"])
    if "enum" in schema:
        return f"one of {', '.join(schema['enum'])}"
    types = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    words = " or ".join(_TYPES[one] for one in types)
    if "maximum" in schema:
        return f"{words} from {schema['minimum']} to {schema['maximum']}"
    if "minimum" in schema:
        return f"{words} of at least {schema['minimum']}"
    if "exclusiveMinimum" in schema:
        return f"{words} above {schema['exclusiveMinimum']}"
    return f"{words} other than {schema['not']['const']}" if "not" in schema else words


def _numbers(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, Any]]:
    """Numbers in plain data, with their places; what is for people is left out."""
    if isinstance(value, dict):
        for key, item in value.items():
            if key != "provenance":
                yield from _numbers(item, (*place, key))
    elif isinstance(value, list):
        for at, item in enumerate(value):
            yield from _numbers(item, (*place, at))
    elif isinstance(value, int | float):
        yield place, value


def _is_finite(value: float) -> bool:
    """Whether a number is finite as a float; an integer may be too large for one."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False
