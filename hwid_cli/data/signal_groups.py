"""Groups of signals with clocks: what TDMS and MDF files hold, as named arrays.

A signal is ``group/name``, its time ``group/time``; a file with one group needs no group
in its names. Units stand behind the mark of ``array_columns``.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import UNIT_MARK, Variables, check_size

_TIME = "time"


@dataclass(frozen=True)
class GroupedSignal:
    """A signal of a group.

    Parameters
    ----------
    clock : object
        What tells signals of one clock from others of their group.
    size : int, [samples]
    values, times : callable
        Give arrays of shape (size,); ``times`` in seconds, None for a signal without.
    unit : str
        Empty where the file says none.
    """

    group: str
    name: str
    clock: object
    size: int
    values: Callable[[], Any]
    times: Callable[[], Any] | None
    unit: str = ""


def as_variables(signals: Iterable[GroupedSignal]) -> Variables:
    """Give signals and their clocks as variables.

    Raises
    ------
    ValueError
        If a signal is too long, or two of one group have one name.
    """
    known = list(signals)
    groups = {one.group for one in known}
    found: dict[str, Callable[[], Any]] = {}
    repeated = Counter((one.group, one.name) for one in known)
    clocks: dict[tuple[str, object], str] = {}
    for one in known:
        check_size(one.name, 8 * one.size)
        if repeated[one.group, one.name] > 1:
            raise ValueError(f"holds {one.name!r} twice in the group {one.group!r}")
        place = "" if len(groups) == 1 else f"{one.group}/"
        found[f"{place}{one.name}"] = one.values
        if one.unit:
            found[f"{place}{one.name}{UNIT_MARK}"] = _constant(one.unit)
        if one.times is None or (one.group, one.clock) in clocks:
            continue
        is_first = not any(group == one.group for group, _ in clocks)
        name = f"{place}{_TIME}" if is_first else f"{place}{one.name}/{_TIME}"
        while name in found or any(f"{place}{other.name}" == name for other in known):
            name += "_s"
        clocks[one.group, one.clock] = name
        found[name] = one.times
        found[name + UNIT_MARK] = _constant("s")
    return found


def _constant(text: str) -> Callable[[], Any]:
    return lambda: np.array(text)
