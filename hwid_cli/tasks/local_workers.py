"""Workers on this machine, which the system may kill one day; joblib lives here.

A worker that is killed takes the pool of workers down with it. The tasks that were
under way are then tried once more, one at a time, which also tells the one that cannot
be done.
"""

import logging
import multiprocessing.resource_tracker
import os
import re
import signal
import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager

# As it is now: while a user's own function runs, it is another one.
from os import _exit
from typing import Any

import joblib
from joblib.externals.loky.backend import resource_tracker as loky_tracker

from hwid_cli.errors import WorkerError
from hwid_cli.tasks.task import Computed, Task, run_task

# Tasks handed out ahead for each worker, [-]: enough that none waits for the parent.
TASKS_AHEAD = 3
# A worker looks this often whether the process that needs its results is alive, [s].
PARENT_CHECK_S = 0.5
# A signal to all processes may reach a worker before this one, [s].
SIGNAL_DELAY_S = 0.2
# Names of tasks in a message, [-]: more fill the screen.
MOST_NAMES = 4

# What joblib says of results that nobody waited for.
_UNUSED = r"\d+ tasks (which were still being processed|have been successfully)"

_log = logging.getLogger(__name__)
# The process that a worker works for, once it is being watched.
_watched: list[int] = []


def compute_here(tasks: Sequence[Task], count: int) -> Iterator[tuple[str, Computed]]:
    """Results of workers on this machine as they come.

    Parameters
    ----------
    tasks : sequence of Task
        With different keys.
    count : int, [-]
        Workers.

    Yields
    ------
    str
        Key of the task.
    Computed
        Its result.

    Raises
    ------
    WorkerError
        If a task was tried twice, and the system killed its worker each time.
    """
    threading.excepthook = _forget_stopping
    left = {task.key: task for task in tasks}
    while left:
        handed_out: list[Task] = []
        try:
            for key, result in _stream(
                list(left.values()), count, TASKS_AHEAD * count, handed_out
            ):
                del left[key]
                yield key, result
        except BrokenExecutor as error:
            # A signal to all processes ends this one here, without a word on workers.
            time.sleep(SIGNAL_DELAY_S)
            suspects = [task for task in handed_out if task.key in left]
            # None of them is to blame where a worker was killed before it began.
            suspects = suspects or list(left.values())[:1]
            _log.warning(
                "a worker %s; under way were %s; tried once more, one at a time",
                _how(error),
                _names(suspects),
            )
            for key, result in _one_at_a_time(suspects, count):
                del left[key]
                yield key, result


def _one_at_a_time(tasks: Sequence[Task], count: int) -> Iterator[tuple[str, Computed]]:
    """Try tasks again of which one may be too much for a worker."""
    for task in tasks:
        try:
            yield from _alone(task)
        except BrokenExecutor:
            # It may have waited when the first worker was killed: then this was the
            # first time that it killed one itself.
            time.sleep(SIGNAL_DELAY_S)
            try:
                yield from _alone(task)
            except BrokenExecutor as error:
                time.sleep(SIGNAL_DELAY_S)
                raise WorkerError(
                    f"{task.name}: tried twice, and each time its worker {_how(error)}; "
                    "expected a task that a worker finishes; what was finished is kept: "
                    "run the same command again with fewer processes (--jobs, now "
                    f"{count}) or when other programs have ended"
                ) from error


def _alone(task: Task) -> Iterator[tuple[str, Any]]:
    """Run a task while no other runs; not in this process, which it would take down."""
    yield from _stream([task], 2, 1)


def _how(error: BrokenExecutor) -> str:
    """What became of a worker: only one signal hints at memory that ran out."""
    found = re.search(r"\{(.*?)\}", str(error))
    signals = "" if found is None else f" ({found[1]})"
    if "SIGKILL" in signals:
        return f"was killed by the system{signals}, most likely for lack of memory"
    return f"ended before its time{signals}"


def _names(tasks: Sequence[Task]) -> str:
    named = ", ".join(task.name for task in tasks[:MOST_NAMES])
    more = len(tasks) - MOST_NAMES
    return f"{named} and {more} more" if more > 0 else named


def _stream(
    tasks: Sequence[Task],
    count: int,
    ahead: int,
    handed_out: list[Task] | None = None,
) -> Iterator[tuple[str, Computed]]:
    """Results of workers as they come; notes which tasks were handed to them."""
    noted = [] if handed_out is None else handed_out
    run = joblib.delayed(_run_for)

    def calls() -> Iterator[Any]:
        for task in tasks:
            noted.append(task)
            yield run(os.getpid(), task)

    # An interrupt, or a disk that is full, leaves results that nobody waits for.
    warnings.filterwarnings("ignore", message=_UNUSED, category=UserWarning)
    # max_nbytes: a memory-mapped array would not be a plain array in the worker.
    parallel = joblib.Parallel(
        n_jobs=count,
        backend="loky",
        return_as="generator_unordered",
        pre_dispatch=ahead,
        batch_size=1,
        max_nbytes=None,
    )
    # The call starts the workers, and they inherit what is held back.
    with _interrupts_held_back():
        results = parallel(calls())
    yield from results


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Hold signals from the terminal back while workers start.

    They inherit it and so leave them to this process, which gets them afterwards.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    held = {signal.SIGINT, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, held)
    try:
        # These let Ctrl-C through again when they start, some of them.
        with _quiet_trackers():
            multiprocessing.resource_tracker.ensure_running()
            loky_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, held)
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _quiet_trackers() -> Iterator[None]:
    """Let what cleans up after this process do so without a word."""
    before = os.environ.get("PYTHONWARNINGS")
    own = "ignore:resource_tracker"
    os.environ["PYTHONWARNINGS"] = own if before is None else f"{before},{own}"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = before


def _forget_stopping(problem: threading.ExceptHookArgs) -> None:
    """Report what happened in a thread, except for loky's own race when it is stopped.

    An interrupt may clear the list of tasks while loky's thread still reads it.
    """
    name = problem.thread.name if problem.thread is not None else ""
    if not (name == "ExecutorManagerThread" and problem.exc_type is KeyError):
        threading.__excepthook__(problem)


def _run_for(parent: int, task: Task) -> tuple[str, Computed]:
    """Run a task in a worker, for as long as somebody waits for its result."""
    if not _watched:
        _watched.append(parent)
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    return run_task(task)


def _end_with(parent: int) -> None:
    """End this process with its parent, which could not do so when it was killed."""
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK_S)
    _exit(1)
