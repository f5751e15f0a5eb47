"""How long a diagnosis will take: its beginning is run, some of its tasks are timed.

What a candidate takes depends on the machine that is diagnosed: how often it sticks, hits
a stop or is reversed. So the forecast does what the diagnosis does first, up to the
screening of single effects, and times every fourth task of that. How often they are
screened, and whether sets of several effects follow, is known only then: the forecast is
a range, from one screening to all rounds that the search may take.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from hwid_cli.diagnosis.proposals import LIKELY_PAIRS, SCREENED_ON_TOP
from hwid_cli.diagnosis.rounds import MOST_PARENTS, MOST_SCREENINGS
from hwid_cli.diagnosis.simulator import most_runs
from hwid_cli.diagnosis.tasks import DiagnosisTask, OnRound, RunTasks
from hwid_cli.records.programs import SimulatorRun
from hwid_cli.stages.run_seconds import LOADING_SECONDS

# Of the tasks of the screening, [tasks].
_EACH = 4
# Time of all single effects against that of their screening: the promising ones are
# fitted on whole recordings, [-].
_SINGLE_EFFECTS = 1.2
# A set of effects against a single one: more parameters, more of the motion, [-].
_SET_OF_EFFECTS = 1.5
# A law is fitted from few starts, but its terms are many, and worked off one by one: its
# fit against one of the screening, and how many there are, [-].
_LAW, _LAWS = 8.0, 16
# Runs of the user's simulation with a candidate inside, for each recording, [-].
_CONFIRMING_RUNS = 9
# A simulation of the user's own is not run for longer to say how long it takes, [s].
_MOST_RUN_S = 30.0
# Runs of it that a diagnosis takes at least, as measured (docs/any_simulation.md), [-].
LEAST_RUNS = 250

# Drawing what was found, [s].
_FIGURES_S = 0.7
# What of a round is left of the gain of several processes: they wait for its longest task
# and for the first one, which runs alone (docs/benchmarks.md), [-].
_SHARED = 0.8

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


@dataclass(frozen=True)
class DiagnosisTime:
    """How long a diagnosis takes.

    Parameters
    ----------
    seconds : float, [s]
        Where a single effect is enough and shows at once.
    most_seconds : float, [s]
        With all rounds of the search.
    n_tasks : int, [-]
        Candidates that are screened; 0 where nothing is searched for.
    by_runs : bool
        Whether a simulation of the user's own takes so long that its runs are the
        forecast; then nothing is known of the search.
    """

    seconds: float
    most_seconds: float
    n_tasks: int
    by_runs: bool = False


def time_diagnosis(
    diagnose: Diagnose,
    n_recordings: int,
    max_effects: int,
    workers: int,
    *,
    searches: int = 1,
    may_be_law: bool = False,
) -> DiagnosisTime:
    """Time the beginning of a diagnosis, and count the rounds that may follow.

    Parameters
    ----------
    diagnose : callable
        Runs it with what runs its tasks and what is told of its rounds.
    n_recordings : int, [-]
    max_effects : int, [-]
        Of the largest set that is searched for.
    workers : int, [-]
        Processes that share its rounds.
    searches : int, [-]
        Most that follow each other: beside parameters that the last one has moved, a
        better base, a held command, or behind a filter for noise.
    may_be_law : bool
        Whether laws are searched for where effects do not settle it.
    """
    sampler = _Sampler()
    start = time.process_time()
    try:
        diagnose(sampler.run, sampler.on_round)
    except _Enough:
        if not sampler.n_tasks:
            side_by_side = min(workers, n_recordings)
            each = sampler.run_seconds / sampler.runs / side_by_side
            longest = most_runs(None, n_recordings) * each
            return DiagnosisTime(LEAST_RUNS * each, longest, 0, by_runs=True)
    spent = time.process_time() - start - sampler.sampling
    confirming = most_confirming = 0.0
    if sampler.runs and sampler.n_tasks:
        each = sampler.run_seconds / sampler.runs
        confirming = _CONFIRMING_RUNS * n_recordings * each
        further = most_runs(None, n_recordings) - sampler.runs
        most_confirming = max(confirming, further * each)
    # The user's own simulations run side by side, all at once; what comes before the
    # screening waits for each of its steps.
    running = (sampler.run_seconds + confirming) / workers
    fixed = spent + running + LOADING_SECONDS + _FIGURES_S
    single = _SINGLE_EFFECTS * sampler.screening / _gain(sampler.n_tasks, workers)
    rounds = searches * (1 + MOST_SCREENINGS)
    most = rounds * single * (1.0 + _sets_for_one(sampler.n_tasks, max_effects))
    if may_be_law and sampler.n_tasks:
        each = sampler.screening / sampler.n_tasks
        most += _LAW * _LAWS * each / _gain(_LAWS, workers)
    most += (most_confirming - confirming) / workers
    return DiagnosisTime(fixed + single, fixed + most, sampler.n_tasks)


def _gain(n_tasks: int, workers: int) -> float:
    """How many times a round of tasks is faster on several processes, [-]."""
    if n_tasks == 0 or workers == 1:
        return 1.0
    return max(_SHARED * n_tasks / math.ceil(n_tasks / workers), 1.0)


def _sets_for_one(n_tasks: int, max_effects: int) -> float:
    """Work on all sets of several effects against that on all single ones, [-]."""
    if n_tasks == 0 or max_effects < 2:
        return 0.0
    on_top = MOST_PARENTS * min(SCREENED_ON_TOP, n_tasks - 1) * (max_effects - 1)
    pairs = min(LIKELY_PAIRS, n_tasks * (n_tasks - 1) // 2)
    return _SET_OF_EFFECTS * (on_top + pairs) / n_tasks
