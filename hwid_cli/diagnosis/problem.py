"""What a diagnosis works on: recordings, the drive, and what is compared."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hwid_cli.drive.effect import Scales, Wave
from hwid_cli.drive.simulation import refined
from hwid_cli.records.drive import Drive

# Share of the range of a signal below which a change is rest.
_REST = 1e-3


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
    output : ndarray, shape (n_samples,), [m]
    sample_time_s : float, [s]
    skip : int, [samples]
        First samples that are not judged.
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

    @cached_property
    def finely_driven_by(self) -> np.ndarray:
        """Input on a smooth curve, at more samples."""
        return refined(self.driven_by)

    @property
    def judged(self) -> slice:
        """Samples that are judged."""
        return slice(self.skip, None)

    @property
    def n_judged(self) -> int:
        """Number of samples that are judged."""
        return int(self.compared.size - self.skip)

    @cached_property
    def rest_position_m(self) -> float:
        """Mean of the output before the input first moves."""
        still = rest_length(self.driven_by)
        return float(np.mean(self.output[: max(1, still)]))


@dataclass(frozen=True, eq=False)
class Problem:
    """Recordings that one fit works on, and the drive that it starts from.

    Parameters
    ----------
    drive : Drive
        With the effects that its simulation already has.
    start : str
        One of ``records.drive.STARTS``: how recordings start.
    unit : str
        Of what is compared.
    """

    signals: tuple[Signals, ...]
    drive: Drive
    start: str = "rest"
    unit: str = "m"

    @property
    def compares_command(self) -> bool:
        """Whether the command is compared instead of the output."""
        return self.drive.controller is not None

    @property
    def n_judged(self) -> int:
        """Number of samples that are judged in all recordings."""
        return sum(one.n_judged for one in self.signals)

    def part(self, *, held_out: bool) -> "Problem":
        """Only the recordings that are held out, or only the others."""
        chosen = tuple(one for one in self.signals if one.is_held_out == held_out)
        return replace(self, signals=chosen)


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
        """Measured minus simulated, where it is judged."""
        return (self.signals.compared - self.simulated)[self.signals.judged]

    @property
    def rms(self) -> float:
        """RMS of the residual."""
        return float(np.sqrt(np.mean(np.square(self.residual))))


def rest_length(driven_by: np.ndarray) -> int:
    """Count the samples before an input first moves.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,)

    Returns
    -------
    int, [samples]
        The sample from which it moves counts as well: there it has not moved yet.
    """
    size = float(np.max(np.abs(driven_by - driven_by[0])))
    moved = np.flatnonzero(np.abs(driven_by - driven_by[0]) > _REST * size)
    return int(moved[0]) if moved.size else int(driven_by.size)


def scales(
    problem: Problem,
    velocities: Sequence[np.ndarray],
    frequencies_Hz: tuple[float, ...] = (),
    waves: tuple[Wave, ...] = (),
) -> Scales:
    """Sizes of what the recordings hold.

    Parameters
    ----------
    velocities : sequence of ndarray, [m/s]
        Of the base's simulation, one for each recording.
    frequencies_Hz : tuple of float, [Hz]
        Highest lines of the base's error.
    waves : tuple of Wave
        With which it repeats along the way.
    """
    drive, all_signals = problem.drive, problem.signals
    largest = [max(float(np.max(np.abs(one.output))) for one in all_signals)]
    current = max(float(np.max(np.abs(one.input))) for one in all_signals)
    stroke = max(float(np.ptp(one.output)) for one in all_signals)
    rate = max(
        float(np.max(np.abs(np.diff(one.input)))) / one.sample_time_s
        for one in all_signals
    )
    speed = max(float(np.nanmax(np.abs(one))) for one in velocities)
    duration = max(one.compared.size * one.sample_time_s for one in all_signals)
    natural = np.sqrt(drive.stiffness_N_per_m / drive.mass_kg) / (2 * np.pi)
    force = abs(drive.force_constant_N_per_A) * current
    if drive.resistance_ohm is not None:
        force /= drive.resistance_ohm
    return Scales(
        displacement_m=max(largest[0], 1e-12),
        velocity_m_per_s=max(speed, 1e-12),
        current_A=max(current, 1e-12),
        current_rate_A_per_s=max(rate, 1e-12),
        stroke_m=max(stroke, 1e-12),
        force_N=max(force, 1e-12),
        mass_kg=drive.mass_kg,
        natural_Hz=float(max(natural, 2.0 / duration)),
        sample_time_s=min(one.sample_time_s for one in all_signals),
        duration_s=duration,
        frequencies_Hz=frequencies_Hz,
        waves=waves,
    )
