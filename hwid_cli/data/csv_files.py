"""Columns of a text file, as laboratories, instruments and spreadsheets write them.

Comma, semicolon, tab, bar or blanks; decimal point or decimal comma, marks between
thousands; with or without a byte order mark, preamble, header, quotes and comment lines.
A row of units may stand above the numbers, rows of text below them. Columns may end early
in blank cells. Times may be dates.

The file is read block by block: memory grows with the columns that are wanted, not with
the text.
"""

import codecs
import csv
import logging
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import chain, islice, repeat
from pathlib import Path
from typing import TextIO

import numpy as np

from hwid_cli.data.cells import is_stamp, is_word
from hwid_cli.data.columns import ROLES, MeasuredColumn
from hwid_cli.data.header_stamps import (
    joined_stamp,
    split_stamps,
    with_joined_stamps,
)
from hwid_cli.data.long_tables import (
    LongTable,
    columns_of_long,
    long_form_of,
    long_tables,
    pick_from_long,
)
from hwid_cli.data.packed import open_bytes, open_text
from hwid_cli.data.table_columns import (
    ColumnParts,
    begun_together,
    column_named,
    found_columns,
    titles_of,
    with_unit,
)
from hwid_cli.data.table_heads import TableHead, is_quantity, read_head
from hwid_cli.errors import MeasurementError, MissingColumnError
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

_log = logging.getLogger(__name__)

# Semicolons and tabs come first: with decimal commas a comma is no separator. The blank
# stands for any number of them.
_SEPARATORS = ("\t", ";", ",", "|", " ")
_COMMENT = "#"
# Lines from which the form of a file is told: no preamble that was met has more.
_HEAD_LINES = 1000
# Rows of plain numbers, at least, from which it is told where more of them follow.
_PLAIN_LINES = 24
# Lines that are taken at once.
_BLOCK_LINES = 4096
# Rows that end early are torn while they are fewer than this share, [-].
_MOST_TORN = 0.02
# Rows of values behind their names that are damaged and left out, at most, [-].
_MOST_DAMAGED = 0.02
# The csv module reads no longer cell, and says so.
_LONGEST_LINE = 2**16
_READ_BYTES = 2**20
# A value behind its name, in every row: u=0.5, or u:0.5 as small controllers print it.
_NAME_OF_VALUE = r"[^\W\d]\w*(?=[ ]*[:=])"
_NAMED_VALUE = rf"{_NAME_OF_VALUE}[ ]*[:=][ ]*[-+]?[.\d][^\s,;:=]*"
_NAMED_VALUES = re.compile(rf"\s*{_NAMED_VALUE}(?:[ ]*[,;\t ][ ]*{_NAMED_VALUE})+\s*")
_NAMES_OF_VALUES = re.compile(rf"(?<![^\s,;])({_NAME_OF_VALUE})[ ]*[:=][ ]*")
_QUOTED_OR_BARE = re.compile(r'"([^"]*)"|([^\s"]+)')


@dataclass(frozen=True)
class _Sheet:
    """The form of a file, told from its beginning.

    Parameters
    ----------
    rows : list of list of str
        Of the beginning.
    lines : list of int
        Line in which each of them ends.
    width : int
        Cells in the row of names, else in the first row of numbers.
    is_named : bool
        Whether each value stands behind its name.
    """

    path: Path
    encoding: str
    separator: str
    rows: list[list[str]]
    lines: list[int]
    head: TableHead
    width: int
    is_named: bool = False

    @property
    def first_line(self) -> int:
        """Lines in front of the numbers."""
        return self.lines[self.head.body - 1] if self.head.body else 0


# Forms by the lines that tell them: a folder has thousands of files of one form.
_forms: dict[tuple[tuple[str, ...], tuple[str, ...]], _Sheet] = {}
_MOST_FORMS = 64


