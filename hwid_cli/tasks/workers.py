"""Where tasks run: in this process, on workers of this machine, or on a dask cluster."""

import logging
import pickle
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any

import joblib

from hwid_cli.errors import ConfigError
from hwid_cli.tasks.cluster import cluster_results
from hwid_cli.tasks.local_workers import compute_here
from hwid_cli.tasks.task import Computed, Task, run_task

_log = logging.getLogger(__name__)

BACKENDS = ("loky", "dask")

# Functions of which this process has run a task: their loops are compiled.
_compiled: set[Callable[..., Any]] = set()


@dataclass(frozen=True)
class Workers:
    """Where tasks run and how many at a time.

    Parameters
    ----------
    jobs : int or None, [-]
        Processes; None means one for each core. 1 computes in this process.
    backend : str
        One of ``BACKENDS``.
    scheduler : str or None
        Address of a running dask scheduler; None starts one on this machine.
    """

    jobs: int | None = None
    backend: str = "loky"
    scheduler: str | None = None

    @property
    def count(self) -> int:
        """Number of processes."""
        return joblib.cpu_count() if self.jobs is None else self.jobs


def compute(
    tasks: Sequence[Task], workers: Workers
) -> Generator[tuple[str, Computed], None, None]:
    """Results as they come, each with its key.

    Parameters
    ----------
    tasks : sequence of Task
        With different keys.

    Yields
    ------
    str
        Key of the task.
    Computed
        Its result.

    Raises
    ------
    ConfigError
        If the backend is not there.
    WorkerError
        If a task was tried twice, and the system killed its worker each time.
    """
    if workers.backend not in BACKENDS:
        raise ConfigError(
            f"backend {workers.backend!r} is unknown; expected {' or '.join(BACKENDS)}"
        )
    is_local = workers.backend == "loky"
    if is_local and workers.count == 1:
        yield from (run_task(task) for task in tasks)
        return
    if is_local and tasks and tasks[0].function not in _compiled:
        # The first task runs here: it fills the on-disk cache of compiled loops, which
        # the workers then load instead of each compiling them. It goes through pickle
        # because arrays become writable on that way, which compiled loops see.
        _compiled.add(tasks[0].function)
        yield run_task(pickle.loads(pickle.dumps(tasks[0])))
        tasks = tasks[1:]
    if not tasks:
        return
    _log.debug(
        "%d tasks on %d workers (%s)", len(tasks), workers.count, workers.backend
    )
    if is_local:
        yield from compute_here(tasks, workers.count)
        return
    yield from cluster_results(tasks, workers.scheduler, workers.count)
