"""Many records of one type as columns: row i of every data set is record i.

For thousands of records this is a hundred times smaller and faster than a group for
each. Arrays and tuples are rows padded to the longest (NaN, 0 or empty text); where
lengths differ, ``<name>_length`` holds them. Records inside are groups of columns;
where some are None, the group's ``is_present`` says which; for other optional fields
``<name>_is_present`` does. An optional field that is None in every record has no column.
"""

from collections.abc import Sequence
from typing import Any, TypeVar

import h5py
import numpy as np

from hwid_cli.store.hdf5_records import StoredField, built, schema
from hwid_cli.store.hdf5_values import has_value, read_array, write_array

Record = TypeVar("Record")

_PRESENT = "is_present"
# Kinds of numpy in which what a column holds may be stored.
_KINDS: dict[type, str] = {str: "U", bool: "b", int: "iu", float: "f"}
_DTYPES: dict[type, Any] = {str: object, bool: bool, int: np.int64, float: np.float64}


def write_table(
    group: h5py.Group, records: Sequence[Any], record_type: type[Any]
) -> None:
    """Write records as columns into an empty group.

    Parameters
    ----------
    group : h5py.Group
    records : sequence of dataclass instances
        None stands for a missing one.

    Raises
    ------
    TypeError, ValueError
        If a field is of a kind that has no place in a column.
    """
    is_present = np.array([record is not None for record in records], dtype=bool)
    if not is_present.all():
        write_array(group, _PRESENT, is_present)
    for field in schema(record_type):
        values = [
            None if record is None else getattr(record, field.name)
            for record in records
        ]
        if field.is_optional and all(value is None for value in values):
            continue
        if field.form == "record":
            write_table(group.create_group(field.name), values, field.member)
            continue
        if field.form == "scalar":
            _write_scalars(group, field, values, is_present)
        elif field.form in ("tuple", "array"):
            _write_rows(group, field, values)
        else:
            raise TypeError(f"{field.name}: a tuple of records has no place in columns")
        if field.is_optional:
            there = np.array([value is not None for value in values], dtype=bool)
            write_array(group, f"{field.name}_{_PRESENT}", there)


def read_table(group: h5py.Group, record_type: type[Record]) -> list[Record | None]:
    """Read records that ``write_table`` wrote.

    Parameters
    ----------
    group : h5py.Group

    Raises
    ------
    KeyError, TypeError, ValueError
        If the group does not hold such a table.
    """
    stored = schema(record_type)
    absent = {
        field.name
        for field in stored
        if field.is_optional and not has_value(group, field.name)
    }
    # Fields that an earlier version did not write are left to their defaults.
    columns = {
        field.name: _read_column(group, field)
        for field in stored
        if field.name not in absent
        if field.default is None or has_value(group, field.name)
    }
    (count,) = {len(column) for column in columns.values()}
    columns |= {name: [None] * count for name in absent}
    is_present = [True] * count
    if has_value(group, _PRESENT):
        is_present = read_array(group, _PRESENT).tolist()
    return [
        built(
            record_type,
            {name: column[row] for name, column in columns.items()},
            group,
            row,
        )
        if is_present[row]
        else None
        for row in range(count)
    ]


def _write_scalars(
    group: h5py.Group, field: StoredField, values: list[Any], is_present: np.ndarray
) -> None:
    filler = {str: "", bool: False, int: 0, float: np.nan}[field.member]
    if not field.is_optional and any(
        value is None for value, there in zip(values, is_present, strict=True) if there
    ):
        raise TypeError(f"{field.name}: a scalar that is None has no place in columns")
    filled = [filler if value is None else value for value in values]
    write_array(group, field.name, np.array(filled, dtype=_DTYPES[field.member]))


def _write_rows(group: h5py.Group, field: StoredField, values: list[Any]) -> None:
    given = [value for value in values if value is not None]
    dtype = _DTYPES.get(field.member) or np.result_type(*given, np.bool_)
    rows = [np.asarray(() if value is None else value, dtype=dtype) for value in values]
    if any(row.ndim != 1 for row in rows):
        raise ValueError(f"{field.name}: only 1-D arrays have a place in columns")
    lengths = np.array([row.size for row in rows], dtype=np.int64)
    longest = int(lengths.max(initial=0))
    filler = {"f": np.nan, "c": complex(np.nan, np.nan), "O": ""}.get(
        np.dtype(dtype).kind, 0
    )
    padded = np.full((len(rows), longest), filler, dtype=dtype)
    for place, row in zip(padded, rows, strict=True):
        place[: row.size] = row
    write_array(group, field.name, padded)
    if (lengths != longest).any():
        write_array(group, f"{field.name}_length", lengths)


def _read_column(group: h5py.Group, field: StoredField) -> list[Any]:
    if field.form == "record":
        return read_table(group[field.name], field.member)
    values = _read_values(group, field)
    if not field.is_optional:
        return values
    there = read_array(group, f"{field.name}_{_PRESENT}")
    return [
        value if is_there else None
        for value, is_there in zip(values, there, strict=True)
    ]


def _read_values(group: h5py.Group, field: StoredField) -> list[Any]:
    """Scalars or rows of a column, filling included."""
    values = read_array(group, field.name)
    if values.size and values.dtype.kind not in _KINDS.get(field.member, "iufcbU"):
        raise TypeError(f"{field.name} holds numbers or words of another kind")
    if field.form == "scalar":
        return values.tolist()
    lengths = np.full(len(values), values.shape[1])
    if has_value(group, f"{field.name}_length"):
        lengths = read_array(group, f"{field.name}_length")
        if ((lengths < 0) | (lengths > values.shape[1])).any():
            raise ValueError(
                f"{field.name} has rows longer than what is stored of them"
            )
    rows = [row[:length] for row, length in zip(values, lengths, strict=True)]
    return rows if field.form == "array" else [tuple(row.tolist()) for row in rows]
