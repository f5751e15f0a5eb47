"""Objects of MATLAB in a MAT file: timetable, table, timeseries, iddata, Dataset.

The library mat-io gives their properties. A timetable becomes named columns with their
time; of any other object the arrays in its properties are taken, by names without
the trailing underscores of stored properties.
"""

import warnings
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import OBJECT_MARK, UNIT_MARK, member_of

# Objects inside objects; a Dataset of timeseries has five levels.
_DEEPEST = 8
_MOST_ELEMENTS = 1000


def object_variables(path: Path, classes: Mapping[str, str]) -> dict[str, Any]:
    """Give what can be read of objects as variables.

    Parameters
    ----------
    classes : mapping of str to str
        Class of each object by the name of its variable.

    Returns
    -------
    dict of str to callable
        An object that cannot be read is a name with a mark, and its class.
    """
    unread = {
        f"{name}{OBJECT_MARK}": partial(str, one) for name, one in classes.items()
    }
    if not classes:
        return {}
    try:
        from matio import load_from_mat
    except ImportError:
        return unread
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            content = load_from_mat(
                str(path), add_table_attrs=True, variable_names=list(classes)
            )
    # The library raises whatever it stumbles on; plain arrays may still be read.
    except Exception:
        return unread
    found: dict[str, Any] = {}
    for name in classes:
        arrays = dict(_arrays_in(name, content.get(name), 0))
        mark = f"{name}{OBJECT_MARK}"
        found |= {key: partial(_given, value) for key, value in arrays.items()}
        if not arrays:
            found[mark] = unread[mark]
    return found


def _given(value: Any) -> Any:
    return value


def _arrays_in(name: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    """Arrays of numbers, and texts, inside of an object, with the way to them."""
    if hasattr(value, "columns") and hasattr(value, "index"):
        yield from _columns_of(name, value)
    elif isinstance(value, bool | int | float):
        yield name, np.array(float(value))
    elif isinstance(value, str):
        yield name, np.array(value)
    elif getattr(getattr(value, "dtype", None), "kind", "O") in "fiubU":
        yield name, value
    elif depth < _DEEPEST:
        for place, one in _inside(name, value):
            yield from _arrays_in(place, one, depth + 1)


def _inside(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """What an object, a struct or an array of cells consists of."""
    properties = getattr(value, "properties", value)
    if isinstance(properties, Mapping):
        for key, one in properties.items():
            yield f"{name}.{str(key).strip('_')}", one
    elif isinstance(value, np.ndarray) and value.dtype.names:
        for member in value.dtype.names:
            yield f"{name}.{member}", member_of(value, member)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        cells = value.ravel()[:_MOST_ELEMENTS]
        for number, one in enumerate(cells, 1):
            yield name if cells.size == 1 else f"{name}({number})", one


def _columns_of(name: str, table: Any) -> Iterator[tuple[str, Any]]:
    """Columns of a table, and the time of its rows."""
    index = np.asarray(table.index)
    if index.dtype.kind in "mM":
        if index.dtype.kind == "M":
            index = index - index[:1].astype("datetime64[D]")
        seconds = index.astype("timedelta64[ns]").astype(float) / 1e9
        yield f"{name}.Time", seconds
        yield f"{name}.Time{UNIT_MARK}", np.array("s")
    units = table.attrs.get("varUnits") or []
    texts = [str(one) for one in np.asarray(units, dtype=object).ravel()]
    for number, column in enumerate(table.columns):
        values = np.asarray(table[column])
        if values.dtype.kind in "mM":
            values = (values - values[0]).astype("timedelta64[ns]").astype(float) / 1e9
        if values.dtype.kind in "fiub":
            yield f"{name}.{column}", values
            if number < len(texts) and texts[number]:
                yield f"{name}.{column}{UNIT_MARK}", np.array(texts[number])
