"""Memory of a process and all that it has started, while it runs."""

import subprocess
import threading
from pathlib import Path

INTERVAL_S = 0.25
KIB_IN_MIB = 1024


def proportional_kib(pid: int) -> int:
    """Memory of one process; what it shares with others counts in shares. 0 if gone."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return 0
    lines = [line for line in text.splitlines() if line.startswith("Pss:")]
    return int(lines[0].split()[1]) if lines else 0


def family(pid: int) -> list[int]:
    """A process and its descendants."""
    found = [pid]
    for one in found:
        for task in Path(f"/proc/{one}/task").glob("*/children"):
            try:
                found += [int(child) for child in task.read_text().split()]
            except OSError:
                continue
    return found


def peak_mib(process: subprocess.Popen) -> float:
    """Largest sum over the process and its descendants until it ends."""
    peak, ended = 0, threading.Event()

    def watch() -> None:
        nonlocal peak
        while not ended.wait(INTERVAL_S):
            peak = max(peak, sum(proportional_kib(one) for one in family(process.pid)))

    watcher = threading.Thread(target=watch)
    watcher.start()
    process.wait()
    ended.set()
    watcher.join()
    return peak / KIB_IN_MIB
