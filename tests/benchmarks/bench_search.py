"""The whole search for groups of the thesis (section 3.3) from an empty cache.

``make bench-search`` runs this file at full size, which takes half an hour. Twelve
steps may join and judge, seven begin, records are put one after the other and every order
of a group is a group of its own; as many groups go on at each level as went on in the
thesis: 77 pairs, 340 groups of three and 279 of four, 100 orders each, 69 600 fits. The
recordings are those of ``configs/model1.yaml``, simulated outside the clock;
``hwid identify`` and ``hwid group`` then run as a user runs them, groups beginning with the
models of their members unless told otherwise.
"""

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

PROJECT = Path(__file__).resolve().parents[2]
CONFIG = PROJECT / "configs" / "model1.yaml"
START = ("06", "07", "08", "09", "12", "13", "14")
# Groups that go on after the second and the third level in the thesis.
GOING_ON = [34, 31]


def options() -> argparse.Namespace:
    """Size of the search."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--orders", type=int, default=10, help="1 ... N of each kind")
    parser.add_argument("--threshold", type=float, default=0.01)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--top", type=int, nargs=2, default=GOING_ON)
    parser.add_argument("--start", nargs="+", default=START)
    parser.add_argument("--from-nothing", action="store_true", help="no warm starts")
    return parser.parse_args()


def write_config(chosen: argparse.Namespace, where: Path) -> Path:
    """The configuration of Combination Model 1 with the thesis's rules for groups."""
    config = yaml.safe_load(CONFIG.read_text())
    twelve = config["group"]["candidates"]
    config["simulate"]["plan"]["only"] = twelve
    config["orders"]["nb"] = config["orders"]["nk"] = [1, chosen.orders]
    config["fit"]["join"] = "concatenate"
    config["crossval"]["threshold"] = chosen.threshold
    config["group"]["start"] = [f"step_{one}" for one in chosen.start]
    config["group"]["keep"] = {"top": list(chosen.top)}
    config["group"]["warm_start"] = not chosen.from_nothing
    del config["test"]
    path = where / "search.yaml"
    path.write_text(yaml.safe_dump(config))
    return path


def stage(name: str, path: Path, jobs: int) -> float:
    """Wall seconds of one command."""
    command = [sys.executable, "-m", "hwid_cli", name, str(path), "--quiet"]
    command += ["--out", str(path.parent / "results"), "--jobs", str(jobs)]
    begun = time.perf_counter()
    done = subprocess.run(command, cwd=PROJECT, stdout=subprocess.DEVNULL, check=False)
    if done.returncode:
        raise SystemExit(f"hwid {name} ended with {done.returncode}")
    return time.perf_counter() - begun


def levels(table: Path) -> dict[int, list[int]]:
    """Coverage of every group that was tried, by the number of its recordings."""
    found: dict[int, list[int]] = {}
    with table.open(newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault(int(row["level"]), []).append(int(row["coverage"]))
    return found


def main() -> None:
    """Time the two commands."""
    chosen = options()
    with tempfile.TemporaryDirectory() as folder:
        path = write_config(chosen, Path(folder))
        for name in ("simulate", "calibrate"):
            stage(name, path, chosen.jobs)
        single = stage("identify", path, chosen.jobs)
        joined = stage("group", path, chosen.jobs)
        found = levels(path.parent / "results" / "groups.csv")
    grid = chosen.orders**2
    fits = grid * sum(len(one) for level, one in found.items() if level > 1)
    print(f"{'recordings in a group':>22}{'groups':>8}{'widest coverage':>17}")
    for level, coverage in sorted(found.items()):
        print(f"{level:22d}{len(coverage):8d}{max(coverage):17d}")
    print(f"identify, {12 * grid} fits: {single:.0f} s")
    print(
        f"group, {fits} fits, each judged on 12 recordings: {joined / 60:.1f} min with "
        f"{chosen.jobs} processes, {1e3 * joined / max(fits, 1):.1f} ms a fit"
    )


if __name__ == "__main__":
    main()
