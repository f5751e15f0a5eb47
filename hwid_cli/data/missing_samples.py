"""Samples that a file does not have: a blank cell, NaN, a word for no number.

A few between two others are bridged by a straight line, and said to be. More of them
are a fault, which the checks refuse, or a slow signal in the rows of a fast one, which can
be resampled. Where a signal was out of range, a line would cut its top off: one sample is
bridged there, and no more.
"""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

from hwid_cli.data.cells import MISSING_WORDS, OVER_RANGE_WORDS
from hwid_cli.data.columns import ROLES, FileColumns, MeasuredColumn, place_of

_log = logging.getLogger(__name__)

# Beyond this share a signal is no longer one with a sample lost, [-], and beyond so many
# in a row the line would be a guess, [samples].
_MOST_BRIDGED = 0.01
_LONGEST_BRIDGE = 10
# Instruments send 9.9E37 for overflow and 9.91E37 for no number (SCPI 1999, 7.2.1);
# loggers write 7.77777E+99 for a wire that is broken. Among others below this they are none.
_NO_NUMBER, _LARGEST_NUMBER = 9.9e37, 1e30
# Loggers write these, where they are farther from the others than these reach,
# this many times (LAS 2.0 has -999.25 in its header, catman 1000000 for overflow).
_CODES = (
    *(-999.0, -999.25, -9999.0, -9999.25, -99999.0, -999999.0, 9999.0, 99999.0),
    *(-1e6, 1e6),
)
_FAR = 1.0


def missing(column: MeasuredColumn) -> np.ndarray:
    """Say which samples are missing, and not damaged in another way.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    is_lost = np.isnan(column.values)
    for index in np.flatnonzero(is_lost):
        text = column.texts.get(int(column.rows[index]), "")
        is_lost[index] = text.lower() in MISSING_WORDS
    return is_lost


def bridge_missing(
    path: Path, columns: FileColumns
) -> tuple[FileColumns, dict[str, tuple[int, ...]]]:
    """Bridge a few missing samples.

    Parameters
    ----------
    path : Path
        For messages.

    Returns
    -------
    FileColumns
        Columns that lack more are left as they are.
    dict of str to tuple of int, [samples]
        Samples that were bridged, by role.
    """
    bridged: dict[str, tuple[int, ...]] = {}
    changed: dict[str, MeasuredColumn] = {}
    for role in ROLES:
        column = getattr(columns, role)
        if column is None:
            continue
        changed[role], places = bridge_column(path, column)
        if places:
            bridged[role] = places
    return replace(columns, **changed), bridged


def bridge_column(
    path: Path, column: MeasuredColumn
) -> tuple[MeasuredColumn, tuple[int, ...]]:
    """Bridge a few missing samples of one column, and say so.

    Returns
    -------
    MeasuredColumn
        As it is where it lacks more.
    tuple of int, [samples]
        That were bridged.
    """
    if (is_none := _says_none(column.values)).any():
        column = replace(column, values=np.where(is_none, np.nan, column.values))
    places = _bridged(column)
    if places.size == 0:
        return column, ()
    values = column.values.copy()
    known = np.flatnonzero(np.isfinite(values))
    values[places] = np.interp(places, known, values[known])
    more = f" (and {places.size - 1} more)" if places.size > 1 else ""
    _log.warning(
        "%s: %s has no number%s; a straight line bridges it",
        place_of(path, column, int(places[0])),
        column.title,
        more,
    )
    return replace(column, values=values), tuple(int(place) for place in places)


def _says_none(values: np.ndarray) -> np.ndarray:
    size = np.abs(values)
    is_none = (size >= _NO_NUMBER) & np.isfinite(values)
    others = size[~is_none & np.isfinite(values)]
    if others.size < is_none.sum() or others.max(initial=0.0) > _LARGEST_NUMBER:
        is_none[:] = False
    return is_none | _are_codes(np.where(is_none, np.nan, values))


def _are_codes(values: np.ndarray) -> np.ndarray:
    """Which values are a logger's number for no number, far from all others."""
    found = np.isin(values, _CODES)
    others = values[np.isfinite(values) & ~found]
    if not found.any() or others.size == 0:
        return np.zeros(values.size, dtype=bool)
    low, high = float(others.min()), float(others.max())
    away = _FAR * max(high - low, abs(low), abs(high))
    return found & ((values < low - away) | (values > high + away))


def _bridged(column: MeasuredColumn) -> np.ndarray:
    """Places of lost samples, if they are few and stand between some that are there."""
    is_lost = missing(column)
    places = np.flatnonzero(is_lost)
    if places.size == 0 or places.size > max(1.0, _MOST_BRIDGED * is_lost.size):
        return np.zeros(0, int)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    at_end = places[0] == 0 or places[-1] == is_lost.size - 1
    is_long = any(run.size > _longest(column, run) for run in runs)
    return np.zeros(0, int) if at_end or is_long else places


def _longest(column: MeasuredColumn, run: np.ndarray) -> int:
    """How many samples in a row may be bridged where some are missing."""
    is_over = any(is_over_range(column, int(one)) for one in run)
    return 1 if is_over else _LONGEST_BRIDGE


def is_over_range(column: MeasuredColumn, index: int) -> bool:
    """Whether a word says that a signal was out of range at a sample."""
    text = column.texts.get(int(column.rows[index]), "")
    return text.lower() in OVER_RANGE_WORDS
