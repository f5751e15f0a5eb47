import re
import time
from dataclasses import replace

import pytest

from hwid_cli.cli import driver, progress_lines, session
from hwid_cli.cli.progress_lines import ProgressLines
from hwid_cli.stages.table import stage_named


class Told:
    """Stands for a session: keeps what it is told."""

    def __init__(self, *, is_quiet=False):
        self.is_quiet, self.lines = is_quiet, []

    def note(self, text):
        self.lines.append(text)


def wait_for(lines, count):
    end = time.monotonic() + 20.0
    while len(lines) < count and time.monotonic() < end:
        time.sleep(0.005)


def test_a_line_comes_at_intervals_while_nothing_ends():
    told, doing = Told(), ["pairs"]
    with ProgressLines(told, lambda: doing[0], every_s=0.01):
        wait_for(told.lines, 2)
        doing[0] = "sets of three: 2 of 9 tasks"
        wait_for(told.lines, len(told.lines) + 2)
    count = len(told.lines)
    assert told.lines[0] == "pairs, 0 s passed"
    assert told.lines[-1] == "sets of three: 2 of 9 tasks, 0 s passed"
    time.sleep(0.05)
    assert len(told.lines) == count


@pytest.mark.parametrize("is_quiet", [True, False])
def test_quiet_and_a_terminal_with_its_bar_have_none(monkeypatch, is_quiet):
    told = Told(is_quiet=is_quiet)
    monkeypatch.setattr(
        progress_lines.sys.stderr, "isatty", lambda: not is_quiet, raising=False
    )
    with ProgressLines(told, lambda: "pairs", every_s=0.005):
        time.sleep(0.05)
    assert told.lines == []


@pytest.mark.thorough
def test_a_stage_that_takes_long_says_so_in_its_log(hwid, monkeypatch):
    # A moment is long here, and nothing is held back.
    monkeypatch.setattr(ProgressLines.__init__, "__kwdefaults__", {"every_s": 0.02})
    monkeypatch.setattr(session, "_HELD_S", 0.0)
    one_s = 0.3

    def slow(name):
        # Looking at recordings before the work itself may compile loops.
        def choose(context):
            time.sleep(one_s * (name == "calibrate"))
            return stage_named(name).choose(context)

        return replace(stage_named(name), choose=choose)

    monkeypatch.setattr(driver, "stage_named", slow)
    said = hwid("calibrate").stderr.splitlines()
    first = said.index("stage 2 of 2 calibrate, 0 s passed")
    (end,) = [number for number, one in enumerate(said) if "calibrate: 3" in one]
    assert first < end
    # All of it counts, so that stages add up to the whole.
    (seconds,) = re.findall(r", ([0-9.]+) s [(]stage 2 of 2", said[end])
    assert float(seconds) >= one_s
