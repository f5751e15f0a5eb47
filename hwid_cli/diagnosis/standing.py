"""The drive that stands for a simulation with given parameters, and moves as it does.

docs/method_diagnosis.md, eq. (D30), (D31).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.diagnose import held_out_of
from hwid_cli.diagnosis.force_scale import force_in_newtons
from hwid_cli.diagnosis.input_lag import inputs_behind
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals, prepare
from hwid_cli.diagnosis.run_starts import Begun, begin
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator
from hwid_cli.diagnosis.stand_in import (
    error_of,
    force_beside,
    moved_as,
    standing_for,
    starts_with_a_jump,
    with_change,
)
from hwid_cli.diagnosis.stand_in_fit import fit_stand_in
from hwid_cli.diagnosis.tasks import RunTasks
from hwid_cli.records.axis import MotionUnits, way_unit
from hwid_cli.records.drive import LINE, StandIn
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.programs import SimulatorRun
from hwid_cli.records.recordings import Recording

# Share of the largest speed below which a machine is at rest, [-].
_AT_REST = 0.01


def its_own(simulator: Simulator) -> SimulationOptions:
    """What is known of any simulation.

    How a command goes on between samples is a matter of its own.
    """
    return SimulationOptions(hold=LINE, output=simulator.output)


def as_given(
    recordings: Sequence[Recording],
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
) -> Begun:
    """Recordings and what a simulation gives by itself, from where they start.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    options : DiagnoseOptions
        Which of them are held out: laws that need a reference count from the others.
    """
    held_out = held_out_of(recordings, options)
    problem = prepare(recordings, its_own(simulator), options, held_out)
    return begin(problem, simulator, options, CountedRuns(run_tasks))


def stand_in_for(begun: Begun, *, may_curve: bool = True) -> StandIn:
    """Plain drive that stands for a simulation that can be run.

    Parameters
    ----------
    may_curve : bool
        Whether its spring may be curved.
    """
    problem, runs, given = begun.problem, begun.runs, begun.given
    drive = _standing(runs, problem, given, may_curve=may_curve)
    return force_in_newtons(runs, problem.signals, given, runs.simulator.values, drive)


def outputs_of_stand_in(begun: Begun) -> dict[str, np.ndarray]:
    """What the drive that stands for a simulation says with what was added to it.

    All that can be said of one that cannot be run.

    Returns
    -------
    dict of str to ndarray, shape (n_samples,)
        By the names of the recordings.
    """
    values = begun.runs.simulator.values
    standing = standing_beside(begun.runs, begun.problem, begun.given, values)
    return begun.beside_recordings(
        [one.simulated for one in compared_as_given(standing)]
    )


def standing_beside(
    runs: Runs,
    problem: DiagnosisProblem,
    given: Sequence[SimulatorRun],
    values: Mapping[str, float],
) -> DiagnosisProblem:
    """The problem of the drive that stands for the simulation with these parameters.

    Parameters
    ----------
    given : sequence of SimulatorRun
        What the simulation gives with them.
    """
    simulator = runs.simulator
    drive = _standing(runs, problem, given)
    drive = force_in_newtons(runs, problem.signals, given, values, drive)
    way = way_unit(problem.unit) if drive.output == "velocity" else problem.unit
    force = problem.input_unit
    if simulator.capabilities.force:
        force = "N m" if way == "rad" else "N"
    drive = replace(
        drive,
        hold=problem.drive.hold,
        effects={k: dict(v) for k, v in simulator.effects.items()},
        own_units=MotionUnits(force, way, problem.input_unit),
    )
    standing = _with_stand_in(problem, drive, given)
    standing = replace(standing, drive=with_change(drive, simulator.change))
    if simulator.run is not None:
        return standing
    # What a lag of the input does is known, and no error of the drive behind it.
    behind = (
        inputs_behind(problem.signals, drive.lag_s, drive.hold)
        if drive.lag_s
        else problem.signals
    )
    return replace(standing, stand_in_error=error_of(drive, behind, given))


def _standing(
    runs: Runs,
    problem: DiagnosisProblem,
    given: Sequence[SimulatorRun],
    *,
    may_curve: bool = True,
) -> StandIn:
    """The stand-in, with where laws count from."""
    simulator = runs.simulator
    comes_through_input = not simulator.capabilities.force
    return replace(
        fit_stand_in(
            problem.signals,
            given,
            may_curve=may_curve,
            may_lag=comes_through_input,
            hold=problem.drive.hold,
        ),
        reference_current_A=problem.drive.reference_current_A,
        reference_displacement_m=problem.drive.reference_displacement_m,
    )


def _runs(signals: Signals) -> bool:
    """Whether what is seen is the speed of a machine that runs when a recording begins."""
    if not signals.is_velocity or signals.own_start is None:
        return False
    speed = abs(signals.own_start[1])
    return speed > _AT_REST * float(np.max(np.abs(signals.compared)))


def _with_stand_in(
    problem: DiagnosisProblem, drive: StandIn, given: Sequence[SimulatorRun]
) -> DiagnosisProblem:
    """The problem of a drive that moves as the simulation did."""
    plain, signals, jumps = replace(drive, effects={}), [], []
    for one, found in zip(problem.signals, given, strict=True):
        moved = moved_as(one, found)
        force = force_beside(plain, one, moved)
        signals.append(standing_for(one, found, plain, force))
        jumps.append(starts_with_a_jump(plain, one, force, moved) or _runs(signals[-1]))
    if any(jumps):
        # Starts are known of all recordings, or of none.
        signals = [replace(one, start=one.own_start) for one in signals]
    return replace(problem, signals=tuple(signals), drive=drive)
