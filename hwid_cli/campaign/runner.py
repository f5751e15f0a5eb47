"""Tasks over workers, memoised: the only home of joblib.

Workers compute, the parent writes. Every result is handed to the store as it arrives,
so that stopping the program loses only what is being computed. Results are returned in
the order of the tasks and every task runs with one thread of linear algebra, so that
the number of workers never changes a number.
"""

import logging
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import joblib
from threadpoolctl import ThreadpoolController

from hwid_cli.campaign.cache import Store
from hwid_cli.errors import ConfigError

BACKENDS = ("loky", "dask")
# Tasks handed out ahead for each worker, [-]: enough that none waits for the parent.
TASKS_AHEAD = 3
# A scheduler that does not answer within this time is not there, [s].
CONNECT_TIMEOUT_S = 10

_log = logging.getLogger(__name__)
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


@dataclass(frozen=True, eq=False)
class Task:
    """One call whose result is worth keeping.

    Parameters
    ----------
    key : str
        Content key, see ``cache.task_key``.
    name : str
        For people.
    function : callable
        At module level, so that a worker can import it.
    arguments : tuple
    result_type : type
        Record type of the result.
    """

    key: str
    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    result_type: type


@dataclass(frozen=True, eq=False)
class TaskDone:
    """A task with its result.

    Parameters
    ----------
    task : Task
    result : object
        Of the task's ``result_type``.
    from_cache : bool
        True if nothing was computed.
    """

    task: Task
    result: Any
    from_cache: bool


@dataclass(frozen=True, eq=False)
class RunSettings:
    """How a stage runs its tasks; none of it changes a number.

    Parameters
    ----------
    store : Store
    workers : Workers
    force : bool
        Compute again what the store already has.
    on_done : callable or None
        Called with every ``TaskDone`` as it comes, in any order.
    """

    store: Store
    workers: Workers = field(default_factory=Workers)
    force: bool = False
    on_done: Callable[[TaskDone], None] | None = None


def run_tasks(tasks: Sequence[Task], settings: RunSettings) -> tuple[TaskDone, ...]:
    """Run tasks that the store has no result for, and keep each result at once.

    Parameters
    ----------
    tasks : sequence of Task
    settings : RunSettings

    Returns
    -------
    tuple of TaskDone
        In the order of the tasks.

    Raises
    ------
    ConfigError
        If the backend is not there.
    KeyboardInterrupt
        Workers are stopped; what had arrived is in the store.
    """
    done: dict[int, TaskDone] = {}

    def finish(numbers: list[int], result: Any, *, from_cache: bool) -> None:
        for number in numbers:
            done[number] = TaskDone(tasks[number], result, from_cache)
            if settings.on_done is not None:
                settings.on_done(done[number])

    missing: dict[str, list[int]] = {}
    for number, task in enumerate(tasks):
        found = None
        if not settings.force:
            found = settings.store.get(task.key, task.result_type)
        if found is None:
            # Tasks with the same content are computed once.
            missing.setdefault(task.key, []).append(number)
        else:
            finish([number], found, from_cache=True)
    unique = [tasks[numbers[0]] for numbers in missing.values()]
    for key, result in _compute(unique, settings.workers):
        settings.store.put(key, result)
        finish(missing[key], result, from_cache=False)
    return tuple(done[number] for number in range(len(tasks)))


def _compute(tasks: Sequence[Task], workers: Workers) -> Iterator[tuple[str, Any]]:
    """Results as they come, each with its key."""
    is_local = workers.backend == "loky"
    if is_local and workers.count == 1:
        yield from (_run(task) for task in tasks)
        return
    if is_local and tasks and tasks[0].function not in _compiled:
        # The first task runs here: it fills the on-disk cache of compiled loops, which
        # the workers then load instead of each compiling them. It goes through pickle
        # because arrays become writable on that way, which compiled loops see.
        _compiled.add(tasks[0].function)
        yield _run(pickle.loads(pickle.dumps(tasks[0])))
        tasks = tasks[1:]
    if not tasks:
        return
    _log.debug(
        "%d tasks on %d workers (%s)", len(tasks), workers.count, workers.backend
    )
    threading.excepthook = _forget_stopping
    # max_nbytes: a memory-mapped array would not be a plain array in the worker.
    with _parallel_backend(workers):
        parallel = joblib.Parallel(
            n_jobs=workers.count,
            return_as="generator_unordered",
            pre_dispatch=TASKS_AHEAD * workers.count,
            batch_size=1,
            max_nbytes=None,
        )
        # The call starts the workers, and they inherit what is ignored.
        with _interrupts_ignored():
            results = parallel(joblib.delayed(_run)(task) for task in tasks)
        yield from results


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Ignore Ctrl-C while workers start, so that they leave it to the parent for good."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _forget_stopping(problem: threading.ExceptHookArgs) -> None:
    """Report what happened in a thread, except for loky's own race when it is stopped.

    An interrupt may clear the list of tasks while loky's thread still reads it.
    """
    name = problem.thread.name if problem.thread is not None else ""
    if not (name == "ExecutorManagerThread" and problem.exc_type is KeyError):
        threading.__excepthook__(problem)


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep linear algebra to one thread: more change last bits, and fight over cores."""
    with _thread_pools().limit(limits=1):
        yield


def _run(task: Task) -> tuple[str, Any]:
    with one_thread():
        return task.key, task.function(*task.arguments)


@lru_cache(maxsize=1)
def _thread_pools() -> ThreadpoolController:
    """Threads of linear algebra in this process; finding them takes milliseconds."""
    return ThreadpoolController()


@contextmanager
def _parallel_backend(workers: Workers) -> Iterator[None]:
    """Choose where joblib runs; a dask cluster is left at the end."""
    if workers.backend == "loky":
        with joblib.parallel_config(backend="loky"):
            yield
        return
    if workers.backend != "dask":
        raise ConfigError(
            f"backend {workers.backend!r} is unknown; expected {' or '.join(BACKENDS)}"
        )
    with _dask_client(workers), joblib.parallel_config(backend="dask"):
        yield


def _dask_client(workers: Workers) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise ConfigError(
            f"--backend dask: {error}; expected dask[distributed] in this environment; "
            "run: pip install 'hwid[dask]', or leave --backend out"
        ) from error
    if workers.scheduler is None:
        return Client(n_workers=workers.count, threads_per_worker=1)
    try:
        return Client(workers.scheduler, timeout=CONNECT_TIMEOUT_S)
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"--scheduler {workers.scheduler}: {error}; expected the address of a "
            "running dask scheduler, such as tcp://127.0.0.1:8786"
        ) from error
