"""The second process of a first fit: when there is one, what it compiles, and its end."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hwid_cli.model import loops_beside

PROJECT = Path(__file__).parents[2]
MAPS = ("piecewise_linear", "piecewise_linear")
FIT = """
import numpy as np
from hwid_cli import Orders, Recording, fit
from hwid_cli.model.loops_beside import BESIDE
u = np.sin(np.arange(300) ** 1.3)
x = np.tanh(np.convolve(u, [0, 0.5, 0.3])[:300])
found = fit([Recording("r", u, x, 1.0)], Orders(2, 1, 1))
print([one.__name__ for one, signature in BESIDE if signature not in one.signatures])
print([sum(one.stats.cache_misses.values()) for one, _ in BESIDE])
print(found.rmsd.hex(), found.model.numerator.tobytes().hex())
"""


def printed(code, **variables):
    """Lines that a process of its own prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=PROJECT,
        env={**os.environ, "PYTHONPATH": str(PROJECT), **variables},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


@pytest.fixture
def started(monkeypatch):
    """Processes that were started; a first fit on two cores, if nothing is changed."""
    processes = []

    def start():
        code = "import time; time.sleep(600)"
        processes.append(subprocess.Popen([sys.executable, "-c", code]))
        return processes[-1]

    monkeypatch.setattr(loops_beside, "_started", start)
    monkeypatch.setattr(loops_beside, "_is_first_fit", lambda: True)
    monkeypatch.setattr(loops_beside, "_cores", lambda: 2)
    monkeypatch.setattr(loops_beside, "HAS_LOCKS", True)
    monkeypatch.setattr(sys, "executable", sys.executable)
    return processes


def test_the_second_process_ends_with_the_fit(started):
    with loops_beside.loops_compiled_beside(MAPS):
        assert [one.poll() for one in started] == [None]
    assert all(one.returncode for one in started)


def test_it_ends_with_a_fit_that_fails(started):
    beside = loops_beside.loops_compiled_beside(MAPS)
    with pytest.raises(ValueError, match="fails"), beside:
        raise ValueError("fails")
    assert [one.returncode is None for one in started] == [False]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("_is_first_fit", lambda: False),
        ("_cores", lambda: 1),
        ("HAS_LOCKS", False),
        ("sys.executable", "/opt/matlab/bin/matlab"),
        ("sys.executable", None),
        ("multiprocessing.parent_process", object),
    ],
)
def test_there_is_none_where_it_would_not_help(started, monkeypatch, name, value):
    monkeypatch.setattr(f"hwid_cli.model.loops_beside.{name}", value)
    with loops_beside.loops_compiled_beside(MAPS):
        assert started == []


def test_linear_models_have_none(started):
    with loops_beside.loops_compiled_beside(("none", "none")):
        assert started == []


@pytest.mark.thorough
@pytest.mark.skipif(not loops_beside.HAS_LOCKS, reason="no second process there")
def test_the_second_process_stands_back():
    process = loops_beside._started()
    try:
        for _ in range(100):
            nice = os.getpriority(os.PRIO_PROCESS, process.pid)
            if nice > os.nice(0):
                break
            time.sleep(0.1)
        assert nice == 19
    finally:
        process.kill()
        process.wait()


def test_a_fit_goes_on_where_no_process_is_to_be_had(monkeypatch):
    def refused(*arguments, **options):
        raise BlockingIOError

    monkeypatch.setattr(subprocess, "Popen", refused)
    assert loops_beside._started() is None


@pytest.mark.thorough
def test_a_fit_calls_every_loop_that_the_second_process_compiles():
    assert printed(FIT)[0] == "[]"


@pytest.mark.slow
def test_a_fit_finds_what_the_second_process_left(tmp_path):
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    compile_them = (
        "from hwid_cli.model import loops_beside; loops_beside.compile_them()"
    )
    printed(compile_them, **cache)
    found = printed(FIT, **cache)
    assert found[1] == str([0] * len(loops_beside.BESIDE))
    # Loaded loops give the same bits as those compiled here.
    other = {"NUMBA_CACHE_DIR": str(tmp_path / "other")}
    assert printed(FIT, **other)[2] == found[2] == printed(FIT, **cache)[2]
