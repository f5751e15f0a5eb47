"""Any record in an HDF5 group and back, by the annotations of its dataclass.

Scalars and tuples of scalars become attributes (data sets where they are too long for
one), arrays data sets, records groups, tuples of records numbered groups. None is
absent. Floats come back bit by bit. A record with a text form of its own (``str`` and
``of_text``) is stored as that text where there is a tuple of it.
"""

from collections.abc import Callable, Collection
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

import h5py
import numpy as np

from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.rules import check_fields
from hwid_cli.store.hdf5_values import (
    has_value,
    read_array,
    read_small,
    write_array,
    write_small,
)
from hwid_cli.store.trusted_functions import check_function

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