def read_csv_columns(
    path: Path, columns: Columns, roles: Sequence[str] = ROLES
) -> list[tuple[str, MeasuredColumn]]:
    """Read the columns of some roles from a text file.

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
    wanted = {
        role: key for role in roles if (key := getattr(columns, role)) is not None
    }
    sheet = _read_sheet(path, [key for key in wanted.values() if isinstance(key, str)])
    tables = _long_tables(sheet, wanted)
    if tables:
        return pick_from_long(str(path), columns, tables, roles)
    stamps = split_stamps(sheet.head.names)
    split = {role: stamps[key] for role, key in wanted.items() if key in stamps}
    places = {
        role: _find(sheet, key, role)
        for role, key in wanted.items()
        if role not in split
    }
    if sheet.head.body == len(sheet.rows):
        raise MeasurementError(
            f"{path}: holds a header and no rows; expected rows of numbers; "
            "export the measurement again or leave the file out"
        )
    titles = titles_of(wanted, places)
    for role, pair in split.items():
        titles |= dict.fromkeys(pair, f"{role} {wanted[role]!r}")
    # Without a clock, nobody can tell whether a second head begins a second recording.
    read = _read_body(sheet, titles, keep_heads="time" not in wanted)
    read = begun_together(read, sheet.head)
    return [
        *(
            (role, with_unit(path, read[place], role, sheet.head, place))
            for role, place in places.items()
        ),
        *((role, joined_stamp(read[s], read[ns])) for role, (s, ns) in split.items()),
    ]


def list_csv_columns(path: Path) -> tuple[FoundColumn, ...]:
    """List the columns of numbers in a text file, and the sample times that it states.

    Returns
    -------
    tuple of FoundColumn
        Named by their header, or by their number where it is missing or not unique.

    Raises
    ------
    MeasurementError
        If the file holds no rows that can be told apart.
    """
    sheet = _read_sheet(path, [])
    head = sheet.head
    if head.body == len(sheet.rows):
        return ()
    if tables := _long_tables(sheet):
        return columns_of_long(tables)
    width = max(map(len, sheet.rows[head.body :]))
    places = [place for place in range(width) if place not in head.texts]
    read = _read_body(sheet, {place: f"column {place}" for place in places})
    read = begun_together(read, head)
    return with_joined_stamps(found_columns(read, head))


def _long_tables(
    sheet: _Sheet, wanted: Mapping[str, str | int] | None = None
) -> tuple[LongTable, ...]:
    """Tables of a file whose rows name their signals; none where they do not.

    Parameters
    ----------
    wanted : mapping of str to (str or int) or None
        Columns that are asked for: where the head names them all, they are meant.
    """
    head = sheet.head
    form = long_form_of(head.names, head.texts)
    asked = [] if wanted is None else list(wanted.values())
    if form is None or (asked and all(_is_in_head(key, head) for key in asked)):
        return ()
    read = _read_body(sheet, {form.time: "time", form.value: "value"})
    return long_tables(
        head.names[form.time],
        (read[form.time], read[form.value]),
        partial(_words_of, sheet),
        form,
    )


def _is_in_head(key: str | int, head: TableHead) -> bool:
    return isinstance(key, int) or key in head.names


def _words_of(
    sheet: _Sheet, places: Sequence[int], lines: np.ndarray
) -> dict[int, list[str]]:
    """Cells of columns of words in some lines, by column."""
    found: dict[int, list[str]] = {place: [] for place in places}
    wanted = iter(lines.tolist())
    line = next(wanted, None)
    with open_text(sheet.path, sheet.encoding) as file:
        for end, row in _cells_of(sheet.path, file, sheet.separator, 0):
            if end == line:
                for place in places:
                    found[place].append(row[place] if place < len(row) else "")
                line = next(wanted, None)
    return found


def _read_sheet(path: Path, wanted: Sequence[str]) -> _Sheet:
    """Find out the form of a file."""
    encoding = _encoding(path)
    with open_text(path, encoding) as file:
        lines = _telling(list(islice(file, _HEAD_LINES)))
    told_by = (tuple(lines), tuple(wanted))
    form = _forms.get(told_by)
    if form is None:
        form = _form_of(path, lines, wanted)
        if len(_forms) < _MOST_FORMS and sum(map(len, lines)) <= _LONGEST_LINE:
            _forms[told_by] = form
    return replace(form, path=path, encoding=encoding)


def _form_of(path: Path, lines: list[str], wanted: Sequence[str]) -> _Sheet:
    """Form of a file that begins with some lines."""
    names = _names_of_values(lines)
    lines = _without_names(lines) if names else lines
    separator = _separator(lines)
    rows, ends, comments = _rows(path, lines, separator)
    if not any(any(row) for number, row in enumerate(rows) if number not in comments):
        raise MeasurementError(
            f"{path}: holds no rows; expected rows of numbers; "
            "export the measurement again or leave the file out"
        )
    head = read_head(rows, wanted=wanted, comments=comments)
    if names:
        head = replace(head, names=names, name_row=-1)
    place = head.name_row if head.name_row >= 0 else min(head.body, len(rows) - 1)
    width = max(len(rows[place]), len(head.names))
    return _Sheet(path, "", separator, rows, ends, head, width, bool(names))


def _names_of_values(lines: Sequence[str]) -> tuple[str, ...]:
    """Names that stand in front of the values of most rows; none where they do not."""
    filled = [line for line in lines if line.strip()]
    lower = filled[len(filled) // 2 :]
    named = [line for line in lower if _NAMED_VALUES.fullmatch(line)]
    if not named or 2 * len(named) < len(lower):
        return ()
    return tuple(_NAMES_OF_VALUES.findall(named[0]))


def _without_names(lines: Sequence[str], *, keep_others: bool = True) -> list[str]:
    """Lines without the names in front of their values; others stay, or become blank."""
    return [
        _NAMES_OF_VALUES.sub("", line)
        if _NAMED_VALUES.fullmatch(line)
        else line
        if keep_others
        else "\n"
        for line in lines
    ]


def _count_damaged(lines: Sequence[str]) -> int:
    """Lines in which something else stands than values behind their names."""
    return sum(
        bool(line.strip())
        and not _is_comment(line)
        and not _NAMED_VALUES.fullmatch(line)
        for line in lines
    )


def _telling(lines: list[str]) -> list[str]:
    """Leave out the last lines of a beginning where they only go on as those above.

    What is left tells the same: its lower half, from which the form is told, consists of
    rows of as many plain numbers too. Which numbers tells nothing, so zeros stand for them:
    files of one logger are told alike.
    """
    if len(lines) <= _PLAIN_LINES:
        return lines
    mark = next((one for one in _SEPARATORS if one in lines[-1].strip()), None)
    if mark is None or len(lines[-1]) > _LONGEST_LINE:
        return lines
    width = len(_split(lines[-1].strip(), mark))
    rows = _plain_rows(mark, width)
    first = next(
        (n for n, line in enumerate(lines) if rows.fullmatch(line)), len(lines)
    )
    kept = 2 * first + _PLAIN_LINES
    if kept >= len(lines) or not rows.fullmatch("".join(lines[first:])):
        return lines
    return [*lines[:first], *[mark.join("0" * width) + "\n"] * (kept - first)]


@lru_cache(maxsize=32)
def _plain_rows(mark: str, count: int) -> re.Pattern[str]:
    """Lines of so many plain numbers; a comma is decimal where it separates nothing."""
    point = "[.,]" if mark in "\t;" else "[.]"
    number = rf"[-+]?(?:[0-9]++(?:{point}[0-9]*+)?|{point}[0-9]++)(?:[eE][-+]?[0-9]++)?"
    between = " ++" if mark == " " else f" *+{re.escape(mark)} *+"
    row = rf" *+{number}(?:{between}{number}){{{count - 1}}} *+"
    return re.compile(rf"(?:{row}(?:\r\n?|\n))*+(?:{row})?")


def _encoding(path: Path) -> str:
    """Encoding of a file: its mark, else UTF-8 where it is, else that of old Windows."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    with open_bytes(path) as file:
        begin = file.read(4)
        if begin.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return "utf-16"
        # Text of the West in two bytes a character, without its mark.
        if len(begin) == 4 and begin[1::2] == b"\0\0":
            return "utf-16-le"
        block = begin
        try:
            while block:
                decoder.decode(block)
                block = file.read(_READ_BYTES)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            # Only names of columns and units are affected.
            return "latin-1"
    return "utf-8-sig"


