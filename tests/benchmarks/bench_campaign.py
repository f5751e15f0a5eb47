"""A whole campaign from an empty cache: 15 steps, 10 x 10 orders, every model on each.

``make bench-campaign`` runs this file at full size, which takes minutes. The
configuration is ``configs/thesis_steps.yaml``, the recordings are simulated first,
outside the clock; ``hwid identify`` and ``hwid crossval`` then run as a user runs them.
Memory is the largest sum over all processes, shared pages counted once (Linux only). The
hand-written baseline is fitted for some pairs of orders, the median is scaled up to all.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

from hwid_cli.records.model import Orders
from tests.benchmarks.by_hand import MOST_IN_GRID, fit_by_hand
from tests.benchmarks.process_memory import peak_mib

PROJECT = Path(__file__).resolve().parents[2]
CONFIG = PROJECT / "configs" / "thesis_steps.yaml"
BY_HAND = tuple(Orders(n, n, 1) for n in (1, 3, 5, 8, 10))


def options() -> argparse.Namespace:
    """Size of the campaign."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=int, default=15)
    parser.add_argument("--orders", type=int, default=10, help="1 ... N of each kind")
    parser.add_argument("--samples", type=int, default=7500)
    parser.add_argument("--jobs", type=int, default=2)
    return parser.parse_args()


def write_config(chosen: argparse.Namespace, where: Path) -> Path:
    """The configuration of the thesis in the size that is asked for."""
    config = yaml.safe_load(CONFIG.read_text())
    plan = config["simulate"]["plan"]
    plan["only"] = plan["only"][: chosen.recordings]
    plan["samples"] = config["calibrate"]["samples"] = chosen.samples
    config["orders"]["nb"] = config["orders"]["nk"] = [1, chosen.orders]
    path = where / CONFIG.name
    path.write_text(yaml.safe_dump(config))
    return path


def stage(name: str, path: Path, jobs: int) -> tuple[float, float]:
    """Wall seconds and peak memory of one command."""
    command = [sys.executable, "-m", "hwid_cli", name, str(path), "--quiet"]
    command += ["--out", str(path.parent / "results"), "--jobs", str(jobs)]
    begun = time.perf_counter()
    process = subprocess.Popen(command, cwd=PROJECT, stdout=subprocess.DEVNULL)
    peak = peak_mib(process)
    seconds = time.perf_counter() - begun
    if process.returncode:
        raise SystemExit(f"hwid {name} ended with {process.returncode}")
    return seconds, peak


def by_hand_s(chosen: argparse.Namespace, where: Path) -> float:
    """Median seconds of a fit by hand on the first recording."""
    raw = next(iter(sorted((where / "results" / "raw").glob("step_*.csv"))))
    table = np.genfromtxt(raw, delimiter=",", skip_header=1)
    rows = table[np.isfinite(table).all(axis=1)][: chosen.samples, 1:3]
    u, y = np.ascontiguousarray(rows.T)
    seconds = []
    for orders in BY_HAND:
        begun = time.perf_counter()
        fit_by_hand(orders, u, y, free=False, most_evaluations=MOST_IN_GRID)
        seconds.append(time.perf_counter() - begun)
    return float(np.median(seconds))


def compile_loops(jobs: int) -> None:
    """Run a campaign of nearly nothing, so that the clock sees no compilation."""
    tiny = argparse.Namespace(recordings=2, orders=2, samples=2000)
    with tempfile.TemporaryDirectory() as folder:
        path = write_config(tiny, Path(folder))
        stage("crossval", path, jobs)


def main() -> None:
    """Time the stages one after the other."""
    chosen = options()
    compile_loops(chosen.jobs)
    fits = chosen.recordings * chosen.orders**2
    print(
        f"\n{chosen.recordings} recordings of {chosen.samples} samples, "
        f"{chosen.orders} x {chosen.orders} orders, {chosen.jobs} processes"
    )
    print(f"{'stage':14}{'wall s':>9}{'peak MiB':>10}{'results':>9}{'s each':>10}")
    with tempfile.TemporaryDirectory() as folder:
        path = write_config(chosen, Path(folder))
        for name in ("simulate", "calibrate"):
            stage(name, path, chosen.jobs)
        found = {}
        for name, count in (("identify", fits), ("crossval", fits * chosen.recordings)):
            found[name] = seconds, peak = stage(name, path, chosen.jobs)
            print(
                f"{name:14}{seconds:9.1f}{peak:10.0f}{count:9d}{seconds / count:10.4f}"
            )
        total = sum(seconds for seconds, _ in found.values())
        print(
            f"{'together':14}{total:9.1f}{max(peak for _, peak in found.values()):10.0f}"
        )
        hand = by_hand_s(chosen, Path(folder)) * fits / chosen.jobs
        print(
            f"by hand, fixed break-points, scaled up from {len(BY_HAND)} fits: "
            f"{hand:.0f} s; by hand / identify: {hand / found['identify'][0]:.1f}"
        )


if __name__ == "__main__":
    main()
