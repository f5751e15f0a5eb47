"""A task, and how it runs wherever it runs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from threadpoolctl import ThreadpoolController


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


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep linear algebra to one thread: more change last bits, and fight over cores."""
    with _thread_pools().limit(limits=1):
        yield


def run_task(task: Task) -> tuple[str, Any]:
    """Run a task with one thread of linear algebra.

    Parameters
    ----------
    task : Task

    Returns
    -------
    str
        Its key.
    object
        Its result.
    """
    with one_thread():
        return task.key, task.function(*task.arguments)


@lru_cache(maxsize=1)
def _thread_pools() -> ThreadpoolController:
    """Threads of linear algebra in this process; finding them takes milliseconds."""
    return ThreadpoolController()
