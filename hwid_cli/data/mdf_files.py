"""Signals of an MDF file (version 3 and 4), by the library asammdf."""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import Variables, check_size
from hwid_cli.data.signal_groups import GroupedSignal, as_variables


@contextmanager
def open_mdf(path: Path) -> Iterator[Variables]:
    """Open an MDF file.

    Yields
    ------
    mapping of str to callable
        Signals with numbers, and the clock of each group.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with _opened(path) as file:
            yield as_variables(_signals(file))


def _opened(path: Path) -> Any:
    from asammdf import MDF
    from asammdf.blocks.utils import MdfException

    try:
        return MDF(str(path), raise_on_multiple_occurrences=False)
    except MdfException as error:
        # It names its own buffer in place of the file.
        said = re.sub(r"'<.*?>'", "it", str(error))
        raise ValueError(said) from None


def _signals(file: Any) -> Iterator[GroupedSignal]:
    for number, group in enumerate(file.groups):
        count = int(group.channel_group.cycles_nr)
        master = file.masters_db.get(number)
        if not count:
            continue
        name = str(getattr(group.channel_group, "acq_name", "") or f"group {number}")
        check_size(name, 8 * count)
        for index, channel in enumerate(group.channels):
            if index == master:
                continue
            conversion = getattr(channel, "conversion", None)
            unit = channel.unit or getattr(conversion, "unit", "") or ""
            yield GroupedSignal(
                f"{name}" if _is_alone(file, number, name) else f"{name} {number}",
                channel.name,
                number,
                count,
                partial(_values, file, number, index),
                None if master is None else partial(_times, file, number),
                str(unit),
            )


def _is_alone(file: Any, number: int, name: str) -> bool:
    others = (
        getattr(group.channel_group, "acq_name", "")
        for other, group in enumerate(file.groups)
        if other != number
    )
    return name not in others


def _values(file: Any, group: int, index: int) -> Any:
    signal = file.get(group=group, index=index)
    samples = np.asarray(signal.samples)
    if samples.dtype.kind not in "fiub":
        return samples
    values = samples.astype(float)
    invalid = signal.invalidation_bits
    if invalid is not None:
        values[np.asarray(invalid, dtype=bool)] = np.nan
    return values


def _times(file: Any, group: int) -> Any:
    return np.asarray(file.get_master(group), dtype=float)
