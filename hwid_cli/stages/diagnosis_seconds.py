"""How long a diagnosis will take: its beginning is run, some of its tasks are timed.

What a candidate takes depends on the machine that is diagnosed: how often it sticks, hits
a stop or is reversed. So the forecast does what the diagnosis does first, up to the
screening of single effects, and times every fourth task of that. Whether sets of several
effects follow is known only then: they are not part of the forecast.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

from hwid_cli.diagnosis.rounds import DiagnosisTask, OnRound, RunTasks
from hwid_cli.records.programs import SimulatorRun

# Of the tasks of the screening, [tasks].
_EACH = 4
# Time of all single effects against that of their screening: the promising ones are
# fitted on whole recordings, [-].
_SINGLE_EFFECTS = 1.2
# Runs of the user's simulation with a candidate inside, for each recording, [-].
_CONFIRMING_RUNS = 9
# A simulation of the user's own is not run for longer to say how long it takes, [s].
_MOST_RUN_S = 30.0

# Drawing what was found, [s].
_FIGURES_S = 0.7

Diagnose = Callable[[RunTasks, OnRound], Any]


class _Enough(Exception):
    """Ends a diagnosis that is run for its beginning only."""


class _Sampler:
    """Runs the tasks of a diagnosis up to the screening; a clock needs a memory."""

    def __init__(self) -> None:
        self.runs = 0
        self.run_seconds = 0.0
        self.screening = 0.0
        self.n_tasks = 0
        self.sampling = 0.0
        self._is_screening = False

    def on_round(self, text: str, total: int) -> None:
        """Note what begins."""
        self._is_screening = "screening" in text and total > 0

    def run(self, tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:  # noqa: ARG002
        """Run tasks in turn; of the screening, some."""
        if self._is_screening:
            self._sample(tasks)
        if tasks and tasks[0].result_type is SimulatorRun:
            return [self._timed(one) for one in tasks]
        return [one.function(*one.arguments) for one in tasks]

    def _sample(self, tasks: Sequence[DiagnosisTask]) -> None:
        begun = time.process_time()
        chosen = tasks[::_EACH]
        # The first call loads compiled loops, which no later task does.
        chosen[0].function(*chosen[0].arguments)
        start = time.process_time()
        for one in chosen:
            one.function(*one.arguments)
        each = (time.process_time() - start) / len(chosen)
        self.n_tasks, self.screening = len(tasks), each * len(tasks)
        self.sampling = time.process_time() - begun
        raise _Enough

    def _timed(self, task: DiagnosisTask) -> Any:
        """A run of the user's simulation, which works in a process of its own."""
        if self.run_seconds > _MOST_RUN_S:
            raise _Enough
        start = time.perf_counter()
        result = task.function(*task.arguments)
        self.run_seconds += time.perf_counter() - start
        self.runs += 1
        return result


def time_diagnosis(diagnose: Diagnose, n_recordings: int) -> tuple[float, int]:
    """Time the beginning of a diagnosis.

    Parameters
    ----------
    diagnose : callable
        Runs it with what runs its tasks and what is told of its rounds.
    n_recordings : int, [-]

    Returns
    -------
    seconds : float, [s]
        Of the diagnosis with single effects, on one core; NaN where a simulation of the
        user's own takes so long that even its beginning does.
    n_tasks : int, [-]
        Candidates that are screened; 0 where nothing is searched for.
    """
    sampler = _Sampler()
    start = time.process_time()
    try:
        diagnose(sampler.run, sampler.on_round)
    except _Enough:
        if not sampler.n_tasks:
            return float("nan"), 0
    spent = time.process_time() - start - sampler.sampling
    confirming = 0.0
    if sampler.runs and sampler.n_tasks:
        each = sampler.run_seconds / sampler.runs
        confirming = _CONFIRMING_RUNS * n_recordings * each
    rest = _SINGLE_EFFECTS * sampler.screening
    seconds = spent + sampler.run_seconds + rest + confirming + _FIGURES_S
    return seconds, sampler.n_tasks
