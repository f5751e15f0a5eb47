"""The input that a prediction reads, and the file that it writes."""

import csv
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hwid_cli.data.columns import MeasuredColumn, keep_rows, place_of
from hwid_cli.data.formats import read_columns, tables_of
from hwid_cli.data.missing_samples import bridge_column
from hwid_cli.data.units import factor_between, in_unit, is_unitless
from hwid_cli.errors import ConfigError, MeasurementError, MissingColumnError
from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import Exported, ModelCard
from hwid_cli.records.next import PROPOSED_COLUMNS
from hwid_cli.records.trust import Band

_log = logging.getLogger(__name__)

# A time column may jitter by this share of a step, and differ so much in its mean step.
_TOLERANCE = 0.01
# Columns that say which samples of a prediction rest on data, and in which respect.
_KNOWN = ("value_known", "rate_known", "frequency_known")
# Names that are listed where one has to be chosen.
_LISTED = 3
# So much of a file's first line tells whether it is a prediction, [characters].
_LONGEST_HEADER = 10_000


@dataclass(frozen=True)
class InputSource:
    """Where a file holds the input, other than the model's own files do.

    Parameters
    ----------
    table : str or None
        Sheet, group, struct or array; None takes that of the model's own files, or the
        only one.
    input, time : str or None
        Columns by name, or by number as in a configuration.
    """

    table: str | None = None
    input: str | None = None
    time: str | None = None


