"""Long tables: a row for each number, which says which signal it is of.

Databases of measurements and historians of plants export time, name and value in three
columns, one signal below the other; further columns of words may tell recordings apart.
Here each signal becomes a column, and each recording a table, on the stamps that the
signals have in common. Signals that have none in common keep stamps of their own.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from hwid_cli.data.column_words import counts_recordings
from hwid_cli.data.columns import ROLES, MeasuredColumn, array_column, keep_rows
from hwid_cli.data.units import split_unit, unit_in_name
from hwid_cli.errors import MissingColumnError
from hwid_cli.files.messages import is_plain, shown
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.experiment import Columns
from hwid_cli.records.starter import FoundColumn

# Names of the columns that hold numbers, names of signals and times; in lower case.
_OF_VALUES = ("_value", "value", "wert", "val", "reading", "messwert", "metric_value")
_OF_NAMES = (
    *("_field", "field", "channel", "kanal", "signal", "variable", "variablename"),
    *("tag", "tagname", "tag_name", "sensor", "point", "parameter", "name", "key"),
    *("metric", "topic", "series", "measurement", "item", "messgröße"),
)
_OF_TIMES = ("_time", "time", "timestamp", "zeit", "zeitstempel", "datetime", "t", "ts")
_FEWEST_NAMES, _MOST_NAMES = 2, 200
# Signals are put on common stamps where so many of theirs are the same, [-].
_IN_COMMON = 0.5


@dataclass(frozen=True)
class LongForm:
    """Which columns of a file make it a long table.

    Parameters
    ----------
    time, name, value : int
    others : tuple of int
        Further columns of words, and those that count recordings: each may tell these
        apart.
    """

    time: int
    name: int
    value: int
    others: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class LongTable:
    """Signals of one recording, each with its stamps.

    Parameters
    ----------
    name : str
        Of the recording; empty where a file holds one.
    clock : str
        Name of the column of times.
    unit : str
        Of the clock; empty where nothing says it.
    signals : mapping of str to tuple of two ndarray, shape (n_own,)
        Stamps, [unit of the clock], and values, by name.
    """

    name: str
    clock: str
    unit: str
    signals: Mapping[str, tuple[np.ndarray, np.ndarray]]

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Columns of a table with a row for each stamp, the clock first.

        Returns
        -------
        dict of str to ndarray, shape (n_stamps,)
            NaN where a signal has no number. Signals that share few stamps with the
            longest one have a clock of their own behind that, and their own length.
        """
        stamps = {name: np.unique(times) for name, (times, _) in self.signals.items()}
        longest = max(stamps.values(), key=len)
        alike = [one for one in stamps if _share_in(stamps[one], longest) >= _IN_COMMON]
        common = reduce(np.union1d, [stamps[one] for one in alike])
        found = {self.clock: common}
        for name in alike:
            times, values = self.signals[name]
            found[name] = np.full(common.size, np.nan)
            found[name][np.searchsorted(common, times)] = values
        for name in [one for one in stamps if one not in alike]:
            times, values = self.signals[name]
            order = np.argsort(times, kind="stable")
            found[self._own_clock(name)] = times[order]
            found[name] = values[order]
        return found

    def is_clock(self, column: str) -> bool:
        """Whether a column is that of times, or a signal's own one."""
        return column in (self.clock, *map(self._own_clock, self.signals))

    def _own_clock(self, name: str) -> str:
        return f"{self.clock} of {name}"


def _share_in(stamps: np.ndarray, others: np.ndarray) -> float:
    """Share of some stamps that others hold, too."""
    return float(np.isin(stamps, others).mean())


def long_form_of(names: Sequence[str], texts: Iterable[int]) -> LongForm | None:
    """Columns that make a table a long one; None where it is none.

    Parameters
    ----------
    names : sequence of str
        Names of all columns.
    texts : iterable of int
        Columns of words.
    """
    lower = [split_unit(name)[0].strip().lower() for name in names]
    words = [place for place in texts if place < len(lower)]
    value = next((lower.index(one) for one in _OF_VALUES if one in lower), None)
    time = next((lower.index(one) for one in _OF_TIMES if one in lower), None)
    named = (place for one in _OF_NAMES for place in words if lower[place] == one)
    name = next(named, None)
    if value is None or time is None or name is None or value in words:
        return None
    counts = [place for place, one in enumerate(names) if counts_recordings(one)]
    telling = sorted({*words, *counts} - {name, value, time})
    others = tuple(place for place in telling if lower[place])
    return LongForm(time, name, value, others)