def _separator(lines: Sequence[str]) -> str:
    """Separator by which most cells of the last half of some lines are numbers."""
    plain = [line for line in lines if line.strip() and not _is_comment(line)]
    lower = plain[len(plain) // 2 :]

    def share(separator: str) -> float:
        cells = [cell for line in lower for cell in _split(line, separator)]
        filled = [cell for cell in cells if cell]
        if len(cells) < 2 * len(lower) or not filled:
            return 0.0
        return sum(map(is_quantity, filled)) / len(filled)

    # The first of those that are equally good; none is better than all cells.
    best, most = ",", 0.0
    for separator in _SEPARATORS:
        found = share(separator)
        if found > most:
            best, most = separator, found
        if most == 1.0:
            break
    if most > 0.0:
        return best
    bare = ["".join(line.split('"')[::2]) for line in plain[:2]]
    for separator in _SEPARATORS[:3]:
        if bare and all(separator in line for line in bare):
            return separator
    return ","


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        return _between_blanks(line)
    # A quote that is not closed, or a cell of any length, is told when it is read.
    if '"' not in line or len(line) > _LONGEST_LINE:
        return [cell.strip() for cell in line.split(separator)]
    row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in row]


def _between_blanks(line: str) -> list[str]:
    """Cells between any number of blanks; a cell in quotes may hold some."""
    if '"' not in line or len(line) > _LONGEST_LINE:
        return line.split()
    return [quoted or bare for quoted, bare in _QUOTED_OR_BARE.findall(line)]


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT)


