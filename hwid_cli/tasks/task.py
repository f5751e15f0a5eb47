"""A task, and how it runs wherever it runs."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

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
    result_type : type
        Record type of the result.
    pack : callable or None
        Turns key and result into what the store keeps, where the task is computed; the
        process that writes has the results of all workers to keep.
    """

    key: str
    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    result_type: type
    pack: Callable[[str, Any], Any] | None = None


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep linear algebra to one thread: more change last bits, and fight over cores."""
    with _thread_pools().limit(limits=1):
        yield


class Computed(NamedTuple):
    """Result of a task, and what the store keeps of it; None if it was not packed."""

    result: Any
    packed: Any


def run_task(task: Task) -> tuple[str, Computed]:
    """Run a task with one thread of linear algebra.

    Returns
    -------
    str
        Its key.
    """
    with one_thread():
        return task.key, computed(task.key, task.function, task.arguments, task.pack)


def computed(
    key: str,
    function: Callable[..., Any],
    arguments: Sequence[Any],
    pack: Callable[[str, Any], Any] | None,
) -> Computed:
    """Run a task that comes in parts."""
    result = function(*arguments)
    return Computed(result, None if pack is None else pack(key, result))


@lru_cache(maxsize=1)
def _thread_pools() -> ThreadpoolController:
    """Threads of linear algebra in this process; finding them takes milliseconds."""
    return ThreadpoolController()
