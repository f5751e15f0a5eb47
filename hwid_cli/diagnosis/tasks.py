"""Tasks of a diagnosis, and whoever runs them.

A diagnosis describes its long computations as tasks and hands them to a runner that it is
given, so that nothing here knows of processes or of a cache.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

OnRound = Callable[[str, int], None]


@dataclass(frozen=True, eq=False)
class DiagnosisTask:
    """One call for whoever runs the tasks of a diagnosis.

    Parameters
    ----------
    name : str
        For people.
    function : callable
        At module level, so that a worker can import it.
    result_type : type
        Record type of the result.
    content : mapping
        With the arrays, all that tells it from other tasks of the same diagnosis.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    result_type: type
    content: Mapping[str, Any]
    arrays: tuple[np.ndarray, ...] = ()


class RunTasks(Protocol):
    """Whatever runs tasks: in turn, over processes, from a cache."""

    def __call__(self, tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:
        """Results in the order of the tasks.

        Parameters
        ----------
        keep : bool
            Whether the results are worth keeping for another run.
        """
