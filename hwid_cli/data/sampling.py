"""The time column: is it a clock, what does it tick, and a uniform grid where not.

Models are discrete, so a recording must be sampled uniformly. Small jitter passes;
larger jitter is refused, or resampled where the configuration says so.
"""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

from hwid_cli.data.columns import (
    FileColumns,
    MeasuredColumn,
    array_column,
    place_of,
    with_each,
)
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import RecordingsOptions

# The mean step of a clock that only scatters is this close to the median one.
_SCATTER = 0.02
# A clock that keeps its step most of the time has no jitter, but gaps.
_REGULAR, _MOSTLY = 1e-3, 0.5

_log = logging.getLogger(__name__)

# Time stamps carry rounding errors; a relative difference below this is one.
_ROUNDING = 1e-9
# Digits of a resampling step that was read off jittering time stamps.
_STEP_DIGITS = 6
# Resampling fills gaps by straight lines; beyond this growth it would invent data.
_MOST_GROWTH = 2
# Two time stamps make one step; one makes none.
_FEWEST_STAMPS = 2


def sample_uniformly(
    path: Path, columns: FileColumns, options: RecordingsOptions
) -> tuple[FileColumns, float]:
    """Give the columns on a uniform grid, and its step.

    Parameters
    ----------
    path : Path
        For messages.
    columns : FileColumns
        Checked for finite numbers.
    options : RecordingsOptions
        ``sample_time_s``, ``sampling_tolerance`` and ``resample``.

    Returns
    -------
    FileColumns
        Unchanged unless it had to be resampled.
    float, [s]

    Raises
    ------
    MeasurementError
        If time is too short, repeats, goes back, jumps or contradicts
        ``sample_time_s``.
    """
    time = columns.time
    if time is None:
        if options.sample_time_s is None:
            raise ValueError("neither a time column nor sample_time_s")
        return columns, options.sample_time_s
    _check_length(path, columns, time)
    steps = np.diff(time.values)
    _check_order(path, time, steps)
    median = float(np.median(steps))
    _check_against_options(path, median, options)
    jumps = np.abs(steps - median) > options.sampling_tolerance * median
    if not jumps.any():
        return columns, options.sample_time_s or _simplest_step(
            time.values, np.arange(time.values.size)
        )
    if not options.resample:
        index = int(np.argmax(jumps))
        raise MeasurementError(
            f"{place_of(path, time, index + 1)}: time steps by {steps[index]:.6g} s, "
            f"from {time.values[index]:.9g} s to {time.values[index + 1]:.9g} s; "
            f"expected {median:.6g} s within {options.sampling_tolerance:.3g} of it; "
            "set recordings.resample: true, or raise recordings.sampling_tolerance"
        )
    step = options.sample_time_s or _grid_step(time.values, median)
    _check_gaps(path, time, steps, step)
    _log.info(
        "%s: resampled to %.9g s, because %d of %d steps lie beyond the tolerance",
        path,
        step,
        int(jumps.sum()),
        steps.size,
    )
    return _resample(columns, time.values, step), step


def _grid_step(time: np.ndarray, median: float) -> float:
    """Step to resample by: that of the clock which the stamps scatter around.

    On the clock's own grid a reading moves by the jitter alone. Samples may be missing:
    ticks are counted with them where the stamps fit better so.
    """
    missing = np.maximum(np.round(np.diff(time) / median), 1.0) - 1.0
    every = np.arange(time.size, dtype=np.float64)
    counted = every + np.concatenate([[0.0], np.cumsum(missing)])
    ticks = min((every, counted), key=lambda one: _misfit(time, one))
    mean = float(time[-1] - time[0]) / ticks[-1]
    regular = np.abs(np.diff(time) - median) <= _REGULAR * median
    if np.mean(regular) < _MOSTLY and abs(mean - median) <= _SCATTER * median:
        return _simplest_step(time, ticks)
    return float(f"{median:.{_STEP_DIGITS}g}")


def _check_length(path: Path, columns: FileColumns, time: MeasuredColumn) -> None:
    others = (columns.input, columns.output, columns.reference)
    longest = max(one.values.size for one in others if one is not None)
    if time.values.size < longest:
        raise MeasurementError(
            f"{path}: {time.title} has {time.values.size} values for {longest} rows; "
            "expected a time in every row; fill the column, or leave out columns.time "
            "and give recordings.sample_time_s"
        )
    if time.values.size < _FEWEST_STAMPS:
        raise MeasurementError(
            f"{path}: has {time.values.size} rows; expected a whole measurement; "
            "export it again or leave the file out"
        )


