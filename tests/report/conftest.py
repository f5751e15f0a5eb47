"""One report of everything, written once."""

import pytest

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
