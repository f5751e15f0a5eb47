"""Any record in an HDF5 group and back, by the annotations of its dataclass.

Scalars and tuples of scalars become attributes (data sets where they are too long for
one), arrays data sets, records groups, tuples of records numbered groups. None is
absent. Floats come back bit by bit. A record with a text form of its own (``str`` and
``of_text``) is stored as that text where there is a tuple of it.

Single values in HDF5: attributes for what is small, data sets for arrays.

h5py's low-level calls are used where the type is known beforehand: they are three
times faster than ``group.attrs`` and a campaign reads thousands of records.
"""

import math
from collections.abc import Callable, Collection
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache, lru_cache
from types import NoneType, UnionType
from typing import Any, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

import h5py
import numpy as np
from h5py import h5a, h5d, h5p, h5s, h5t

from hwid_cli.data.array_columns import check_size
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.rules import check_fields
from hwid_cli.store.trusted_functions import check_function

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


Record = TypeVar("Record")

_SCALARS = (str, bool, int, float)


class StoredField(NamedTuple):
    """How a dataclass field is stored; ``member`` is its type, or that of its items.

    ``default`` gives the value where a file of an earlier version lacks the field; None
    where every file must have it.
    """

    name: str
    form: str
    member: Any
    is_optional: bool
    default: Callable[[], Any] | None = None


def write_record(
    group: h5py.Group, record: Any, *, without: Collection[str] = ()
) -> None:
    """Write a record's fields into an empty group.

    Parameters
    ----------
    group : h5py.Group
    without : collection of str
        Fields that the caller writes.

    Raises
    ------
    TypeError
        If a field is of a kind that has no place in HDF5.
    """
    for name, form, member, *_ in schema(type(record)):
        value = getattr(record, name)
        if value is None or name in without:
            continue
        if form == "array":
            write_array(group, name, value)
        elif form == "record":
            write_record(group.create_group(name), value)
        elif form == "records":
            members = group.create_group(name)
            for number, item in enumerate(value):
                write_record(members.create_group(str(number)), item)
        elif form == "texts":
            write_small(group, name, [str(item) for item in value], str)
        else:
            write_small(group, name, value, member)


def read_record(group: h5py.Group, record_type: type[Record]) -> Record:
    """Read a record back from its group.

    Parameters
    ----------
    group : h5py.Group
    record_type : type
        The dataclass that was written.

    Raises
    ------
    KeyError, OSError, TypeError, ValueError
        If the group does not hold such a record.
    """
    values: dict[str, Any] = {}
    for field in schema(record_type):
        if field.is_optional and not has_value(group, field.name):
            values[field.name] = None
        elif field.default is not None and not has_value(group, field.name):
            values[field.name] = field.default()
        else:
            values[field.name] = _read_field(group, field)
    return built(record_type, values, group)


def built(
    record_type: type[Record],
    values: dict[str, Any],
    group: h5py.Group,
    row: int | None = None,
) -> Record:
    """Build a record out of what was stored: by its rules, Python in it trusted.

    Parameters
    ----------
    group : h5py.Group
        Where the values stand; with the row, where they are one of many, for messages.

    Raises
    ------
    UntrustedFunctionError
        If it is a function that the configuration at hand does not name.
    ValueError
        If such a record cannot be.
    """
    try:
        record = record_type(**values)
        check_fields(record)
        if hasattr(record, "check_stored"):
            record.check_stored()
    except (TypeError, ValueError) as error:
        place = group.name if row is None else f"{group.name}, row {row}"
        raise ValueError(f"{place}: {error}") from error
    if isinstance(record, OwnFunction):
        check_function(record)
    return record


def _read_field(group: h5py.Group, field: StoredField) -> Any:
    name, form, member, *_ = field
    if form == "array":
        return read_array(group, name)
    if form == "record":
        return read_record(group[name], member)
    if form == "records":
        numbered = group[name]
        return tuple(
            read_record(numbered[str(number)], member)
            for number in range(len(numbered))
        )
    value = read_small(group, name, str if form == "texts" else member)
    if isinstance(value, list) != (form != "scalar"):
        raise TypeError(f"{group.name}: {name} has the wrong shape")
    if not isinstance(value, list):
        return value
    return tuple(map(member.of_text, value) if form == "texts" else value)


def _read_schema(record_type: Any) -> list[StoredField]:
    """How each field of a dataclass is stored, from its annotation."""
    hints = get_type_hints(record_type)
    return [
        _field(record_type, field.name, hints[field.name])._replace(
            default=_default(field)
        )
        for field in fields(record_type)
    ]


# mypy does not take a class for hashable, hence the plain annotation.
schema: Callable[[Any], list[StoredField]] = cache(_read_schema)


def _default(field: Field) -> Callable[[], Any] | None:
    """What a field holds that was added after files had been written."""
    if not field.metadata.get("added_later"):
        return None
    if field.default_factory is not MISSING:
        return field.default_factory
    return lambda: field.default


def _field(record_type: type, name: str, hint: Any) -> StoredField:
    members = [hint]
    if get_origin(hint) in (Union, UnionType):
        members = [part for part in get_args(hint) if part is not NoneType]
    is_optional = NoneType in get_args(hint)
    if len(members) == 1:
        (inner,) = members
        item = get_args(inner)[0] if get_origin(inner) is tuple else None
        if inner is np.ndarray:
            return StoredField(name, "array", inner, is_optional)
        if inner in _SCALARS:
            return StoredField(name, "scalar", inner, is_optional)
        if item in _SCALARS:
            return StoredField(name, "tuple", item, is_optional)
        if isinstance(inner, type) and is_dataclass(inner):
            return StoredField(name, "record", inner, is_optional)
        if isinstance(item, type) and is_dataclass(item):
            form = "texts" if hasattr(item, "of_text") else "records"
            return StoredField(name, form, item, is_optional)
    raise TypeError(f"{record_type.__name__}.{name}: {hint} has no place in HDF5")
