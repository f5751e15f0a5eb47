"""What a diagnosis works on: recordings, the drive, and what is compared."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy

from hwid_cli.diagnosis.differences import differences_rms
from hwid_cli.diagnosis.innovations import Whitening
from hwid_cli.diagnosis.rests import (
    position_of_rest,
    rest_length,
    with_level_of_rest,
)
from hwid_cli.drive.simulation import NO_FORCE, refined
from hwid_cli.records.axis import base_of, name_inside
from hwid_cli.records.drive import (
    LINE,
    SOURCES,
    UNSAID_HOLD,
    WINDING,
    Controller,
    Drive,
)
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording

# Samples that are not used are bridged for a filter up to so many from one that is: damage
# takes one or two, longer ones are sound and only not evaluated, [samples].
_BRIDGED = 2
# First samples that tell the command that a controller holds, [samples].
_FIRST_COMMANDS = 16
# That is clear beyond so many times its error, and this share of the command's range, [-].
_CLEARLY_HELD, _LEAST_HELD = 5.0, 0.02
# All move in one direction if the way back is no longer than this share of the way, [-].
_WAY_BACK = 0.05


class HasMotion(Protocol):
    """Position and velocity at every sample."""

    @property
    def position(self) -> np.ndarray:
        """Shape (n_samples,), [m]."""

    @property
    def velocity(self) -> np.ndarray:
        """Shape (n_samples,), [m/s]."""


@dataclass(frozen=True, eq=False)
class Signals:
    """One recording as a simulation needs it.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,)
        Command, or the reference under a controller.
    compared : ndarray, shape (n_samples,)
        Measured output, or the measured command under a controller.
    input : ndarray, shape (n_samples,)
        Measured command.
    output : ndarray, shape (n_samples,), [m] or [m/s]
    sample_time_s : float, [s]
    skip : int, [samples]
        First samples that are not evaluated.
    used : ndarray of bool, shape (n_samples,), or None
        Which of the others are; None means all.
    start : tuple of float, or None, [m], [m/s]
        Position and velocity at the first sample, where they are known; a search begins
        there where the problem estimates its starts.
    is_velocity : bool
        Whether the output is a velocity. What needs one or the other asks ``position``
        and ``velocity``.
    force : ndarray, shape (n_samples,) or (0,), [N]
        That acts on the mass beside the drive's own, for a drive that stands for another
        simulation.
    offset : ndarray, shape (n_samples,), or None
        What is added to the simulated output.
    own_start : tuple of float, or None, [m], [m/s]
        Where that simulation starts whatever acts on it, be it out of balance there; None
        if it starts in balance, or nothing is known of it.
    pushes : ndarray, shape (n_samples, n_free) or (0, 0), [N]
        Forces that move such a drive as parameters of that simulation do, each by about
        the noise; what is fitted beside them is as uncertain as they leave it.
    noise_filter : Whitening or None
        Takes out of what a simulation leaves what noise of the input has done.
    """

    name: str
    kind: str
    driven_by: np.ndarray
    compared: np.ndarray
    input: np.ndarray
    output: np.ndarray
    sample_time_s: float
    skip: int = 0
    is_held_out: bool = False
    used: np.ndarray | None = None
    start: tuple[float, float] | None = None
    is_velocity: bool = False
    force: np.ndarray = field(default_factory=lambda: NO_FORCE)
    offset: np.ndarray | None = None
    own_start: tuple[float, float] | None = None
    pushes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    noise_filter: Whitening | None = None

    @cached_property
    def position(self) -> np.ndarray:
        """Measured position, [m]; of a velocity the way since the first sample."""
        if not self.is_velocity:
            return self.output
        way = scipy.integrate.cumulative_trapezoid(
            self.output, dx=self.sample_time_s, initial=0.0
        )
        return np.asarray(way)

    @cached_property
    def velocity(self) -> np.ndarray:
        """Measured velocity, [m/s]; of a position with the noise of differences."""
        if self.is_velocity or self.output.size < 2:
            return self.output if self.is_velocity else np.zeros(self.output.size)
        return np.gradient(self.output, self.sample_time_s)

    def seen(self, motion: HasMotion) -> np.ndarray:
        """What a sensor without effects shows of a motion, [output unit]."""
        return motion.velocity if self.is_velocity else motion.position

    def left(self, simulated: np.ndarray) -> np.ndarray:
        """What a simulation leaves where it is evaluated, behind the filter if there is one.

        The filter sees all samples: what a gap hides of the noise's past would come back
        at its end. Single samples that are not used are bridged.

        Parameters
        ----------
        simulated : ndarray, shape (n_samples,), [output unit]
            Of what is compared.

        Returns
        -------
        ndarray, shape (n_evaluated,), [output unit]
        """
        residual = self.compared - simulated
        if self.noise_filter is None:
            return np.asarray(residual[self.evaluated])
        if self.used is not None:
            beside = np.convolve(self.used, np.ones(2 * _BRIDGED + 1), mode="same")
            known = self.used | (beside == 0)
            every = np.arange(residual.size)
            residual = np.interp(every, every[known], residual[known])
        return np.asarray(self.noise_filter(residual).values[self.evaluated])

    @cached_property
    def finely_driven_by(self) -> np.ndarray:
        """Input on a smooth curve, at more samples."""
        return refined(self.driven_by)

    @property
    def evaluated(self) -> slice | np.ndarray:
        """Samples that are evaluated, as an index."""
        if self.used is None:
            return slice(self.skip, None)
        return np.flatnonzero(self.used[self.skip :]) + self.skip

    @property
    def n_evaluated(self) -> int:
        """Number of samples that are evaluated."""
        if self.used is None:
            return int(self.compared.size - self.skip)
        return int(np.count_nonzero(self.used[self.skip :]))

    def repaired(self, driven_by: np.ndarray) -> "Signals":
        """Simulate with another input.

        Parameters
        ----------
        driven_by : ndarray, shape (n_samples,)
        """
        return replace(self, driven_by=driven_by)

    def only(self, used: np.ndarray) -> "Signals":
        """Evaluate no other samples than these.

        Parameters
        ----------
        used : ndarray of bool, shape (n_samples,)
        """
        both = used if self.used is None else used & self.used
        return replace(self, used=both)

    def part(self, first: int, last: int) -> "Signals":
        """Samples from the first one to the one before the last.

        Parameters
        ----------
        first, last : int, [samples]
        """
        rows = slice(first, last)
        return replace(
            self,
            driven_by=self.driven_by[rows].copy(),
            compared=self.compared[rows].copy(),
            input=self.input[rows].copy(),
            output=self.output[rows].copy(),
            force=self.force[rows].copy(),
            offset=None if self.offset is None else self.offset[rows].copy(),
            skip=min(max(self.skip - first, 0), last - first - 1),
            used=None if self.used is None else self.used[rows].copy(),
        )

    @cached_property
    def rest_position_m(self) -> float:
        """Level of the position before input or position first move; of a velocity 0."""
        if self.is_velocity:
            return 0.0
        return position_of_rest(self.driven_by, self.output)


@dataclass(frozen=True, eq=False)
class DiagnosisProblem:
    """Recordings that one fit works on, and the drive that it starts from.

    Parameters
    ----------
    drive : Drive
        With the effects that its simulation already has.
    start : str
        One of ``records.drive.STARTS``: how recordings start.
    unit : str
        Of what is compared.
    input_unit : str
        Of the recorded input.
    known : mapping of str to float, [-]
        Parameters of the base that may not move beyond this share of their value.
    stand_in_error : float, [output unit squared]
        Sum of squares by which a stand-in that no run corrects may be wrong about what
        lies between simulation and recordings.
    start_told_by : tuple of str
        Names of the recordings whose first samples have told how recordings start,
        where the configuration says otherwise.
    n_damaged : int, [samples]
        Left out as damage of the sensor.
    damaged : tuple of str
        Names of the recordings that hold them.
    may_be_held : bool
        Whether nobody has said how the command goes on between samples, so that the
        recordings may tell that it is held.
    command_tells_start : bool
        Whether the command that is compared shows where a recording starts better than
        the sensor does.
    loop_holds : bool
        Whether the sum of a controller holds a command when recordings begin, as against
        a weight.
    """

    signals: tuple[Signals, ...]
    drive: Drive
    start: str = "rest"
    unit: str = "m"
    input_unit: str = "A"
    known: Mapping[str, float] = field(default_factory=dict)
    stand_in_error: float = 0.0
    start_told_by: tuple[str, ...] = ()
    n_damaged: int = 0
    damaged: tuple[str, ...] = ()
    may_be_held: bool = False
    command_tells_start: bool = False
    loop_holds: bool = False

    @property
    def compares_command(self) -> bool:
        """Whether the command is compared instead of the output."""
        return self.drive.controller is not None

    @property
    def is_filtered(self) -> bool:
        """Whether noise of the input is taken out of what a simulation leaves."""
        return any(one.noise_filter is not None for one in self.signals)

    def without_filter(self) -> "DiagnosisProblem":
        """The same, judged by whole recordings as they are."""
        signals = tuple(replace(one, noise_filter=None) for one in self.signals)
        return replace(self, signals=signals)

    @property
    def has_starts(self) -> bool:
        """Whether it is known how each recording starts, exactly."""
        starts = [one.start for one in self.signals]
        are_given = bool(starts) and all(one is not None for one in starts)
        return are_given and self.start != "estimated"

    @property
    def n_evaluated(self) -> int:
        """Number of samples that are evaluated in all recordings."""
        return sum(one.n_evaluated for one in self.signals)

    @property
    def each_motion(self) -> np.ndarray:
        """Sum of squares of what is compared about the mean of each recording.

        Returns
        -------
        ndarray, shape (n_recordings,), [output unit squared]
        """
        parts = [one.compared[one.evaluated] for one in self.signals]
        return np.array([np.sum(np.square(one - one.mean())) for one in parts])

    @property
    def moves_one_way(self) -> bool:
        """Whether no recording goes back on more than a small share of the longest way."""
        ways = [_ways(one) for one in self.signals]
        return _is_one_way(max(up for up, _ in ways), max(down for _, down in ways))

    @property
    def way_without_return(self) -> float:
        """Longest way of a training recording, where none comes back on its own.

        In each of them place and time go together. 0 where one does, and of pieces of
        recordings.

        Returns
        -------
        float, [output unit]
        """
        train = [one for one in self.signals if not one.is_held_out]
        ways = [_ways(one) for one in train]
        are_whole = all(one.start is None for one in train)
        return (
            max(max(one) for one in ways)
            if ways and are_whole and all(_is_one_way(*one) for one in ways)
            else 0.0
        )

    @property
    def passes_once(self) -> bool:
        """Whether each place is passed once: what changes there may change in time."""
        train = self.part(held_out=False)
        return len(train.signals) == 1 and train.moves_one_way

    def part(self, *, held_out: bool) -> "DiagnosisProblem":
        """Only the recordings that are held out, or only the others."""
        chosen = tuple(one for one in self.signals if one.is_held_out == held_out)
        return replace(self, signals=chosen)


def _ways(signals: Signals) -> tuple[float, float]:
    """Longest ways up and down of a recording, [output unit]."""
    way = signals.position
    up = float(np.max(way - np.minimum.accumulate(way)))
    return up, float(np.max(np.maximum.accumulate(way) - way))


def _is_one_way(up: float, down: float) -> bool:
    return min(up, down) <= _WAY_BACK * max(up, down)


@dataclass(frozen=True, eq=False)
class Compared:
    """One recording beside its simulation.

    Parameters
    ----------
    simulated : ndarray, shape (n_samples,)
        Of what is compared.
    position, velocity : ndarray, shape (n_samples,), [m], [m/s]
        Of the simulation.
    """

    signals: Signals
    simulated: np.ndarray
    position: np.ndarray
    velocity: np.ndarray

    @property
    def residual(self) -> np.ndarray:
        """Measured minus simulated, where it is evaluated."""
        return (self.signals.compared - self.simulated)[self.signals.evaluated]

    @property
    def left(self) -> np.ndarray:
        """The same behind the filter for noise of the input, where there is one."""
        return self.signals.left(self.simulated)

    @property
    def rms(self) -> float:
        """RMS of the residual."""
        return float(np.sqrt(np.mean(np.square(self.residual))))


def prepare(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    held_out: Sequence[str],
) -> DiagnosisProblem:
    """Recordings as the fits need them, and the drive with its references.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one; with a reference each where the simulation has a controller.
    held_out : sequence of str
        Names of the recordings that are not trained on.
    """
    signals = tuple(_signals(one, simulation, options, held_out) for one in recordings)
    train = [one for one in signals if not one.is_held_out] or list(signals)
    drive = drive_of(simulation, train, recordings[0].input_unit)
    if "inductance_H" not in simulation.known:
        drive = _with_free_winding(drive)
    return DiagnosisProblem(
        signals,
        drive,
        _start_of(drive, options.initial_state),
        recordings[0].input_unit
        if simulation.controller is not None
        else recordings[0].output_unit,
        recordings[0].input_unit,
        {name_inside(name): share for name, share in simulation.known.items()},
        may_be_held=simulation.hold == UNSAID_HOLD and simulation.controller is None,
        command_tells_start=_command_tells_start(drive.controller, signals),
        loop_holds=_loop_holds(drive.controller, signals),
    )


def held_command(controller: Controller, signals: Signals) -> tuple[float, float]:
    """Command that the sum of a controller holds when a recording begins, and its error.

    Returns
    -------
    held, error : float, [input unit]
        From samples in which the reference has not moved yet, and few of these: a sum
        that was empty fills while a weight sinks.
    """
    count = min(max(rest_length(signals.driven_by), 1), _FIRST_COMMANDS)
    error = signals.driven_by[:count] - signals.output[:count]
    held = signals.compared[:count] - controller.at_once_per_position * error
    noise = differences_rms([signals.compared], 0.0)
    return float(held.mean()), noise / float(np.sqrt(count))


def _loop_holds(controller: Controller | None, all_signals: Sequence[Signals]) -> bool:
    """Whether a controller's sum is not empty when most recordings begin.

    One whose loop was closed with the recording begins with the command of its error.
    """
    if controller is None or not controller.has_sum:
        return False
    clear = []
    for one in all_signals:
        held, error = held_command(controller, one)
        least = max(_CLEARLY_HELD * error, _LEAST_HELD * float(np.ptp(one.compared)))
        clear.append(abs(held) > least)
    return 2 * sum(clear) > len(clear)


def _command_tells_start(
    controller: Controller | None, all_signals: Sequence[Signals]
) -> bool:
    """Whether a start that is off by the sensor's error shows in the command.

    The controller may read a better sensor than the one that is logged, or the same one
    with a noise that its command shows as well.
    """
    if controller is None or any(one.is_velocity for one in all_signals):
        return False
    at_rest = float(np.median([rest_length(one.driven_by) for one in all_signals]))
    sensor = differences_rms([one.output for one in all_signals], 0.0)
    command = differences_rms([one.compared for one in all_signals], 0.0)
    error = sensor / np.sqrt(max(at_rest, 1.0))
    return bool(controller.at_once_per_position * error > command)


def _with_free_winding(drive: Drive) -> Drive:
    """Drive whose inductance is an effect of the simulation, which a re-fit may move.

    An inductance that is off would be one that is missing.
    """
    if drive.inductance_H == 0 or WINDING in drive.effects:
        return drive
    effects = {**drive.effects, WINDING: {"inductance_H": drive.inductance_H}}
    return replace(drive, effects=effects, inductance_H=0.0)


def _start_of(drive: Drive, initial_state: str) -> str:
    """How recordings start; without a spring nothing pulls a drive that is held.

    Its zero would say nothing but where along the way forces repeat, which recordings of
    one sensor have in common.
    """
    is_free = drive.stiffness_N_per_m == 0 and drive.controller is None
    return "rest" if is_free and initial_state == "held" else initial_state


def drive_of(
    simulation: SimulationOptions, train: Sequence[Signals], input_unit: str = ""
) -> Drive:
    """Drive that a configuration describes.

    Parameters
    ----------
    input_unit : str
        Of the recordings; what is none of ``SOURCES`` stands for that of the simulation.
    train : sequence of Signals
        Training recordings, whose largest magnitudes are the references where the
        configuration gives none.
    """
    current = max(float(np.max(np.abs(one.input))) for one in train)
    # Of a voltage what it drives through the winding at rest: laws count currents.
    current /= simulation.resistance_ohm or 1.0
    displacement = max(float(np.max(np.abs(one.output))) for one in train)
    return Drive(
        effects=simulation.effects,
        reference_current_A=simulation.reference_current_A or current or 1.0,
        reference_displacement_m=simulation.reference_displacement_m
        or displacement
        or 1.0,
        resistance_ohm=simulation.resistance_ohm,
        inductance_H=simulation.inductance_H,
        hold=LINE if simulation.hold == UNSAID_HOLD else simulation.hold,
        controller=simulation.controller,
        output=simulation.output,
        input_unit=_source_unit(simulation, input_unit),
        **base_of(simulation),
    )


def _source_unit(simulation: SimulationOptions, unit: str) -> str:
    """Unit of the input; a circuit has a voltage at its input, whatever is written."""
    is_source = unit in SOURCES and simulation.resistance_ohm is None
    return unit if is_source else ""


def _signals(
    recording: Recording,
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    held_out: Sequence[str],
) -> Signals:
    driven_by, compared = recording.input, recording.output
    if simulation.controller is not None and recording.reference is not None:
        driven_by, compared = recording.reference, recording.input
    # Compiled loops tell read-only arrays apart: plain copies need one compilation.
    return Signals(
        name=recording.name,
        kind=recording.kind,
        driven_by=with_level_of_rest(driven_by),
        compared=np.array(compared),
        input=np.array(recording.input),
        output=np.array(recording.output),
        sample_time_s=recording.sample_time_s,
        skip=min(options.skip_samples, recording.n_samples - 1),
        is_held_out=recording.name in held_out,
        is_velocity=simulation.output == "velocity",
    )
