"""Single values in HDF5: attributes for what is small, data sets for arrays.

h5py's low-level calls are used where the type is known beforehand: they are three
times faster than ``group.attrs`` and a campaign reads thousands of records.
"""

import math
from functools import lru_cache

import h5py
import numpy as np
from h5py import h5a, h5d, h5p, h5s, h5t

from hwid_cli.data.array_columns import check_size

Scalar = str | bool | int | float

_TEXT = h5py.string_dtype()
_DTYPES: dict[type, np.dtype] = {
    str: _TEXT,
    bool: np.dtype(bool),
    int: np.dtype(np.int64),
    float: np.dtype(np.float64),
}
# Types in memory and in the file; they differ for text, and mixing them up crashes.
_MEMORY = {kind: h5t.py_create(dtype) for kind, dtype in _DTYPES.items()}
_STORED = {kind: h5t.py_create(dtype, logical=True) for kind, dtype in _DTYPES.items()}
# HDF5 refuses attributes above 64 KiB; text counts as 16 bytes of reference plus itself.
LONGEST_ATTRIBUTE = 30_000


# Equal content gives equal files: HDF5 notes when a data set was made unless told not to.
_WITHOUT_TIMES = h5p.create(h5p.DATASET_CREATE)
_WITHOUT_TIMES.set_obj_track_times(False)


def write_small(group: h5py.Group, name: str, value: object, kind: type) -> None:
    """Write a scalar or a tuple of scalars as an attribute of a group.

    Parameters
    ----------
    group : h5py.Group
    value : scalar or sequence of scalars
        Becomes a data set where it is too long for an attribute.
    kind : type
        ``str``, ``bool``, ``int`` or ``float``.

    Raises
    ------
    TypeError, ValueError
        If a value is not of that kind, or text holds a null character.
    """
    values = np.array(value, dtype=object if kind is str else _DTYPES[kind])
    size = values.nbytes
    if kind is str:
        size = sum(16 + len(_checked(text).encode()) for text in values.flat)
    if size > LONGEST_ATTRIBUTE:
        write_array(group, name, values)
        return
    stored = _STORED[kind]
    attribute = h5a.create(group.id, name.encode(), stored, _space(values.shape))
    if values.size:
        attribute.write(values, mtype=_MEMORY[kind])


def read_small(group: h5py.Group, name: str, kind: type) -> Scalar | list[Scalar]:
    """Read a scalar, or a list of scalars, that ``write_small`` wrote.

    Parameters
    ----------
    group : h5py.Group

    Raises
    ------
    KeyError, TypeError, ValueError
        If there is no such value, or of another kind.
    """
    if not h5a.exists(group.id, name.encode()):
        return _plain(np.asarray(group[name][()]), kind)
    attribute = h5a.open(group.id, name.encode())
    values = np.zeros(attribute.shape, dtype=_DTYPES[kind])
    if values.size:
        attribute.read(values, mtype=_MEMORY[kind])
    return _plain(values, kind)


def has_value(group: h5py.Group, name: str) -> bool:
    """Say whether a group holds an attribute, data set or group of a name.

    Parameters
    ----------
    group : h5py.Group
    """
    return bool(h5a.exists(group.id, name.encode())) or name in group


def write_array(group: h5py.Group, name: str, values: np.ndarray) -> None:
    """Write an array of numbers, truth values or text as a data set.

    Parameters
    ----------
    group : h5py.Group
    values : ndarray, any shape
        Empty ones too.

    Raises
    ------
    TypeError
        If the array holds something else.
    """
    if values.dtype.kind in "UO":
        # Fixed length: HDF5 never gives back the room of variable-length text.
        encoded = [_checked(text).encode() for text in values.flat]
        length = max((len(text) for text in encoded), default=0) or 1
        text = np.array(encoded, dtype=h5py.string_dtype("utf-8", length))
        group.create_dataset(name, data=text.reshape(values.shape), dtype=text.dtype)
        return
    values = np.require(values, requirements="C")
    stored, space = _stored_as(values.dtype), _space(values.shape)
    dataset = h5d.create(group.id, name.encode(), stored, space, dcpl=_WITHOUT_TIMES)
    if values.size:
        dataset.write(h5s.ALL, h5s.ALL, values)


@lru_cache(maxsize=64)
def _stored_as(dtype: np.dtype) -> h5t.TypeID:
    return h5t.py_create(dtype, logical=True)


@lru_cache(maxsize=64)
def _space(shape: tuple[int, ...]) -> h5s.SpaceID:
    """Shape of what is written; making one takes as long as writing a small array."""
    return h5s.create_simple(shape) if shape else h5s.create(h5s.SCALAR)


def read_array(group: h5py.Group, name: str) -> np.ndarray:
    """Read an array back; text as an array of ``str``.

    Parameters
    ----------
    group : h5py.Group

    Raises
    ------
    KeyError
        If there is no such data set.
    ValueError
        If it is larger than a measurement may be.
    """
    dataset = h5d.open(group.id, name.encode())
    if h5py.check_string_dtype(dataset.dtype) is not None:
        return np.array(h5py.Dataset(dataset).asstr()[()], dtype=np.str_)
    check_size(name, math.prod(dataset.shape) * dataset.dtype.itemsize)
    values = np.zeros(dataset.shape, dtype=dataset.dtype)
    if values.size:
        dataset.read(h5s.ALL, h5s.ALL, values)
    return values


def _checked(text: object) -> str:
    if not isinstance(text, str):
        raise TypeError(f"expected text, got {text!r}")
    if "\0" in text:
        raise ValueError(f"text with a null character has no place in HDF5: {text!r}")
    return text


def _plain(values: np.ndarray, kind: type) -> Scalar | list[Scalar]:
    """Python values of an array; text may arrive as bytes."""
    if kind is not str:
        return values.tolist()
    texts = (t.decode() if isinstance(t, bytes) else str(t) for t in values.flat)
    plain: list[Scalar] = list(texts)
    return plain if values.ndim else plain[0]
