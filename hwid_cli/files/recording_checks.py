"""What makes a measurement unusable, each with place, value, expectation, next step."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hwid_cli.errors import MeasurementError
from hwid_cli.files.columns import Column, FileColumns, place_of
from hwid_cli.records.experiment import CalibrateOptions, OrdersOptions
from hwid_cli.records.recordings import RawRecording

# Samples that must remain beyond the largest orders, to estimate anything at all.
SPARE_SAMPLES = 50


def check_numbers(path: Path, columns: FileColumns) -> None:
    """Refuse cells that hold no finite number.

    Parameters
    ----------
    path : Path
    columns : FileColumns

    Raises
    ------
    MeasurementError
        For the first such row.
    """
    for column in (columns.time, columns.input, columns.output, columns.reference):
        if column is None:
            continue
        if column.values.size == 0:
            raise MeasurementError(
                f"{path}: {column.title} has no values; expected a number in every "
                "row; name another column or leave the file out"
            )
        is_bad = ~np.isfinite(column.values)
        if is_bad.any():
            index = int(np.argmax(is_bad))
            raise MeasurementError(
                f"{place_of(path, column, index)}: {column.title} is "
                f"{_what_stands_there(column, index)}; expected a finite number; "
                "correct the row, or choose rows with recordings.first_sample and "
                "last_sample"
            )


def check_excitation(path: Path, columns: FileColumns) -> None:
    """Refuse a constant input or output.

    Parameters
    ----------
    path : Path
    columns : FileColumns

    Raises
    ------
    MeasurementError
        If one of the two never changes.
    """
    for column in (columns.input, columns.output):
        if np.ptp(column.values) == 0.0:
            raise MeasurementError(
                f"{path}: {column.title} is {column.values[0]:.9g} in all "
                f"{column.values.size} rows; expected a signal that changes; name "
                "another column or leave the file out"
            )


def check_length(path: Path, columns: FileColumns, orders: OrdersOptions) -> None:
    """Refuse a recording too short for the largest orders.

    Parameters
    ----------
    path : Path
    columns : FileColumns
    orders : OrdersOptions

    Raises
    ------
    MeasurementError
        If there are not more samples than ``max(nb) + max(nk) + nf`` plus
        ``SPARE_SAMPLES``.
    """
    samples = min(columns.input.values.size, columns.output.values.size)
    least = max(orders.nb) + max(orders.nk) + (orders.nf or 0) + SPARE_SAMPLES
    if samples <= least:
        raise MeasurementError(
            f"{path}: has {samples} samples; expected more than {least} for orders up "
            f"to nb {max(orders.nb)} and nk {max(orders.nk)}; use a longer recording "
            "or lower orders"
        )


def check_equal_lengths(
    path: Path, columns: FileColumns, kind: str, calibrate: CalibrateOptions
) -> None:
    """Refuse columns of different length that calibration will not cut.

    A reference goes with the input: both are commands of the same length.

    Parameters
    ----------
    path : Path
    columns : FileColumns
    kind : str
    calibrate : CalibrateOptions

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

    Raises
    ------
    MeasurementError
        For the first name that comes twice or holds a plus.
    """
    first: dict[str, Path] = {}
    for path, name in named:
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


def check_sample_times(recordings: Sequence[RawRecording], tolerance: float) -> None:
    """Refuse recordings of different sample times in one experiment.

    Parameters
    ----------
    recordings : sequence of RawRecording
    tolerance : float, [-]
        Share of the sample time by which two may differ.

    Raises
    ------
    MeasurementError
        For the first recording that differs from the first one of all.
    """
    for recording in recordings:
        common = recordings[0].sample_time_s
        if abs(recording.sample_time_s - common) > tolerance * common:
            raise MeasurementError(
                f"{recording.source}: has a sample time of "
                f"{recording.sample_time_s:.6g} s; expected {common:.6g} s as in "
                f"{recordings[0].source}, because models are discrete; make one "
                "experiment for each sample time"
            )


def _what_stands_there(column: Column, index: int) -> str:
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
