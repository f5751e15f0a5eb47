"""A user's own function that ends its process: exit code 1 and one line, never success."""

import subprocess
import sys

import pytest

from tests.bad_input import trial

FIT = """
fit: {units: 3, starts: 1, max_iterations: 4, output_map: none,
  input_map: {file: curve.py, name: curve}}
identify: {}
"""
SOURCE = """
import os, signal, sys, time
import numpy as np
from hwid_cli import MapFunction

AT_START
def value(v, p):
    IN_VALUE
    return p[0] * np.tanh(v)

curve = MapFunction(
    value=value,
    by_argument=lambda v, p: p[0] * (1.0 - np.tanh(v) ** 2),
    by_parameters=lambda v, p: np.tanh(v)[:, None],
    start=[0.7],
)
"""
COMMAND = [sys.executable, "-m", "hwid_cli", "identify"]
# The checks of a function move p[0] by a millionth, a search by more.
LATER = "if abs(p[0] - 0.7) > 1e-3: "


def hwid(folder, at_start="", in_value="pass", jobs="1"):
    trial.make_good(folder)
    source = SOURCE.replace("AT_START", at_start).replace("IN_VALUE", in_value)
    (folder / "curve.py").write_text(source)
    with (folder / "config.yaml").open("a") as file:
        file.write(FIT)
    return subprocess.run(
        [*COMMAND, folder / "config.yaml", "--out", folder / "out", "--jobs", jobs],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def assert_one_line(done, *words):
    assert done.returncode == 1, (done.stdout, done.stderr)
    assert done.stdout.count("runs the Python function 'curve'") == 1
    (complaint,) = done.stderr.splitlines()
    assert all(word in complaint for word in ("curve", *words)), complaint


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("at_start", "in_value", "says"),
    [
        ("sys.exit(0)", "pass", "exit(0)"),
        pytest.param("os._exit(0)", "pass", "exit(0)", marks=pytest.mark.slow),
        ("os.kill(os.getpid(), signal.SIGKILL)", "pass", "SIGKILL"),
        pytest.param("", "sys.exit(0)", "exit(0)", marks=pytest.mark.slow),
        pytest.param("", f"{LATER}sys.exit(0)", "exit(0)", marks=pytest.mark.slow),
        ("", f"{LATER}os._exit(0)", "exit(0)"),
        ("", f"{LATER}raise KeyError('gone')", "KeyError: 'gone'"),
    ],
)
def test_function_that_ends_the_process_is_one_line(tmp_path, at_start, in_value, says):
    assert_one_line(hwid(tmp_path, at_start, in_value), says)


@pytest.mark.slow
@pytest.mark.parametrize("in_value", ["os._exit(0)", "sys.exit(0)"])
def test_the_same_on_workers(tmp_path, in_value):
    assert_one_line(hwid(tmp_path, "", f"{LATER}{in_value}", jobs="2"), "exit(0)")


@pytest.mark.slow
def test_function_that_does_not_come_back_is_one_line(tmp_path):
    assert_one_line(hwid(tmp_path, "while True: pass"), "20 s")
