"""The report as one HTML file that needs nothing else: records in, text and figures out."""

import base64
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec

from jinja2 import Environment, PackageLoader, StrictUndefined

from hwid_cli.records.report import ReportContents
from hwid_cli.report.page import Section, images_of
from hwid_cli.report.sections.summary import summary_section
from hwid_cli.report.table import shown_part

TEMPLATE = "report.html"
_SECTIONS = "hwid_cli.report.sections"


@dataclass(frozen=True)
class Page:
    """A finished report.

    Parameters
    ----------
    figures : mapping of str to bytes
        PNG files by their place below ``figures/``, without those that were given.
    """

    html: str
    figures: Mapping[str, bytes]


def report_page(contents: ReportContents, stages: Iterable[str]) -> Page:
    """Write the report.

    Parameters
    ----------
    stages : iterable of str
        All there are, in the order of their sections.

    Returns
    -------
    Page
        The same contents give the same bytes.
    """
    makers = [one for name in stages for one in _sections_of(name)]
    sections = (summary_section(contents), *(make(contents) for make in makers))
    environment = Environment(
        loader=PackageLoader("hwid_cli.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["base64"] = lambda png: base64.b64encode(png).decode("ascii")
    environment.filters["shown"] = lambda table: shown_part(
        table, is_screen=False, thesis_names=contents.stored.thesis_names
    )
    html = environment.get_template(TEMPLATE).render(
        name=contents.stored.name, sections=sections
    )
    images = images_of(tuple(block for one in sections for block in one.blocks))
    return Page(html, {one.file: one.png for one in images})


def _sections_of(stage: str) -> tuple[Callable[[ReportContents], Section], ...]:
    """What the module of a stage's name shows; a stage without one shows nothing."""
    place = f"{_SECTIONS}.{stage}"
    if find_spec(place) is None:
        return ()
    found: tuple[Callable[[ReportContents], Section], ...]
    found = import_module(place).SECTIONS
    return found
