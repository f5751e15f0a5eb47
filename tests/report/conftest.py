"""One report of everything, written once."""

from importlib import import_module
from pathlib import Path

import pytest

import hwid_cli.report.sections
from hwid_cli.report.html import report_page
from hwid_cli.stages.report import report_contents
from hwid_cli.stages.table import STAGES
from tests.report.report_examples import everything


@pytest.fixture(scope="session")
def contents():
    """What a report on six recordings and all stages shows."""
    return report_contents(everything(6, levels=2))


@pytest.fixture(scope="session")
def page(contents):
    """That report."""
    return report_page(contents, STAGES)


@pytest.fixture(scope="session")
def section_ids(contents):
    """Sections of that report as their modules say them, in the page's order.

    The answers first, then the stages from the last to the first, then what was run.
    """
    room = Path(hwid_cli.report.sections.__file__).parent
    shown = [name for name in STAGES if (room / f"{name}.py").is_file()]
    made = [
        make(contents)
        for name in reversed(shown)
        for make in import_module(f"hwid_cli.report.sections.{name}").SECTIONS
    ]
    return ["summary", *(one.id for one in made if not one.missing), "about"]
