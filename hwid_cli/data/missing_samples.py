"""Samples that a file does not have: a blank cell, NaN, a word for no number.

A single one between two others is bridged by a straight line, and said to be. More of
them are a fault, which the checks refuse, or a slow signal in the rows of a fast one,
which can be resampled.
"""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

from hwid_cli.data.cells import MISSING_WORDS
from hwid_cli.data.columns import ROLES, FileColumns, MeasuredColumn, place_of

_log = logging.getLogger(__name__)

# Beyond this share a signal is no longer one with a sample lost, [-].
_MOST_BRIDGED = 0.01
# Instruments send 9.9E37 for overflow and 9.91E37 for no number (SCPI 1999, 7.2.1).
_NO_NUMBER, _NO_MORE = 9.9e37, 1e38


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
    """Bridge single missing samples.

    Parameters
    ----------
    path : Path
        For messages.

    Returns
    -------
    FileColumns
        Columns that lack more than single samples are left as they are.
    dict of str to tuple of int, [samples]
        Samples that were bridged, by role.
    """
    bridged: dict[str, tuple[int, ...]] = {}
    changed: dict[str, MeasuredColumn] = {}
    for role in ROLES:
        column = getattr(columns, role)
        if column is not None and (is_none := _says_none(column.values)).any():
            column = replace(column, values=np.where(is_none, np.nan, column.values))
            changed[role] = column
        places = np.zeros(0, int) if column is None else _single(missing(column))
        if places.size == 0:
            continue
        values = column.values.copy()
        values[places] = 0.5 * values[places - 1] + 0.5 * values[places + 1]
        changed[role] = replace(column, values=values)
        bridged[role] = tuple(int(place) for place in places)
        more = f" (and {places.size - 1} more)" if places.size > 1 else ""
        _log.warning(
            "%s: %s has no number%s; a straight line bridges it",
            place_of(path, column, int(places[0])),
            column.title,
            more,
        )
    return replace(columns, **changed), bridged


def _says_none(values: np.ndarray) -> np.ndarray:
    return (np.abs(values) >= _NO_NUMBER) & (np.abs(values) < _NO_MORE)


def _single(is_lost: np.ndarray) -> np.ndarray:
    """Places of lost samples, if each stands alone between two that are there."""
    places = np.flatnonzero(is_lost)
    if places.size == 0 or places.size > max(1.0, _MOST_BRIDGED * is_lost.size):
        return np.zeros(0, int)
    at_end = places[0] == 0 or places[-1] == is_lost.size - 1
    together = bool((np.diff(places) == 1).any())
    return np.zeros(0, int) if at_end or together else places
