"""Tasks over workers, memoised.

Workers compute, the parent writes. Every result is handed to the store as it arrives,
so that stopping the program loses only what is being computed. Results are returned in
the order of the tasks and every task runs with one thread of linear algebra, so that
the number of workers never changes a number.
"""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import Any

from hwid_cli.tasks.cache import Store
from hwid_cli.tasks.task import Task
from hwid_cli.tasks.workers import Workers, compute


@dataclass(frozen=True, eq=False)
class TaskDone:
    """A task with its result.

    Parameters
    ----------
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
    force : bool
        Compute again what the store already has.
    fresh : set of str
        Keys of what was computed with these settings, which force spares; filled here.
    on_done : callable or None
        Called with every ``TaskDone`` as it comes, in any order.
    """

    store: Store
    workers: Workers = field(default_factory=Workers)
    force: bool = False
    on_done: Callable[[TaskDone], None] | None = None
    fresh: set[str] = field(default_factory=set)


def run_tasks(tasks: Sequence[Task], settings: RunSettings) -> tuple[TaskDone, ...]:
    """Run tasks that the store has no result for, and keep each result at once.

    Returns
    -------
    tuple of TaskDone
        In the order of the tasks.

    Raises
    ------
    ConfigError
        If the backend is not there.
    WorkerError
        If the system kills the worker of a task twice.
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
        if not settings.force or task.key in settings.fresh:
            found = settings.store.get(task.key, task.result_type)
        if found is None:
            # Tasks with the same content are computed once.
            missing.setdefault(task.key, []).append(number)
        else:
            finish([number], found, from_cache=True)
    pack = settings.store.pack
    unique = [replace(tasks[numbers[0]], pack=pack) for numbers in missing.values()]
    # Closed at once where the store fails: workers must not go on for nobody.
    with closing(compute(unique, settings.workers)) as results:
        for key, (result, packed) in results:
            settings.store.put_packed(key, packed)
            settings.fresh.add(key)
            finish(missing[key], result, from_cache=False)
    return tuple(done[number] for number in range(len(tasks)))
