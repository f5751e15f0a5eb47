"""The report as one HTML file that needs nothing else: records in, text and figures out."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from hwid_cli.records.report import ReportContents
from hwid_cli.report.page import images_of
from hwid_cli.report.sections.calibrate import calibration_section
from hwid_cli.report.sections.crossval import crossval_section
from hwid_cli.report.sections.diagnose import diagnosis_section
from hwid_cli.report.sections.group import groups_section
from hwid_cli.report.sections.identify import (
    orders_section,
    recordings_section,
    residuals_section,
)
from hwid_cli.report.sections.models import models_section
from hwid_cli.report.sections.summary import summary_section
from hwid_cli.report.sections.test import (
    assignment_section,
    coverage_section,
    final_test_section,
)
from hwid_cli.report.table import shown_part

TEMPLATE = "report.html"


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


def report_page(
    contents: ReportContents, calibration_figures: Mapping[str, bytes]
) -> Page:
    """Write the report.

    Parameters
    ----------
    calibration_figures : mapping of str to bytes
        PNG files of ``hwid calibrate`` by the names of the recordings.

    Returns
    -------
    Page
        The same contents give the same bytes.
    """
    sections = (
        summary_section(contents),
        calibration_section(contents, calibration_figures),
        recordings_section(contents),
        residuals_section(contents),
        orders_section(contents),
        crossval_section(contents),
        models_section(contents),
        groups_section(contents),
        final_test_section(contents),
        coverage_section(contents),
        assignment_section(contents),
        diagnosis_section(contents),
    )
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
