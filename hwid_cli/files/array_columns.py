"""Columns of MAT, NPZ and HDF5 files.

A column is a named variable (row or column vector, ``a.b`` or ``a/b`` for a member of
a struct or group), or a numbered column of one table, the ``variable``. MATLAB's
version 7.3 files are HDF5 with every array transposed, which is undone here.
"""

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import ZipFile

import h5py
import numpy as np
import scipy.io

from hwid_cli.errors import MeasurementError
from hwid_cli.files.array_bounds import check_archive, check_dataset
from hwid_cli.files.columns import ROLES, Column, FileColumns, array_column
from hwid_cli.files.mat_structure import check_mat
from hwid_cli.files.rehearsed_reading import rehearse
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Columns

_MATLAB_NUMBERS = {
    *(b"double", b"single", b"logical"),
    *(b"int8", b"int16", b"int32", b"int64"),
    *(b"uint8", b"uint16", b"uint32", b"uint64"),
}

# A file's variables by name; arrays are loaded only when they are asked for.
Load = Callable[[], Any]
_Variables = Mapping[str, Load]


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
    return _pick(path, columns, mat_variables(path))


def mat_variables(path: Path) -> dict[str, Load]:
    """Variables of a MAT file up to version 7, members of structs included.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict of str to callable
        Each gives its array.

    Raises
    ------
    ValueError
        If it holds what is no array of numbers, too much, or two of one name.
    """
    check_mat(path)
    with warnings.catch_warnings():
        # Such as two variables of one name: which one was meant?
        warnings.simplefilter("error")
        content = scipy.io.loadmat(path)
    variables: dict[str, Load] = {}
    for name, value in content.items():
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
        return _pick(path, columns, npz_variables(path, file))


def npz_variables(path: Path, file: BinaryIO) -> dict[str, Load]:
    """Arrays of an open NPZ file by their names.

    Parameters
    ----------
    path : Path
        For messages.
    file : binary file

    Returns
    -------
    dict of str to callable
        Each reads its array, as long as the file is open.

    Raises
    ------
    MeasurementError
        If it is no archive.
    ValueError
        If it unpacks to too much.
    """
    content = np.load(file, allow_pickle=False)
    if not isinstance(content, np.lib.npyio.NpzFile):
        raise MeasurementError(
            f"{path}: holds a single array; expected an archive of named arrays; "
            "save it with numpy.savez"
        )
    check_archive(ZipFile(file))
    return {name: _item(content, name) for name in content}


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


def _from_hdf5(path: Path, columns: Columns, *, is_transposed: bool) -> FileColumns:
    rehearse(lambda: _read_hdf5(path, columns, is_transposed=is_transposed))
    return _read_hdf5(path, columns, is_transposed=is_transposed)


def _read_hdf5(path: Path, columns: Columns, *, is_transposed: bool) -> FileColumns:
    with h5py.File(path, "r") as file:
        variables = hdf5_variables(file, is_transposed=is_transposed)
        return _pick(path, columns, variables)


def hdf5_variables(file: h5py.File, *, is_transposed: bool) -> dict[str, Load]:
    """Data sets of an open HDF5 file by their paths.

    Parameters
    ----------
    file : h5py.File
    is_transposed : bool
        Whether MATLAB wrote it: columns come first, members are named with dots.

    Returns
    -------
    dict of str to callable
        Each reads its array.
    """
    separator = "." if is_transposed else "/"
    variables: dict[str, Load] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            variables[name.replace("/", separator)] = _dataset(item, is_transposed)

    file.visititems(note)
    return variables


def _loader(value: Any) -> Load:
    return lambda: value


def _item(content: Any, name: str) -> Load:
    return lambda: content[name]


def _dataset(dataset: h5py.Dataset, is_transposed: bool) -> Load:
    def load() -> Any:
        if is_transposed and not _is_matlab_array(dataset):
            is_text = dataset.attrs.get("MATLAB_class") == b"char"
            return np.array("text") if is_text else None
        check_dataset(dataset)
        if is_transposed and "MATLAB_empty" in dataset.attrs:
            return np.zeros(0)
        values = dataset[()]
        return values.T if is_transposed and values.dtype.names is None else values

    return load


def _is_matlab_array(dataset: h5py.Dataset) -> bool:
    """Whether MATLAB stored numbers: objects and functions are stored as such too."""
    kind = dataset.attrs.get("MATLAB_class", b"double")
    return kind in _MATLAB_NUMBERS and "MATLAB_object_decode" not in dataset.attrs


def _with_members(name: str, value: Any) -> dict[str, Load]:
    """A MATLAB variable, and all that lies inside if it is a struct."""
    variables: dict[str, Load] = {name: _loader(value)}
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
