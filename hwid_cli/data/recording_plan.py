"""A plan of recordings that could be taken: a table, and the input of each row.

A row names a file that holds the input, or says how it is made: a step, a sine or a sweep.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from hwid_cli.data.formats import read_columns
from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import name_fault, shown
from hwid_cli.files.small_files import read_small_file
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Columns, RecordingsOptions
from hwid_cli.records.next import PlannedInput
from hwid_cli.records.units import behind

# What each kind needs besides its name.
KINDS = {
    "step": ("amplitude", "duration_s"),
    "sine": ("amplitude", "frequency_Hz", "duration_s"),
    "sweep": ("amplitude", "frequency_Hz", "last_frequency_Hz", "duration_s"),
}
COLUMNS = (
    "name", "file", "kind", "amplitude", "frequency_Hz", "last_frequency_Hz",
    "duration_s",
)  # fmt: skip
_FREQUENCIES = ("frequency_Hz", "last_frequency_Hz")
# A recording begins at rest for this share of it.
_REST = 0.05
# Samples of an input; a typing error in its duration must not fill the memory.
_MOST_SAMPLES = 5_000_000
# As of what was measured (docs/security.md).
_LARGEST = 1e60


def read_plan(
    path: Path, options: RecordingsOptions, sample_time_s: float, unit: str = ""
) -> tuple[PlannedInput, ...]:
    """Read a plan and make or read the input of every row.

    Parameters
    ----------
    options : RecordingsOptions
        Where a file has its input, and what it is multiplied by.
    sample_time_s : float, [s]
        Of the recordings; files of inputs must have it.
    unit : str
        Of the input, for words.

    Raises
    ------
    MeasurementError
        If the plan or a file cannot be read, is empty, or a column or value is none.
    """
    found: list[PlannedInput] = []
    for place, row in _rows(path):
        name = row["name"]
        fault = name_fault(name) if name else "it is empty"
        if fault:
            _refuse(place, "name", name, f"a name that can be a file: {fault}")
        if name in {one.name for one in found}:
            _refuse(place, "name", name, "a name that no row before has")
        if row["file"]:
            _refuse_others(place, row, ("name", "file"), "a row with a file")
            given = path.parent / row["file"]
            if not _is_file(given):
                expected = "a file with the input of a recording that could be taken"
                _refuse(place, "file", row["file"], expected)
            values = _input_of(given, options)
            found.append(PlannedInput(name, values, f"the input of {row['file']}"))
        else:
            found.append(_made(place, row, sample_time_s, behind(unit)))
    return tuple(found)


def _rows(path: Path) -> list[tuple[str, dict[str, str]]]:
    """Place and cells of every row; every known column is there."""
    wanted = "expected a table with the columns name and file, or name, kind, amplitude"
    try:
        text = read_small_file(path).decode("utf-8-sig", errors="replace")
        first = text.partition("\n")[0]
        # Spreadsheets of many countries write decimal commas between semicolons.
        mark = max(",;\t", key=first.count)
        reader = csv.DictReader(
            io.StringIO(text, newline=""), restkey="", delimiter=mark
        )
        names = [(one or "").strip() for one in reader.fieldnames or ()]
        rows = [(reader.line_num, row) for row in reader]
    except (OSError, csv.Error) as error:
        raise MeasurementError(
            f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}); "
            f"{wanted}; correct next.plan or the file"
        ) from error
    for name in names:
        if name not in COLUMNS:
            raise MeasurementError(
                f"{path}, row 1: unknown column {shown(name)}; "
                f"{did_you_mean(name, COLUMNS)}"
            )
    if "name" not in names or not rows:
        lacks = "has no column 'name'" if rows or not names else "has no rows"
        raise MeasurementError(
            f"{path}: {lacks if names else 'is empty'}; {wanted}, and a row for each "
            "recording that could be taken; add them"
        )
    cells = []
    for number, row in rows:
        tidy = {(key or "").strip(): _text(value) for key, value in row.items()}
        cells.append(
            (f"{path}, row {number}", {key: tidy.get(key, "") for key in COLUMNS})
        )
    return cells


def _text(value: object) -> str:
    return value.strip() if isinstance(value, str) else ""


def _refuse(place: str, column: str, found: str, expected: str) -> NoReturn:
    raise MeasurementError(
        f"{place}: {column}: found {shown(found)}; expected {expected}; correct the row"
    )


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:
        # Of a name that no file can have.
        return False


def _input_of(path: Path, options: RecordingsOptions) -> np.ndarray:
    columns = options.columns
    # Nobody knows the output yet: the input's column stands in for it.
    wanted = Columns(
        input=columns.input, output=columns.input, variable=columns.variable
    )
    values = read_columns(path, wanted).input.values
    if not values.size or not (np.abs(values) <= _LARGEST).all():
        raise MeasurementError(
            f"{path}: its input holds no numbers, or one that is not finite or beyond "
            f"{_LARGEST:g}; expected numbers only; correct the file"
        )
    n = values.size // options.average * options.average
    means = values[:n].reshape(-1, options.average).mean(axis=1)
    return np.asarray(means * options.input_scale)


def _made(place: str, row: Mapping[str, str], step_s: float, unit: str) -> PlannedInput:
    """An input that a row describes."""
    kind = row["kind"]
    if kind not in KINDS:
        expected = f"one of {', '.join(KINDS)}, or a file"
        _refuse(place, "kind", kind, expected)
    _refuse_others(place, row, ("name", "kind", *KINDS[kind]), f"a {kind}")
    amplitude = _number(place, row, "amplitude")
    given = {name: _number(place, row, name) for name in KINDS[kind][1:]}
    for name, value in given.items():
        if value <= 0.0:
            _refuse(place, name, row[name], "a number > 0")
        if name in _FREQUENCIES and value >= 0.5 / step_s:
            expected = f"less than half the sample rate, {0.5 / step_s:g} Hz"
            _refuse(place, name, row[name], expected)
    n = round(given["duration_s"] / step_s)
    if not 2 <= n <= _MOST_SAMPLES:
        expected = f"2 to {_MOST_SAMPLES} samples of {step_s:g} s"
        _refuse(place, "duration_s", row["duration_s"], expected)
    rest = max(1, round(_REST * n))
    time = step_s * np.arange(n - rest)
    if kind == "step":
        shape, words = np.ones(time.size), f"a step of {amplitude:g}{unit}"
    else:
        low = given["frequency_Hz"]
        high = given.get("last_frequency_Hz", low)
        phase = 2 * np.pi * (low * time + (high - low) * time**2 / (2 * time[-1]))
        shape = np.sin(phase)
        span = f"at {low:g} Hz" if high == low else f"from {low:g} to {high:g} Hz"
        words = f"a {kind} of {amplitude:g}{unit} {span}"
    values = np.concatenate([np.zeros(rest), amplitude * shape])
    return PlannedInput(row["name"], values, words)


def _refuse_others(
    place: str, row: Mapping[str, str], used: Sequence[str], what: str
) -> None:
    """Refuse a cell that says nothing of this row."""
    for name, text in row.items():
        if text and name not in used:
            _refuse(place, name, text, f"an empty cell: {what} has none")


def _number(place: str, row: Mapping[str, str], name: str) -> float:
    try:
        value = float(row[name].replace(",", "."))
    except ValueError:
        value = float("nan")
    if not abs(value) <= _LARGEST:
        _refuse(place, name, row[name], f"a finite number up to {_LARGEST:g}")
    return value
