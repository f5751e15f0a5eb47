"""A signal stops the program wherever it arrives."""

import signal
import subprocess
import sys
from types import SimpleNamespace

import click
import pytest

from hwid_cli.cli.stage_runner import StageRunner
from hwid_cli.cli.stopping import KEPT_IN, _sentence

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


def test_a_stopped_command_says_how_far_it_had_come(tmp_path):
    """A diagnosis that is stopped after minutes has found something already."""
    context = click.Context(click.Command("diagnose"))
    context.meta[KEPT_IN] = tmp_path
    before = _sentence(context, signal.SIGTERM)
    assert before.endswith("run the same command again to go on")
    with context:
        session = SimpleNamespace(
            place=lambda name: "", cache=tmp_path, workers=None, forced=(),
            is_quiet=True, is_verbose=False,
        )  # fmt: skip
        runner = StageRunner(session, "diagnose")
        with runner.rounds("tasks") as (_, begin):
            begin("single effects (so far input_delay, 7 times the noise)", 0)
            said = _sentence(context, signal.SIGTERM)
    assert said == (
        f"{before}; it had come to: single effects (so far input_delay, 7 times the noise)"
    )
    assert _sentence(context, signal.SIGTERM) == before
