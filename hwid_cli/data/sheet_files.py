"""Columns of a spreadsheet: XLSX, XLS and ODS, by the library calamine.

A sheet is a table like a text file: names, units and settings may stand above the
numbers. Of several sheets ``recordings.columns.variable`` names one. A sheet may hold a
long table, too: its recordings stand behind the sheet's name where there are several.
"""

import datetime as dt
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import check_size
from hwid_cli.data.cells import is_stamp
from hwid_cli.data.columns import ROLES, MeasuredColumn
from hwid_cli.data.long_tables import (
    LongTable,
    columns_of_long,
    long_form_of,
    long_tables,
    pick_from_long,
)
from hwid_cli.data.table_columns import (
    ColumnParts,
    column_named,
    found_columns,
    titles_of,
    with_unit,
)
from hwid_cli.data.table_heads import TableHead, read_head
from hwid_cli.errors import MeasurementError
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

# Rows from which the form of a sheet is told.
_HEAD_ROWS = 1000
# A sheet with fewer rows of numbers is no measurement.
_FEWEST_ROWS = 10
# Cells of the largest sheet: a spreadsheet has a million rows, a measurement few columns.
_MOST_CELLS = 30_000_000


def read_sheet_columns(
    path: Path, columns: Columns, roles: Sequence[str] = ROLES
) -> Iterator[tuple[str, MeasuredColumn]]:
    """Read the columns of some roles from a spreadsheet.

    Raises
    ------
    MeasurementError
        If a sheet or column is missing, or a row has a number in two ways of writing.
    """
    wanted = {
        role: key for role in roles if (key := getattr(columns, role)) is not None
    }
    texts = [key for key in wanted.values() if isinstance(key, str)]
    names = _names(path)
    is_sheet = columns.variable in names
    sheets = _asked(path, columns.variable if is_sheet else None)
    tables = _long_tables(path, sheets, texts, is_named=is_sheet or len(sheets) > 1)
    if tables:
        yield from pick_from_long(str(path), columns, tables, roles)
        return
    if columns.variable is not None and not is_sheet:
        raise MeasurementError(
            f"{path}: has no sheet {columns.variable!r} for recordings.columns.variable; "
            f"{did_you_mean(columns.variable, names)}"
        )
    name, rows = next(iter(sheets.items()))
    head = read_head(_as_texts(rows[:_HEAD_ROWS]), wanted=texts)
    if head.body == min(len(rows), _HEAD_ROWS):
        raise MeasurementError(
            f"{path}: sheet {name!r} holds no rows of numbers; expected some; name "
            "another sheet in recordings.columns.variable, or leave the file out"
        )
    width = max(map(len, rows))
    place_of_names = f"{path}, row {max(head.name_row, 0) + 1}"
    places = {}
    for role, key in wanted.items():
        if isinstance(key, int) and key >= width:
            raise MeasurementError(
                f"{path}: has no column {key} for the {role}; expected a number from 0 "
                f"to {width - 1}; correct recordings.columns.{role}"
            )
        is_number = isinstance(key, int)
        places[role] = (
            key if is_number else column_named(key, head.names, role, place_of_names)
        )
    titles = titles_of(wanted, places)
    read = _read_body(path, rows, head, titles)
    for role, place in places.items():
        yield role, with_unit(path, read[place], role, head, place)


def list_sheet_columns(path: Path) -> Iterator[FoundColumn]:
    """List the columns of numbers of every sheet; of one sheet alone without its name."""
    found = {}
    sheets = _tables(path)
    if tables := _long_tables(path, sheets, is_named=len(sheets) > 1):
        yield from columns_of_long(tables)
        sheets = {}
    for name, rows in sheets.items():
        head = read_head(_as_texts(rows[:_HEAD_ROWS]))
        places = [one for one in range(max(map(len, rows))) if one not in head.texts]
        titles = {place: f"column {place}" for place in places}
        found[name] = (_read_body(path, rows, head, titles), head)
    for name, (read, head) in found.items():
        yield from found_columns(read, head, variable=name if len(found) > 1 else None)


