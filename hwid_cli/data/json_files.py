"""Columns of JSON: a record in each line, or in a list, or a list of numbers by name.

Devices that report over a network write a record for each sample. A record without any
number of the others says what all of them are: its ``units`` name those of the columns.
"""

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import (
    MOST_BYTES,
    UNIT_MARK,
    Variables,
    check_size,
)
from hwid_cli.data.cells import is_stamp, stamps_in_seconds
from hwid_cli.data.packed import open_bytes

_log = logging.getLogger(__name__)

_UNITS = ("units", "unit")
# Of the lines, records that a lost byte or a reset has torn, at most, [-].
_MOST_TORN = 0.02


@contextmanager
def open_json(path: Path) -> Iterator[Variables]:
    """Open a file of JSON, or of a record in each line.

    Yields
    ------
    mapping of str to callable
        Each gives a column, shape (n_samples,): ``a.b`` for a member of a record's
        member; NaN where a record has no number.

    Raises
    ------
    ValueError
        If it is no JSON, or too large.
    """
    check_size(path.name, path.stat().st_size)
    with open_bytes(path) as file:
        # What is packed shows its size as it is read.
        content = file.read(MOST_BYTES + 1)
    check_size(path.name, len(content))
    text = content.decode("utf-8-sig")
    try:
        said = json.loads(text)
    except json.JSONDecodeError:
        said = _records_in(path, text.splitlines())
    found, units = _columns(said)
    variables = {name: partial(np.asarray, values) for name, values in found.items()}
    for name, unit in units.items():
        variables[name + UNIT_MARK] = partial(np.asarray, unit)
    yield variables


def _records_in(path: Path, lines: Sequence[str]) -> list[Any]:
    """A record in each line; a few that are torn are left out, and said to be.

    Raises
    ------
    ValueError
        If more of them are none.
    """
    found, torn, fault = [], 0, ""
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError as error:
            torn += 1
            fault = fault or f"row {number}: {error.msg}"
    if torn > _MOST_TORN * len(lines):
        raise ValueError(fault)
    if torn:
        _log.warning("%s: %d torn records are left out (%s)", path, torn, fault)
    return found


def _columns(content: Any) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Columns and their units."""
    if isinstance(content, Mapping):
        lists = {
            name: one
            for name, one in _members(content).items()
            if isinstance(one, list)
        }
        records = [one for one in lists.values() if one and isinstance(one[0], Mapping)]
        units = _units_of(content, lists)
        if len(records) != 1:
            return {name: _numbers(cells) for name, cells in lists.items()}, units
        found, more = _of_records(records[0])
        return found, {**_units_of(content, found), **more}
    return _of_records(content)


def _of_records(
    records: Sequence[Any],
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    rows = [_members(one) for one in records if isinstance(one, Mapping)]
    counts: dict[str, int] = {}
    for row in rows:
        for name in row:
            counts[name] = counts.get(name, 0) + 1
    names = [name for name, count in counts.items() if 2 * count > len(rows)]
    # What says that a run begins has a time, and no numbers of the signals.
    samples = [
        row
        for row in rows
        if 2 * sum(_is_value(row.get(name)) for name in names) >= len(names)
    ]
    found = {name: _numbers([row.get(name) for row in samples]) for name in names}
    units: dict[str, str] = {}
    for one in records:
        if isinstance(one, Mapping):
            units |= _units_of(one, names)
    return {name: one for name, one in found.items() if np.isfinite(one).any()}, units


def _members(record: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Members of a record, those of its members behind a point."""
    found: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, Mapping):
            found |= _members(value, f"{before}{name}.")
        else:
            found[f"{before}{name}"] = value
    return found


def _units_of(record: Mapping[str, Any], names: Any) -> dict[str, str]:
    stated = next((record[key] for key in _UNITS if key in record), None)
    if not isinstance(stated, Mapping):
        return {}
    return {
        name: str(unit)
        for name, unit in stated.items()
        if name in names and unit != "-"
    }


def _numbers(cells: Sequence[Any]) -> np.ndarray:
    """Numbers of a column, or the times that its texts say, [s]; NaN for all else."""
    texts = [one for one in cells if isinstance(one, str)]
    if texts and all(map(is_stamp, texts)):
        return stamps_in_seconds([str(one) for one in cells])[0]
    return np.array([_number(one) for one in cells], dtype=float)


def _is_value(cell: Any) -> bool:
    if isinstance(cell, str) and is_stamp(cell):
        return True
    return bool(np.isfinite(_number(cell)))


def _number(cell: Any) -> float:
    if not isinstance(cell, bool | int | float | str):
        return float("nan")
    try:
        return float(cell)
    except ValueError:
        return float("nan")
