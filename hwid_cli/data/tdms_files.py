"""Channels of a TDMS file of LabVIEW, by the library npTDMS."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import Variables
from hwid_cli.data.signal_groups import GroupedSignal, as_variables

_STEP, _BEGIN = "wf_increment", "wf_start_offset"
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
            _signal(group.name, channel)
            for group in file.groups()
            for channel in group.channels()
            if len(channel) and channel.dtype.kind in "fiubM"
        ]
        yield as_variables(channels)


def _signal(group: str, channel: Any) -> GroupedSignal:
    said = channel.properties
    step, begin = (float(said.get(name, 0.0) or 0.0) for name in (_STEP, _BEGIN))
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
