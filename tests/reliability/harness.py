"""A tiny campaign that is started, killed, damaged and started again."""

import hashlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.files.checksums import without_checksum
from hwid_cli.files.locks import RUN_LOCK, USERS_LOCK

CONFIG = """
name: tiny
simulate:
  kind: gun
  plan: {samples: 400, only: [step_02, step_12, sine_12, random_02]}
recordings:
  files: raw/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
calibrate:
  step: [cut, output_offset]
  sine: [cut, input_offset, output_offset, recut]
  random: [cut]
  samples: 400
orders: {nb: [1, 2], nk: [1, 3]}
fit: {units: 3, starts: 1, max_iterations: 4}
identify: {}
crossval: {threshold: 0.001}
group: {keep: {best: true}, max_level: 2}
test: {recordings: [random_02]}
"""
# Arrays that say what a campaign found; they must be the same bit by bit.
ARRAYS = ("crossval/rmsd", "group/rmsd", "group/groups/coverage", "test/rmsd")
# Records that are kept for tables and sentences, which no task counts.
BESIDE_TASKS = (b"_Examined",)
TABLES = ("crossval", "coverage", "groups", "test", "assignment", "coverage_matrix")


def write_config(folder: Path, text: str = CONFIG) -> Path:
    path = folder / "tiny.yaml"
    path.write_text(text)
    return path


def start(config: Path, out: Path, *options: str, command="run", hear=None):
    """Start ``hwid`` as a process group of its own."""

    def listen():
        # A shell that starts the tests in the background has them ignore Ctrl-C.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if hear is not None:
            hear()

    return subprocess.Popen(
        [sys.executable, "-m", "hwid_cli", command, config, "--out", out, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=listen,
    )


def finish(config: Path, out: Path, *options: str, **settings) -> str:
    """Run to the end, which must be a good one, and give what was said."""
    process = start(config, out, *options, **settings)
    said, complaint = process.communicate(timeout=120)
    assert process.returncode == 0, complaint
    return said + complaint


def kill(process: subprocess.Popen, number: int = signal.SIGKILL) -> None:
    """Send a signal to a whole process group, unless it has ended."""
    if process.poll() is None:
        os.killpg(process.pid, number)


def wait_for_entries(process: subprocess.Popen, out: Path, count: int) -> None:
    """Wait until a cache has so many entries, or the process has ended."""
    limit = time.monotonic() + 60
    while process.poll() is None and len(entries(out)) < count:
        assert time.monotonic() < limit, "the campaign does not get on"
        time.sleep(0.01)


def entries(out: Path) -> dict[str, int]:
    """Entries of tasks in a cache with the number of the file that holds each."""
    found = {}
    for path in (out / "cache").glob("??/*.h5"):
        try:
            content = path.read_bytes()
            if not any(record in content for record in BESIDE_TASKS):
                found[path.name] = path.stat().st_ino
        except FileNotFoundError:
            # Set aside while we looked.
            continue
    return found


def count_computed(said: str) -> int:
    return sum(int(number) for number in re.findall(r"(\d+) computed", said))


def results(out: Path) -> dict[str, bytes]:
    """What a campaign found, as bytes that can be compared."""
    found = {}
    with h5py.File(out / "results.h5") as file:
        for name in ARRAYS:
            found[name] = np.ascontiguousarray(file[name][()]).tobytes()
    for name in TABLES:
        found[name] = (out / f"{name}.csv").read_bytes()
    return found


def assert_readable(out: Path) -> None:
    """Every file that a killed run has left is whole."""
    for name in ("calibrated.h5", "results.h5"):
        if (out / name).exists():
            content = (out / name).read_bytes()
            assert without_checksum(content) != content, f"{name} has no checksum"
    for path in (out / "cache").glob("??/*.h5"):
        content = path.read_bytes()
        assert hashlib.sha256(content[:-32]).digest() == content[-32:], path


def temporary_files(out: Path) -> list[Path]:
    return [
        path
        for path in out.rglob(".*")
        if path.is_file() and path.name not in (RUN_LOCK, USERS_LOCK)
    ]


def alive(session: int) -> list[str]:
    """Processes of a session that still run."""
    listed = subprocess.run(
        ["ps", "-eo", "sid=,stat=,pid=,args="],
        capture_output=True,
        text=True,
        check=True,
    )
    rows = [line.split(None, 3) for line in listed.stdout.splitlines()]
    # Z: has ended, and waits for somebody to ask how.
    return [
        " ".join(row) for row in rows if row[0] == str(session) and row[1][0] != "Z"
    ]


def wait_until_gone(session: int, seconds: float) -> list[str]:
    """Processes of a session that are still there after some time."""
    limit = time.monotonic() + seconds
    while (left := alive(session)) and time.monotonic() < limit:
        time.sleep(0.05)
    return left


def run_here(config: Path, out: Path, *options, command="test", code: int | None = 0):
    """Run a command in this process, without workers."""
    arguments = [command, str(config), "--out", str(out), "--jobs", "1", *options]
    done = CliRunner().invoke(main, arguments)
    if code is not None:
        assert done.exit_code == code, done.output
    return done
