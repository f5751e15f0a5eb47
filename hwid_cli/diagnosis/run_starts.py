"""Where recordings start, beside a simulation that always starts at one place.

A free axis goes on from where the last recording has left it, and a sensor may have a
zero of its own in each: what the simulation cannot know is no gap.
docs/method_diagnosis.md, eq. (D30a).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hwid_cli.diagnosis.held_force import is_held
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator
from hwid_cli.diagnosis.stand_in_fit import fit_stand_in
from hwid_cli.drive.simulation import NO_FORCE
from hwid_cli.records.drive import HELD
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import RunRequest, SimulatorRun

# Share of its motion within which a simulation has not moved yet, and starts at one place.
_NOT_YET = 1e-3
# Starts that differ by less than this share of the motion are left to the effects.
_LEAST_SPREAD = 0.01
# Without the starts at most this share of the squares is left.
_MOST_LEFT = 0.5


@dataclass(frozen=True)
class RunStarts:
    """By how much recordings start above a simulation.

    Parameters
    ----------
    above : mapping of str to float, [output unit]
        By the names of the recordings; empty where all start where the simulation does.
    are_places : bool
        Whether the machine itself is there, as a free axis, so that effects may go with
        the place; otherwise the sensor's zero is.
    """

    above: Mapping[str, float] = field(default_factory=dict)
    are_places: bool = False

    @property
    def of_places(self) -> Mapping[str, float]:
        """What belongs to the runs of the simulation, [output unit]."""
        return self.above if self.are_places else {}

    def of_sensor(self, name: str) -> float:
        """What belongs to the sensor of a recording, [output unit]."""
        return 0.0 if self.are_places else self.above.get(name, 0.0)

    def taken_off(self, signals: Sequence[Signals]) -> tuple[Signals, ...]:
        """Recordings without what belongs to their sensor."""
        return tuple(_lowered(one, self.of_sensor(one.name)) for one in signals)


def _lowered(signals: Signals, by: float) -> Signals:
    output, compared = signals.output - by, signals.compared - by
    return replace(signals, output=output, compared=compared) if by else signals


@dataclass(frozen=True, eq=False)
class Begun:
    """Recordings and a simulation that start at the same place.

    Parameters
    ----------
    given : tuple of SimulatorRun
        What the simulation gives with its own parameters.
    """

    problem: DiagnosisProblem
    runs: Runs
    given: tuple[SimulatorRun, ...]
    starts: RunStarts

    @property
    def lowered(self) -> tuple[Signals, ...]:
        """The recordings as if each started where the simulation does."""
        above = self.starts.of_places
        return tuple(
            _lowered(one, above.get(one.name, 0.0)) for one in self.problem.signals
        )

    def beside_recordings(self, outputs: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
        """Outputs by the names of the recordings, beside these as they were measured."""
        names = [one.name for one in self.problem.signals]
        pairs = zip(names, outputs, strict=True)
        return {name: one + self.starts.of_sensor(name) for name, one in pairs}


def begin(
    problem: DiagnosisProblem,
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: CountedRuns,
) -> Begun:
    """Run a simulation as it is given, from where the recordings start."""
    runs = Runs(simulator, run_tasks)
    given = runs.of(problem.signals, simulator.values)
    problem, runs = _with_holds(problem, runs)
    begun = Begun(problem, runs, tuple(given), RunStarts())
    return with_starts(begun, given, is_said=options.initial_state != "rest")


def with_starts(
    begun: Begun, given: Sequence[SimulatorRun], *, is_said: bool = False
) -> Begun:
    """The same from where the recordings start, if that shows beside given runs.

    Parameters
    ----------
    given : sequence of SimulatorRun
        From where the simulation starts by itself, with any values of its parameters:
        beside wrong ones starts may be a small part of the gap.
    is_said : bool
        Whether starts may be anywhere, as somebody has said.
    """
    problem, runs = begun.problem, begun.runs
    if begun.starts.above:
        return begun
    above = starts_above(problem.signals, given, is_said=is_said)
    if not above:
        return begun
    drive = fit_stand_in(problem.signals, given)
    is_free = drive.stiffness_N_per_m == 0 and drive.bends == (0.0, 0.0)
    # Of a velocity none shows where a machine is.
    is_place = is_free and runs.simulator.output == "position"
    starts = RunStarts(above, are_places=is_place)
    runs = replace(runs, starts=starts.of_places)
    signals = starts.taken_off(problem.signals)
    own = tuple(runs.from_starts(problem.signals, begun.given))
    return Begun(replace(problem, signals=signals), runs, own, starts)


def _with_holds(problem: DiagnosisProblem, runs: Runs) -> tuple[DiagnosisProblem, Runs]:
    """A problem and runs that know whether the simulation holds its inputs."""
    simulator, one = runs.simulator, problem.signals[0]
    request = RunRequest(
        one.name, one.sample_time_s, one.driven_by, NO_FORCE, dict(simulator.values)
    )
    holds_input = is_held(runs.once, request, at_force=False)
    are_held = holds_input
    if simulator.capabilities.force:
        are_held = is_held(runs.once, request, at_force=True)
    hold = HELD if holds_input else problem.drive.hold
    drive = replace(problem.drive, hold=hold)
    return replace(problem, drive=drive), replace(runs, are_held=are_held)


def starts_above(
    signals: Sequence[Signals], runs: Sequence[SimulatorRun], *, is_said: bool
) -> dict[str, float]:
    """By how much recordings start above a simulation; empty where all start there.

    Unless it is said, starts have to differ, beside a simulation that knows one start
    only, and most of the gap has to go with them: a drive that starts out of balance
    comes back from there.

    Parameters
    ----------
    is_said : bool
        Whether starts may be anywhere, as somebody has said.

    Returns
    -------
    dict of str to float, [output unit]
        By the names of the recordings.
    """
    pairs = list(zip(signals, runs, strict=True))
    above = {one.name: _start_above(one, run) for one, run in pairs}
    if is_said:
        return above
    motion = max(float(np.ptp(run.output)) for run in runs)
    knows_one = np.ptp([run.output[0] for run in runs]) <= _NOT_YET * motion
    differ = np.ptp(list(above.values())) > _LEAST_SPREAD * motion
    before = _squares(pairs, dict.fromkeys(above, 0.0))
    is_gap = _squares(pairs, above) <= _MOST_LEFT * before
    return above if knows_one and differ and is_gap else {}


def _start_above(signals: Signals, run: SimulatorRun) -> float:
    """Mean distance until the simulation moves."""
    moves = np.abs(run.output - run.output[0]) > _NOT_YET * np.ptp(run.output)
    n = int(np.argmax(moves)) if moves.any() else moves.size
    return float(np.mean(signals.compared[:n] - run.output[:n]))


def _squares(
    pairs: Sequence[tuple[Signals, SimulatorRun]], above: Mapping[str, float]
) -> float:
    left = [
        (one.compared - run.output - above[one.name])[one.evaluated]
        for one, run in pairs
    ]
    return sum(float(one @ one) for one in left)


def starts_sentence(above: Mapping[str, float], unit: str) -> str:
    """Say what was done about starts; empty where nothing was."""
    if not any(above.values()):
        return ""
    low, high = min(above.values()), max(above.values())
    ends = f"{low:.4g} to {high:.4g} {unit}".rstrip()
    return (
        f"recordings start {ends} from where the simulation does; "
        "each is compared from its own start (diagnose.initial_state: held)"
    )