def _long_tables(
    path: Path,
    sheets: Mapping[str, list[list[Any]]],
    wanted: Sequence[str] = (),
    *,
    is_named: bool,
) -> tuple[LongTable, ...]:
    """Tables of sheets whose rows name their signals; none where they do not.

    Parameters
    ----------
    wanted : sequence of str
        Columns that are asked for: where the head names them all, they are meant.
    is_named : bool
        Whether the name of a sheet stands in front of those of its recordings.
    """
    found = []
    for sheet, rows in sheets.items():
        head = read_head(_as_texts(rows[:_HEAD_ROWS])) if rows else None
        form = None if head is None else long_form_of(head.names, head.texts)
        is_wide = bool(wanted) and head is not None and set(wanted) <= set(head.names)
        if head is None or form is None or is_wide:
            continue
        read = _read_body(path, rows, head, {form.time: "time", form.value: "value"})
        tables = long_tables(
            head.names[form.time],
            (read[form.time], read[form.value]),
            partial(_words_of, rows),
            form,
        )
        for one in tables:
            parts = (sheet if is_named else "", one.name)
            found.append(replace(one, name="/".join(part for part in parts if part)))
    return tuple(found)


def _words_of(
    rows: Sequence[Sequence[Any]], places: Sequence[int], lines: np.ndarray
) -> dict[int, list[str]]:
    """Cells of columns of words in some rows, which count from 1, by column."""
    cells = [rows[line - 1] for line in lines.tolist()]
    return {
        place: [_as_text(row[place]) if place < len(row) else "" for row in cells]
        for place in places
    }


def _read_body(
    path: Path, rows: Sequence[Sequence[Any]], head: TableHead, titles: dict[int, str]
) -> dict[int, MeasuredColumn]:
    body = rows[head.body :]
    stamped = {
        place
        for place in titles
        if _mostly(is_stamp(str(row[place])) for row in body if place < len(row))
    }
    parts = ColumnParts(path, titles, stamped)
    kept = [(head.body + number, row) for number, row in enumerate(body, 1)]
    parts.add_cells(
        [(number, row) for number, row in kept if any(c != "" for c in row)]
    )
    return parts.columns()


def _mostly(flags: Iterator[bool]) -> bool:
    known = list(flags)
    return 2 * sum(known) > len(known)


def _asked(path: Path, name: str | None) -> dict[str, list[list[Any]]]:
    """The sheet that is asked for, else all that hold numbers."""
    found = _tables(path) if name is None else {name: _rows(path, name)}
    if found:
        return found
    raise MeasurementError(
        f"{path}: holds no sheet with numbers; expected one; export the measurement "
        "again or leave the file out"
    )


def _tables(path: Path) -> dict[str, list[list[Any]]]:
    """Rows of the sheets that hold numbers.

    A cover holds a date and a setting: beside a longer table it is none.
    """
    sheets = {name: _rows(path, name) for name in _names(path)}
    counts = {name: _rows_of_numbers(rows) for name, rows in sheets.items()}
    least = min(_FEWEST_ROWS, max(counts.values(), default=1)) or 1
    return {name: rows for name, rows in sheets.items() if counts[name] >= least}


def _rows_of_numbers(rows: Sequence[Sequence[Any]]) -> int:
    """Rows that follow a head; programs write numbers as text too ("0,5")."""
    texts = _as_texts(rows[:_HEAD_ROWS])
    return len(texts) - read_head(texts).body if texts else 0


def _names(path: Path) -> list[str]:
    from python_calamine import CalamineWorkbook

    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            check_size("the file", sum(one.file_size for one in archive.infolist()))
    with CalamineWorkbook.from_path(str(path)) as book:
        return list(book.sheet_names)


def _rows(path: Path, name: str) -> list[list[Any]]:
    """Cells of a sheet: numbers, and all else as text."""
    from python_calamine import CalamineWorkbook

    with CalamineWorkbook.from_path(str(path)) as book:
        sheet = book.get_sheet_by_name(name)
        if sheet.total_height * sheet.total_width > _MOST_CELLS:
            raise ValueError(
                f"sheet {name!r} has {sheet.total_height} rows of {sheet.total_width} "
                f"cells; at most {_MOST_CELLS} cells are read"
            )
        rows = sheet.to_python(skip_empty_area=False)
    return [[_cell(cell) for cell in row] for row in rows]


def _cell(cell: Any) -> float | str:
    if isinstance(cell, bool | int | float):
        return float(cell)
    if isinstance(cell, dt.datetime):
        return cell.isoformat(sep=" ")
    if isinstance(cell, dt.time):
        return cell.isoformat()
    if isinstance(cell, dt.timedelta):
        return cell.total_seconds()
    return str(cell).strip()


def _as_text(cell: Any) -> str:
    """Text of a cell; a sheet has no whole numbers, which count recordings."""
    return (
        str(int(cell)) if isinstance(cell, float) and cell.is_integer() else str(cell)
    )


def _as_texts(rows: Sequence[Sequence[Any]]) -> list[list[str]]:
    return [[str(cell) for cell in row] for row in rows]
