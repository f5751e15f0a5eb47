"""A signal stops the program wherever it arrives."""

import subprocess
import sys

import pytest

PROGRAM = """
import signal, sys, time
import click
from hwid_cli.cli.stopping import Stopped, stop_signals

class Freed:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)

try:
    with stop_signals(click.Context(click.Command("hwid"))):
        Freed()
        limit = time.monotonic() + 10
        while time.monotonic() < limit:
            [Freed.__name__ for _ in range(100)]
    print("was not stopped")
except Stopped as stopped:
    print(stopped.sentence)
"""


@pytest.mark.thorough
def test_a_signal_while_an_object_is_freed_stops_the_program_without_a_traceback():
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False
        )

        assert done.stderr == ""
        assert done.stdout.startswith("interrupted by SIGTERM; nothing was begun;")
