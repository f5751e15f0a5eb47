"""What a dask cluster costs: each task's way, and a campaign beside the local workers.

Scheduler and two workers run on this machine and talk over loopback. Results are those
of a fit, in size and in form, and the parent keeps each in a cache on disk as in a run.
``--json`` writes what ``tools/scale.py`` needs.
"""

import argparse
import json
import pickle
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.identify import identify_all
from hwid_cli.store.cache import Hdf5Store, pack_entry
from hwid_cli.tasks import cluster
from hwid_cli.tasks.runner import RunSettings, run_tasks
from hwid_cli.tasks.task import Task
from hwid_cli.tasks.workers import Workers
from tests import dask_processes
from tests.benchmarks.plants import random_plant

TASKS, REPEATS = 600, 3
SIZES = (1, 4, 16)
RECORDINGS, GRID, SAMPLES = 4, 6, 4000


def cpu_seconds(process: int) -> float:
    """Processor time of a process so far (Linux)."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / 100.0


def recording(seed: int) -> Recording:
    """A plant's response to levels."""
    _, u, y, *_ = random_plant(seed, SAMPLES)
    return Recording(f"plant {seed}", u, y, 1e-3)


def echoed(model: Fit, number: int) -> Fit:
    """A task that takes no time and gives a result of the usual size."""
    return model


def way(address: str, process: int, model: Fit) -> dict[str, float]:
    """Seconds per chunk and per result: of the wall, the parent, the scheduler."""
    rows = []
    for size in SIZES:
        cluster.MOST_IN_CHUNK = size
        for repeat in range(REPEATS):
            tasks = [
                Task(f"{size} {repeat} {n}", str(n), echoed, (model, n), Fit)
                for n in range(TASKS)
            ]
            with tempfile.TemporaryDirectory() as folder:
                settings = RunSettings(
                    Hdf5Store(Path(folder)), Workers(2, "dask", address)
                )
                wall, parent = time.perf_counter(), time.process_time()
                there = cpu_seconds(process)
                run_tasks(tasks, settings)
                rows.append(
                    (
                        TASKS / size,
                        TASKS,
                        time.perf_counter() - wall,
                        time.process_time() - parent,
                        cpu_seconds(process) - there,
                    )
                )
    counts, times = np.array(rows)[:, :2], np.array(rows)[:, 2:]
    found = np.linalg.lstsq(counts, times, rcond=None)[0]
    names = ("wall", "parent", "scheduler")
    return {
        f"{name}_{what}_s": float(max(0.0, found[row, column]))
        for column, name in enumerate(names)
        for row, what in enumerate(("chunk", "result"))
    }


def seconds_of(run: Callable[[], object]) -> float:
    """Median of a few runs."""
    found = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        run()
        found.append(time.perf_counter() - begun)
    return float(np.median(found))


def campaign(workers: Workers) -> float:
    """Seconds of a small campaign from an empty cache."""
    recordings = [recording(seed) for seed in range(RECORDINGS)]
    orders = tuple(range(1, GRID + 1))
    grid = OrdersOptions(nb=orders, nk=orders)

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            settings = RunSettings(Hdf5Store(Path(folder)), workers)
            identify_all(recordings, grid, FitOptions(), settings)

    run()  # compiles and connects
    return seconds_of(run)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args()
    model = fit([recording(0)], Orders(5, 5, 1))
    with (
        tempfile.TemporaryDirectory() as name,
        dask_processes.scheduler(Path(name)) as (address, process),
        dask_processes.workers(address, Path(name)),
    ):
        found = way(address, process, model)
        cluster.MOST_IN_CHUNK = 64
        found["dask_s"] = campaign(Workers(2, "dask", address))
    found["local_s"] = campaign(Workers(2))
    found["fits"] = RECORDINGS * GRID**2
    found["fit_bytes"] = len(pickle.dumps(model))
    found["entry_bytes"] = len(pack_entry("key", model))
    print(f"{TASKS} tasks in chunks of {', '.join(map(str, SIZES))}, over loopback")
    for who in ("wall", "parent", "scheduler"):
        chunk, result = found[f"{who}_chunk_s"], found[f"{who}_result_s"]
        print(
            f"  {who:9} {chunk * 1e3:6.2f} ms a chunk, {result * 1e3:6.2f} ms a result"
        )
    ratio = found["dask_s"] / found["local_s"]
    print(
        f"{found['fits']} fits: dask {found['dask_s']:.2f} s, local workers "
        f"{found['local_s']:.2f} s, ratio {ratio:.3f}"
    )
    if chosen.json is not None:
        chosen.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
