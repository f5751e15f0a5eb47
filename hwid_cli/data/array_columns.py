"""Columns in files that hold arrays with names.

A column is a named variable (row or column vector, ``a.b`` or ``a/b`` for a member of
a struct or group), or a numbered column of one table, the ``variable``.

Its unit is said by an attribute (HDF5), by text of a name like ``current_unit``,
``units.current`` or ``current.unit`` beside ``current.value``, or by the column's own name.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.columns import ROLES, MeasuredColumn, array_column
from hwid_cli.data.units import bare_unit, unit_in_name
from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import is_plain
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

# 2^26 numbers of 8 bytes: eight times the longest recording that was measured, 8e6
# samples.
MOST_BYTES = 2**29

# A file's variables by name; each is loaded when it is asked for. Behind marks stand
# attributes that say a unit or what a signal is called, and classes of objects that
# cannot be read.
Variables = Mapping[str, Callable[[], Any]]
UNIT_MARK, TITLE_MARK, OBJECT_MARK = "@unit", "@title", "@object"
# Behind the number of an element that has a name of its own: it is listed by that.
NAMED_MARK = "@named"
_MARKS = (UNIT_MARK, TITLE_MARK, OBJECT_MARK, NAMED_MARK)
# Members that hold the numbers of a signal whose unit stands beside them.
_VALUES = ("value", "values", "data", "Value", "Values", "Data")


def pick_columns(
    path: Path, columns: Columns, variables: Variables, roles: Sequence[str] = ROLES
) -> Iterator[tuple[str, MeasuredColumn]]:
    """Give the columns of some roles.

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
    for role in roles:
        key = getattr(columns, role)
        if key is None:
            continue
        if isinstance(key, int):
            values = _numbered(path, columns.variable, table, key, role)
        else:
            values = _named(path, columns.variable, table, key, (variables, role))
        unit, said_by = _unit_of(variables, columns.variable, key, role)
        yield (
            role,
            array_column(f"{role} {key!r}", values, unit=unit, unit_said_by=said_by),
        )


def _unit_of(
    variables: Variables, variable: str | None, key: str | int, role: str
) -> tuple[str, str]:
    """Unit of a column and what says it; two empty texts where nothing does."""
    stated = _stated_unit(variables, variable, key)
    if stated is not None:
        return stated
    last = re.split(r"[./]", key)[-1] if isinstance(key, str) else ""
    named = unit_in_name(last, "output" if role == "reference" else role)
    return (named, f"the name {key!r}") if named else ("", "")


def _stated_unit(
    variables: Variables, variable: str | None, key: str | int
) -> tuple[str, str] | None:
    """Unit that something beside a column states."""
    if isinstance(key, int):
        places = [f"{variable}{mark}" for mark in (UNIT_MARK, "_units", "_unit")]
        places += ["units", "unit"]
        column = key
    else:
        full = [f"{variable}{mark}{key}" for mark in "./"]
        name = next((one for one in full if one in variables), key)
        places, column = _places_of_units(name), 0
    for place in places:
        if place in variables:
            texts = _texts(variables[place]())
            text = texts[column] if column < len(texts) else ""
            if bare_unit(text):
                what = "the attribute" if place.endswith(UNIT_MARK) else "the variable"
                return bare_unit(text), f"{what} {place.replace(UNIT_MARK, '.unit')!r}"
    return None


def _places_of_units(name: str) -> list[str]:
    """Names under which the unit of a variable may stand."""
    places = [name + UNIT_MARK]
    places += [f"{name}{end}" for end in ("_unit", "_units", ".unit", ".units")]
    parent, mark, last = _parted(name)
    for word in ("units", "unit", "Unit"):
        places += [f"{parent}{mark}{word}{other}{last}" for other in (mark or ".", ".")]
        if last in _VALUES and parent:
            places.append(f"{parent}{mark}{word}")
    if last in _VALUES and parent:
        # A time series of MATLAB that was made a struct.
        places.append(f"{parent}{mark}DataInfo{mark}Units")
    return places


def _parted(name: str) -> tuple[str, str, str]:
    """Struct or group of a variable, the mark behind it, and its own name."""
    found = re.fullmatch(r"(.*)([./])([^./]*)", name)
    return (found[1], found[2], found[3]) if found else ("", "", name)


