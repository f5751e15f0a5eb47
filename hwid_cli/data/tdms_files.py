"""Channels of a TDMS file of LabVIEW, by the library npTDMS."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import Variables
from hwid_cli.data.signal_groups import GroupedSignal, as_variables

_STEP, _BEGIN, _STARTED = "wf_increment", "wf_start_offset", "wf_start_time"
# Channels that begin further apart are no recording of one machine: such a date is a
# program's default, [s].
_LONGEST_WAIT_S = 3600.0
_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit", "units")


@contextmanager
def open_tdms(path: Path) -> Iterator[Variables]:
    """Open a TDMS file.

    Yields
    ------
    mapping of str to callable
        Channels with numbers or times, and the clocks that their properties state.
    """
    from nptdms import TdmsFile

    with TdmsFile.open(str(path)) as file:
        channels = [
            (group.name, channel)
            for group in file.groups()
            for channel in group.channels()
            if len(channel) and channel.dtype.kind in "fiubM"
        ]
        waits = _waits([channel for _, channel in channels])
        pairs = zip(channels, waits, strict=True)
        yield as_variables(_signal(*one, wait) for one, wait in pairs)


def _waits(channels: Sequence[Any]) -> list[float]:
    """By how much channels begin after the first of them, [s]; 0 where some do not say."""
    nothing = [0.0] * len(channels)
    dates = [
        np.datetime64(channel.properties[_STARTED])
        for channel in channels
        if _STARTED in channel.properties
    ]
    if len(dates) < len(channels) or not dates:
        return nothing
    waits = [(one - min(dates)) / np.timedelta64(1, "s") for one in dates]
    return [float(one) for one in waits] if max(waits) < _LONGEST_WAIT_S else nothing


def _signal(group: str, channel: Any, wait: float) -> GroupedSignal:
    said = channel.properties
    step, begin = (float(said.get(name, 0.0) or 0.0) for name in (_STEP, _BEGIN))
    begin += wait
    size = len(channel)
    has_clock = step > 0 and channel.dtype.kind != "M"
    unit = next((str(said[name]) for name in _UNITS if said.get(name)), "")
    is_time = channel.dtype.kind == "M"
    return GroupedSignal(
        group,
        channel.name,
        (step, begin, size),
        size,
        partial(_values, channel),
        partial(_times, begin, step, size) if has_clock else None,
        "s" if is_time else unit,
    )


def _values(channel: Any) -> Any:
    values = channel[:]
    if values.dtype.kind != "M":
        return values
    since = values - values[0].astype("datetime64[D]")
    return since.astype("timedelta64[ns]").astype(float) / 1e9


def _times(begin: float, step: float, size: int) -> Any:
    return begin + step * np.arange(size)