def _rows(
    path: Path, lines: Sequence[str], separator: str
) -> tuple[list[list[str]], list[int], set[int]]:
    """Rows that are not blank, the line in which each ends, and which are comments.

    Comments count where they stand in front of everything else.
    """
    rows: list[list[str]] = []
    ends: list[int] = []
    for number, line in enumerate(lines, 1):
        if line.strip() and not _is_comment(line):
            break
        if _is_comment(line):
            rows.append(_split(line.strip().lstrip(_COMMENT).strip(), separator))
            ends.append(number)
    comments = set(range(len(rows)))
    for end, row in _cells_of(path, lines, separator, 0):
        rows.append(row)
        ends.append(end)
    if separator == " " and rows:
        width = len(rows[-1])
        for number, end in enumerate(ends):
            line = lines[end - 1].strip().lstrip(_COMMENT).strip()
            if len(rows[number]) == width + 1 and rows[number][0].endswith(":"):
                # A word in front says that names follow.
                rows[number] = rows[number][1:]
                continue
            # Names with single blanks inside stand further apart; units in brackets
            # belong to the name in front.
            for blanks in (r"\s{2,}", r"\s+(?![\[(])"):
                apart = re.split(blanks, line)
                if len(rows[number]) != width == len(apart):
                    rows[number] = apart
    return rows, ends, comments


def _cells_of(
    path: Path, lines: Iterable[str], separator: str, before: int
) -> Iterator[tuple[int, list[str]]]:
    """Rows of cells that are not blank, with the line in which each ends.

    Parameters
    ----------
    before : int
        Lines of the file in front of these.
    """
    if separator == " ":
        for number, line in enumerate(lines, before + 1):
            if line.strip() and not _is_comment(line):
                yield number, _between_blanks(line)
        return
    kept = ("\n" if _is_comment(line) else line for line in lines)
    reader = csv.reader(kept, delimiter=separator, skipinitialspace=True)
    try:
        for cells in reader:
            row = [cell.strip() for cell in cells]
            if len(row) > 1 or any(row):
                yield before + reader.line_num, row
    except csv.Error as error:
        raise MeasurementError(
            f"{path}, row {before + reader.line_num}: {error}; expected rows of numbers; "
            "look for a quote that is not closed"
        ) from None


