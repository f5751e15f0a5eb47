"""``hwid`` in processes that have their imports behind them: a fork of one that waits.

A start of Python with everything that a campaign imports takes longer than a tiny
campaign. The one that waits runs that campaign once, so that forks have the compiled
loops too; they draw blank figures. ``python -m tests.reliability.warm_process FOLDER`` is
that process; it is asked by lines of JSON.
"""

import json
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import leave_figures_blank
from tests.reliability import harness, system_faults

_HERTZ = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def cpu_seconds(pid: int) -> float:
    """Processor time that a process and its children have used; inf where it is gone."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except (FileNotFoundError, ProcessLookupError):
        return float("inf")
    own = (int(words[11]) + int(words[12])) / _HERTZ
    of_children = [cpu_seconds(int(child)) for child in children]
    return own + sum(one for one in of_children if one != float("inf"))


def draw_nothing(patch: pytest.MonkeyPatch) -> None:
    """Write blank figures: drawing takes most of the time of a tiny campaign."""
    from matplotlib.figure import Figure

    from hwid_cli.report import page, plots

    leave_figures_blank(patch)
    blank = plots.as_png(Figure((1, 1)))
    patch.setattr(page.Drawing, "png", property(lambda _: blank))


class WarmProcess:
    """A run of ``hwid`` that has begun, used as ``subprocess.Popen`` is."""

    def __init__(self, answers, pid: int, errors: Path) -> None:
        self.pid, self.returncode = pid, None
        self._answers, self._errors = answers, errors

    def poll(self) -> int | None:
        """Its exit code where it has ended; nothing is read that blocks."""
        state = Path(f"/proc/{self.pid}/stat")
        try:
            ended = state.read_text().rpartition(")")[2].split()[0] == "Z"
        except FileNotFoundError:
            ended = True
        if ended and self.returncode is None:
            self.returncode = int(self._answers.readline())
        return self.returncode

    def communicate(self, timeout: float = 0) -> tuple[str, str]:  # noqa: ARG002
        """Wait for the end; what it said on stderr."""
        if self.returncode is None:
            self.returncode = int(self._answers.readline())
        return "", self._errors.read_text(errors="replace")


class WarmStarter:
    """Starts runs of ``hwid``, one after the other; a context manager."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __enter__(self) -> "WarmStarter":
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.reliability.warm_process", self._folder],
            env=system_faults.environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._server.stdout.readline() == "ready\n"
        return self

    def __exit__(self, *_: object) -> None:
        self._server.stdin.close()
        # It may still wait for a run that nobody asks for any more.
        self._server.kill()
        self._server.wait()
        self._server.stdout.close()

    def start(self, words: list[str], faults: dict[str, str]) -> WarmProcess:
        """Begin ``hwid`` with arguments, in a session of its own."""
        errors = self._folder / "errors.txt"
        asked = {"words": words, "faults": faults, "errors": str(errors)}
        self._server.stdin.write(json.dumps(asked) + "\n")
        self._server.stdin.flush()
        pid = int(self._server.stdout.readline())
        return WarmProcess(self._server.stdout, pid, errors)


def _wait_to_be_asked(folder: Path) -> None:
    """Warm up; then fork for every line, and answer with pid and exit code."""
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        folder.mkdir(exist_ok=True)
        config = harness.write_config(folder)
        harness.run_here(config, folder / "out", command="run")
        print("ready", flush=True)
        for line in sys.stdin:
            pid = os.fork()
            if pid == 0:
                return _be(**json.loads(line))
            code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
            print(code, flush=True)
    return None


def _be(words: list[str], faults: dict[str, str], errors: str) -> None:
    """Become the run that was asked for."""
    os.setsid()
    print(os.getpid(), flush=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.update(faults)
    nowhere = os.open(os.devnull, os.O_RDWR)
    said = os.open(errors, os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
    for file, place in ((nowhere, 0), (nowhere, 1), (said, 2)):
        os.dup2(file, place)
    sys.argv = ["hwid", *words]
    runpy.run_module("hwid_cli", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _wait_to_be_asked(Path(sys.argv[1]))