def _texts(value: Any) -> list[str]:
    """Text of an array, a cell array or an attribute; empty where it is none."""
    texts = []
    for one in np.asarray(value).ravel():
        while isinstance(one, np.ndarray):
            one = one.flat[0] if one.size else ""
        if isinstance(one, bytes):
            one = one.decode("utf-8", errors="replace")
        texts.append(one if isinstance(one, str) else "")
    return texts


def list_variables(variables: Variables) -> Iterator[FoundColumn]:
    """List vectors and single numbers by name, columns of tables by number.

    Raises
    ------
    ValueError
        If a variable is too large, or there are only objects that cannot be read.
    """
    has_columns = False
    for name, load in variables.items():
        # A configuration takes no text with control characters.
        if (
            name.endswith(_MARKS)
            or not is_plain(name)
            or name + NAMED_MARK in variables
        ):
            continue
        values = np.asarray(_checked(name, load()))
        if values.dtype.names and values.ndim == 1:
            has_columns = True
            yield from _fields(name, values)
        if values.dtype.kind not in "fiub" or values.size == 0:
            continue
        vector = np.squeeze(values)
        title = _title(variables, name)
        if vector.ndim <= 1:
            has_columns = True
            unit = _stated_unit(variables, None, name) or ("", "")
            numbers = np.atleast_1d(vector).astype(float)
            yield FoundColumn(title or name, name, numbers, unit=unit[0])
        elif values.ndim == 2 and values.shape[0] != values.shape[1]:
            has_columns = True
            values = upright(values)
            for number in range(values.shape[1]):
                unit = _stated_unit(variables, name, number) or ("", "")
                numbers = values[:, number].astype(float)
                called = f"{title}({number + 1})" if title else ""
                yield FoundColumn(called, number, numbers, name, unit[0])
    if not has_columns and (said := _unread_objects(variables)):
        raise ValueError(f"holds no plain arrays{said}")


def _fields(name: str, records: np.ndarray) -> Iterator[FoundColumn]:
    """Columns of numbers of a structured array."""
    for field in records.dtype.names or ():
        if records.dtype[field].kind in "fiub" and is_plain(field):
            yield FoundColumn(field, field, records[field].astype(float), name)


def upright(table: np.ndarray) -> np.ndarray:
    """Give a table with a column for each signal; Simulink's To File has rows of them.

    Parameters
    ----------
    table : ndarray, shape (n, m)
    """
    return table.T if table.shape[0] < table.shape[1] else table


def _title(variables: Variables, name: str) -> str:
    load = variables.get(name + TITLE_MARK)
    return "" if load is None else text_of(load())


def text_of(value: Any) -> str:
    """First text of an array, a cell array or an attribute; empty where it is none."""
    return next((text for text in _texts(value) if text), "")


def _unread_objects(variables: Variables) -> str:
    """What to say of objects of MATLAB that cannot be read; empty without any."""
    names = [name for name in variables if name.endswith(OBJECT_MARK)]
    if not names:
        return ""
    name, kind = names[0].removesuffix(OBJECT_MARK), str(variables[names[0]]())
    return (
        f"; {name} is an object ({kind}), which mat-io may read (pip install "
        "'hwid[formats]'), or save plain vectors: t = seconds(T.Time), u = T.u, y = T.y"
    )


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
    if size > MOST_BYTES:
        raise ValueError(f"{name!r} unpacks to more than {MOST_BYTES // 2**20} MB")


def _checked(name: str, value: Any) -> Any:
    check_size(name, getattr(value, "nbytes", 0))
    return value


def _is_group(name: str, variables: Variables) -> bool:
    """Whether a name is only the first part of other names."""
    return name not in variables and any(
        other.startswith((f"{name}.", f"{name}/")) for other in variables
    )


def _names(variables: Variables) -> list[str]:
    return [name for name in variables if not name.endswith(_MARKS)]


def _variable(path: Path, name: str, variables: Variables, role: str) -> Any:
    if name not in variables:
        raise MeasurementError(
            f"{path}: has no variable {name!r} for recordings.columns.{role}; "
            f"{did_you_mean(name, _names(variables))}{_unread_objects(variables)}"
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
    table = upright(table)
    shape = table.shape
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
