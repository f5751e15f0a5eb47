"""Columns of MAT, NPZ and HDF5 files.

A column is a named variable (row or column vector, ``a.b`` or ``a/b`` for a member of
a struct or group), or a numbered column of one table, the ``variable``. MATLAB's
version 7.3 files are HDF5 with every array transposed, which is undone here.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io

from hwid_cli.errors import MeasurementError
from hwid_cli.files.columns import ROLES, Column, FileColumns, array_column
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

# A file's variables by name; arrays are loaded only when they are asked for.
_Load = Callable[[], Any]
_Variables = Mapping[str, _Load]


def read_mat_columns(path: Path, columns: Columns) -> FileColumns:
    """Read input, output, time and reference from a MAT file of any version.

    Parameters
    ----------
    path : Path
    columns : Columns

    Returns
    -------
    FileColumns

    Raises
    ------
    MeasurementError
        If the file is damaged, a variable is missing or is no column of numbers.
    """
    if h5py.is_hdf5(path):
        return _from_hdf5(path, columns, is_transposed=True)
    return _pick(path, columns, _mat_variables(path))


def _mat_variables(path: Path) -> dict[str, _Load]:
    variables: dict[str, _Load] = {}
    for name, value in scipy.io.loadmat(path).items():
        if not name.startswith("__"):
            variables.update(_with_members(name, value))
    return variables


def read_npz_columns(path: Path, columns: Columns) -> FileColumns:
    """Read input, output, time and reference from an NPZ file.

    Parameters
    ----------
    path : Path
    columns : Columns

    Returns
    -------
    FileColumns

    Raises
    ------
    MeasurementError
        As for ``read_mat_columns``.
    """
    # np.load does not close a file that it cannot read.
    with path.open("rb") as file:
        content = np.load(file, allow_pickle=False)
        if not isinstance(content, np.lib.npyio.NpzFile):
            raise MeasurementError(
                f"{path}: holds a single array; expected an archive of named arrays; "
                "save it with numpy.savez"
            )
        return _pick(path, columns, {name: _item(content, name) for name in content})


def read_h5_columns(path: Path, columns: Columns) -> FileColumns:
    """Read input, output, time and reference from an HDF5 file.

    Parameters
    ----------
    path : Path
    columns : Columns

    Returns
    -------
    FileColumns

    Raises
    ------
    MeasurementError
        As for ``read_mat_columns``.
    """
    return _from_hdf5(path, columns, is_transposed=False)


def list_array_columns(path: Path) -> tuple[FoundColumn, ...]:
    """List the columns of numbers in a MAT, NPZ or HDF5 file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    tuple of FoundColumn
        Vectors and single numbers by their names, and columns of tables by number.
    """
    if h5py.is_hdf5(path):
        with h5py.File(path, "r") as file:
            is_mat = path.suffix.lower() == ".mat"
            return _list(_hdf5_variables(file, is_mat))
    if path.suffix.lower() == ".mat":
        return _list(_mat_variables(path))
    with np.load(path, allow_pickle=False) as content:
        return _list({name: _item(content, name) for name in content})


def _list(variables: _Variables) -> tuple[FoundColumn, ...]:
    found = []
    for name, load in variables.items():
        values = np.asarray(load())
        if values.dtype.kind not in "fiub" or values.size == 0:
            continue
        vector = np.squeeze(values)
        if vector.ndim <= 1:
            found.append(FoundColumn(name, name, np.atleast_1d(vector).astype(float)))
        elif values.ndim == 2 and values.shape[0] > values.shape[1]:
            found += [
                FoundColumn("", number, values[:, number].astype(float), name)
                for number in range(values.shape[1])
            ]
    return tuple(found)


def _from_hdf5(path: Path, columns: Columns, *, is_transposed: bool) -> FileColumns:
    with h5py.File(path, "r") as file:
        return _pick(path, columns, _hdf5_variables(file, is_transposed))


def _hdf5_variables(file: h5py.File, is_transposed: bool) -> dict[str, _Load]:
    separator = "." if is_transposed else "/"
    variables: dict[str, _Load] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            variables[name.replace("/", separator)] = _dataset(item, is_transposed)

    file.visititems(note)
    return variables


def _loader(value: Any) -> _Load:
    return lambda: value


def _item(content: Any, name: str) -> _Load:
    return lambda: content[name]


def _dataset(dataset: h5py.Dataset, is_transposed: bool) -> _Load:
    def load() -> Any:
        if is_transposed and dataset.attrs.get("MATLAB_class", b"double") in (
            b"char",
            b"cell",
        ):
            return np.array("text")
        values = dataset[()]
        return values.T if is_transposed and values.dtype.names is None else values

    return load


def _with_members(name: str, value: Any) -> dict[str, _Load]:
    """A MATLAB variable, and all that lies inside if it is a struct."""
    variables: dict[str, _Load] = {name: _loader(value)}
    for member in getattr(getattr(value, "dtype", None), "names", None) or ():
        variables.update(_with_members(f"{name}.{member}", _member(value, member)))
    return variables


def _member(value: np.ndarray, member: str) -> Any:
    """Member of a MATLAB struct; a struct array of one holds it in its only cell."""
    inner = value[member]
    return inner.flat[0] if inner.dtype == object and inner.size == 1 else inner


def _pick(path: Path, columns: Columns, variables: _Variables) -> FileColumns:
    found: dict[str, Column] = {}
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
        found[role] = array_column(f"{role} {key!r}", values)
    return FileColumns(**found)


def _is_group(name: str, variables: _Variables) -> bool:
    """Whether a name is only the first part of other names."""
    return name not in variables and any(
        other.startswith((f"{name}.", f"{name}/")) for other in variables
    )


def _variable(path: Path, name: str, variables: _Variables, role: str) -> Any:
    if name not in variables:
        raise MeasurementError(
            f"{path}: has no variable {name!r} for recordings.columns.{role}; "
            f"{did_you_mean(name, variables)}"
        )
    return variables[name]()


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
    source: tuple[_Variables, str],
) -> np.ndarray:
    variables, role = source
    members = getattr(getattr(table, "dtype", None), "names", None) or ()
    if key in members:
        values = _member(table, key)
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
