"""How a file shows the numbers of a static map: by the names that its kind gives them."""

from typing import Any

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.model.maps.rule import Portable
from hwid_cli.model.static_map import RULES
from hwid_cli.records.maps import MAP_KINDS, StaticMap


def portable(kind: str) -> Portable:
    """How maps of a kind leave the program."""
    return RULES[kind].portable


def parts_of(one: StaticMap) -> dict[str, np.ndarray]:
    """Split a map's parameters into their named parts.

    Examples
    --------
    >>> parts_of(StaticMap("piecewise_linear", np.array([0.0, 1.0, 5.0, 6.0])))
    {'break_points': array([0., 1.]), 'values': array([5., 6.])}
    """
    total, first = one.parameters.size, 0
    parts = {}
    for part in portable(one.kind).parts:
        size = part.size(total)
        parts[part.name] = one.parameters[first : first + size]
        first += size
    return parts


def numbers_of(one: StaticMap) -> dict[str, np.ndarray]:
    """Named parts of a map, and what is derived from them."""
    return {**parts_of(one), **portable(one.kind).derived(one)}


def language_text(side: str, one: StaticMap, language: str, text: str | None) -> str:
    """Text of a map in a language, refused where there is none.

    Parameters
    ----------
    side : str
        ``input`` or ``output``.

    Raises
    ------
    ConfigError
        With the map.
    """
    if text is not None:
        return text
    what = f"of the kind {one.kind}"
    if one.function is not None:
        what = f"the Python function {one.function.name!r}"
    raise ConfigError(
        f"--format: the {side} map is {what}, which {language} does not know; expected "
        "another kind of map; use --format json"
    )


def map_schema() -> dict[str, Any]:
    """What a file's maps must look like, as JSON Schema."""
    return {
        "type": "object",
        "description": "A static map; its kind says which parts it has.",
        "oneOf": [_schema_of(kind) for kind in RULES],
    }


_FUNCTION = {
    "type": "object",
    "description": "A Python function of the user's own; runs only where that is allowed.",
    "properties": {
        "name": {"type": "string"},
        "source": {"type": "string"},
        "unit": {"type": "number", "exclusiveMinimum": 0},
    },
    "required": ["name", "source", "unit"],
    "additionalProperties": False,
}


def _schema_of(kind: str) -> dict[str, Any]:
    form = portable(kind)
    properties: dict[str, Any] = {"kind": {"const": kind}}
    for part in (*form.parts, *form.derived_parts):
        properties[part.name] = _array(part.about, part.least, part.most)
    if MAP_KINDS[kind].has_function:
        properties["function"] = _FUNCTION
    properties["domain"] = _array(
        "Range of the argument in the fit; outside it the map extrapolates.", 2, 2
    )
    return {
        "properties": {
            **properties,
            "extrapolation": {"$ref": "#/$defs/extrapolation"},
        },
        "required": list(properties),
        "additionalProperties": False,
    }


def extrapolation_schema() -> dict[str, Any]:
    """What a file says of a map where its fit had no samples, as JSON Schema."""
    properties = {
        "visited": _array(
            "First and last argument of each stretch that samples visited, one after the "
            "other, rising: there the law of the kind holds.",
            2,
        ),
        "arguments": _array("Rising arguments of the points.", 2),
        "values": _array(
            "Value at each of them. Elsewhere the map is the straight lines between the "
            "points; the first and the last line go on.",
            2,
        ),
    }
    return {
        "type": "object",
        "description": "What a map does where its fit had no samples; without it the law "
        "of its kind holds everywhere.",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def _array(about: str, least: int = 0, most: int | None = None) -> dict[str, Any]:
    found: dict[str, Any] = {"type": "array", "items": {"type": "number"}}
    if least:
        found["minItems"] = least
    if most is not None:
        found["maxItems"] = most
    return {**found, "description": about}
