"""Columns of Parquet and Feather (Arrow) files, by the library pyarrow."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import UNIT_MARK, Variables, check_size
from hwid_cli.data.columns import array_column
from hwid_cli.data.long_tables import columns_of_long, long_form_of, long_tables

# How the names of types begin.
_NUMBERS = ("int", "uint", "float", "double", "half", "bool", "decimal")
_TIMES = ("duration", "time")
_WORDS = ("string", "large_string", "dictionary<values=string")
_UNITS = (b"unit", b"units", b"Unit")


@contextmanager
def open_arrow(path: Path) -> Iterator[Variables]:
    """Open a Parquet or Feather file.

    Yields
    ------
    mapping of str to callable
        Columns with numbers or times; each is read when it is asked for.

    Raises
    ------
    ValueError
        If a column is too large, or two have one name.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    if path.suffix.lower() == ".parquet":
        with pq.ParquetFile(str(path)) as file:
            rows, schema = file.metadata.num_rows, file.schema_arrow
            yield _variables(rows, schema, lambda name: file.read([name]).column(0))
        return
    with pa.OSFile(str(path)) as source:
        table = pa.ipc.open_file(source)
        batches = range(table.num_record_batches)
        rows = 0
        for number in batches:
            rows += table.get_batch(number).num_rows
            check_size("all rows", 8 * rows)
        yield _variables(
            rows,
            table.schema,
            lambda name: pa.chunked_array(
                [table.get_batch(number).column(name) for number in batches],
                type=table.schema.field(name).type,
            ),
        )


def _variables(rows: int, schema: Any, load: Any) -> Variables:
    found: dict[str, Any] = {}
    for entry in schema:
        if entry.name in found:
            raise ValueError(f"holds {entry.name!r} twice")
        check_size(entry.name, 8 * rows)
        kind = str(entry.type)
        is_time = kind.startswith(_TIMES)
        if not is_time and not kind.startswith(_NUMBERS):
            continue
        found[entry.name] = partial(_values, load, entry.name, is_time)
        unit = _unit(entry.metadata or {})
        if is_time or unit:
            found[entry.name + UNIT_MARK] = partial(np.array, "s" if is_time else unit)
    return _of_long_table(schema, load, found) or found


def _of_long_table(schema: Any, load: Any, numbers: Variables) -> Variables:
    """Signals of a table whose rows name them; none where they do not."""
    names = [entry.name for entry in schema]
    kinds = [str(entry.type) for entry in schema]
    form = long_form_of(
        names, [place for place, kind in enumerate(kinds) if kind.startswith(_WORDS)]
    )
    if form is None or not {names[form.time], names[form.value]} <= set(numbers):
        return {}

    def words_of(places: Sequence[int], rows: np.ndarray) -> dict[int, list[str]]:
        columns = {place: load(names[place]).to_pylist() for place in places}
        return {
            place: [
                "" if cells[row] is None else str(cells[row]) for row in rows.tolist()
            ]
            for place, cells in columns.items()
        }

    clock = names[form.time]
    unit = "s" if kinds[form.time].startswith(_TIMES) else ""
    tables = long_tables(
        clock,
        (
            array_column("time", numbers[clock](), unit=unit),
            array_column("value", numbers[names[form.value]]()),
        ),
        words_of,
        form,
    )
    found: dict[str, Any] = {}
    for one in columns_of_long(tables):
        name = f"{one.variable}/{one.key}" if one.variable else str(one.key)
        found[name] = partial(np.asarray, one.values)
        if one.unit:
            found[name + UNIT_MARK] = partial(np.array, one.unit)
    return found


def _unit(said: dict[bytes, bytes]) -> str:
    text = next((said[name] for name in _UNITS if said.get(name)), b"")
    return text.decode("utf-8", errors="replace")


def _values(load: Any, name: str, is_time: bool) -> Any:
    column = load(name)
    if not is_time:
        column = column.cast("double", safe=False)
        return column.to_numpy(zero_copy_only=False).astype(float)
    values = column.to_numpy(zero_copy_only=False)
    if values.dtype.kind == "O":
        # Times of day.
        return np.array([_of_day(value) for value in values])
    if values.dtype.kind == "M":
        known = values[~np.isnat(values)]
        values = values - known[:1].astype("datetime64[D]")
    seconds = values.astype("timedelta64[ns]").astype(float) / 1e9
    return np.where(np.isnat(values), np.nan, seconds)


def _of_day(value: Any) -> float:
    if value is None:
        return np.nan
    return (
        3600.0 * value.hour
        + 60.0 * value.minute
        + value.second
        + 1e-6 * value.microsecond
    )