def long_tables(
    clock: str,
    numbers: tuple[MeasuredColumn, MeasuredColumn],
    words_of: Callable[[Sequence[int], np.ndarray], Mapping[int, Sequence[str]]],
    form: LongForm,
) -> tuple[LongTable, ...]:
    """Tables that a long one holds.

    Parameters
    ----------
    clock : str
        Name of the column of times.
    numbers : tuple of two MeasuredColumn
        Times and values; the rows that one of them lacks at its end are left out.
    words_of : callable
        Cells of columns of words in some rows of the file, by column.

    Returns
    -------
    tuple of LongTable
        In the order in which they begin; empty where there are no two signals.
    """
    n = min(one.values.size for one in numbers)
    time, value = (keep_rows(one, slice(n)) for one in numbers)
    words = words_of((form.name, *form.others), value.rows)
    names = np.asarray(words[form.name])
    known = np.isfinite(time.values) & np.isfinite(value.values)
    if not _FEWEST_NAMES <= np.unique(names[known]).size <= _MOST_NAMES:
        return ()
    # What differs between signals of one recording tells none apart.
    telling = [place for place in form.others if _tells_apart(names, words[place])]
    labels = np.array(
        [
            "/".join(parts)
            for parts in zip(*(words[one] for one in telling), strict=True)
        ]
        if telling
        else [""] * names.size
    )
    unit = time.unit or unit_in_name(clock, "time")
    tables = []
    for label in dict.fromkeys(labels.tolist()):
        signals = {}
        for name in dict.fromkeys(names.tolist()):
            rows = known & (labels == label) & (names == name)
            if rows.any() and is_plain(name) and name:
                signals[name] = (time.values[rows], value.values[rows])
        if len(signals) >= _FEWEST_NAMES:
            tables.append(LongTable(label, clock, unit, signals))
    return tuple(tables)


def _tells_apart(names: np.ndarray, words: Sequence[str]) -> bool:
    """Whether several words stand beside one and the same signal."""
    cells = np.asarray(words)
    kinds = np.unique(cells)
    if not 1 < kinds.size <= _MOST_NAMES:
        return False
    counts = [np.unique(cells[names == name]).size for name in np.unique(names)]
    return 2 * sum(count > 1 for count in counts) > len(counts)


def columns_of_long(tables: Sequence[LongTable]) -> tuple[FoundColumn, ...]:
    """List the columns of long tables."""
    return tuple(
        FoundColumn(
            name,
            name,
            values,
            table.name or None,
            table.unit if table.is_clock(name) else "",
        )
        for table in tables
        for name, values in table.columns.items()
    )


def pick_from_long(
    place: str,
    columns: Columns,
    tables: Sequence[LongTable],
    roles: Sequence[str] = ROLES,
) -> list[tuple[str, MeasuredColumn]]:
    """Columns of some roles.

    Parameters
    ----------
    place : str
        File, for messages.

    Raises
    ------
    MissingColumnError
        If there is no such table or signal.
    """
    names = [table.name for table in tables]
    table = next((one for one in tables if one.name == (columns.variable or "")), None)
    if table is None and columns.variable is None and len(tables) == 1:
        table = tables[0]
    if table is None:
        asked = columns.variable or ""
        raise MissingColumnError(
            f"{place}: holds {len(tables)} recordings, none of them {shown(asked)}; "
            f"{did_you_mean(asked, names)}; name one in recordings.columns.variable, or "
            "'*' for all"
        )
    found = []
    there = table.columns
    for role in roles:
        key = getattr(columns, role)
        if key is None:
            continue
        if key not in there:
            raise MissingColumnError(
                f"{place}: has no signal {key!r} for the {role}; "
                f"{did_you_mean(str(key), list(there))}"
            )
        named = unit_in_name(str(key), "output" if role == "reference" else role)
        unit = table.unit if table.is_clock(str(key)) else named
        said_by = f"the name {key!r}" if unit else ""
        title = f"{role} {key!r}"
        found.append(
            (role, array_column(title, there[key], unit=unit, unit_said_by=said_by))
        )
    return found
