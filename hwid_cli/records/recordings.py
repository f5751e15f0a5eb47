"""Measurements as records: what was read, what was calibrated, and what was changed."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.rules import SAMPLE_TIME, STORED_NUMBERS, Integer
from hwid_cli.records.shown import Shown
from hwid_cli.records.stored import ADDED_LATER

KINDS = ("step", "sine", "random", "other")


def frozen_vector(values: np.ndarray, name: str) -> np.ndarray:
    """Read-only 1-D float64 copy.

    Parameters
    ----------
    values : ndarray, shape (n,)
    name : str
        For the message.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    ValueError
        If the shape is another one.
    """
    vector = np.array(values, dtype=np.float64)
    if vector.ndim != 1:
        raise ValueError(f"{name} must be 1-D, got shape {vector.shape}")
    vector.setflags(write=False)
    return vector


@dataclass(frozen=True)
class SignalUnit:
    """In which unit a signal was, who says so, and what became of it.

    Parameters
    ----------
    role : str
        ``time``, ``input`` or ``output``.
    given : str
        Unit of the file's numbers; empty where nothing says it.
    said_by : str
        What says it: a key of the configuration, a name, a row, an attribute.
    unit : str
        Unit of the recording's numbers.
    factor : float, [unit/given]
        1 where nothing was converted.
    overruled : str
        What the file says instead; empty where it says the same, or nothing.
    """

    role: str
    given: str
    said_by: str
    unit: str
    factor: float = 1.0
    overruled: str = field(default="", metadata=ADDED_LATER)


@dataclass(frozen=True, eq=False, repr=False)
class RawRecording(Shown):
    """A measurement as the file holds it, before calibration.

    Parameters
    ----------
    name : str
        Unique within an experiment; the file name without its ending.
    input : ndarray, shape (n_input,), [input_unit]
    output : ndarray, shape (n_output,), [output_unit]
        May differ in length from the input until calibration cuts both.
    sample_time_s : float, [s]
    kind : str
        One of ``KINDS``.
    source : str
        The file it came from, for messages.
    sha256 : str
        Hash of the file's bytes, hexadecimal.
    reference : ndarray or None, [output_unit]
        What a controller was told to follow; as long as the input.
    units : tuple of SignalUnit
        Where the units come from.
    bridged_input, bridged_output : tuple of int, [samples]
        Where a straight line stands for a sample that the file does not have.
    """

    name: str
    input: np.ndarray
    output: np.ndarray
    sample_time_s: float
    kind: str = "other"
    source: str = ""
    sha256: str = ""
    input_unit: str = "A"
    output_unit: str = "m"
    reference: np.ndarray | None = None
    units: tuple[SignalUnit, ...] = ()
    bridged_input: tuple[int, ...] = ()
    bridged_output: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "input", frozen_vector(self.input, "input"))
        object.__setattr__(self, "output", frozen_vector(self.output, "output"))
        _freeze_reference(self)
        _check_common(self.kind, self.sample_time_s)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("name", repr(self.name)),
            ("kind", self.kind),
            ("samples", f"{self.input.size} every {self.sample_time_s:g} s"),
            ("input in", self.input_unit),
            ("output in", self.output_unit),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Shown):
    """A calibrated measurement: input and output of equal length, all finite.

    Parameters
    ----------
    name : str
        Unique within an experiment.
    input : ndarray, shape (n_samples,), [input_unit]
    output : ndarray, shape (n_samples,), [output_unit]
    sample_time_s : float, [s]
    kind : str
        One of ``KINDS``.
    sha256 : str
        Hash of the bytes of the file that it was read from; empty if from memory.
    reference : ndarray or None, shape (n_samples,), [output_unit]
        What a controller was told to follow; None for a drive without one.

    Raises
    ------
    ValueError
        If the lengths differ, a value is not finite, or the sample time is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> Recording("r1", np.ones(3), np.zeros(3), sample_time_s=1e-3).n_samples
    3
    """

    name: str
    input: Annotated[np.ndarray, STORED_NUMBERS]
    output: Annotated[np.ndarray, STORED_NUMBERS]
    sample_time_s: Annotated[float, SAMPLE_TIME]
    kind: str = "other"
    sha256: str = ""
    input_unit: str = "A"
    output_unit: str = "m"
    reference: Annotated[np.ndarray | None, STORED_NUMBERS] = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "input", frozen_vector(self.input, "input"))
        object.__setattr__(self, "output", frozen_vector(self.output, "output"))
        _freeze_reference(self)
        _check_common(self.kind, self.sample_time_s)
        if self.input.size != self.output.size:
            raise ValueError(
                f"recording {self.name!r}: input has {self.input.size} samples, "
                f"output {self.output.size}"
            )
        if not (np.isfinite(self.input).all() and np.isfinite(self.output).all()):
            raise ValueError(
                f"recording {self.name!r} holds values that are not finite"
            )

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return int(self.input.size)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("name", repr(self.name)),
            ("kind", self.kind),
            ("samples", f"{self.n_samples} every {self.sample_time_s:g} s"),
            ("input in", self.input_unit),
            ("output in", self.output_unit),
        )


# As many numbers as the largest array of a file may hold, 512 MB.
_COUNT = Integer(least=0, most=2**26)


@dataclass(frozen=True)
class CalibrationLog:
    """What calibration did to one recording.

    Parameters
    ----------
    steps : tuple of str
        The recipe's steps in the order in which they ran.
    first_sample : int, [samples]
        Index in the raw record of the first sample kept.
    n_samples : int, [samples]
        Samples kept.
    n_raw_input, n_raw_output : int, [samples]
        Lengths of the raw columns.
    input_offset, output_offset : float, [input unit], [output unit]
        What was subtracted; 0 where the recipe subtracts nothing.
    period_samples : float, [samples]
        Period found in a sine's input; 0 where the recipe needs none.
    repaired_input, repaired_output : tuple of int
        Indices in the raw record of single damaged or missing samples that were
        replaced.
    units : tuple of SignalUnit
        Where the units come from, and what was converted.
    removed : ndarray, shape (n_removed,), [input unit], then [output unit]
        What the recording does not hold any more, for the input and then for the output:
        what was cut before it and behind it, and the damaged samples.
    """

    name: str
    steps: tuple[str, ...]
    first_sample: Annotated[int, _COUNT]
    n_samples: Annotated[int, _COUNT]
    n_raw_input: Annotated[int, _COUNT]
    n_raw_output: Annotated[int, _COUNT]
    input_offset: float = 0.0
    output_offset: float = 0.0
    period_samples: float = 0.0
    repaired_input: tuple[int, ...] = field(default=())
    repaired_output: tuple[int, ...] = field(default=())
    units: tuple[SignalUnit, ...] = field(default=(), metadata=ADDED_LATER)
    removed: np.ndarray = field(
        default_factory=lambda: np.zeros(0), compare=False, metadata=ADDED_LATER
    )


def _freeze_reference(record: "RawRecording | Recording") -> None:
    if record.reference is None:
        return
    reference = frozen_vector(record.reference, "reference")
    if reference.size != record.input.size or not np.isfinite(reference).all():
        raise ValueError(
            f"recording {record.name!r}: reference must be finite and as long as the "
            f"input, {record.input.size} samples, got {reference.size}"
        )
    object.__setattr__(record, "reference", reference)


def _check_common(kind: str, sample_time_s: float) -> None:
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)}")
    if not (np.isfinite(sample_time_s) and sample_time_s > 0):
        raise ValueError(f"sample_time_s must be positive, got {sample_time_s!r}")


@dataclass(frozen=True, eq=False, repr=False)
class Calibrated(Shown):
    """Calibrated recordings, and what was done to each.

    Parameters
    ----------
    logs : tuple of CalibrationLog
        In the order of the recordings.
    key : str
        Key of the calibration that made them.
    """

    recordings: tuple[Recording, ...]
    logs: tuple[CalibrationLog, ...]
    key: str

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("recordings", str(len(self.recordings))),
            ("samples", str(sum(one.n_samples for one in self.recordings))),
        )
