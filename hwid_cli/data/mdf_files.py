"""Signals of an MDF file (version 3 and 4), by the library asammdf."""

import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hwid_cli.data.array_columns import Variables, check_size
from hwid_cli.data.signal_groups import GroupedSignal, as_variables
from hwid_cli.files.messages import shown

# Of a formula by which raw numbers become physical ones.
_LONGEST_FORMULA, _SHOWN = 500, 60
_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")
_NAME = re.compile(r"[^\W\d]\w*")
_FOREIGN_SIGN = re.compile(r"[^\d.\s+*/%()<>=!&|~,-]|\.\D|\.$")
_KNOWN_NAME = re.compile(
    "X1?|P[1-6]|INF|NaN|where|abs|sqrt|expm1?|log|log10|log1p|floor|ceil|"
    "(arc)?(sin|cos|tan)h?|arctan2"
)


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
    from asammdf.blocks import v2_v3_blocks, v4_blocks
    from asammdf.blocks.utils import MdfException

    modules: tuple[Any, ...] = (v2_v3_blocks, v4_blocks)
    for blocks in modules:
        # The library would run a formula that is none as Python, with all that this can do.
        blocks.evaluate, blocks.lambdify = _evaluate, _refuse
    try:
        return MDF(str(path), raise_on_multiple_occurrences=False)
    except MdfException as error:
        # It names its own buffer in place of the file.
        said = re.sub(r"'<.*?>'", "it", str(error))
        raise ValueError(said) from None


def _evaluate(formula: str) -> Any:
    """What a formula of the file makes of raw numbers, called from within the library.

    Raises
    ------
    ValueError
        If it holds anything but numbers, the raw value and functions of arithmetic.
    """
    from numexpr import evaluate

    names = set(_NAME.findall(_NUMBER.sub(" ", formula)))
    is_known = all(map(_KNOWN_NAME.fullmatch, names)) and not _FOREIGN_SIGN.search(
        _NAME.sub("", formula)
    )
    if len(formula) > _LONGEST_FORMULA or not is_known:
        _refuse(None, formula)
    # As the library does: by the names of the function that asks.
    known = sys._getframe(1).f_locals
    return evaluate(formula, {name: known[name] for name in names & known.keys()}, {})


def _refuse(_: object, formula: str, **__: object) -> NoReturn:
    raise ValueError(
        f"its conversion {shown(formula)[:_SHOWN]} is no formula of arithmetic; not run"
    )


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
