"""What a model's recordings visited, and what is known of the error of its prediction."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.recordings import frozen_vector
from hwid_cli.records.rules import (
    STORED_CURVE,
    STORED_NUMBERS,
    STORED_OR_MISSING,
    ArrayOf,
)
from hwid_cli.records.stored import check_lengths


def frozen_matrix(values: np.ndarray, n_columns: int) -> np.ndarray:
    """Read-only 2-D float64 copy.

    Parameters
    ----------
    values : ndarray, shape (n, n_columns) or empty

    Returns
    -------
    ndarray, shape (n, n_columns)
    """
    matrix = np.array(values, dtype=np.float64).reshape(-1, n_columns)
    matrix.setflags(write=False)
    return matrix


@dataclass(frozen=True, eq=False)
class VisitedPlane:
    """Which values of a signal were visited, and at which rates.

    Parameters
    ----------
    edges : ndarray, shape (n_cells + 1,), [signal's unit]
        Of equal cells between the lowest and the highest value.
    lowest_rate, highest_rate : ndarray, shape (n_cells,), [signal's unit/sample]
        Of the samples in each cell; NaN in a cell without any.
    """

    edges: Annotated[np.ndarray, STORED_NUMBERS]
    lowest_rate: Annotated[np.ndarray, STORED_OR_MISSING]
    highest_rate: Annotated[np.ndarray, STORED_OR_MISSING]

    def __post_init__(self) -> None:
        for name in ("edges", "lowest_rate", "highest_rate"):
            object.__setattr__(self, name, frozen_vector(getattr(self, name), name))
        n_cells = self.edges.size - 1
        if n_cells < 1 or {self.lowest_rate.size, self.highest_rate.size} != {n_cells}:
            raise ValueError(f"{self.edges.size} edges need {n_cells} rates")


@dataclass(frozen=True, eq=False)
class Visited:
    """What the recordings of a model visited.

    Parameters
    ----------
    input, inner : VisitedPlane
        Of the input, and of the signal that reaches the output map.
    bands : ndarray, shape (n_bands,), [input unit]
        Largest local amplitude of the input in each octave, from Nyquist's frequency down.
    """

    input: VisitedPlane
    inner: VisitedPlane
    bands: Annotated[np.ndarray, STORED_NUMBERS]

    def __post_init__(self) -> None:
        object.__setattr__(self, "bands", frozen_vector(self.bands, "bands"))


@dataclass(frozen=True, eq=False)
class ModelTrust:
    """What is known of the error of a model's predictions.

    Parameters
    ----------
    steps : ndarray, shape (n_steps, n_parameters)
        Steps of one standard deviation in independent directions: the covariance of the
        parameters is ``steps.T @ steps``. Parameters are those of the input map, B, F
        without its first coefficient, and those of the output map.
    noise_rms : float, [output unit]
        What the model leaves of its own recordings.
    scale : float, [-]
        Half width of the band in standard deviations.
    judged_on : tuple of str
        Recordings that scale and scatter come from.
    scatter : float, [output unit]
        Between recordings: the median error on these.
    reason : str
        Why there are no steps, if so.
    gain : float, [-]
        Between recordings: the part of the error that grows with the output.
    parameters : tuple of str
        Names of the parameters of a simulation, ``owner.name``; none of a model.
    """

    visited: Visited
    steps: Annotated[np.ndarray, STORED_NUMBERS]
    noise_rms: float
    scale: float
    judged_on: tuple[str, ...]
    scatter: float = 0.0
    reason: str = ""
    gain: float = 0.0
    parameters: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n_columns = np.shape(self.steps)[-1] if np.size(self.steps) else 1
        object.__setattr__(self, "steps", frozen_matrix(self.steps, n_columns))


@dataclass(frozen=True, eq=False)
class Inside:
    """Which samples of a prediction lie inside what a model's recordings visited.

    Parameters
    ----------
    amplitude, rate, frequency : ndarray of bool, shape (n_samples,)
        By value and by rate of the input and of the inner signal, by octaves of the input.
    """

    amplitude: np.ndarray
    rate: np.ndarray
    frequency: np.ndarray

    @property
    def all(self) -> np.ndarray:
        """Samples that rest on data in every respect, shape (n_samples,)."""
        return self.amplitude & self.rate & self.frequency


@dataclass(frozen=True, eq=False)
class Band:
    """A prediction with its band of 90 %.

    Parameters
    ----------
    output, lower, upper : ndarray, shape (n_samples,), [output unit]
    """

    output: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    inside: Inside


@dataclass(frozen=True)
class RecordingTrust:
    """How a model's band did on a recording that its fit has not used.

    Parameters
    ----------
    inside_amplitude, inside_rate, inside_frequency, inside : float, [-]
        Shares of the samples inside what was visited; the last in every respect.
    coverage : float, [-]
        Share of the measured samples within the band.
    width, rmsd : float, [output unit]
        Mean width of the band; root mean square of the error.
    """

    model: str
    recording: str
    inside_amplitude: float
    inside_rate: float
    inside_frequency: float
    inside: float
    coverage: float
    width: float
    rmsd: float
    unit: str = field(default="m")


@dataclass(frozen=True, eq=False)
class ShownBand:
    """A prediction with its band beside what was measured.

    Parameters
    ----------
    time_s : ndarray, shape (n_samples,), [s]
    measured, output, lower, upper : ndarray, shape (n_samples,), [output unit]
    is_inside : ndarray of bool, shape (n_samples,)
        Whether a sample rests on data in every respect.
    """

    model: str
    recording: str
    time_s: Annotated[np.ndarray, STORED_NUMBERS]
    measured: Annotated[np.ndarray, STORED_CURVE]
    output: Annotated[np.ndarray, STORED_CURVE]
    lower: Annotated[np.ndarray, STORED_CURVE]
    upper: Annotated[np.ndarray, STORED_CURVE]
    is_inside: Annotated[np.ndarray, ArrayOf("b", "truth values")]
    unit: str

    def check_stored(self) -> None:
        """Refuse curves of different lengths.

        Raises
        ------
        ValueError
        """
        curves = ("measured", "output", "lower", "upper", "is_inside")
        check_lengths(self, "time_s", *curves)


@dataclass(frozen=True, eq=False)
class TrustOnTests:
    """How models and their bands did on the test recordings.

    Parameters
    ----------
    rows : tuple of RecordingTrust
        Model by model.
    shown : ShownBand or None
        Of the first model, on the test recording that its band holds worst.
    """

    rows: tuple[RecordingTrust, ...] = ()
    shown: ShownBand | None = None

    def check_stored(self) -> None:
        """Refuse a band of a model and a recording that no row is about.

        Raises
        ------
        ValueError
        """
        names = [(one.model, one.recording) for one in self.rows]
        if self.shown and (self.shown.model, self.shown.recording) not in names:
            told = f"{self.shown.model} on {self.shown.recording}"
            raise ValueError(f"shown: {told} has no row")
