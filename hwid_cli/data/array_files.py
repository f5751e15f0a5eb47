"""What columns a MAT, NPZ or HDF5 file offers, before anybody has named one.

The structure of a MAT file of level 5, checked before scipy reads it.

scipy's reader is compiled and takes the file's word for types and classes: a damaged
file was seen to crash the interpreter. And what is packed may unpack to any size.

References
----------
MathWorks, "MAT-File Format": tags, types and classes of level 5.

Columns of MAT, NPZ and HDF5 files.

A column is a named variable (row or column vector, ``a.b`` or ``a/b`` for a member of
a struct or group), or a numbered column of one table, the ``variable``. MATLAB's
version 7.3 files are HDF5 with every array transposed, which is undone here.
"""

import struct
import warnings
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import ZipFile

import h5py
import numpy as np
import scipy.io

from hwid_cli.data.columns import ROLES, Column, FileColumns, array_column
from hwid_cli.data.isolated_reading import rehearse
from hwid_cli.errors import MeasurementError
from hwid_cli.files.array_bounds import (
    MOST_BYTES,
    check_archive,
    check_dataset,
    check_declared,
)
from hwid_cli.files.messages import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

_HEADER_BYTES, _TAG_BYTES = 128, 8
_MATRIX, _COMPRESSED = 14, 15
# Types of plain data: integers, floats and texts.
_PLAIN = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18}
_CLASSES = set(range(1, 18))
# Parts behind flags, dimensions and name: text, sparse tables, arrays of numbers. The
# imaginary part of complex numbers is one more.
_DATA_PARTS = {4: 1, 5: 3, **dict.fromkeys(range(6, 16), 1)}
_FIRST_PARTS = 3
_IS_COMPLEX = 0x0800
_FLAGS_TYPE, _FLAGS_BYTES = 6, 8
_PIECE_BYTES = 2**20
_MOST_DEPTH = 50


def check_mat(path: Path) -> None:
    """Refuse a MAT file of level 5 that is damaged or unpacks to too much.

    Parameters
    ----------
    path : Path
        Of another level: nothing in it is packed, so nothing is checked.

    Raises
    ------
    ValueError
    """
    content = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(content[126:_HEADER_BYTES])
    if order is None or 0 in content[:4]:
        return
    room = MOST_BYTES
    for kind, body in _elements(memoryview(content)[_HEADER_BYTES:], order):
        if kind == _COMPRESSED:
            unpacked = _unpacked(body, room)
            room -= len(unpacked)
            for inner_kind, inner in _elements(memoryview(unpacked), order):
                _check_matrix(inner_kind, inner, order)
        else:
            _check_matrix(kind, body, order)


def _elements(data: memoryview, order: str) -> list[tuple[int, memoryview]]:
    """Types and contents of the elements that lie one after the other."""
    found = []
    at = 0
    while at < len(data):
        if len(data) - at < _TAG_BYTES:
            raise ValueError("an element is cut off")
        kind, size = struct.unpack_from(f"{order}II", data, at)
        # Up to four bytes may lie in the tag itself, their number in its upper half.
        is_small = kind >> 16 != 0
        start = at + (4 if is_small else _TAG_BYTES)
        if is_small:
            kind, size = kind & 0xFFFF, kind >> 16
        room = 4 if is_small else len(data) - start
        if size > room:
            raise ValueError("an element is longer than the file")
        found.append((kind, data[start : start + size]))
        # Packed elements end where they end, others at the next multiple of 8.
        packed = kind == _COMPRESSED
        at = (
            at + _TAG_BYTES if is_small else start + size + (0 if packed else -size % 8)
        )
    return found


def _check_matrix(kind: int, body: memoryview, order: str, depth: int = 0) -> None:
    """Refuse a variable of an unknown class, or with parts of unknown types."""
    if kind != _MATRIX or depth > _MOST_DEPTH:
        raise ValueError("an element is no variable, or nested too deeply")
    parts = _elements(body, order)
    if not parts:
        return
    flags_kind, flags = parts[0]
    if flags_kind != _FLAGS_TYPE or len(flags) != _FLAGS_BYTES:
        raise ValueError("a variable begins without its flags")
    flag = struct.unpack(f"{order}I", flags[:4])[0]
    if flag & 0xFF not in _CLASSES:
        raise ValueError("a variable is of an unknown class")
    expected = _DATA_PARTS.get(flag & 0xFF)
    if expected is not None:
        expected += _FIRST_PARTS + bool(flag & _IS_COMPLEX)
        kinds = {part_kind for part_kind, _ in parts}
        if len(parts) != expected or _MATRIX in kinds:
            raise ValueError(f"a variable has {len(parts)} parts, not {expected}")
    for part_kind, part in parts[1:]:
        if part_kind == _MATRIX:
            _check_matrix(part_kind, part, order, depth + 1)
        elif part_kind not in _PLAIN:
            raise ValueError(f"a variable holds data of an unknown type, {part_kind}")


def _unpacked(packed: memoryview, room: int) -> bytes:
    unpacker = zlib.decompressobj()
    pieces, size = [], 0
    left = bytes(packed)
    while left and not unpacker.eof:
        pieces.append(unpacker.decompress(left, _PIECE_BYTES))
        left = unpacker.unconsumed_tail
        size += len(pieces[-1])
        if size > room:
            check_declared("variables", MOST_BYTES + 1)
    return b"".join(pieces)


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


def list_array_columns(path: Path) -> tuple[FoundColumn, ...]:
    """List the columns of numbers in a MAT, NPZ or HDF5 file.

    Returns
    -------
    tuple of FoundColumn
        Vectors and single numbers by their names, and columns of tables by number.

    Raises
    ------
    KeyError, OSError, ValueError
        If it cannot be read.
    """
    if h5py.is_hdf5(path):
        rehearse(lambda: _list_hdf5(path))
        return _list_hdf5(path)
    if path.suffix.lower() == ".mat":
        return _list(mat_variables(path))
    with path.open("rb") as file:
        return _list(npz_variables(path, file))


def _list_hdf5(path: Path) -> tuple[FoundColumn, ...]:
    with h5py.File(path, "r") as file:
        is_mat = path.suffix.lower() == ".mat"
        return _list(hdf5_variables(file, is_transposed=is_mat))


def _list(variables: Mapping[str, Load]) -> tuple[FoundColumn, ...]:
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
