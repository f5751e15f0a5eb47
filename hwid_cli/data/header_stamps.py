"""Time stamps in the headers of ROS messages, as exports of bags name their columns.

A bag has two times of each message: when it was recorded, which jitters with the
network, and ``header.stamp``, when its publisher sampled. The second one is the clock of
the signals. Some exports write it as whole seconds and nanoseconds in two columns.
"""

import re
from collections.abc import Sequence

import numpy as np

from hwid_cli.data.columns import MeasuredColumn
from hwid_cli.records.starter import FoundColumn

_STAMP = re.compile(r"(.*?)(?:field\.)?header([._/])stamp")
_SECONDS, _NANOSECONDS = ("secs", "sec"), ("nsecs", "nanosec", "nsec", "nanosecs")
_UNIT, _SAID_BY = "s", "its seconds and nanoseconds"


def topic_of(title: str) -> str | None:
    """Give what stands in front of a header's stamp: other columns of the message share it.

    Returns
    -------
    str or None
        None for another column.

    Examples
    --------
    >>> topic_of("/joint_states/header/stamp"), topic_of("field.header.stamp")
    ('/joint_states/', '')
    >>> topic_of("time") is None
    True
    """
    found = _STAMP.fullmatch(title)
    return None if found is None else found[1]


def split_stamps(names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Find stamps in two columns.

    Parameters
    ----------
    names : sequence of str
        Of all columns.

    Returns
    -------
    dict of str to tuple of int
        Places of seconds and nanoseconds, by the name of both together.

    Examples
    --------
    >>> split_stamps(["Time", "header.stamp.secs", "header.stamp.nsecs", "position"])
    {'header.stamp': (1, 2)}
    """
    found = {}
    for place, name in enumerate(names):
        stem, mark, last = name[: -len(_last(name))][:-1], _mark(name), _last(name)
        if last not in _SECONDS or topic_of(stem) is None or stem in names:
            continue
        others = [f"{stem}{mark}{one}" for one in _NANOSECONDS]
        other = next((one for one in others if names.count(one) == 1), None)
        if other is not None and names.count(name) == 1:
            found[stem] = place, names.index(other)
    return found


def _last(name: str) -> str:
    return re.split(r"[._/]", name)[-1]


def _mark(name: str) -> str:
    return name[: -len(_last(name))][-1:]


def joined_stamp(
    seconds: MeasuredColumn, nanoseconds: MeasuredColumn
) -> MeasuredColumn:
    """Give the clock of two columns, from the second in which it begins."""
    n = min(seconds.values.size, nanoseconds.values.size)
    values = _joined(seconds.values[:n], nanoseconds.values[:n])
    return MeasuredColumn(
        seconds.title,
        values,
        seconds.rows[:n],
        rows_from_zero=seconds.rows_from_zero,
        texts={**nanoseconds.texts, **seconds.texts},
        unit=_UNIT,
        unit_said_by=_SAID_BY,
    )


def _joined(seconds: np.ndarray, nanoseconds: np.ndarray) -> np.ndarray:
    # Seconds since 1970 would leave no digits for the nanoseconds.
    known = seconds[np.isfinite(seconds)]
    first = known[0] if known.size else 0.0
    return np.asarray((seconds - first) + 1e-9 * nanoseconds)


def with_joined_stamps(found: Sequence[FoundColumn]) -> tuple[FoundColumn, ...]:
    """Stand one column for the two of each stamp, in the place of the first."""
    changed = list(found)
    for stem, (first, second) in split_stamps([one.title for one in found]).items():
        seconds, nanoseconds = found[first], found[second]
        if seconds.values.size != nanoseconds.values.size:
            continue
        values = _joined(seconds.values, nanoseconds.values)
        clock = FoundColumn(stem, stem, values, seconds.variable, _UNIT)
        place = next(n for n, one in enumerate(changed) if one is seconds)
        changed[place] = clock
        changed = [one for one in changed if one is not nanoseconds]
    return tuple(changed)
