"""What inputs may reach: no file outside of the results, no page, no network."""

import json
import os
import socket
import stat
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from hwid_cli.data.virtual_measurements import (
    read_virtual_key,
    write_virtual_measurements,
)
from hwid_cli.records.machines import VirtualMeasurement
from tests.bad_input import trial
from tests.conftest import leave_figures_blank

# Names may hold none of < and >; what remains must not break out of an attribute.
NASTY_NAME = "x' onmouseover='alert(1)' y&lt;script&gt;"
NASTY_UNIT = "<script>alert(1)</script>"
CONFIG = f"""\
name: tiny
recordings:
  files: "*.csv"
  columns: {{time: t, input: u, output: y}}
  output_unit: "{NASTY_UNIT}"
  input_unit: "\\"><img src=x onerror=alert(2)>"
orders: {{nb: 1, nk: 1}}
fit: {{units: 3, starts: 1, max_iterations: 2}}
identify: {{}}
crossval: {{threshold: 0.01}}
"""
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
# Audit events whose first argument, or first two, is a path that changes.
CHANGING = {
    "os.mkdir": 1,
    "os.remove": 1,
    "os.rename": 2,
    "os.link": 2,
    "os.symlink": 2,
}


class Page(HTMLParser):
    """Names of tags and attributes of a page, and its text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.text = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += attributes

    def handle_data(self, text):
        self.text.append(text)


@pytest.fixture(scope="module")
def nasty(tmp_path_factory):
    folder = tmp_path_factory.mktemp("nasty") / "nasty"
    folder.mkdir()
    (folder / "config.yaml").write_text(CONFIG)
    (folder / f"{NASTY_NAME}.csv").write_text(trial.csv_text())
    time, current, output = trial.signals()
    (folder / "[link=x]b[.csv").write_text(trial.csv_text((time, current, output + 1)))
    return folder


def forbid_network(monkeypatch):
    """Let sockets be between processes of this machine only."""
    plain = socket.socket

    class Local(plain):
        def __init__(self, family=-1, *arguments, **options):
            if family != socket.AF_UNIX:
                raise AssertionError("a socket to a network")
            super().__init__(family, *arguments, **options)

    monkeypatch.setattr(socket, "socket", Local)


class Writes:
    """Paths that this process writes, as Python's audit hook reports them."""

    def __init__(self):
        self.paths, self.is_on = [], False
        sys.addaudithook(self)

    def __call__(self, event, arguments):
        if not self.is_on:
            return
        if event == "open":
            path, mode, flags = arguments
            opens = isinstance(mode, str) and set(mode) & set("wax+")
            if isinstance(path, str | bytes | Path) and (opens or flags & WRITING):
                self.paths.append(os.fsdecode(path))
        elif event in CHANGING:
            found = arguments[: CHANGING[event]]
            self.paths += [
                os.fsdecode(one) for one in found if not isinstance(one, int)
            ]


def is_device(path):
    return Path(path).exists() and stat.S_ISCHR(Path(path).stat().st_mode)


@pytest.fixture(scope="module")
def written(nasty):
    """What a run of all stages writes, and where."""
    writes = Writes()
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        forbid_network(monkeypatch)
        writes.is_on = True
        result = trial.run(nasty, "run")
        writes.is_on = False
    assert result.exit_code == 0, (result.stderr, result.exception)
    return writes.paths


def test_nasty_names_and_units_are_text_on_the_page(nasty, written):
    text = (nasty / "out" / "report.html").read_text()
    page = Page(text)
    # One program, which the policy of the page names by its hash; the rest is data.
    assert text.count("<script>") == 1
    data = text.count('<script type="application/json" class="data">')
    assert page.tags.count("script") == 1 + data
    assert any(
        value.startswith("default-src 'none'; style-src 'sha256-")
        for name, value in page.attributes
        if name == "content"
    )
    assert not [name for name, _ in page.attributes if name.startswith("on")]
    assert not [
        value for name, value in page.attributes if name == "src" and value == "x"
    ]
    shown = "".join(page.text)
    assert NASTY_UNIT in shown
    assert NASTY_NAME in shown


def test_nothing_is_written_elsewhere(nasty, written):
    outside = [
        path
        for path in written
        if not Path(path).resolve().is_relative_to(nasty / "out")
        # What numba has compiled lies beside the package.
        and "__pycache__" not in path
        and not is_device(path)
    ]
    assert written
    assert outside == []


def test_no_cell_of_any_table_is_a_formula(nasty, written):
    tables = sorted((nasty / "out").glob("*.csv"))
    assert tables
    for table in tables:
        for line in table.read_text().splitlines():
            for cell in line.split(","):
                is_number = (
                    cell.lstrip("+-").replace(".", "").replace("e-", "").isdigit()
                )
                assert is_number or not cell.strip('"').startswith(("=", "+", "@", "-"))


def test_a_manifest_cannot_remove_a_file_elsewhere(tmp_path):
    import hashlib

    kept = tmp_path / "kept.txt"
    kept.write_text("precious")
    folder = tmp_path / "out" / "raw"
    folder.mkdir(parents=True)
    digest = hashlib.sha256(b"precious").hexdigest()
    manifest = {"format": "hwid-raw", "schema_version": 1, "key": "k"}
    text = json.dumps({**manifest, "files": {"../../kept.txt": digest}})
    (folder / "simulate.json").write_text(text)

    assert read_virtual_key(tmp_path / "out") is None
    one = VirtualMeasurement("a", "step", np.arange(2.0), np.ones(2), np.ones(2), {})
    write_virtual_measurements(tmp_path / "out", [one])

    assert kept.read_text() == "precious"


@pytest.mark.thorough
def test_only_the_function_that_a_configuration_names_runs(tmp_path):
    folder = tmp_path / "tiny"
    trial.make_good(folder)
    ran = folder / "ran"
    (folder / "map.py").write_text(f"open({str(ran)!r}, 'w').close()\nf = 1\n")
    for name in ("conftest.py", "sitecustomize.py", "numpy.py", "run.py"):
        (folder / name).write_text(
            f"open({str(folder / name)!r} + '.ran', 'w').close()\n"
        )

    assert trial.run(folder).exit_code == 0
    assert not ran.exists()

    config = folder / "config.yaml"
    config.write_text(trial.CONFIG + "fit: {input_map: {file: map.py, name: f}}\n")
    trial.run(folder)

    assert ran.exists()
    assert sorted(folder.glob("*.ran")) == []


def test_an_entry_of_the_cache_answers_under_its_own_name_only(tmp_path):
    from hwid_cli.records.recordings import CalibrationLog
    from hwid_cli.store.cache import Hdf5Store

    store = Hdf5Store(tmp_path)
    log = CalibrationLog("a", (), 0, 1, 1, 1)
    store.put("aa", log)
    (tmp_path / "bb").mkdir()
    (tmp_path / "bb" / "bb.h5").write_bytes((tmp_path / "aa" / "aa.h5").read_bytes())

    assert store.get("aa", CalibrationLog) == log
    assert store.get("bb", CalibrationLog) is None
    assert "another task" in store.unusable[0]
