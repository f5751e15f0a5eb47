"""Columns that stand still in a recording and differ between recordings.

A valve, a load or a temperature that is set once for each recording is no signal: no model
has it as its input. A recording with another setting is one of another plant.
"""

from collections import Counter
from collections.abc import Collection, Sequence

import numpy as np

from hwid_cli.data.column_clocks import clock_of_column, long_columns
from hwid_cli.data.column_words import counts_recordings
from hwid_cli.files.messages import escaped
from hwid_cli.records.starter import FoundFile

# Columns that are named, and files of each: a note is to be read.
_MOST_NOTES, _MOST_FILES = 3, 4
# A setting stands still in more than this share of the files, [-].
_MOSTLY = 0.5
# Values in a file below this share of the largest one are no change, [-].
_ROUNDING = 1e-9

_Place = tuple[str | None, str | int]


def condition_notes(
    files: Sequence[FoundFile], signals: Collection[_Place]
) -> tuple[str, ...]:
    """Say which columns stand still in most files, and where they are another.

    Parameters
    ----------
    files : sequence of FoundFile
        Those that are used.
    signals : collection of place
        Columns that have a role.

    Examples
    --------
    >>> from hwid_cli.records.starter import FoundColumn
    >>> files = [
    ...     FoundFile(name, (FoundColumn("valve", "valve", np.full(200, value)),))
    ...     for name, value in (("a.csv", 1.0), ("b.csv", 1.0), ("c.csv", 0.6))
    ... ]
    >>> condition_notes(files, ())[0].split(": ")[1]
    "'valve' is 1 in 2 of 3 recordings, another in c.csv (0.6)"
    """
    titles = {
        column.place: escaped(str(column.title or column.key))
        for file in files
        for column in long_columns(file.columns)
        if column.place not in signals
        and clock_of_column(column) is None
        and not counts_recordings(column.title)
    }
    found = [_note(files, place, title) for place, title in titles.items()]
    return tuple([one for one in found if one][:_MOST_NOTES])


def _note(files: Sequence[FoundFile], place: _Place, title: str) -> str:
    """What to say of one column; empty where it is no setting, or the same everywhere."""
    values = {}
    for file in files:
        own = {column.place: column.values for column in file.columns}
        if place in own:
            values[file.name] = _held(own[place])
    still = [value for value in values.values() if value is not None]
    if len(still) <= _MOSTLY * len(values) or len(values) < 2:
        return ""
    usual, count = Counter(still).most_common(1)[0]
    others = [(name, value) for name, value in values.items() if value != usual]
    if not others:
        return ""
    what = f"is {usual:g} in {count} of {len(values)} recordings, another in"
    if count == 1:
        what, others = "differs between recordings:", list(values.items())
    said = ", ".join(
        f"{escaped(name)} ({'changes' if value is None else f'{value:g}'})"
        for name, value in others[:_MOST_FILES]
    )
    more = ", ..." if len(others) > _MOST_FILES else ""
    return (
        f"NOT USED: {title!r} {what} {said}{more}: no model has it as an input; recordings of "
        "another setting may be of another plant: leave them out (recordings.exclude), or "
        "expect models to be worse there"
    )


def _held(values: np.ndarray) -> float | None:
    """The value of a column that stands still; None where it changes or holds none."""
    known = values[np.isfinite(values)]
    if not known.size:
        return None
    if np.ptp(known) > _ROUNDING * float(np.max(np.abs(known))):
        return None
    return float(known[0])
