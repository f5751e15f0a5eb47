"""Columns of a table of cells, gathered block by block: text files and sheets alike."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hwid_cli.data.cells import (
    TwoWaysError,
    Writing,
    is_word,
    number_in,
    stamp_reader,
    writing_of,
)
from hwid_cli.data.columns import MeasuredColumn, keep_rows
from hwid_cli.data.table_heads import TableHead
from hwid_cli.data.units import unit_in_name
from hwid_cli.errors import MeasurementError, MissingColumnError
from hwid_cli.files.messages import is_plain, shown
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.starter import FoundColumn

# Rows of text below the numbers that are no part of them; more are a fault.
_MOST_TEXT_BELOW = 20
# Texts in place of numbers that are kept for messages, by column.
_MOST_TEXTS = 20_000


class ColumnParts:
    """Columns under way.

    Parameters
    ----------
    path : Path
        For messages.
    titles : mapping of int to str
        How messages call the columns, by number.
    stamped : collection of int
        Columns of dates or times of day.
    """

    def __init__(
        self, path: Path, titles: Mapping[int, str], stamped: Collection[int] = ()
    ) -> None:
        self.places = sorted(titles)
        self.stamped = frozenset(stamped)
        self._path, self._titles = path, titles
        self._blocks: dict[int, list[np.ndarray]] = {one: [] for one in self.places}
        self._rows: list[np.ndarray] = []
        self._texts: dict[int, dict[int, str]] = {one: {} for one in self.places}
        self._writing = dict.fromkeys(self.places, Writing())
        self._stamps = {place: stamp_reader() for place in self.stamped}
        self._ends = dict.fromkeys(self.places, 0)
        self._count = 0
        self._last_value = 0

    def are_decimal(self, mark: str) -> bool:
        """Whether all columns may write their numbers with this decimal mark alone.

        Those that have shown none are taken to, where others have.
        """
        found = set(self._writing.values())
        is_known = any(one.decimal for one in found) or mark == "."
        return is_known and found <= {Writing(), Writing(mark)}

    def are_known(self, mark: str) -> bool:
        """Whether all columns have shown this decimal mark alone."""
        return set(self._writing.values()) == {Writing(mark)}

    def add_numbers(self, first_row: int, table: np.ndarray, decimal: str) -> None:
        """Add rows of nothing but numbers.

        Parameters
        ----------
        first_row : int
            As a reader of the file counts it.
        table : ndarray, shape (n, n_columns)
        decimal : str
            Mark that some of them have; empty if none has one.
        """
        for place, one in self._writing.items():
            self._writing[place] = replace(one, decimal=one.decimal or decimal)
        self._count += table.shape[0]
        self._last_value = self._count
        self._rows.append(np.arange(first_row, first_row + table.shape[0]))
        for number, place in enumerate(self.places):
            self._blocks[place].append(table[:, number].copy())
            self._ends[place] = self._count

    def add_cells(self, rows: Sequence[tuple[int, Sequence[str | float]]]) -> None:
        """Add rows of cells, each with its number as a reader of the file counts it.

        Raises
        ------
        MeasurementError
            If a cell is written in another way than others of its column.
        """
        lines = np.array([line for line, _ in rows], dtype=np.int64)
        self._rows.append(lines)
        known = np.zeros(len(rows), dtype=bool)
        for place in self.places:
            cells = [row[place] if place < len(row) else "" for _, row in rows]
            values = self._numbers(place, cells, lines)
            self._blocks[place].append(values)
            known |= ~np.isnan(values)
            filled = [number for number, cell in enumerate(cells) if cell != ""]
            if filled:
                self._ends[place] = self._count + filled[-1] + 1
        if known.any():
            self._last_value = self._count + int(np.flatnonzero(known)[-1]) + 1
        self._count += len(rows)

    def columns(self) -> dict[int, MeasuredColumn]:
        """Give the columns; blank cells and rows of text at their ends are left out."""
        rows = np.concatenate([np.zeros(0, np.int64), *self._rows])
        self._rows.clear()
        is_text_below = self._count - self._last_value <= _MOST_TEXT_BELOW
        last = self._last_value if is_text_below and self._last_value else self._count
        last = min(self._above_footer(rows, last), self._below_clock(last))
        found = {}
        for place in self.places:
            values = np.concatenate([np.zeros(0), *self._blocks.pop(place)])
            end = min(self._ends[place], last)
            found[place] = MeasuredColumn(
                self._titles[place],
                values[:end],
                rows[:end],
                rows_from_zero=False,
                texts=self._texts[place],
                unit="s" if place in self.stamped else "",
                unit_said_by="its dates or times of day"
                if place in self.stamped
                else "",
            )
        return found

    def _above_footer(self, rows: np.ndarray, last: int) -> int:
        """Leave out last rows that begin with a word: a mean, a largest value."""
        texts = self._texts[self.places[0]] if self.places else {}
        first = last
        while first > 0 and is_word(texts.get(int(rows[first - 1]), "")):
            first -= 1
        return first if last - first <= _MOST_TEXT_BELOW else last

    def _below_clock(self, last: int) -> int:
        """Leave out a few last rows without a time of day, where the others have one."""
        ends = [
            int(np.flatnonzero(known)[-1]) + 1
            for place in self.stamped
            if (known := np.isfinite(np.concatenate(self._blocks[place]))).any()
        ]
        end = max(ends, default=last)
        return end if last - end <= _MOST_TEXT_BELOW else last

    def _numbers(
        self, place: int, cells: Sequence[str | float], lines: np.ndarray
    ) -> np.ndarray:
        if place in self.stamped:
            texts = [cell if isinstance(cell, str) else "" for cell in cells]
            values, others = self._stamps[place](texts)
            self._note(place, {int(lines[n]): text for n, text in others.items()})
            return values
        texts = [cell for cell in cells if isinstance(cell, str)]
        try:
            if len(texts) == len(cells):
                known = writing_of(texts, known=self._writing[place])
                self._writing[place] = known
            values, missed = _values(cells, self._writing[place])
        except TwoWaysError as error:
            number = int(error.args[0])
            raise MeasurementError(
                f"{self._path}, row {lines[number]}: {self._titles[place]} is "
                f"{shown(str(cells[number]))}, while other rows use the other decimal "
                "mark, or it can be read in two ways; expected points or commas "
                "throughout; export without thousands separators"
            ) from None
        self._note(place, {int(lines[n]): text for n, text in missed.items()})
        return values

    def _note(self, place: int, texts: Mapping[int, str]) -> None:
        room = _MOST_TEXTS - len(self._texts[place])
        self._texts[place].update(list(texts.items())[: max(room, 0)])


def _values(
    cells: Sequence[str | float], writing: Writing
) -> tuple[np.ndarray, dict[int, str]]:
    """Numbers of cells, NaN where there is none, and what stands there instead."""
    values = np.empty(len(cells))
    missed = {}
    for number, cell in enumerate(cells):
        if not isinstance(cell, str):
            values[number] = cell
            continue
        try:
            value = number_in(cell, writing)
        except TwoWaysError:
            raise TwoWaysError(number) from None
        values[number] = np.nan if value is None else value
        if value is None:
            missed[number] = cell
    return values, missed


def begun_together(
    read: Mapping[int, MeasuredColumn], head: TableHead
) -> dict[int, MeasuredColumn]:
    """Columns without what they hold before the last of them begins.

    Only where the head states when each begins, and how far its samples are apart: then no
    column of the file is a clock.
    """
    starts = [head.starts.get(place) for place in read]
    steps = {step_s for _, step_s in head.settings}
    known = [one for one in starts if one is not None]
    if len(known) < len(starts) or len(steps) != 1 or len(set(known)) < 2:
        return dict(read)
    (step_s,), last = steps, max(known)
    return {
        place: keep_rows(one, slice(round((last - start) / step_s), None))
        for (place, one), start in zip(read.items(), known, strict=True)
    }


def column_named(key: str, header: Sequence[str], role: str, place: str) -> int:
    """Number of the column of a name.

    Parameters
    ----------
    place : str
        File and row of the names, for messages.

    Raises
    ------
    MeasurementError
        If no column or several have it.
    """
    if header.count(key) > 1:
        raise MeasurementError(
            f"{place}: column {key!r} occurs {header.count(key)} times; expected it "
            "once; rename the others or give its number in "
            f"recordings.columns.{role}"
        )
    if key not in header:
        said = did_you_mean(key, [name for name in header if name])
        # A name that was nearly right says what to do by itself.
        step = "" if said.endswith("?") else "; name one of them, or rename the column"
        raise MissingColumnError(
            f"{place}: has no column {key!r} for the {role}; {said}{step}"
        )
    return header.index(key)


def titles_of(
    wanted: Mapping[str, str | int], places: Mapping[str, int]
) -> dict[int, str]:
    """How messages call columns; one with several roles goes by the first."""
    titles: dict[int, str] = {}
    for role, place in places.items():
        titles.setdefault(place, f"{role} {wanted[role]!r}")
    return titles


def with_unit(
    path: Path, column: MeasuredColumn, role: str, head: TableHead, place: int
) -> MeasuredColumn:
    """Column with the unit that the row of units or its name says."""
    title = head.names[place] if place < len(head.names) else ""
    of_role = {"reference": "output", "output_time": "time"}.get(role, role)
    named, in_row = unit_in_name(title, of_role), head.units.get(place, "")
    if in_row and named and in_row != named:
        raise MeasurementError(
            f"{path}: the name {title!r} says {named!r} and the row of units {in_row!r}; "
            f"expected one unit; say recordings.units.{role}, and mend the file"
        )
    if column.unit:
        return column
    if in_row:
        return replace(column, unit=in_row, unit_said_by="the row of units")
    said_by = f"the name {title!r}" if named else ""
    return replace(column, unit=named, unit_said_by=said_by)


def found_columns(
    read: Mapping[int, MeasuredColumn], head: TableHead, *, variable: str | None = None
) -> tuple[FoundColumn, ...]:
    """List columns of numbers, and the sample times that stand above them.

    Returns
    -------
    tuple of FoundColumn
        Named by their header, or by their number where it is missing or not unique.
    """
    found = []
    for place, column in sorted(read.items()):
        title = head.names[place] if place < len(head.names) else ""
        if np.isfinite(column.values).any():
            # A configuration takes no text with control characters.
            is_name = bool(title) and head.names.count(title) == 1 and is_plain(title)
            key = title if is_name else place
            unit = head.units.get(place, column.unit)
            scale = head.scales.get(place, 1.0)
            said = f"{title}: {head.said[place]}" if place in head.said else title
            found.append(FoundColumn(said, key, column.values, variable, unit, scale))
    for title, step_s in head.settings:
        found.append(FoundColumn(title, title, np.array([step_s]), variable, "s"))
    return tuple(found)
