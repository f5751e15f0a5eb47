"""Settings that hold for every test."""

import gc
import logging
import os
from pathlib import Path

import pytest
from _pytest.doctest import DoctestModule
from hypothesis import settings

# Tests run side by side already: threads of the linear algebra would fight over the
# cores. It is read when numpy is first imported, so not before this line.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

# Compiled loops build on their first call, which no deadline can foresee; examples are
# derived from the test's name, so that a run can be repeated.
settings.register_profile("hwid", deadline=None, derandomize=True)
settings.register_profile("hwid-fast", settings.get_profile("hwid"), max_examples=30)


def pytest_configure(config):
    """Try fewer examples where slow tests are left out."""
    is_fast = "not slow" in config.getoption("markexpr")
    settings.load_profile("hwid-fast" if is_fast else "hwid")
    gc.disable()


def pytest_collection_finish():
    """Look for garbage among what the tests make, not among what is collected."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path):
    """Look for examples in docstrings only where there are some.

    pytest imports every module for them: benchmarks, and what only slow tests need.
    """
    found = yield
    if file_path.suffix != ".py" or ">>>" in file_path.read_text(encoding="utf-8"):
        return found
    return [one for one in found if not isinstance(one, DoctestModule)]


TINY_CONFIG = """\
name: tiny
recordings:
  files: {files}
  columns: {columns}
{more}
orders: {{nb: [1, 2], nk: [1, 2]}}
"""


@pytest.fixture(autouse=True)
def _log_level_as_before():
    yield
    logging.getLogger("hwid_cli").setLevel(logging.NOTSET)


def leave_figures_blank(monkeypatch):
    """Put a blank figure where one would be rendered."""
    from matplotlib.figure import Figure

    from hwid_cli.report import plots

    blank = plots.as_png(Figure((1, 1)))
    monkeypatch.setattr(plots, "as_png", lambda figure: blank)


@pytest.fixture
def blank_figures(monkeypatch):
    """Draw figures, but leave their files blank, where a test does not look at them.

    Rendering takes most of the time of a report; other tests of the same file do it.
    """
    leave_figures_blank(monkeypatch)


@pytest.fixture
def write_config(tmp_path):
    """Write a YAML file and give its path."""

    def write(text: str, name: str = "tiny.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def tiny(write_config):
    """Give an experiment that reads files beside its YAML file."""
    from hwid_cli.config.load import load_experiment

    def make(
        files="'*.csv'", columns="{time: t, input: u, output: y}", more="", sections=""
    ):
        more = "\n".join(f"  {line}" for line in more.splitlines())
        text = TINY_CONFIG.format(files=files, columns=columns, more=more)
        return load_experiment(write_config(text + sections))

    return make


@pytest.fixture
def signals():
    """Time, input and output of 80 samples: more than the orders of `tiny` need."""
    time = np.round(0.01 * np.arange(80), 6)
    return time, np.sin(7 * time), np.cos(5 * time)


@pytest.fixture
def write_csv(tmp_path, signals):
    """Write a measurement as CSV, with single cells replaced."""

    def write(name="run.csv", cells=None, columns=signals, header="t,u,y"):
        rows = [[repr(float(v)) for v in row] for row in zip(*columns, strict=True)]
        for (line, column), text in (cells or {}).items():
            # Lines count from 1 and the first one is the header.
            rows[line - 2][column] = text
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = ([header] if header else []) + [",".join(row) for row in rows]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write
