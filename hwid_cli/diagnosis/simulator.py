"""A simulation of any kind as the diagnosis sees it, and its runs on recordings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.tasks import DiagnosisTask, OnRound, RunTasks
from hwid_cli.drive.simulation import NO_FORCE
from hwid_cli.errors import SimulationError
from hwid_cli.records.programs import (
    Capabilities,
    FreeParameter,
    RunRequest,
    SimulatorRun,
    StandInChange,
)

# Derivatives by its parameters, as a share of their size: its integrator may be no more
# exact than a millionth. At most so much more where that changes less than this share of
# what is left: an integrator of less accuracy would be all of it.
DIFFERENCE = 1e-3
_MOST_WIDER = 50.0
_LEAST_CHANGE = 0.1
# A difference that should be wider by more than this is taken again.
_CLEARLY_WIDER = 2.0

# Of a diagnosis, at most, where nobody says how many: in all, or for each recording and
# what is fitted to it.
_FEWEST_RUNS, _RUNS_OF_EACH = 800, 40


def difference_for(slope: np.ndarray, errors_rms: float) -> float:
    """Width of a difference that tells a derivative, as a share of the parameter's size.

    Parameters
    ----------
    slope : ndarray, shape (n_samples,), [output unit]
        What a parameter changes over the share of its size by which it was changed; not
        finite where a run gave no answer.
    errors_rms : float, [output unit]
        What the derivative is used on.

    Returns
    -------
    float, [-]
        At least ``DIFFERENCE``.
    """
    size = float(np.sqrt(np.mean(slope**2)))
    if not np.isfinite(size):
        return DIFFERENCE
    most = _MOST_WIDER * DIFFERENCE
    least = _LEAST_CHANGE * errors_rms
    return float(np.clip(least / size, DIFFERENCE, most)) if size > 0 else most


def derivative(slope: Callable[[float], np.ndarray], errors_rms: float) -> np.ndarray:
    """A derivative by a difference that is as wide as the simulation needs.

    Parameters
    ----------
    slope : callable
        What a parameter changes over the share of its size by which it is changed, shape
        (n_samples,), [output unit].
    errors_rms : float, [output unit]
        What the derivative is used on.

    Returns
    -------
    ndarray, shape (n_samples,), [output unit]
    """
    found = slope(DIFFERENCE)
    wanted = difference_for(found, errors_rms)
    return slope(wanted) if wanted > _CLEARLY_WIDER * DIFFERENCE else found


@dataclass(frozen=True, eq=False)
class Simulator:
    """A simulation as the diagnosis sees it.

    Parameters
    ----------
    run : callable or None
        One run; a function at module level or a partial of one. None where only outputs
        are at hand.
    given : mapping of str to ndarray
        What the simulation gave, by the names of the recordings, where it cannot be run.
    free : mapping of str to FreeParameter
        Parameters that may be fitted again.
    values : mapping of str to float
        All parameters.
    effects : mapping
        Effects that were added to it before.
    change : StandInChange
        Of the drive that stands for it, added before.
    output : str
        What is compared; one of ``records.drive.OUTPUTS``.
    """

    capabilities: Capabilities
    run: Callable[[RunRequest], SimulatorRun] | None = None
    given: Mapping[str, np.ndarray] = field(default_factory=dict)
    free: Mapping[str, FreeParameter] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)
    change: StandInChange = field(default_factory=StandInChange)
    output: str = "position"

    @property
    def is_extended(self) -> bool:
        """Whether something was added to it before."""
        return bool(self.effects) or not self.change.is_none


def most_runs(given: int | None, n_recordings: int, n_free: int = 1) -> int:
    """Runs after which nothing is tried that may be left out.

    Parameters
    ----------
    given : int or None
        By the configuration; None means 800, or if that is more 40 for each recording and
        each of the parameters and effects that are fitted to it.
    n_free : int
        Parameters of the simulation that are fitted again.
    """
    if given is not None:
        return given
    return max(_FEWEST_RUNS, _RUNS_OF_EACH * n_recordings * (1 + n_free))


class CountedRuns:
    """Runs tasks as another one does, and counts runs of a simulation among them.

    Parameters
    ----------
    most : float
        After so many of them nothing is tried that may be left out.
    """

    def __init__(self, run_tasks: RunTasks, most: float = np.inf) -> None:
        self.count = 0
        self._run_tasks, self._most = run_tasks, most

    @property
    def are_spent(self) -> bool:
        """Whether the search has to do with what it has."""
        return self.count >= self._most

    def __call__(self, tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:
        """Results in the order of the tasks."""
        self.count += sum(one.result_type is SimulatorRun for one in tasks)
        return self._run_tasks(tasks, keep=keep)

    def up_to(self, share: float) -> "CountedRuns":
        """The same, spent after a share of all runs; what it runs counts here, too."""
        return CountedRuns(self, share * self._most - self.count)

    def at_least(self, number: int) -> "CountedRuns":
        """The same with so many runs left at least."""
        return CountedRuns(self, max(self._most - self.count, number))

    def told(self, on_round: OnRound) -> OnRound:
        """What begins, with the runs until then."""

        def begin(what: str, total: int) -> None:
            plural = "" if self.count == 1 else "s"
            after = f", after {self.count} run{plural}" if self.count else ""
            on_round(f"{what}{after}", total)

        return begin


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of a simulation on recordings, by whoever runs tasks.

    Parameters
    ----------
    starts : mapping of str to float, [output unit]
        What is added to the outputs of recordings, by their names: a machine that goes
        on from where it is, beside a simulation that always starts at one place.
    are_held : bool
        Whether the simulation holds forces between samples.
    """

    simulator: Simulator
    run_tasks: CountedRuns
    starts: Mapping[str, float] = field(default_factory=dict)
    are_held: bool = False

    def up_to(self, share: float) -> "Runs":
        """The same, spent after a share of all runs."""
        return replace(self, run_tasks=self.run_tasks.up_to(share))

    def of(
        self,
        signals: Sequence[Signals],
        values: Mapping[str, float],
        forces: Sequence[np.ndarray] = (),
        inputs: Sequence[np.ndarray] = (),
    ) -> list[SimulatorRun]:
        """Run the simulation on every recording.

        Parameters
        ----------
        forces : sequence of ndarray, [N]
            At its force input; empty for none.
        inputs : sequence of ndarray
            In place of the recordings' own; empty for these.

        Raises
        ------
        SimulationError
            If a run gives no answer, or a force is not finite: none is run with that.
        """
        run = self.simulator.run
        if run is None:
            given = self.simulator.given
            found = [SimulatorRun(given[one.name], np.zeros(0)) for one in signals]
            return self.from_starts(signals, found)
        tasks = []
        for row, one in enumerate(signals):
            force = forces[row] if forces else NO_FORCE
            if not np.isfinite(force).all():
                raise SimulationError(
                    f"simulation: the force for recording {one.name!r} is not finite"
                )
            driven_by = inputs[row] if inputs else one.driven_by
            request = RunRequest(
                one.name, one.sample_time_s, driven_by, force, dict(values)
            )
            tasks.append(_task(run, request))
        return self.from_starts(signals, self.run_tasks(tasks, keep=True))

    def once(self, request: RunRequest) -> SimulatorRun | None:
        """One run by itself; None where it gives no answer."""
        run = self.simulator.run
        if run is None:
            return None
        try:
            (found,) = self.run_tasks([_task(run, request)], keep=True)
        except SimulationError:
            return None
        return found if isinstance(found, SimulatorRun) else None

    def from_starts(
        self, signals: Sequence[Signals], found: Sequence[SimulatorRun]
    ) -> list[SimulatorRun]:
        """Runs from where their recordings start."""
        return [
            replace(run, output=run.output + self.starts[one.name])
            if one.name in self.starts
            else run
            for one, run in zip(signals, found, strict=True)
        ]

    def tried(
        self,
        signals: Sequence[Signals],
        values: Mapping[str, float],
        forces: Sequence[np.ndarray] = (),
        inputs: Sequence[np.ndarray] = (),
    ) -> list[SimulatorRun] | None:
        """The same with what a search has chosen; None where a run gives no answer.

        A trial may leave what the simulation was made for: a capacity below 0, a voltage
        that no supply gives.
        """
        try:
            return self.of(signals, values, forces, inputs)
        except SimulationError:
            return None


def _task(
    run: Callable[[RunRequest], SimulatorRun], request: RunRequest
) -> DiagnosisTask:
    """One run as a task, known by its recording, inputs and parameters."""
    content = {"run": request.name, "parameters": dict(request.parameters)}
    return DiagnosisTask(
        f"run {request.name}", run, (request,), SimulatorRun, content,
        (request.input, request.force),
    )  # fmt: skip
