"""Columns in files that hold arrays with names.

A column is a named variable (row or column vector, ``a.b`` or ``a/b`` for a member of
a struct or group), or a numbered column of one table, the ``variable``.
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.columns import ROLES, MeasuredColumn, array_column
from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

# 2^26 numbers of 8 bytes: eight times the longest recording that was measured, 8e6
# samples.
_MOST_BYTES = 2**29

# A file's variables by name; each is loaded when it is asked for.
Variables = Mapping[str, Callable[[], Any]]


def pick_columns(
    path: Path, columns: Columns, variables: Variables
) -> Iterator[tuple[str, MeasuredColumn]]:
    """Give the columns that are wanted, each with its role.

    Raises
    ------
    MeasurementError
        If a variable is missing or is no column of numbers.
    ValueError
        If one is too large.
    """
    table = None
    if columns.variable is not None and not _is_group(columns.variable, variables):
        table = _variable(path, columns.variable, variables, "variable")
    for role in ROLES:
        key = getattr(columns, role)
        if key is None:
            continue
        if isinstance(key, int):
            values = _numbered(path, columns.variable, table, key, role)
        else:
            values = _named(path, columns.variable, table, key, (variables, role))
        yield role, array_column(f"{role} {key!r}", values)


def list_variables(variables: Variables) -> Iterator[FoundColumn]:
    """List vectors and single numbers by name, columns of tables by number.

    Raises
    ------
    ValueError
        If a variable is too large.
    """
    for name, load in variables.items():
        values = np.asarray(_checked(name, load()))
        if values.dtype.kind not in "fiub" or values.size == 0:
            continue
        vector = np.squeeze(values)
        if vector.ndim <= 1:
            yield FoundColumn(name, name, np.atleast_1d(vector).astype(float))
        elif values.ndim == 2 and values.shape[0] > values.shape[1]:
            for number in range(values.shape[1]):
                yield FoundColumn("", number, values[:, number].astype(float), name)


def member_of(value: np.ndarray, member: str) -> Any:
    """Member of a MATLAB struct; a struct array of one holds it in its only cell.

    Parameters
    ----------
    value : ndarray, any shape
        Of records.
    """
    inner = value[member]
    return inner.flat[0] if inner.dtype == object and inner.size == 1 else inner


def check_size(name: str, size: int) -> None:
    """Refuse an array that is too large.

    Parameters
    ----------
    size : int, [bytes]
    """
    if size > _MOST_BYTES:
        raise ValueError(f"{name!r} unpacks to more than {_MOST_BYTES // 2**20} MB")


def _checked(name: str, value: Any) -> Any:
    check_size(name, getattr(value, "nbytes", 0))
    return value


def _is_group(name: str, variables: Variables) -> bool:
    """Whether a name is only the first part of other names."""
    return name not in variables and any(
        other.startswith((f"{name}.", f"{name}/")) for other in variables
    )


def _variable(path: Path, name: str, variables: Variables, role: str) -> Any:
    if name not in variables:
        raise MeasurementError(
            f"{path}: has no variable {name!r} for recordings.columns.{role}; "
            f"{did_you_mean(name, variables)}"
        )
    return _checked(name, variables[name]())


def _numbered(
    path: Path, variable: str | None, table: Any, key: int, role: str
) -> np.ndarray:
    if variable is None:
        raise MeasurementError(
            f"{path}: the {role} is column number {key} of no variable; expected "
            "recordings.columns.variable; name the table, or give the name of a vector"
        )
    shape = np.shape(table)
    _require_numbers(path, variable, table)
    if len(shape) != 2:
        raise MeasurementError(
            f"{path}: variable {variable!r} has shape {shape}; expected a table of "
            f"rows and columns; name vectors in recordings.columns.{role}"
        )
    if key >= shape[1]:
        raise MeasurementError(
            f"{path}: variable {variable!r} has {shape[1]} columns, so none with "
            f"number {key} for the {role}; expected a number from 0 to {shape[1] - 1}; "
            f"correct recordings.columns.{role}"
        )
    return table[:, key]


def _named(
    path: Path,
    variable: str | None,
    table: Any,
    key: str,
    source: tuple[Variables, str],
) -> np.ndarray:
    variables, role = source
    members = getattr(getattr(table, "dtype", None), "names", None) or ()
    if key in members:
        values = member_of(table, key)
    else:
        full = [f"{variable}{mark}{key}" for mark in "./"]
        name = next((name for name in full if name in variables), key)
        values = _variable(path, name, variables, role)
    _require_numbers(path, key, values)
    vector = np.squeeze(values)
    if vector.ndim > 1:
        raise MeasurementError(
            f"{path}: variable {key!r} has shape {np.shape(values)}; expected one row "
            "or one column; name it in recordings.columns.variable and give column "
            "numbers"
        )
    return np.atleast_1d(vector)


def _require_numbers(path: Path, name: str, values: Any) -> None:
    kind = getattr(getattr(values, "dtype", None), "kind", "O")
    if not isinstance(values, np.ndarray | np.generic) or kind not in "fiub":
        words = {"c": "complex numbers", "U": "text", "S": "text"}
        raise MeasurementError(
            f"{path}: variable {name!r} holds {words.get(kind, 'no plain numbers')}; "
            "expected an array of real numbers; name another variable"
        )
