"""What ``hwid check`` forecasts for each stage beside what ``hwid run`` then takes.

``python -m tests.benchmarks.bench_forecast CONFIG...``; both are called as a user does,
from an empty cache, with as many processes as there are cores. Wall time: the machine has
to be quiet. Where a configuration simulates its measurements, these are there before.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

_DONE = re.compile(r"^(\w+): .*, ([\d.]+) s \(stage", re.MULTILINE)


def compare(config: str, out: Path) -> None:
    _hwid("simulate", config, out)
    start = time.perf_counter()
    said = json.loads(_hwid("check", config, out, "--json").stdout)
    check = time.perf_counter() - start
    start = time.perf_counter()
    run = _hwid("run", config, out)
    wall = time.perf_counter() - start
    print(f"{config}: forecast made in {check:.1f} s, run done in {wall:.1f} s")
    taken = {name: float(seconds) for name, seconds in _DONE.findall(run.stderr)}
    for plan in said["stages"]:
        name, least, most = plan["stage"], plan["seconds"], plan["most_seconds"]
        # The figures beside the page are drawn after its line: what no stage has taken.
        seconds = wall - sum(taken.values()) + taken.get(name, 0.0)
        if least is not None and name in taken:
            _show(name, least, most, seconds if name == "report" else taken[name])
    _show("all", said["seconds"], said["most_seconds"], wall)


def _hwid(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command, config, out, *more = arguments
    return subprocess.run(
        [sys.executable, "-m", "hwid_cli", command, config, "--out", out, *more],
        capture_output=True,
        text=True,
        check=False,
    )


def _show(name: str, least: float, most: float, taken: float) -> None:
    missed = _missed(least, most, taken)
    print(f"  {name:9s} {least:8.1f} {most:8.1f} {taken:8.1f} {missed:6.2f}")


def _missed(least: float, most: float, taken: float) -> float:
    """How many times the time lies outside of the range; 1 within it, or below a second."""
    least, most, taken = (max(one, 1.0) for one in (least, most, taken))
    return max(least / taken, taken / most, 1.0)


def main() -> None:
    print("stage         least     most    taken missed")
    for config in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as folder:
            compare(config, Path(folder) / "out")


if __name__ == "__main__":
    main()
