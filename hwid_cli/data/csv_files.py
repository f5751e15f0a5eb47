"""Columns of a CSV file, as laboratories and spreadsheets write them.

Comma, semicolon or tab; decimal point or decimal comma; with or without a byte order
mark, header, quotes and comment lines. A row of units may stand below the header. Columns
may end early in blank cells.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hwid_cli.data.columns import ROLES, MeasuredColumn
from hwid_cli.data.units import bare_unit, looks_like_unit, unit_in_name
from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

# Semicolons and tabs come first: with decimal commas a comma is no separator.
_SEPARATORS = ("\t", ";", ",")
_COMMENT = "#"


@dataclass(frozen=True)
class _Sheet:
    """Rows of cells with the lines they stand in; ``comment`` is the last one above."""

    lines: list[int]
    rows: list[list[str]]
    comment: list[str]
    separator: str


def read_csv_columns(path: Path, columns: Columns) -> list[tuple[str, MeasuredColumn]]:
    """Read input, output, time and reference from a CSV file.

    Parameters
    ----------
    columns : Columns
        Header names, or 0-based numbers of columns.

    Returns
    -------
    list of (str, Column)
        With their roles; cells without a number are NaN and are refused by the checks.

    Raises
    ------
    MeasurementError
        If the file holds no rows, a column is missing, or a row has too many cells.
    """
    sheet = _read_sheet(path)
    wanted = {
        role: key for role in ROLES if (key := getattr(columns, role)) is not None
    }
    header, body = _split_header(sheet, list(wanted.values()))
    places = {
        role: _find(path, key, header, sheet, role) for role, key in wanted.items()
    }
    units = _unit_row(sheet, body)
    body += bool(units)
    if body == len(sheet.rows):
        raise MeasurementError(
            f"{path}: holds a header and no rows; expected rows of numbers; "
            "export the measurement again or leave the file out"
        )
    _check_widths(path, sheet, body)
    found = []
    for role, place in places.items():
        column = _column(path, f"{role} {wanted[role]!r}", sheet, body, place)
        title = header[place] if place < len(header) else ""
        found.append((role, _with_unit(path, column, role, title, units.get(place))))
    return found


def _unit_row(sheet: _Sheet, body: int) -> dict[int, str]:
    """Units by column, where the row above the numbers holds units and no number."""
    if body == len(sheet.rows):
        return {}
    cells = {place: cell for place, cell in enumerate(sheet.rows[body]) if cell}
    if any(_number(cell.replace(",", ".")) is not None for cell in cells.values()):
        return {}
    # 'second' is a unit and a word: most of the cells have to be units.
    known = [looks_like_unit(cell) for cell in cells.values()]
    if sum(known) * 2 < len(known) or not any(known):
        return {}
    return {place: bare_unit(cell) for place, cell in cells.items()}


def _with_unit(
    path: Path, column: MeasuredColumn, role: str, title: str, in_row: str | None
) -> MeasuredColumn:
    """Column with the unit that the row of units or its name says."""
    named = unit_in_name(title, "output" if role == "reference" else role)
    if in_row and named and in_row != named:
        raise MeasurementError(
            f"{path}: the name {title!r} says {named!r} and the row of units {in_row!r}; "
            f"expected one unit; say recordings.units.{role}, and mend the file"
        )
    if in_row:
        return replace(column, unit=in_row, unit_said_by="the row of units")
    said_by = f"the name {title!r}" if named else ""
    return replace(column, unit=named, unit_said_by=said_by)


def list_csv_columns(path: Path) -> tuple[FoundColumn, ...]:
    """List the columns of numbers in a CSV file.

    Returns
    -------
    tuple of FoundColumn
        Named by their header, or by their number where it is missing or not unique.

    Raises
    ------
    MeasurementError
        If the file holds no rows that can be told apart.
    """
    sheet = _read_sheet(path)
    cells = [cell for cell in sheet.rows[0] if cell]
    has_header = not any(_number(cell.replace(",", ".")) is not None for cell in cells)
    header = sheet.rows[0] if has_header else sheet.comment
    body = int(has_header)
    units = _unit_row(sheet, body)
    body += bool(units)
    found = []
    for place in range(len(sheet.rows[0])):
        column = _column(path, f"column {place}", sheet, body, place)
        title = header[place] if place < len(header) else ""
        is_name = bool(title) and header.count(title) == 1
        if np.isfinite(column.values).any():
            key = title if is_name else place
            unit = units.get(place, "")
            found.append(FoundColumn(title, key, column.values, unit=unit))
    return tuple(found)


def _read_sheet(path: Path) -> _Sheet:
    text = _decode(path.read_bytes())
    kept: list[str] = []
    comment = ""
    for line in io.StringIO(text, newline=""):
        is_comment = line.lstrip().startswith(_COMMENT)
        if is_comment and not any(part.strip() for part in kept):
            comment = line.lstrip().lstrip(_COMMENT).strip()
        kept.append("\n" if is_comment else line)
    separator = _separator(kept)
    reader = csv.reader(kept, delimiter=separator, skipinitialspace=True)
    lines, rows = [], []
    try:
        for cells in reader:
            row = [cell.strip() for cell in cells]
            if len(row) > 1 or any(row):
                lines.append(reader.line_num)
                rows.append(row)
    except csv.Error as error:
        raise MeasurementError(
            f"{path}, row {reader.line_num}: {error}; expected rows of numbers; "
            "look for a quote that is not closed"
        ) from None
    if not any(any(row) for row in rows):
        raise MeasurementError(
            f"{path}: holds no rows; expected rows of numbers; "
            "export the measurement again or leave the file out"
        )
    named = next(csv.reader([comment], delimiter=_separator([comment])), [])
    return _Sheet(lines, rows, [cell.strip() for cell in named], separator)


def _decode(content: bytes) -> str:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Old spreadsheets: only header names and units are affected.
        return content.decode("latin-1")


def _separator(lines: Sequence[str]) -> str:
    """Separator that occurs outside quotes in the first two lines with content."""
    bare = []
    for line in lines:
        if line.strip():
            bare.append("".join(line.split('"')[::2]))
        if len(bare) == 2:
            break
    for separator in _SEPARATORS:
        if bare and all(separator in line for line in bare):
            return separator
    return ","


def _split_header(sheet: _Sheet, keys: list[str | int]) -> tuple[list[str], int]:
    """Header cells (empty if there are none) and the position of the first row."""
    first = sheet.rows[0]
    names = {key for key in keys if isinstance(key, str)}
    if names:
        if not names <= set(first) and names <= set(sheet.comment):
            return sheet.comment, 0
        return first, 1
    cells = [first[key] for key in keys if isinstance(key, int) and key < len(first)]
    has_header = all(_number(cell.replace(",", ".")) is None for cell in cells)
    return (first, 1) if cells and has_header else ([], 0)


def _find(
    path: Path, key: str | int, header: list[str], sheet: _Sheet, role: str
) -> int:
    if isinstance(key, int):
        width = max(len(sheet.rows[0]), len(header))
        if key >= width:
            raise MeasurementError(
                f"{path}: has no column {key} for the {role}; expected a number from 0 "
                f"to {width - 1}; correct recordings.columns.{role}"
            )
        return key
    if header.count(key) > 1:
        raise MeasurementError(
            f"{path}, row {sheet.lines[0]}: column {key!r} occurs "
            f"{header.count(key)} times; expected it once; rename the others or give "
            f"its number in recordings.columns.{role}"
        )
    if key not in header:
        raise MeasurementError(
            f"{path}, row {sheet.lines[0]}: has no column {key!r} for the {role}; "
            f"{did_you_mean(key, [name for name in header if name])}"
        )
    return header.index(key)


def _check_widths(path: Path, sheet: _Sheet, body: int) -> None:
    width = len(sheet.rows[0])
    for line, row in zip(sheet.lines[body:], sheet.rows[body:], strict=True):
        if len(row) > width and any(row[width:]):
            raise MeasurementError(
                f"{path}, row {line}: has {len(row)} cells; expected {width} as in "
                f"row {sheet.lines[0]}; if commas are decimal, separate the columns "
                "by semicolons"
            )


def _column(
    path: Path, title: str, sheet: _Sheet, body: int, place: int
) -> MeasuredColumn:
    cells = [row[place] if place < len(row) else "" for row in sheet.rows[body:]]
    length = len(cells)
    while length and not cells[length - 1]:
        length -= 1
    del cells[length:]
    lines = np.array(sheet.lines[body : body + length], dtype=np.int64)
    if sheet.separator != ",":
        cells = _with_points(path, title, cells, lines)
    texts = {}
    values = np.empty(length)
    for index, cell in enumerate(cells):
        number = _number(cell)
        values[index] = np.nan if number is None else number
        if number is None:
            texts[int(lines[index])] = cell
    return MeasuredColumn(title, values, lines, rows_from_zero=False, texts=texts)


def _with_points(
    path: Path, title: str, cells: list[str], lines: np.ndarray
) -> list[str]:
    """Turn decimal commas into points; refuse a column that uses both."""
    commas = [index for index, cell in enumerate(cells) if "," in cell]
    points = [index for index, cell in enumerate(cells) if "." in cell]
    if commas and points:
        index = max(commas[0], points[0])
        raise MeasurementError(
            f"{path}, row {lines[index]}: {title} is {cells[index]!r}, while other "
            "rows use the other decimal mark; expected points or commas throughout; "
            "export without thousands separators"
        )
    return [cell.replace(",", ".") for cell in cells] if commas else cells


def _number(cell: str) -> float | None:
    """Read the number in a cell, or None; Python's own 1_000 is none in a file."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