def read_input(
    path: Path, exported: Exported, source: InputSource | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Read time and input as a model's file names them, or as they are named here.

    Parameters
    ----------
    path : Path
        CSV, MAT, NPZ or H5.
    source : InputSource or None
        Where they are in it; None as in the model's own files.

    Returns
    -------
    time : ndarray, shape (n_samples,), [s]
        Counted from zero where the model names no column of time.
    values : ndarray, shape (n_samples,)
        As they stand in the file, or in the unit of the files that the model was made
        of, where this file says another one.

    Raises
    ------
    MeasurementError
        If the file or a column is missing, a value no finite number, a unit none of what
        the model takes, the sample time another one than the model's, or it is open which
        of several tables is meant.
    """
    if not path.is_file():
        raise MeasurementError(
            f"{path}: no such file; expected measurements of the input; correct the path"
        )
    source = source or InputSource()
    columns, scale = _named_in(exported.card.columns, source), 1.0
    time_column, input_column = PROPOSED_COLUMNS
    asked = source in (InputSource(), InputSource(input=input_column))
    is_other = _named_in(exported.card.columns, InputSource()).input != input_column
    if asked and is_other and _is_proposed(path):
        # As `hwid next` writes it: in the unit that the model takes.
        columns = Columns(input=input_column, output=input_column, time=time_column)
        scale = exported.card.input_scale
    step = exported.sample_time_s
    # Nobody knows the output yet: the input's column stands in for it.
    wanted = Columns(
        input=columns.input,
        output=columns.input,
        time=columns.time,
        variable=columns.variable,
    )
    try:
        found = read_columns(path, _in_table(path, wanted, source.table))
    except MissingColumnError as error:
        raise MeasurementError(f"{error}{_other_names(columns, source)}") from None
    given, _ = bridge_column(path, found.input)
    _check_numbers(path, given)
    values = _as_in_its_files(path, given, exported.card) / scale
    if found.time is None:
        return step * np.arange(values.size), values
    n, time = values.size, _in_seconds(path, found.time, exported.card)
    if time.values.size < n:
        raise MeasurementError(
            f"{path}: {given.title} has {n} values and {time.title} "
            f"{time.values.size}; expected a time for each; fill or cut the columns"
        )
    # Raw measurements may go on with the output for a while.
    time = keep_rows(time, slice(n))
    _check_numbers(path, time)
    _check_steps(path, time, step)
    return time.values, values


def _is_proposed(path: Path) -> bool:
    """Whether a file holds an input that ``hwid next`` has proposed."""
    try:
        with path.open("rb") as file:
            first = file.readline(_LONGEST_HEADER)
    except OSError:
        return False
    return first.strip() == ",".join(PROPOSED_COLUMNS).encode()


def _named_in(columns: Columns, source: InputSource) -> Columns:
    def key(name: str) -> str | int:
        return int(name) if name.isdigit() else name

    if source.input is not None:
        columns = replace(columns, input=key(source.input))
    if source.time is not None:
        columns = replace(columns, time=key(source.time))
    return columns


def _other_names(columns: Columns, source: InputSource) -> str:
    """What to do where a column of the model's own files is missing."""
    if source.input is not None:
        return ""
    return (
        f"; the model's own files call the input {columns.input!r}: --input NAME says "
        "another name, --time NAME that of the time"
    )


def _in_table(path: Path, wanted: Columns, table: str | None) -> Columns:
    """The columns in one table of a file, where the model's own files held several."""
    if table is not None:
        return replace(wanted, variable=table)
    if "*" not in str(wanted.variable or ""):
        return wanted
    try:
        names = tables_of(path, wanted)
    except MeasurementError:
        # Without tables the columns stand alone.
        return replace(wanted, variable=None)
    if len(names) > 1:
        raise MeasurementError(
            f"{path}: holds {len(names)} tables with an input, {', '.join(names[:_LISTED])}"
            f"{', ...' * (len(names) > _LISTED)}; expected one; choose it with --table NAME"
        )
    return replace(wanted, variable=names[0])


def _as_in_its_files(path: Path, column: MeasuredColumn, card: ModelCard) -> np.ndarray:
    """Values of the input in the unit that the model's scale counts from."""
    known, unit = card.file_units, column.unit
    if known is None or not unit or is_unitless(unit):
        return column.values
    before = known.input
    if before is None and abs(card.input_scale) == 1.0:
        before = card.input_unit
    if before is None:
        # The scale was made for numbers without a unit.
        return column.values
    if factor_between(unit, before) is None:
        raise MeasurementError(
            f"{path}: {column.unit_said_by} says that {column.title} is in {unit!r}; "
            f"expected {before!r}, or a unit that goes into it, as the model was made "
            "with; correct the file"
        )
    if factor_between(unit, before) != 1.0:
        _log.warning(
            "%s: %s is in %s, as %s says; it is converted to %s, in which the model's own "
            "files are",
            path, column.title, unit, column.unit_said_by, before,
        )  # fmt: skip
    return np.asarray(in_unit(column.values, unit, before))


def _in_seconds(path: Path, time: MeasuredColumn, card: ModelCard) -> MeasuredColumn:
    if card.file_units is None:
        return time
    unit = time.unit or card.file_units.time or "s"
    if is_unitless(unit):
        return time
    if factor_between(unit, "s") is None:
        raise MeasurementError(
            f"{path}: {time.unit_said_by} says that {time.title} is in {unit!r}; "
            "expected a unit of time, such as s, ms or us; correct the file"
        )
    return replace(time, values=in_unit(time.values, unit, "s"))


def _check_numbers(path: Path, column: MeasuredColumn) -> None:
    if column.values.size == 0:
        raise MeasurementError(
            f"{path}: {column.title} holds no numbers; expected at least one; export "
            "the file again"
        )
    wrong = np.flatnonzero(~np.isfinite(column.values))
    if wrong.size:
        at = int(wrong[0])
        stands = column.texts.get(int(column.rows[at]), str(column.values[at]))
        raise MeasurementError(
            f"{place_of(path, column, at)}: {column.title} is {stands!r}; expected a "
            "finite number; correct the row"
        )


def _check_steps(path: Path, time: MeasuredColumn, step: float) -> None:
    """Refuse a file that is sampled otherwise than the model."""
    if time.values.size == 1:
        return
    steps = np.diff(time.values)
    median = float(np.median(steps))
    if abs(median - step) > _TOLERANCE * step:
        raise MeasurementError(
            f"{path}: {time.title} steps by {median:.6g} s; expected {step:.6g} s, the "
            "sample time of the model; resample the file"
        )
    off = np.abs(steps - step)
    if off.max() > _TOLERANCE * step:
        at = int(np.argmax(off))
        raise MeasurementError(
            f"{place_of(path, time, at + 1)}: {time.title} steps by {steps[at]:.6g} s; "
            f"expected {step:.6g} s throughout; cut the file there or resample it"
        )


def check_target(path: Path, read: Sequence[Path], *, is_forced: bool) -> None:
    """Refuse to write a prediction over a file that is none.

    Parameters
    ----------
    path : Path
        Of the prediction.
    read : sequence of Path
        Files that were read; they are never written.
    is_forced : bool
        Whether any other file may be replaced.

    Raises
    ------
    ConfigError
        If the folder is missing, or another file would be lost.
    """
    if not path.parent.is_dir():
        raise ConfigError(
            f"--out: found {path}, and there is no folder {path.parent}; expected a file "
            "in a folder that exists; make the folder or correct the path"
        )
    if not path.is_file():
        return
    if any(path.samefile(one) for one in read):
        raise ConfigError(
            f"--out: found {path}, which is read for the prediction; expected another "
            "file; choose one"
        )
    if not (is_forced or _is_prediction(path)):
        raise ConfigError(
            f"--out: found {path}, an existing file that is no prediction; expected a "
            "new file or an old prediction; choose another one, or replace it with --force"
        )


def _is_prediction(path: Path) -> bool:
    """Whether the first line is the header that ``write_prediction`` writes."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            names = next(csv.reader([file.readline(_LONGEST_HEADER)]), [])
    except (OSError, UnicodeDecodeError, csv.Error):
        return False
    if names[:1] + names[2:3] != ["time", "predicted"]:
        return False
    band = ["lower", "upper"]
    # With a band alone, as earlier versions wrote it, or with what rests on data.
    return names[3:] in (list[str](), band, [*band, *_KNOWN])


def write_prediction(
    path: Path,
    exported: Exported,
    time: np.ndarray,
    values: np.ndarray,
    predicted: np.ndarray,
    band: Band | None = None,
) -> None:
    """Write ``prediction.csv``.

    Parameters
    ----------
    exported : ExportedModel or ExportedSimulation
        Its file names the column of the input.
    time, values, predicted : ndarray, shape (n_samples,)
        Time [s], input as it was read, output [output unit].
    band : Band, optional
        Adds the columns ``lower`` and ``upper``, and of each sample whether recordings of
        the model were at its value, at its rate and that strong at its frequencies, 1 or 0.

    Raises
    ------
    CacheError
        If it cannot be written.
    """
    header = ["time", prediction_column(exported), "predicted"]
    signals = [time, values, predicted]
    if band is not None:
        where = band.inside
        known = (where.amplitude, where.rate, where.frequency)
        header += ["lower", "upper", *_KNOWN]
        signals += [band.lower, band.upper, *(one.astype(int) for one in known)]
    columns = (column.tolist() for column in signals)
    write_table_csv(path, header, zip(*columns, strict=True))


def prediction_column(exported: Exported) -> str:
    """Name of the input's column in ``prediction.csv``.

    Returns
    -------
    str
        ``input`` where the model's data have numbers for names.
    """
    name = exported.card.columns.input
    is_taken = name in ("time", "predicted", "lower", "upper", *_KNOWN)
    return name if isinstance(name, str) and not is_taken else "input"
