"""Settings that hold for every test."""

import logging
import os

import pytest
from hypothesis import settings

# Tests run side by side already: threads of the linear algebra would fight over the
# cores. It is read when numpy is first imported, so not before this line.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Compiled loops build on their first call, which no deadline can foresee; examples are
# derived from the test's name, so that a run can be repeated.
settings.register_profile("hwid", deadline=None, derandomize=True)
settings.load_profile("hwid")


@pytest.fixture(autouse=True)
def _log_level_as_before():
    yield
    logging.getLogger("hwid_cli").setLevel(logging.NOTSET)


@pytest.fixture
def blank_figures(monkeypatch):
    """Draw figures, but leave their files blank, where a test does not look at them.

    Rendering takes most of the time of a report; other tests of the same file do it.
    """
    from matplotlib.figure import Figure

    from hwid_cli.report import plots

    blank = plots.as_png(Figure((1, 1)))
    monkeypatch.setattr(plots, "as_png", lambda figure: blank)
