"""One report of everything, written once."""

import pytest

from hwid_cli.report import plots
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
    """That report; of figures that look alike the first one is rendered."""
    render, done = plots.as_png, {}

    def as_png(figure):
        shape = (*figure.get_size_inches(), *(one.get_ylabel() for one in figure.axes))
        if shape not in done:
            done[shape] = render(figure)
        return done[shape]

    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(plots, "as_png", as_png)
        return report_page(contents, STAGES)
