"""Bad days drawn by chance: a stage, a fault and a moment; nothing may be lost or wrong.

``python -m tests.reliability.bad_days --count 500 --seed 1`` draws them, shows what came
of each kind of fault, and ends with 1 where a day broke a promise. A day is a first run
that meets the fault and a second one that meets none: the first ends well, or with one
line and a known exit code; the second finds what an undisturbed run finds, byte by byte.
"""

import argparse
import errno
import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml

from hwid_cli.stages.table import STAGES as STAGES_IN_ORDER
from tests.reliability import harness, system_faults
from tests.reliability.warm_process import (
    WarmProcess,
    WarmStarter,
    cpu_seconds,
    draw_nothing,
)

# Stages that the configuration of a day has a section for, and what is no stage.
STAGES = (
    *(name for name in STAGES_IN_ORDER if name in yaml.safe_load(harness.CONFIG)),
    "report",
    "run",
)
# Done, refused, and ended by the signals that are sent.
CODES = (0, 1, 129, 130, 143, -signal.SIGKILL)
# Processor time of the first run where nothing stops it, by what its folder holds at the
# start, and of a start of Python; faults come within it, [s].
WORK_S = {"results": 0.3, "cache": 0.5, "nothing": 1.0}
START_S, PATIENCE_S = 3.0, 1800
# What is started may still run so long after its end; how often we look, [s].
LINGER_S, _LOOK_S = 5.0, 0.01
TOLD_EVERY, RUNS_ON = 25, "something runs on"
# A file outside of the folder that no day may change.
VICTIM, PRECIOUS = "victim", "precious"
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "bit": lambda content: (
        content[: len(content) // 2]
        + bytes([content[len(content) // 2] ^ 16])
        + content[len(content) // 2 + 1 :]
    ),
}


@dataclass(frozen=True)
class Day:
    """What was drawn.

    Parameters
    ----------
    holds : str
        What the folder holds of an undisturbed run: one of ``WORK_S``.
    is_fresh : bool
        Whether Python starts anew: faults meet its imports too.
    share : float, [-]
        The moment: of the time, or of the calls, that a run takes.
    """

    number: int
    stage: str
    fault: str
    share: float
    jobs: int
    holds: str
    is_fresh: bool

    @property
    def moment_s(self) -> float:
        """Processor time after which something happens, [s]."""
        return self.share * (WORK_S[self.holds] + START_S * self.is_fresh)


def draw(number: int, seed: int) -> Day:
    """The day of a number; the same for the same seed."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    return Day(
        number,
        stage=str(rng.choice(STAGES)),
        # In turn, so that each has its share of the days.
        fault=list(FAULTS)[number % len(FAULTS)],
        share=float(rng.uniform()),
        jobs=int(rng.integers(1, 3)),
        holds=str(rng.choice(list(WORK_S), p=[0.5, 0.35, 0.15])),
        is_fresh=bool(rng.uniform() < 0.05),
    )


@dataclass(frozen=True)
class Folder:
    """Where a day is lived through, and what starts its run."""

    config: Path
    out: Path
    starter: WarmStarter


Meeting = Callable[[Day, Folder], tuple[int, str]]


def live(day: Day, undisturbed: Path, work: Path, starter: WarmStarter) -> str:
    """Live through a day; gives what it broke, nothing where all was kept."""
    folder = _begin(day, undisturbed, work, starter)
    out = folder.out
    # Measurements that a fault changes are put back by their owner.
    raw = {path.name: path.read_bytes() for path in (undisturbed / "raw").glob("*")}
    code, said = FAULTS[day.fault](day, folder)
    faults = []
    if code not in CODES:
        faults.append(f"exit code {code}")
    if "Traceback" in said or RUNS_ON in said or (code == 1 and "hwid: " not in said):
        faults.append(f"said {said[-400:]!r}")
    if (work / VICTIM).read_text() != PRECIOUS:
        faults.append("a file elsewhere changed")
    aside = [path.name for path in out.rglob("*.bad")]
    if aside and day.fault not in DAMAGING:
        faults.append(f"whole files were set aside: {aside}")
    for path in [*out.rglob("*"), *out.glob(".hwid*")]:
        if path.is_symlink():
            path.unlink()
    for name, content in raw.items():
        if (out / "raw" / name).exists():
            (out / "raw" / name).write_bytes(content)
    return "; ".join(faults) or _compared(folder, undisturbed)


def _begin(day: Day, undisturbed: Path, work: Path, starter: WarmStarter) -> Folder:
    """The folder as the day finds it."""
    folder = Folder(harness.write_config(work), work / "out", starter)
    folder.out.mkdir()
    if day.holds != "nothing":
        shutil.copytree(undisturbed, folder.out, dirs_exist_ok=True)
    if day.holds == "cache":
        for name in ("results.h5", "calibrated.h5", "report.html"):
            (folder.out / name).unlink(missing_ok=True)
    (work / VICTIM).write_text(PRECIOUS)
    return folder


def _compared(folder: Folder, undisturbed: Path) -> str:
    done = harness.run_here(folder.config, folder.out, command="run", code=None)
    if done.exit_code != 0:
        return f"the second run: {done.exit_code}, {done.output[-400:]!r}"
    if harness.results(folder.out) != harness.results(undisturbed):
        return "other results"
    left = harness.temporary_files(folder.out)
    return f"left behind: {left}" if left else ""


def _start(day: Day, place: Folder, **faults: object) -> subprocess.Popen | WarmProcess:
    words = [day.stage, str(place.config), "--out", str(place.out)]
    words += ["--jobs", str(day.jobs)]
    if not day.is_fresh:
        return place.starter.start(words, system_faults.settings(**faults))
    return subprocess.Popen(
        [sys.executable, "-m", "hwid_cli", *words],
        env=system_faults.environment(**faults) if faults else None,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def _end(process: subprocess.Popen | WarmProcess) -> tuple[int, str]:
    _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode is not None
    limit = time.monotonic() + LINGER_S
    while (runs_on := _has_members(process.pid)) and time.monotonic() < limit:
        time.sleep(_LOOK_S)
    return process.returncode, said + (RUNS_ON if runs_on else "")


def _has_members(group: int) -> bool:
    """Whether processes of a group are left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def _wait(day: Day, process: subprocess.Popen | WarmProcess) -> None:
    """Until the moment of a day; of processor time, so that other work changes nothing."""
    while process.poll() is None and cpu_seconds(process.pid) < day.moment_s:
        time.sleep(_LOOK_S)


def _by_signal(number: int) -> Meeting:
    def meet(day: Day, folder: Folder) -> tuple[int, str]:
        process = _start(day, folder)
        _wait(day, process)
        harness.kill(process, number)
        code, said = _end(process)
        # Before the program listens, the system ends it as it does any other.
        return (0 if code == -number else code), said if code != -number else ""

    return meet


def _by_system(**faults: object) -> Meeting:
    """Calls to the system fail from one moment on."""

    def meet(day: Day, folder: Folder) -> tuple[int, str]:
        settings = dict(faults)
        if "kind" in settings:
            at = 1 + int(day.share**2 * 300)
            settings |= {"folder": folder.out, "at": at}
        return _end(_start(day, folder, **settings))

    return meet


def _while_running(change: Callable[[Path], None]) -> Meeting:
    """Somebody else changes a measurement meanwhile."""

    def meet(day: Day, folder: Folder) -> tuple[int, str]:
        process = _start(day, folder)
        _wait(day, process)
        paths = sorted((folder.out / "raw").glob("s*.csv"))
        if paths:
            change(paths[day.number % len(paths)])
        return _end(process)

    return meet


def _before(change: Callable[[Day, Path], None]) -> Meeting:
    """Something in the folder is not as it was left."""

    def meet(day: Day, folder: Folder) -> tuple[int, str]:
        change(day, folder.out)
        return _end(_start(day, folder))

    return meet


def _damage(pattern: str) -> Callable[[Day, Path], None]:
    def change(day: Day, out: Path) -> None:
        paths = sorted(path for path in out.glob(pattern) if path.is_file())
        if paths:
            path = paths[int(day.share * len(paths))]
            damage = list(DAMAGES.values())[day.number % len(DAMAGES)]
            path.write_bytes(damage(path.read_bytes()) if path.stat().st_size else b"")

    return change


def _link(day: Day, out: Path) -> None:
    names = (".hwid-run.lock", ".hwid-users.lock", "results.h5", "calibrated.h5")
    place = out / (*names, "crossval.csv", "report.html")[int(day.share * 6)]
    place.unlink(missing_ok=True)
    place.symlink_to(out.parent / VICTIM)


def _other_version(_: Day, out: Path) -> None:
    for path in (out / "cache").glob("??/*.h5"):
        with h5py.File(h5py.h5f.open_file_image(path.read_bytes()[:-32], 1)) as file:
            file.attrs["schema_version"] = 99
            file.flush()
            image = file.id.get_file_image()
        path.write_bytes(image + hashlib.sha256(image).digest())
    (out / "results.h5").unlink(missing_ok=True)


def _changed(path: Path) -> None:
    path.write_bytes(re.sub(rb"1", b"2", path.read_bytes()))


FAULTS: dict[str, Meeting] = {
    "kill": _by_signal(signal.SIGKILL),
    "stop": _by_signal(signal.SIGTERM),
    "Ctrl-C": _by_signal(signal.SIGINT),
    "full disk": _by_system(kind="write", errno=errno.ENOSPC),
    "quota": _by_system(kind="write", errno=errno.EDQUOT),
    "EIO at a write": _by_system(kind="write", errno=errno.EIO, once=1),
    "EIO at a read": _by_system(kind="read", errno=errno.EIO, once=1),
    "ENOLCK": _by_system(locks=errno.ENOLCK),
    "clock jumps back": _by_system(clock=-400_000_000),
    "clock jumps ahead": _by_system(clock=400_000_000),
    "input changes": _while_running(_changed),
    "input vanishes": _while_running(lambda path: path.unlink(missing_ok=True)),
    "damaged figure or table": _before(_damage("**/*.[pc][ns][gv]")),
    "damaged page": _before(_damage("report.html")),
    "damaged results": _before(_damage("*.h5")),
    "damaged cache": _before(_damage("cache/??/*.h5")),
    "link": _before(_link),
    "cache of another version": _before(_other_version),
}


# After these files may be set aside.
DAMAGING = ("damaged results", "damaged cache", "cache of another version")


def run_days(
    numbers: range, seed: int, undisturbed: Path, tell: Callable[[str], None]
) -> tuple[Counter, list[str]]:
    """Live through days; gives how many of each fault there were, and what broke."""
    tries: Counter = Counter()
    broken = []
    with (
        tempfile.TemporaryDirectory(prefix="hwid_warm_") as warm,
        WarmStarter(Path(warm)) as starter,
    ):
        for number in numbers:
            day = draw(number, seed)
            with tempfile.TemporaryDirectory(prefix="hwid_day_") as work:
                fault = live(day, undisturbed, Path(work), starter)
            tries[day.fault] += 1
            if fault:
                broken.append(f"{day}: {fault}")
                tell(broken[-1])
            if (number + 1) % TOLD_EVERY == 0:
                tell(f"{number + 1} days, {len(broken)} broken")
    return tries, broken


def main() -> int:
    """Draw days and show what came of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="number of the first day")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        out = Path(folder) / "out"
        harness.run_here(harness.write_config(Path(folder)), out, command="run")
        numbers = range(asked.first, asked.first + asked.count)
        tries, broken = run_days(
            numbers, asked.seed, out, lambda line: print(line, flush=True)
        )
    for fault, number in tries.items():
        bad = sum(f"fault='{fault}'" in line for line in broken)
        print(f"{fault:26} {number:4} days, {bad} broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
