"""Schedulers and workers of dask as processes of this machine."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
PATIENCE_S = 60


@contextmanager
def started(*arguments: str, folder: Path) -> Iterator[subprocess.Popen]:
    """A process of dask's, its output in a file."""
    path = os.pathsep.join([str(PROJECT), os.environ.get("PYTHONPATH", "")])
    module = f"distributed.cli.dask_{arguments[0]}"
    with (folder / f"{arguments[0]}.log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments[1:], "--no-dashboard"],
            stdout=log,
            stderr=log,
            env={**os.environ, "PYTHONPATH": path},
            cwd=folder,
        )
        try:
            yield process
        finally:
            process.kill()
            process.wait()


@contextmanager
def scheduler(folder: Path) -> Iterator[tuple[str, int]]:
    """A scheduler; gives its address and the number of its process."""
    from distributed import Client

    where = folder / "scheduler.json"
    options = ("--port", "0", "--host", "127.0.0.1", "--scheduler-file", str(where))
    with started("scheduler", *options, folder=folder) as process:
        with Client(scheduler_file=str(where), timeout=PATIENCE_S) as client:
            address = client.scheduler.address
        yield address, process.pid


@contextmanager
def workers(address: str, folder: Path, count: int = 2) -> Iterator[list[int]]:
    """Workers of one thread each; gives the numbers of their processes."""
    from distributed import Client

    options = ("--nthreads", "1", "--nworkers", str(count))
    with started("worker", address, *options, folder=folder):
        with Client(address, timeout=PATIENCE_S) as client:
            numbers: list[int] = []
            # Those of a test before may still be listed although they have ended.
            while len(numbers) != count:
                client.wait_for_workers(count, timeout=PATIENCE_S)
                numbers = list(client.run(os.getpid, on_error="ignore").values())
        try:
            yield numbers
        finally:
            for number in numbers:
                with suppress(ProcessLookupError):
                    os.kill(number, signal.SIGKILL)
