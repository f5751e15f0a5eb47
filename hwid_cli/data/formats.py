"""Which reader serves which kind of measurement file: one table.

A new format is a file with its reader, and a line in ``READERS``; what else it touches is in
docs/architecture.md, "Where to touch what".
"""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import Variables, list_variables, pick_columns
from hwid_cli.data.arrow_files import open_arrow
from hwid_cli.data.columns import ROLES, FileColumns, MeasuredColumn
from hwid_cli.data.csv_files import list_csv_columns, read_csv_columns
from hwid_cli.data.hdf5_files import open_hdf5
from hwid_cli.data.json_files import open_json
from hwid_cli.data.mat_files import open_mat
from hwid_cli.data.mdf_files import open_mdf
from hwid_cli.data.npz_files import open_npz
from hwid_cli.data.packed import ending_of, is_packed
from hwid_cli.data.sheet_files import list_sheet_columns, read_sheet_columns
from hwid_cli.data.tdms_files import open_tdms
from hwid_cli.errors import MeasurementError, MissingLibraryError
from hwid_cli.files.isolated_process import (
    MOST_SECONDS,
    IsolatedReader,
    Labelled,
    serve,
)
from hwid_cli.files.messages import escaped, shown
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn


@dataclass(frozen=True)
class Reader:
    """How a kind of measurement file is read.

    Parameters
    ----------
    suffixes : tuple of str
        Endings of such files, in lower case.
    read : callable
        Gives the columns of some roles one by one.
    list_columns : callable
        Gives all columns of numbers, for ``hwid init``.
    needs : str
        Library to install beside hwid; empty for none.
    is_isolated : bool
        Whether a process of its own reads: for what a damaged file may crash.
    is_one_table : bool
        Whether columns of different length belong together.
    may_be_packed : bool
        Whether such a file may be packed by gzip.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path, Columns, Sequence[str]], Iterable[tuple[str, MeasuredColumn]]]
    list_columns: Callable[[Path], Iterable[FoundColumn]]
    needs: str = ""
    is_isolated: bool = False
    is_one_table: bool = False
    may_be_packed: bool = False


def _of_arrays(
    *suffixes: str,
    opened: Callable[[Path], AbstractContextManager[Variables]],
    needs: str = "",
    may_be_packed: bool = False,
) -> Reader:
    """Reader of files that hold arrays with names."""

    def read(
        path: Path, columns: Columns, roles: Sequence[str]
    ) -> Iterator[tuple[str, MeasuredColumn]]:
        with opened(path) as variables:
            yield from pick_columns(path, columns, variables, roles)

    def list_columns(path: Path) -> Iterator[FoundColumn]:
        with opened(path) as variables:
            yield from list_variables(variables)

    return Reader(
        suffixes,
        read,
        list_columns,
        needs,
        is_isolated=True,
        may_be_packed=may_be_packed,
    )


READERS = (
    Reader(
        (".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm", ".ascii", ".log", ".prn"),
        read_csv_columns,
        list_csv_columns,
        is_one_table=True,
        may_be_packed=True,
    ),
    _of_arrays(".mat", opened=open_mat),
    _of_arrays(".npz", opened=open_npz),
    _of_arrays(".h5", ".hdf5", opened=open_hdf5),
    Reader(
        (".xlsx", ".xlsm", ".xls", ".ods"),
        read_sheet_columns,
        list_sheet_columns,
        needs="python-calamine",
        is_isolated=True,
        is_one_table=True,
    ),
    _of_arrays(".jsonl", ".ndjson", ".json", opened=open_json, may_be_packed=True),
    _of_arrays(".tdms", opened=open_tdms, needs="npTDMS"),
    _of_arrays(".mf4", ".mdf", opened=open_mdf, needs="asammdf"),
    _of_arrays(".parquet", ".feather", ".arrow", opened=open_arrow, needs="pyarrow"),
)
SUFFIXES = tuple(suffix for reader in READERS for suffix in reader.suffixes)

# A library of a second takes this long where many programs want the processor.
_MOST_SECONDS_TO_LOAD = 20.0
# What else the process that reads says of a column.
_TOLD = ("title", "rows_from_zero", "unit", "unit_said_by")
_ISOLATED = IsolatedReader("hwid_cli.data.formats")


def has_reader(path: PurePath) -> bool:
    """Whether a reader knows a file by its ending."""
    try:
        reader_of(path)
    except MeasurementError:
        return False
    return True


def reader_of(path: PurePath) -> Reader:
    """Find the reader of a file by its ending.

    Raises
    ------
    MeasurementError
        If no reader knows it.
    """
    for reader in READERS:
        if ending_of(path) in reader.suffixes:
            if is_packed(path) and not reader.may_be_packed:
                raise MeasurementError(
                    f"{path}: is packed, and so are text and JSON read alone; expected "
                    "the file itself; unpack it"
                )
            return reader
    raise MeasurementError(
        f"{path}: has the ending {path.suffix!r}; expected one of "
        f"{', '.join(SUFFIXES)}; convert the file or leave it out"
    )


def read_columns(path: Path, columns: Columns) -> FileColumns:
    """Read the columns of a recording by the ending of its file.

    Parameters
    ----------
    columns : Columns
        Where they are in the file, and in which file the output is.

    Raises
    ------
    MeasurementError
        If the format is unknown, or a file is missing, empty, damaged or lacks a column.
    """
    if columns.output_file is None:
        return FileColumns(**_read_roles(path, columns, ROLES))
    own = _read_roles(path, columns, ("input", "time", "reference"))
    clock = columns.output_time if columns.output_time is not None else columns.time
    of_output = replace(columns, time=clock)
    other = _read_roles(
        output_file_of(path, columns.output_file), of_output, ("output", "time")
    )
    if "time" in other:
        other["output_time"] = other.pop("time")
    return FileColumns(**own, **other)


def output_file_of(path: Path, change: tuple[str, ...]) -> Path:
    """File that the output stands in, beside that of the input.

    Parameters
    ----------
    change : tuple of two str
        What the path of the input's file has, at last, and that of the output's file in
        its place.

    Raises
    ------
    MeasurementError
        If the path has nothing of it, or there is no such file.

    Examples
    --------
    >>> output_file_of(Path("/none/run_1_current.csv"), ("speed", "current"))
    Traceback (most recent call last):
    hwid_cli.errors.MeasurementError: /none/run_1_current.csv: has no 'speed' in its ...
    """
    here, there = change
    before, found, after = str(path).rpartition(here)
    if not found:
        raise MeasurementError(
            f"{path}: has no {here!r} in its name; expected it in that of every input's "
            f"file, with {there!r} in its place in that of the output's; correct "
            "recordings.files or recordings.columns.output_file"
        )
    other = Path(f"{before}{there}{after}")
    if not other.is_file():
        raise MeasurementError(
            f"{path}: the file of its output, {other}, is not there; expected one for "
            "each file of an input; put it there, or leave this one out with "
            "recordings.exclude"
        )
    return other


def _read_roles(
    path: Path, columns: Columns, roles: Sequence[str]
) -> dict[str, MeasuredColumn]:
    """Read the columns of some roles by the ending of a file."""
    reader = reader_of(path)
    try:
        if path.stat().st_size == 0:
            raise MeasurementError(
                f"{path}: is empty; expected a measurement; export it again or leave "
                "the file out"
            )
        with _importing(reader, path):
            if not reader.is_isolated:
                return dict(reader.read(path, columns, roles))
            replies = _asked(reader, path, columns, roles)
        return _with_rows(replies)
    except MeasurementError:
        raise
    # The readers of foreign formats raise whatever their parser stumbles on.
    except Exception as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> MeasurementError:
    said = escaped(" ".join(str(error).split())[:120]) or type(error).__name__
    return MeasurementError(
        f"{path}: cannot be read ({said}); expected a readable {path.suffix} file; "
        "export it again or leave it out"
    )


def list_columns(path: Path) -> tuple[FoundColumn, ...]:
    """List the columns of numbers in a measurement file, as ``FoundColumn`` names them.

    Raises
    ------
    Exception
        Whatever the reader stumbles on.
    """
    reader = reader_of(path)
    with _importing(reader, path):
        if not reader.is_isolated:
            return tuple(reader.list_columns(path))
        replies = _asked(reader, path)
    return tuple(
        FoundColumn(title, key, values, *about)
        for (title, key, *about), values in replies
    )


def tables_of(path: Path, columns: Columns) -> tuple[str, ...]:
    """Name the tables of a file that match ``columns.variable`` and hold its columns.

    A table is a sheet, a group, a struct, or an array with columns.

    Raises
    ------
    MeasurementError
        If the file cannot be read, or no table does.
    """
    wanted = (columns.input, columns.output)
    found: dict[str, set[str | int]] = {}
    try:
        listed = list_columns(path)
    except MeasurementError:
        raise
    # The readers of foreign formats raise whatever their parser stumbles on.
    except Exception as error:
        raise _unreadable(path, error) from error
    for one in listed:
        for key in wanted:
            if one.place == (one.variable, key) and one.variable is not None:
                found.setdefault(one.variable, set()).add(key)
            elif one.variable is None and str(one.key).endswith((f".{key}", f"/{key}")):
                table = str(one.key)[: -len(str(key)) - 1]
                found.setdefault(table, set()).add(key)
    pattern = columns.variable or "*"
    names = [
        name
        for name, keys in found.items()
        if set(wanted) <= keys and fnmatchcase(name, pattern)
    ]
    if not names:
        raise MeasurementError(
            f"{path}: has no table like {shown(pattern)} with {columns.input!r} and "
            f"{columns.output!r}; expected one for each recording; correct "
            "recordings.columns"
        )
    return tuple(names)


@contextmanager
def _importing(reader: Reader, path: Path) -> Iterator[None]:
    """Say which library is missing, and how to get it."""
    try:
        yield
    except ImportError as error:
        if not reader.needs:
            raise
        raise MissingLibraryError(
            f"{path}: is read by {reader.needs}, which is missing ({error}); expected it "
            f"to be installed; run: pip install 'hwid[formats]' (or {reader.needs} alone), "
            "or convert the file"
        ) from error


def _asked(
    reader: Reader,
    path: Path,
    columns: Columns | None = None,
    roles: Sequence[str] = ROLES,
) -> list[Labelled]:
    """Have the process of its own read, which may have to load a library first."""
    seconds = _MOST_SECONDS_TO_LOAD if reader.needs else 0.0
    return _ISOLATED.ask(
        _request(path, columns, roles), most_seconds=MOST_SECONDS + seconds
    )


def _request(
    path: Path, columns: Columns | None, roles: Sequence[str]
) -> dict[str, Any]:
    folder = "" if path.is_absolute() else os.getcwd()  # noqa: PTH109
    wanted = None if columns is None else asdict(columns)
    return {
        "folder": folder,
        "path": str(path),
        "columns": wanted,
        "roles": list(roles),
    }


def _answer(request: dict[str, Any]) -> Iterator[Labelled]:
    """What the process of its own gives: columns with roles, or all columns."""
    # Messages name the path as the program knows it.
    os.chdir(request["folder"] or "/")
    path = Path(request["path"])
    reader = reader_of(path)
    if request["columns"] is None:
        for one in reader.list_columns(path):
            yield [one.title, one.key, one.variable, one.unit, one.scale], one.values
    else:
        wanted = Columns(**request["columns"])
        for role, column in reader.read(path, wanted, request["roles"]):
            about = {name: getattr(column, name) for name in (*_TOLD, "texts")}
            yield [role, about], column.values
            yield [], column.rows


def _with_rows(replies: Iterable[Labelled]) -> dict[str, MeasuredColumn]:
    """Columns by role; behind the numbers of each stand their rows."""
    found = {}
    every = iter(replies)
    for (role, about), values in every:
        rows = next(every)[1].astype(np.int64)
        texts = {int(row): str(text) for row, text in about["texts"].items()}
        about = {name: about[name] for name in _TOLD}
        found[role] = MeasuredColumn(values=values, rows=rows, texts=texts, **about)
    return found


if __name__ == "__main__":
    serve(_answer)
