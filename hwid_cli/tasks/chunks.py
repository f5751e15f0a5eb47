"""Which tasks go out together, and which are tried again after workers have died.

A chunk lasts long enough for its way to a worker and back not to matter; what a chunk
holds changes no number. One over which workers died is taken apart; a task whose workers
die again although it is alone is given up.
"""

import math
import statistics
from collections import Counter, deque
from collections.abc import Sequence

from hwid_cli.errors import WorkerError
from hwid_cli.tasks.task import Task

# How long a chunk shall last, [s], and how many tasks it holds at most. Near the end
# chunks get shorter, so that none is waited for long, down to a length, [s], at which the
# way to a worker and back (docs/scale.md) is still a small share of it.
CHUNK_S, LEAST_CHUNK_S, MOST_IN_CHUNK = 1.0, 0.2, 64
# Chunks handed out ahead for each thread of a worker.
CHUNKS_AHEAD = 3
# Chunks from whose duration that of the next ones is taken.
RECENT = 30
# Names of tasks in a message.
_MOST_NAMES = 4


class Chunks:
    """Tasks that wait for a worker.

    Parameters
    ----------
    tasks : sequence of Task
        Of one kind.
    recent : deque of float, optional, [s]
        How long tasks of that kind took last; goes on with these.
    """

    def __init__(
        self, tasks: Sequence[Task], recent: deque[float] | None = None
    ) -> None:
        self._waiting = deque(tasks)
        self._alone: deque[Task] = deque()
        self._deaths: Counter[str] = Counter()
        self._given_up: list[Task] = []
        self._seconds = deque(maxlen=RECENT) if recent is None else recent

    def __bool__(self) -> bool:
        """Whether a task waits."""
        return bool(self._waiting or self._alone)

    def take(self, threads: int) -> tuple[Task, ...]:
        """Take the next chunk.

        Parameters
        ----------
        threads : int, [-]
            That compute; the last tasks are divided among them.

        Returns
        -------
        tuple of Task
            At least one.
        """
        if self._alone:
            return (self._alone.popleft(),)
        count = 1
        if self._seconds:
            typical = max(statistics.median(self._seconds), 1e-6)
            left = len(self._waiting)
            longest = min(int(CHUNK_S / typical), MOST_IN_CHUNK)
            shortest = min(math.ceil(LEAST_CHUNK_S / typical), -(-left // threads))
            fair = left // (CHUNKS_AHEAD * threads)
            count = max(1, min(longest, max(shortest, fair)))
        return tuple(self._waiting.popleft() for _ in range(count))

    def is_done(self, chunk: Sequence[Task], seconds: float) -> None:
        """Note how long a chunk took.

        Parameters
        ----------
        seconds : float, [s]
        """
        self._seconds.append(seconds / len(chunk))

    def has_died(self, chunk: Sequence[Task]) -> str:
        """Try the tasks of a chunk again, each alone, unless they were already.

        Returns
        -------
        str
            Their names.
        """
        for task in chunk:
            self._deaths[task.key] += 1
            is_first = self._deaths[task.key] == 1
            (self._alone if is_first else self._given_up).append(task)
        return _names(chunk)

    def check(self) -> None:
        """Refuse to end well where tasks were given up.

        Raises
        ------
        WorkerError
            Naming them.
        """
        if self._given_up:
            raise WorkerError(
                f"{_names(self._given_up)}: workers died over it again and again; "
                "expected a task that fits into their memory and that they finish; what "
                "was finished is kept: look into their logs and run the same command "
                "again"
            )


def _names(tasks: Sequence[Task]) -> str:
    named = ", ".join(task.name for task in tasks[:_MOST_NAMES])
    more = len(tasks) - _MOST_NAMES
    return f"{named} and {more} more" if more > 0 else named
