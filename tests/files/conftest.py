"""Small experiments and measurement files for the tests of this room."""

from pathlib import Path

import numpy as np
import pytest

from hwid_cli.files.config import load_experiment

TINY_CONFIG = """\
name: tiny
recordings:
  files: {files}
  columns: {columns}
{more}
orders: {{nb: [1, 2], nk: [1, 2]}}
"""


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