def _find(sheet: _Sheet, key: str | int, role: str) -> int:
    """Number of the column that a key names."""
    header = list(sheet.head.names) or sheet.rows[0]
    if isinstance(key, int):
        width = max(
            len(sheet.rows[min(sheet.head.body, len(sheet.rows) - 1)]), sheet.width
        )
        if key >= width:
            raise MissingColumnError(
                f"{sheet.path}: has no column {key} for the {role}; expected a number "
                f"from 0 to {width - 1}; correct recordings.columns.{role}"
            )
        return key
    line = sheet.lines[max(sheet.head.name_row, 0)]
    return column_named(key, header, role, f"{sheet.path}, row {line}")


def _read_body(
    sheet: _Sheet, titles: dict[int, str], *, keep_heads: bool = False
) -> dict[int, MeasuredColumn]:
    """Read some columns of the numbers.

    Parameters
    ----------
    titles : dict of int to str
        How messages call each of them.
    keep_heads : bool
        Whether a head that comes again, further down, is a fault.
    """
    begins = {
        row[0] for row in sheet.rows[: sheet.head.body] if row and is_word(row[0])
    }
    if keep_heads:
        begins = set()
    parts = ColumnParts(sheet.path, titles, _stamped(sheet, titles))
    number, damaged = sheet.first_line, 0
    with open_text(sheet.path, sheet.encoding) as file:
        for _ in islice(file, number):
            pass
        while lines := list(islice(file, _BLOCK_LINES)):
            if sheet.is_named:
                # With a clock a damaged row is a sample lost.
                damaged += 0 if keep_heads else _count_damaged(lines)
                lines = _without_names(lines, keep_others=keep_heads)
            plain = _add_plain(sheet, lines, parts, number)
            number += plain
            lines = lines[plain:]
            if not lines:
                continue
            source = _Counted(lines, file)
            rows = _cells_of(sheet.path, source, sheet.separator, number)
            inside = _while_inside(rows, number + len(lines))
            block = [
                (end, row)
                for end, row in inside
                if row[0] not in begins and (keep_heads or not _is_title(row, sheet))
            ]
            _check_widths(sheet, block)
            is_cut = not lines[-1].endswith(("\n", "\r"))
            whole = _without_cut_row(block, sheet.width) if is_cut else block
            parts.add_cells(_without_torn_cells(whole, sheet.width))
            number += source.count
    _say_damaged(sheet.path, damaged, number - sheet.first_line)
    return parts.columns()


def _say_damaged(path: Path, damaged: int, n_rows: int) -> None:
    """Say how many damaged rows are left out; too many are no slips of a logger."""
    if damaged > _MOST_DAMAGED * n_rows:
        raise MeasurementError(
            f"{path}: {damaged} of {n_rows} rows are damaged; expected values behind "
            f"their names in all but {_MOST_DAMAGED:.0%} of them; record it again"
        )
    if damaged:
        _log.warning("%s: %d damaged rows are left out", path, damaged)


def _is_title(row: Sequence[str], sheet: _Sheet) -> bool:
    """Whether a row between numbers is the title of those below it."""
    return len(row) == 1 < sheet.width and is_word(row[0])


def _without_cut_row(
    block: list[tuple[int, list[str]]], width: int
) -> list[tuple[int, list[str]]]:
    """Rows without a last one that was still being written: it has no end, and few cells."""
    if len(block) < 2:
        return block
    (_, before), (_, last) = block[-2:]
    return block[:-1] if len(last) < width <= len(before) else block


def _without_torn_cells(
    block: Sequence[tuple[int, list[str]]], width: int
) -> list[tuple[int, list[str]]]:
    """Rows without the last number of those that end early, as a lost byte tears them.

    Of 92 a torn row has kept 9. Where many rows are short, a slow column has no cell in
    them; where all from one on are, a column has ended.
    """
    whole = [n for n, (_, row) in enumerate(block) if len(row) >= width]
    last = whole[-1] if whole else 0
    torn = [n for n, (_, row) in enumerate(block[:last]) if 1 < len(row) < width]
    if len(torn) > _MOST_TORN * len(block):
        return list(block)
    rows = list(block)
    for n in torn:
        line, row = rows[n]
        rows[n] = (line, [*row[:-1], ""])
    return rows


