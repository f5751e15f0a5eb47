"""A Hammerstein-Wiener model as one self-contained C99 file."""

import re
import textwrap
from collections.abc import Iterable, Mapping
from importlib.resources import files

import numpy as np

from hwid_cli import __version__
from hwid_cli.export.map_parts import language_text, numbers_of, portable
from hwid_cli.export.names import in_comment
from hwid_cli.records.exported import ExportedModel, ModelCard
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.units import behind

_SOURCES = files("hwid_cli.export") / "sources"
_WIDTH = 84
# A handle of MATLAB has a parenthesis after the sign.
_BLANK = re.compile("@([A-Za-z_]+)@")
_RULES = {
    "zero": "an empty linear block",
    "steady": "equilibrium with the first input",
    "estimated": "the state of the first recording of the fit",
}


def c_source(exported: ExportedModel) -> str:
    """Text of a C file that computes what ``hwid predict`` does.

    Returns
    -------
    str
        ASCII.

    Raises
    ------
    ConfigError
        If C does not know a map.
    """
    model = exported.model
    orders, free = model.orders, model.free_response
    # The recursion takes four coefficients at a time.
    size_f = 4 * max(1, -(-orders.nf // 4))
    missing = np.zeros(size_f - orders.nf)
    return filled(
        "model.c",
        {
            **card_text(exported.card, model.sample_time_s),
            "rule": _RULES[model.initial_state],
            "input_map": _map("input", model.input_map),
            "output_map": _map("output", model.output_map),
            "nb": orders.nb,
            "nk": orders.nk,
            "size_w": orders.nb + orders.nk,
            "size_f": size_f,
            "size_c": max(free.size, 1),
            "n_free": free.size,
            "numerator": numbers(model.numerator),
            "denominator": numbers(np.append(model.denominator[1:], missing)),
            "free_response": numbers(free if free.size else np.zeros(1)),
            "static_gain": number(exported.static_gain),
            "is_steady": int(model.initial_state == "steady"),
            "has_free": int(free.size > 0),
        },
    )


def card_text(card: ModelCard, sample_time_s: float) -> dict[str, str]:
    """What the comment at the top of a source says.

    Parameters
    ----------
    sample_time_s : float, [s]

    Returns
    -------
    dict of str to str
        Safe inside a comment.
    """
    low, high = card.input_range
    # The dash of a dimensionless input would be a minus behind a number.
    ends = f"{low:.6g} to {high:.6g}{behind(card.input_unit)}"
    about = (
        f"Model {card.name}, written by hwid {__version__}. Its data have inputs from "
        f"{ends}."
    )
    return {
        "title": in_comment(card.title),
        "about": comment_lines(about),
        "sample_time": repr(sample_time_s),
        "input_unit": in_comment(card.input_unit),
        "output_unit": in_comment(card.output_unit),
    }


def comment_lines(text: str) -> str:
    """Text that goes on over several lines of a comment."""
    return "\n * ".join(textwrap.wrap(in_comment(text), _WIDTH))


def filled(name: str, words: Mapping[str, object]) -> str:
    """A source file with its blanks filled in.

    Parameters
    ----------
    name : str
        Path below ``sources``.
    words : mapping of str to object
        By the names that stand between ``@`` signs.
    """
    return _filled((_SOURCES / name).read_text(encoding="ascii"), words)


def _filled(text: str, words: Mapping[str, object]) -> str:
    return _BLANK.sub(lambda found: str(words[found[1]]), text)


def number(value: float) -> str:
    """A number as C reads it, bit by bit the same.

    Examples
    --------
    >>> number(0.1), number(float("-inf"))
    ('0.1', '-HUGE_VAL')
    """
    if np.isinf(value):
        return "HUGE_VAL" if value > 0 else "-HUGE_VAL"
    # The shortest decimal that is read back as the same number.
    return repr(float(value))


def numbers(values: Iterable[float]) -> str:
    """Numbers as C reads them, in lines of bearable length."""
    line = ", ".join(number(value) for value in values)
    if len(line) < _WIDTH // 2:
        return line
    return "\n" + textwrap.indent(textwrap.fill(line, _WIDTH - 4), " " * 4)


def _map(side: str, one: StaticMap) -> str:
    text = language_text(side, one, "C", portable(one.kind).c)
    if one.extrapolation is None:
        return _law(side, one, text)
    lines = one.extrapolation
    # The straight lines are a map of another kind.
    straight = StaticMap(
        "piecewise_linear", np.concatenate([lines.arguments, lines.values])
    )
    law = text.replace("@side@_map(", "@side@_law(")
    return "\n".join(
        [
            _law(side, one, law),
            _law(f"{side}_beyond", straight, portable(straight.kind).c or ""),
            filled(
                "extrapolated.c",
                {
                    "side": side,
                    "visited": numbers(lines.visited),
                    "count": len(lines.stretches),
                },
            ),
        ]
    )


def _law(side: str, one: StaticMap, text: str) -> str:
    """A map by the law of its kind alone."""
    parts = numbers_of(one)
    return _filled(
        text,
        {
            "side": side,
            "domain": numbers(one.domain),
            **{name: numbers(values) for name, values in parts.items()},
            **{f"size_{name}": values.size for name, values in parts.items()},
        },
    )