def _check_order(path: Path, time: MeasuredColumn, steps: np.ndarray) -> None:
    if (steps > 0).all():
        return
    index = int(np.argmin(steps > 0))
    before, after = time.values[index], time.values[index + 1]
    place = place_of(path, time, index + 1)
    if after < before:
        raise MeasurementError(
            f"{place}: time goes back from {before:.9g} s to {after:.9g} s; expected "
            "time to go on; sort or cut the file"
        )
    raise MeasurementError(
        f"{place}: time {after:.9g} s is repeated; expected a later time than in the "
        "row before; remove repeated rows"
    )


def _check_against_options(
    path: Path, median: float, options: RecordingsOptions
) -> None:
    stated = options.sample_time_s
    if stated and abs(stated - median) > options.sampling_tolerance * stated:
        raise MeasurementError(
            f"{path}: the time column steps by {median:.6g} s; expected {stated:.6g} s "
            "as recordings.sample_time_s says; correct that key or leave it out"
        )


def _simplest_step(time: np.ndarray, ticks: np.ndarray) -> float:
    """Shortest decimal number that fits the stamps as well as their mean step does."""
    step = float(time[-1] - time[0]) / ticks[-1]
    allowed = max(_misfit(time, ticks) / ticks[-1], _ROUNDING * step)
    for digits in range(1, 17):
        simple = float(f"{step:.{digits}g}")
        if abs(simple - step) <= allowed:
            return simple
    return step


def _misfit(time: np.ndarray, ticks: np.ndarray) -> float:
    """Largest distance of the stamps from ticks of their mean step."""
    step = float(time[-1] - time[0]) / ticks[-1]
    return float(np.max(np.abs(time - time[0] - step * ticks)))


def _check_gaps(
    path: Path, time: MeasuredColumn, steps: np.ndarray, step: float
) -> None:
    """Refuse to make up most of a recording."""
    if steps.sum() / step > _MOST_GROWTH * time.values.size:
        index = int(np.argmax(steps))
        raise MeasurementError(
            f"{place_of(path, time, index + 1)}: time jumps by {steps[index]:.6g} s, "
            f"from {time.values[index]:.9g} s to {time.values[index + 1]:.9g} s; "
            f"expected steps near {step:.6g} s; cut the file at the gap"
        )


def _resample(columns: FileColumns, stamps: np.ndarray, step: float) -> FileColumns:
    """Put every column on a grid over its own stretch of time.

    An output is interpolated. An input is averaged over each step of the grid, because
    what it moves follows its integral: corners keep their time.
    """

    def resampled(column: MeasuredColumn) -> MeasuredColumn:
        known = stamps[: column.values.size]
        # The small share keeps a last sample that rounding pushed past the end.
        count = int((known[-1] - known[0]) / step * (1 + _ROUNDING)) + 1
        grid = known[0] + step * np.arange(count)
        is_input = column is columns.input
        values = _averaged if is_input else np.interp
        return array_column(
            column.title,
            values(grid, known, column.values),
            unit=column.unit,
            unit_said_by=column.unit_said_by,
        )

    return replace(with_each(columns, resampled), time=None)


def _averaged(grid: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Means of straight lines between samples, half a step to either side."""
    edges = np.concatenate([grid[:1], 0.5 * (grid[1:] + grid[:-1]), grid[-1:]])
    lines = np.concatenate(
        [[0.0], np.cumsum(0.5 * np.diff(known) * (values[1:] + values[:-1]))]
    )
    # Within a line the integral is a parabola.
    row = np.clip(np.searchsorted(known, edges, side="right") - 1, 0, known.size - 2)
    done = np.clip(edges - known[row], 0.0, None)
    slope = (values[row + 1] - values[row]) / (known[row + 1] - known[row])
    integral = lines[row] + done * (values[row] + 0.5 * slope * done)
    means = np.diff(integral) / np.diff(edges)
    # Half a step has no middle at the grid's ends.
    means[[0, -1]] = np.interp(grid[[0, -1]], known, values)
    return means
