"""One bad input tried: a folder with a good experiment, one thing made bad, one run.

Every trial checks the same promises: exit code, one line on stderr without a
traceback, seconds, nothing written outside ``--out``, earlier results unharmed.
"""

import hashlib
import shutil
import stat
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.files.locks import RUN_LOCK, USERS_LOCK

CONFIG = """\
name: tiny
recordings:
  files: run.csv
  columns: {time: t, input: u, output: y}
orders: {nb: [1, 2], nk: [1, 2]}
"""
SAMPLES = 80
# The slowest trials took 0.6 s alone on a machine; the rest is for a busy one.
MOST_SECONDS = 10.0


@dataclass(frozen=True)
class Case:
    """A kind of bad input.

    Parameters
    ----------
    name : str
    make : callable
        Takes the folder of the experiment and spoils something in it.
    says : tuple of str
        What the message must hold: place, value, expectation, next step.
    command : str
    code : int
    """

    name: str
    make: Callable[[Path], None]
    says: tuple[str, ...]
    command: str = "calibrate"
    code: int = 1


def signals(samples=SAMPLES):
    """Time, input and output of a small measurement."""
    time_s = np.round(0.01 * np.arange(samples), 6)
    return time_s, np.sin(7 * time_s), np.cos(5 * time_s)


def csv_text(columns=None, header="t,u,y"):
    rows = zip(*(columns or signals()), strict=True)
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    return "\n".join([header, *lines]) + "\n"


def make_good(folder: Path) -> None:
    """Write the experiment that every case starts from."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "config.yaml").write_text(CONFIG)
    (folder / "run.csv").write_text(csv_text())


def run(folder: Path, command="calibrate", out="out", options=()):
    """Run a command on the folder's experiment, in this process."""
    arguments = [command, str(folder / "config.yaml"), "--out", str(folder / out)]
    return CliRunner().invoke(main, [*arguments, "--jobs", "1", *options])


def contents(folder: Path) -> dict[str, str]:
    """What lies in a folder: names, kinds and checksums; opens plain files only.

    The locks of a folder of results say who holds them, and are left out.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.name in (RUN_LOCK, USERS_LOCK):
            continue
        mode = path.lstat().st_mode
        digest = ""
        if stat.S_ISREG(mode):
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
        found[str(path.relative_to(folder))] = f"{stat.S_IFMT(mode):o} {digest}"
    return found


def without(found: dict[str, str], out: str) -> dict[str, str]:
    """The same without what lies in the folder of the results."""
    return {
        name: what
        for name, what in found.items()
        if name != out and not name.startswith(f"{out}/")
    }


def copy_tree(source: Path, target: Path) -> None:
    shutil.copytree(source, target, symlinks=True)


def check(case: Case, folder: Path) -> str:
    """Try a case in a folder that holds a good experiment with results."""
    case.make(folder)
    before = contents(folder)
    start = time.perf_counter()
    result = run(folder, case.command)
    seconds = time.perf_counter() - start
    after = contents(folder)
    said = result.stderr

    assert isinstance(result.exception, SystemExit), (result.exception, said)
    assert result.exit_code == case.code, (result.exit_code, said)
    assert seconds < MOST_SECONDS
    errors = [line for line in said.splitlines() if line.startswith("hwid: ")]
    assert len(errors) == 1, said
    assert said == f"{errors[0]}\n"
    assert errors[0].isprintable(), said
    assert len(said) < 1000, said
    for words in case.says:
        assert words in said, f"{words!r} not in {said!r}"
    assert without(after, "out") == without(before, "out")
    # What was there stays as it was; a stage may add to its folder.
    assert {name: after.get(name) for name in before} == before
    return said