def _stamped(sheet: _Sheet, places: Iterable[int]) -> set[int]:
    """Columns of times of day."""
    body = sheet.rows[sheet.head.body :]

    def is_stamped(place: int) -> bool:
        cells = [row[place] for row in body if place < len(row) and row[place]]
        return 2 * sum(map(is_stamp, cells)) > len(cells)

    return {place for place in places if is_stamped(place)}


class _Counted:
    """Lines of a block, then those behind it as far as a quoted cell goes on."""

    def __init__(self, lines: Sequence[str], rest: TextIO) -> None:
        self._lines, self._rest = lines, rest
        self.count = 0

    def __iter__(self) -> Iterator[str]:
        for line in chain(self._lines, self._rest):
            self.count += 1
            yield line


def _while_inside(
    rows: Iterator[tuple[int, list[str]]], last: int
) -> Iterator[tuple[int, list[str]]]:
    """Rows up to the one that ends in a line or behind it."""
    for end, row in rows:
        yield end, row
        if end >= last:
            return


def _add_plain(
    sheet: _Sheet, lines: Sequence[str], parts: ColumnParts, before: int
) -> int:
    """Add the lines in front that hold nothing but numbers; how many these are.

    Parameters
    ----------
    before : int
        Lines of the file in front of these.
    """
    table = _plain_table(sheet, lines, parts)
    if table is not None:
        parts.add_numbers(before + 1, *table)
        return len(lines)
    half = len(lines) // 2
    # Which way of writing a column keeps to is told from whole blocks.
    if half < _PLAIN_LINES or not parts.are_known(".") or _may_be_grouped(sheet, lines):
        return 0
    first = _add_plain(sheet, lines[:half], parts, before)
    if first < half:
        return first
    return half + _add_plain(sheet, lines[half:], parts, before + half)


def _may_be_grouped(sheet: _Sheet, lines: Iterable[str]) -> bool:
    """Whether a comma may stand in a cell, or a cell in quotes go on in the next line."""
    text = "".join(lines)
    return '"' in text or (sheet.separator != "," and "," in text)


def _plain_table(
    sheet: _Sheet, lines: Sequence[str], parts: ColumnParts
) -> tuple[np.ndarray, str] | None:
    """Numbers of lines that hold nothing else, fast, and their decimal mark."""
    if parts.stamped or max(map(len, lines)) > _LONGEST_LINE:
        return None
    text = "".join(lines)
    if '"' in text or _COMMENT in text or not all(map(str.strip, lines)):
        return None
    mark = sheet.separator
    counts = set(map(str.count, lines, repeat(mark)))
    if mark != " " and (max(counts) >= max(sheet.width, 1) or len(counts) > 1):
        # Too many cells are a fault; a row with too few of them is torn.
        return None
    decimal = "," if mark != "," and "," in text else "." if "." in text else ""
    if decimal and not parts.are_decimal(decimal):
        return None
    if decimal == ",":
        if "." in text:
            return None
        lines = text.replace(",", ".").splitlines()
    try:
        table = np.loadtxt(
            lines,
            delimiter=None if mark == " " else mark,
            usecols=parts.places,
            comments=None,
            ndmin=2,
        )
    except ValueError:
        return None
    return table, decimal


def _check_widths(sheet: _Sheet, block: Sequence[tuple[int, list[str]]]) -> None:
    for line, row in block:
        if len(row) > sheet.width and any(row[sheet.width :]):
            place = sheet.head.name_row if sheet.head.name_row >= 0 else sheet.head.body
            raise MeasurementError(
                f"{sheet.path}, row {line}: has {len(row)} cells; expected "
                f"{sheet.width} as in row {sheet.lines[place]}; if commas are decimal, "
                "separate the columns by semicolons"
            )
