"""Diagnoses every machine and scores the verdicts.

``python -m tests.machines.run_machines --seeds development --work DIR [--only NAME ...]
[--jobs N] [--write FILE.md]``. Folders stay in DIR: recordings, experiment.yaml, truth.json,
and in ``result/`` what ``hwid diagnose`` wrote. The seeds `reporting` are for reports only:
whoever looks at them in detail must draw new ones.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

# Machines run side by side: threads of the linear algebra would fight over the cores. It is
# read when numpy is first imported, so not before this line.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import click

from tests.machines.bench import SEEDS
from tests.machines.score import score
from tests.machines.suite import SUITE, built
from tests.machines.tables import document
from tests.machines.write_machine import accepted, write

# A diagnosis that takes longer has failed, in processor seconds: they do not depend on what
# else the machine does. It waits no longer than so many times that.
TIME_LIMIT = 300.0
PATIENCE = 10.0
PROJECT = Path(__file__).resolve().parents[2]


def options() -> argparse.Namespace:
    """What to run, and where."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", choices=list(SEEDS), required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument(
        "--only", nargs="+", default=list(SUITE), choices=list(SUITE), metavar="NAME"
    )
    parser.add_argument("--jobs", type=int, default=1, help="machines at the same time")
    parser.add_argument("--write", type=Path, help="markdown file of the table")
    parser.add_argument(
        "--limit", type=float, default=TIME_LIMIT, help="processor seconds"
    )
    parser.add_argument(
        "--keep", action="store_true", help="diagnose folders that are there"
    )
    parser.add_argument(
        "--write-only", action="store_true", help="write folders, diagnose nothing"
    )
    parser.add_argument(
        "--score-only", action="store_true", help="score results that are there"
    )
    return parser.parse_args()


def diagnose(folder: Path, limit: float) -> tuple[dict | None, float]:
    """The diagnosis of a folder, and its processor seconds; None where there is none."""
    shutil.rmtree(folder / "result", ignore_errors=True)
    command = [sys.executable, "-m", "hwid_cli", "diagnose", "experiment.yaml"]
    command += ["--out", "result", "--jobs", "1"]
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    start = _used()
    with (folder / "log.txt").open("w") as log:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdout=log,
            stderr=log,
            env=environment,
            start_new_session=True,
            preexec_fn=lambda: resource.setrlimit(
                resource.RLIMIT_CPU, (int(limit), int(limit) + 5)
            ),
        )
        try:
            process.wait(timeout=PATIENCE * limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            log.write("\nstopped\n")
    seconds = _used() - start
    (folder / "seconds.txt").write_text(f"{seconds:.1f}\n")
    path = folder / "result" / "diagnosis.json"
    if process.returncode != 0 or not path.exists():
        return None, seconds
    return json.loads(path.read_text()), seconds


def _used() -> float:
    """Processor seconds of all children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def found(folder: Path) -> tuple[dict | None, float | None]:
    """The diagnosis that a folder holds already."""
    path, clock = folder / "result" / "diagnosis.json", folder / "seconds.txt"
    seconds = float(clock.read_text()) if clock.exists() else None
    return json.loads(path.read_text()) if path.exists() else None, seconds


def row(truth: dict, diagnosis: dict | None, seconds: float | None) -> dict:
    """What the tables show of one machine."""
    result = score(truth, diagnosis)
    gap = (diagnosis or {}).get("gap", {})
    return {
        **{
            name: truth[name] for name in ("name", "family", "hidden", "gap_over_noise")
        },
        "verdict": (diagnosis or {}).get("verdict"),
        "complete": (diagnosis or {}).get("complete")
        if (diagnosis or {}).get("effects")
        else None,
        "before": gap.get("before", {}).get("ratio_to_noise"),
        "after": gap.get("after", {}).get("ratio_to_noise"),
        "explained": gap.get("explained_share"),
        "seconds": seconds,
        **vars(result),
    }


def one_machine(chosen: argparse.Namespace, name: str) -> dict | None:
    """Write, diagnose and score one machine."""
    folder = chosen.work / name
    if chosen.keep or chosen.score_only:
        truth = json.loads((folder / "truth.json").read_text())
        truth |= accepted(built(name, chosen.seeds))
    else:
        truth = write(built(name, chosen.seeds), folder)
    if chosen.write_only:
        click.echo(f"{name}: gap {truth['gap_over_noise']:.3g} of the noise")
        return None
    diagnosis, seconds = (
        found(folder) if chosen.score_only else diagnose(folder, chosen.limit)
    )
    result = row(truth, diagnosis, seconds)
    click.echo(f"{name}: {result['outcome']} ({result['said']})")
    return result


def main() -> None:
    """Run what the command line asks for."""
    chosen = options()
    chosen.work.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(chosen.jobs) as pool:
        rows = list(pool.map(partial(one_machine, chosen), chosen.only))
    rows = [one for one in rows if one is not None]
    if not rows:
        return
    (chosen.work / "scores.json").write_text(json.dumps(rows, indent=1))
    text = document(rows, chosen.seeds)
    if chosen.write:
        chosen.write.write_text(text)
    click.echo(text)


if __name__ == "__main__":
    main()
