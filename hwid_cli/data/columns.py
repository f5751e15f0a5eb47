"""One column of a measurement file, with what is needed to name the row of a fault."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np


@dataclass(frozen=True, eq=False)
class MeasuredColumn:
    """Numbers of one column and the rows of the file that they stand in.

    Parameters
    ----------
    title : str
        How messages call it, such as ``input 'current_A'``.
    values : ndarray, shape (n,)
        NaN where the file holds no number.
    rows : ndarray of int, shape (n,)
        Row of each value as a reader of the file counts it.
    rows_from_zero : bool
        Whether that count starts at 0 (arrays) and not at 1 (lines of text).
    texts : mapping of int to str
        What stands in a row in place of a number.
    unit : str
        As the file says it; empty where it says none.
    unit_said_by : str
        What in the file says so, for messages.
    """

    title: str
    values: np.ndarray
    rows: np.ndarray
    rows_from_zero: bool = True
    texts: Mapping[int, str] = field(default_factory=dict)
    unit: str = ""
    unit_said_by: str = ""


@dataclass(frozen=True, eq=False)
class FileColumns:
    """The columns of one recording, as its file holds them.

    Parameters
    ----------
    input, output : Column
        May differ in length.
    reference : Column or None
        What a controller was told to follow.
    output_time : Column or None
        Where the output has a clock of its own.
    """

    input: MeasuredColumn
    output: MeasuredColumn
    time: MeasuredColumn | None = None
    reference: MeasuredColumn | None = None
    output_time: MeasuredColumn | None = None


# Names of the columns in ``FileColumns`` and in ``records.experiment.Columns``.
ROLES = ("input", "output", "time", "reference", "output_time")


def with_each(
    columns: FileColumns, change: Callable[[MeasuredColumn], MeasuredColumn]
) -> FileColumns:
    """Change every column that is there in the same way."""
    there = {role: getattr(columns, role) for role in ROLES}
    return FileColumns(
        **{role: change(one) for role, one in there.items() if one is not None}
    )


def array_column(
    title: str, values: np.ndarray, *, unit: str = "", unit_said_by: str = ""
) -> MeasuredColumn:
    """Make the column of an array; its rows are sample numbers from 0.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    # What is too large for 64 bits becomes infinite and is refused by the checks.
    with np.errstate(over="ignore"):
        numbers = np.asarray(values, np.float64)
    return MeasuredColumn(
        title, numbers, np.arange(values.size), unit=unit, unit_said_by=unit_said_by
    )


def keep_rows(column: MeasuredColumn, selection: slice) -> MeasuredColumn:
    """Keep a stretch of a column, together with the numbers of its rows."""
    return replace(column, values=column.values[selection], rows=column.rows[selection])


def block_means(column: MeasuredColumn, n: int) -> MeasuredColumn:
    """Replace each block of n values by its mean; an incomplete last block goes.

    Parameters
    ----------
    n : int, [samples]

    Returns
    -------
    Column
        With the row in which each block begins.
    """
    if n == 1:
        return column
    whole = column.values[: column.values.size // n * n].reshape(-1, n)
    return replace(
        column, values=whole.mean(axis=1), rows=column.rows[::n][: whole.shape[0]]
    )


def place_of(path: Path, column: MeasuredColumn, index: int) -> str:
    """Name the place of a value, for a message.

    Parameters
    ----------
    index : int
        Position in ``values``.

    Examples
    --------
    >>> column = array_column("input 'u'", np.zeros(3))
    >>> place_of(Path("run07.mat"), column, 2)
    'run07.mat, row 2 (counted from 0)'
    """
    counted = " (counted from 0)" if column.rows_from_zero else ""
    return f"{path}, row {int(column.rows[index])}{counted}"
