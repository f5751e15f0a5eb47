"""What makes a measurement unusable, each with place, value, expectation, next step."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hwid_cli.data.columns import ROLES, FileColumns, MeasuredColumn, place_of
from hwid_cli.data.missing_samples import is_over_range, missing
from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import name_fault, shown
from hwid_cli.records.experiment import (
    CalibrateOptions,
    OrdersOptions,
    RecordingsOptions,
)
from hwid_cli.records.recordings import RawRecording

# Samples that must remain beyond the largest orders, to estimate anything at all.
SPARE_SAMPLES = 50
# Names of files in a line that is about many.
_MOST_NAMES = 10
# Sizes whose squares, and those of their ratios, still are numbers of 64 bits.
_SMALLEST, _LARGEST = 1e-60, 1e60
# A picosecond, faster than any sampler; and thirty years.
_SHORTEST_S, _LONGEST_S = 1e-12, 1e9


def check_numbers(path: Path, columns: FileColumns, *, may_miss: bool = False) -> None:
    """Refuse cells that hold no finite number.

    Parameters
    ----------
    may_miss : bool
        Whether a signal may lack samples, as one that is resampled.
    """
    for role in ROLES:
        column = getattr(columns, role)
        if column is None:
            continue
        if column.values.size == 0:
            raise MeasurementError(
                f"{path}: {column.title} has no values; expected a number in every "
                "row; name another column or leave the file out"
            )
        is_bad = ~np.isfinite(column.values)
        if may_miss and role not in ("time", "output_time"):
            is_bad &= ~missing(column)
        if is_bad.any():
            index = int(np.argmax(is_bad))
            raise MeasurementError(
                f"{place_of(path, column, index)}: {column.title} is "
                f"{_what_stands_there(column, index)}{_run_of(column, index)}; expected "
                "a finite number; correct the row, or choose rows with "
                "recordings.first_sample and last_sample"
            )


def _run_of(column: MeasuredColumn, index: int) -> str:
    """What to say of many missing samples; a few are bridged."""
    lost = missing(column)
    if not lost[index]:
        return ""
    run = int(np.argmin(np.append(lost[index:], False)))
    if is_over_range(column, index):
        return (
            ": out of range, where a straight line would cut off the top (one sample "
            "alone is bridged)"
        )
    if run > 1:
        return f", as are {run} rows together (a few are bridged)"
    if lost.sum() > 1:
        return f", as are {int(lost.sum())} rows in all (up to 1 % are bridged)"
    return ""


def check_excitation(path: Path, columns: FileColumns) -> None:
    """Refuse a constant input or output."""
    for column in (columns.input, columns.output):
        if np.min(column.values) == np.max(column.values):
            raise MeasurementError(
                f"{path}: {column.title} is {column.values[0]:.9g} in all "
                f"{column.values.size} rows; expected a signal that changes; name "
                "another column or leave the file out"
            )


def check_sizes(path: Path, columns: FileColumns, options: RecordingsOptions) -> None:
    """Refuse signals too large or too small to compute with.

    Parameters
    ----------
    options : RecordingsOptions
        ``input_scale`` and ``output_scale``.

    Raises
    ------
    MeasurementError
        If a scaled signal goes beyond 1e60, or spans less than 1e-60.
    """
    for role in ("input", "output"):
        column, scale = getattr(columns, role), getattr(options, f"{role}_scale")
        with np.errstate(over="ignore", under="ignore"):
            scaled = column.values * scale
            sizes = (float(np.max(np.abs(scaled))), float(np.ptp(scaled)))
        if not _SMALLEST <= sizes[1] <= 2 * _LARGEST or sizes[0] > _LARGEST:
            raise MeasurementError(
                f"{path}: {column.title} reaches {sizes[0]:.3g} and spans "
                f"{sizes[1]:.3g}; expected numbers up to {_LARGEST:g} that span at "
                f"least {_SMALLEST:g}; choose a unit with recordings.{role}_scale"
            )


def check_clock(path: Path, step: float) -> None:
    """Refuse a sample time that no instrument has.

    Parameters
    ----------
    step : float, [s]
    """
    if not _SHORTEST_S <= step <= _LONGEST_S:
        raise MeasurementError(
            f"{path}: has a sample time of {step:.3g} s; expected {_SHORTEST_S:g} to "
            f"{_LONGEST_S:g} s; give time in seconds, or recordings.sample_time_s"
        )


class ShortRecordingError(MeasurementError):
    """A recording too short for the largest orders.

    Parameters
    ----------
    samples : int, [samples]
        That it has.
    expected : str
        How many it must have, and the next step.
    """

    def __init__(self, path: Path, samples: int, expected: str) -> None:
        super().__init__(f"{path}: has {samples} samples; {expected}")
        self.path, self.samples, self.expected = path, samples, expected


def short_recordings_line(short: Sequence[ShortRecordingError]) -> str:
    """Say of all recordings that are too short in one line that they are."""
    if len(short) == 1:
        return str(short[0])
    named = [f"{one.path.name} ({one.samples})" for one in short[:_MOST_NAMES]]
    more = len(short) - len(named)
    end = f" and {more} more" if more else ""
    expected = " / ".join(dict.fromkeys(one.expected for one in short))
    return (
        f"{short[0].path.parent}: {len(short)} recordings have too few samples, "
        f"{', '.join(named)}{end}; {expected}"
    )


def check_length(
    path: Path, columns: FileColumns, orders: OrdersOptions, *, longest_delay: int = 0
) -> None:
    """Refuse a recording too short for the largest orders.

    Parameters
    ----------
    longest_delay : int, [samples]
        That is tried beside those of the orders.

    Raises
    ------
    MeasurementError
        If there are not more samples than ``max(nb) + max(nk) + nf``, the delay and
        ``SPARE_SAMPLES``.
    """
    samples = min(columns.input.values.size, columns.output.values.size)
    least = max(orders.nb) + max(orders.nk) + (orders.nf or 0) + SPARE_SAMPLES
    least += longest_delay
    if samples <= least:
        delay = f" and a delay of {longest_delay}" if longest_delay else ""
        raise ShortRecordingError(
            path,
            samples,
            f"expected more than {least} for orders up to nb {max(orders.nb)} and nk "
            f"{max(orders.nk)}{delay}; use a longer recording or lower orders",
        )


def check_equal_lengths(
    path: Path, columns: FileColumns, kind: str, calibrate: CalibrateOptions
) -> None:
    """Refuse columns of different length that calibration will not cut.

    A reference goes with the input: both are commands of the same length.

    Raises
    ------
    MeasurementError
        If the lengths differ and the recipe of this kind has no ``cut``, or the
        reference has another length than the input.
    """
    n_input, n_output = columns.input.values.size, columns.output.values.size
    reference = columns.reference
    if reference is not None and reference.values.size != n_input:
        raise MeasurementError(
            f"{path}: {columns.input.title} has {n_input} values and {reference.title} "
            f"has {reference.values.size}; expected equal lengths; mend the file or "
            "leave out recordings.columns.reference"
        )
    if n_input != n_output and "cut" not in getattr(calibrate, kind):
        raise MeasurementError(
            f"{path}: {columns.input.title} has {n_input} values and "
            f"{columns.output.title} has {n_output}; expected equal lengths, because "
            f"the recipe calibrate.{kind} has no cut; add cut to it or mend the file"
        )


def check_names(named: Sequence[tuple[Path, str]]) -> None:
    """Refuse recordings of one name, and names that say group.

    Parameters
    ----------
    named : sequence of (Path, str)
        File and name of each recording.
    """
    first: dict[str, Path] = {}
    for path, name in named:
        fault = name_fault(name)
        if fault:
            raise MeasurementError(
                f"{path}: gives the recording name {shown(name)}; expected {fault}; "
                "rename the file"
            )
        if "+" in name:
            raise MeasurementError(
                f"{path}: gives the recording name {name!r}; expected a name "
                "without '+', which joins the names of a group; rename the file"
            )
        if name in first:
            raise MeasurementError(
                f"{path}: gives the recording name {name!r}, which "
                f"{first[name]} gives already; expected every name once; rename "
                "one file or add a pattern to recordings.exclude"
            )
        first[name] = path


def usual_clock(recordings: Sequence[RawRecording]) -> RawRecording:
    """Give a recording of the sample time that most have; of two the shorter one."""
    by_step = sorted(recordings, key=lambda one: one.sample_time_s)
    return by_step[(len(by_step) - 1) // 2]


def check_sample_times(recordings: Sequence[RawRecording], tolerance: float) -> None:
    """Refuse recordings of different sample times in one experiment.

    Parameters
    ----------
    tolerance : float, [-]
        As for ``check_sample_time``.
    """
    if recordings:
        usual = usual_clock(recordings)
        for recording in recordings:
            check_sample_time(recording, usual, tolerance)


def check_sample_time(
    recording: RawRecording, usual: RawRecording, tolerance: float
) -> None:
    """Refuse a recording whose sample time is not that of the others.

    Parameters
    ----------
    tolerance : float, [-]
        Share of the sample time by which the two may differ.
    """
    step, common = recording.sample_time_s, usual.sample_time_s
    if abs(step - common) > tolerance * common:
        raise MeasurementError(
            f"{recording.source}: has a sample time of {step:.6g} s; expected "
            f"{common:.6g} s as in {usual.source}, because models are discrete; put "
            f"all on the slower grid (recordings: sample_time_s: {max(step, common):.6g}, "
            "resample: true), or make one experiment for each sample time"
        )


def check_units(recordings: Sequence[RawRecording]) -> None:
    """Refuse recordings of different units in one experiment."""
    for recording in recordings:
        for side in ("input", "output"):
            found, common = (
                getattr(one, f"{side}_unit") for one in (recording, recordings[0])
            )
            if found != common:
                raise MeasurementError(
                    f"{recording.source}: has its {side} in {found!r}; expected "
                    f"{common!r} as in {recordings[0].source}; say what they are in with "
                    f"recordings.units.{side}, or make one experiment for each"
                )


def _what_stands_there(column: MeasuredColumn, index: int) -> str:
    text = column.texts.get(int(column.rows[index]))
    if text is None:
        value = column.values[index]
        return (
            "nan, which is not a number" if np.isnan(value) else f"{value} (infinite)"
        )
    if text == "":
        return "empty"
    shown = text if len(text) <= 40 else text[:37] + "..."
    return f"{shown!r}, which is not a number"
