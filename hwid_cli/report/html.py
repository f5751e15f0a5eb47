"""The report as one HTML file that needs nothing else: records in, text out.

The answers stand first, then the sections of the stages, the last stage before the first,
then what was run on what. Charts are drawn by the page's own script (templates/report.js)
with uPlot, which is part of the page too (templates/uplot.min.js; its licence, MIT, is
templates/uplot.LICENSE).
"""

import base64
import hashlib
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from importlib.resources import files
from importlib.util import find_spec
from types import ModuleType
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from hwid_cli.records.report import ReportContents
from hwid_cli.report.charts import chart_data
from hwid_cli.report.dots import dot_drawing
from hwid_cli.report.page import Answer, Drawing, Section, to_copy
from hwid_cli.report.sections.about import about_section
from hwid_cli.report.sections.summary import summary_section
from hwid_cli.report.table import shown_part
from hwid_cli.report.terms import explanation

TEMPLATE = "report.html"
_SECTIONS = "hwid_cli.report.sections"
_STYLES = ("uplot.min.css", "report.css")
_SCRIPTS = ("uplot.min.js", "report.js")
_LICENCE = "uplot.LICENSE"
# A browser would break a line behind the sign of its power.
_NUMBER = re.compile(r"(\d(?:\.\d+)?e[+-]\d+)")


@dataclass(frozen=True)
class Page:
    """A finished report.

    Parameters
    ----------
    drawings : tuple of Drawing
        Figures that lie beside it as files; none is drawn yet.
    """

    html: str
    drawings: tuple[Drawing, ...]


def report_page(contents: ReportContents, stages: Iterable[str]) -> Page:
    """Write the report.

    Parameters
    ----------
    stages : iterable of str
        All there are, in their order.

    Returns
    -------
    Page
        The same contents give the same bytes.
    """
    modules = [
        one for one in map(_module_of, reversed(tuple(stages))) if one is not None
    ]
    made = [make(contents) for make in _all_of(modules, "SECTIONS")]
    answers = [make(contents) for make in _all_of(modules, "ANSWERS")]
    known: list[Answer] = [one for one in answers if one is not None]
    sections = (
        summary_section(contents, known),
        *(one for one in made if not one.missing),
        about_section(contents, [one for one in made if one.missing]),
    )
    drawings = [one for make in _all_of(modules, "DRAWINGS") for one in make(contents)]
    return Page(_html(contents, sections), tuple(drawings))


def _html(contents: ReportContents, sections: Iterable[Section]) -> str:
    environment = Environment(
        loader=PackageLoader("hwid_cli.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["chart_data"] = chart_data
    environment.filters["soft"] = soft
    environment.filters["to_copy"] = partial(to_copy, stored=contents.stored)
    environment.filters["laid_out"] = dot_drawing
    environment.filters["shown"] = lambda table: shown_part(
        table, is_screen=False, thesis_names=contents.stored.thesis_names
    )
    environment.filters["explained"] = lambda table: explanation(
        table, contents.stored.nk_role
    )
    # Every copy of uPlot carries its licence.
    licence = Markup("/*\n{}\n*/\n").format(_shipped((_LICENCE,)))
    style, script = _shipped(_STYLES), licence + _shipped(_SCRIPTS)
    return environment.get_template(TEMPLATE).render(
        name=contents.stored.name,
        sections=tuple(sections),
        style=style,
        script=script,
        policy=_policy(style, script),
    )


def soft(text: str) -> Markup:
    """Let long names of groups go on in the next line, and keep numbers whole.

    Examples
    --------
    >>> print(soft("a+b <= 2e-05 m"))
    a+<wbr>b &lt;= <span class="whole">2e-05</span> m
    """
    parts = _NUMBER.split(str(text))
    if parts[::2] == ["", ""]:
        # A cell of a table, which no line breaks.
        return escape(text)
    names, numbers = parts[::2], parts[1::2]
    found = Markup("")
    for name, number in zip(names, [*numbers, ""], strict=True):
        found += Markup("+<wbr>").join(name.split("+"))
        if number:
            found += Markup('<span class="whole">{}</span>').format(number)
    return found


def _policy(style: str, script: str) -> str:
    """What a browser lets the page do: draw with its own style, script and pictures."""
    # report.js saves pictures of charts as blobs; nothing else may be loaded or run.
    return (
        f"default-src 'none'; style-src {_hash(style)}; script-src {_hash(script)}; "
        "img-src blob:; base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    """The hash by which a policy allows the text of an element."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


@cache
def _shipped(names: tuple[str, ...]) -> Markup:
    """Files of the package that become part of the page as they are."""
    folder = files("hwid_cli.report") / "templates"
    texts = [(folder / name).read_text(encoding="utf-8").strip() for name in names]
    return Markup("\n".join(texts))


def _module_of(stage: str) -> ModuleType | None:
    """The module that shows a stage; a stage without one shows nothing."""
    place = f"{_SECTIONS}.{stage}"
    return None if find_spec(place) is None else import_module(place)


def _all_of(modules: Iterable[ModuleType], name: str) -> list[Callable[..., Any]]:
    """What modules make of one kind, in their order."""
    return [make for one in modules for make in getattr(one, name, ())]
