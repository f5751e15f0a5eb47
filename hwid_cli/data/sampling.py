"""The time column: is it a clock, what does it tick, and a uniform grid where not.

Models are discrete, so a recording must be sampled uniformly. Small jitter passes;
larger jitter is refused, or resampled where the configuration says so. So are signals
that have clocks of their own, or not a sample in every row.
"""

import logging
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import scipy

from hwid_cli.data.column_signs import (
    LONGEST_GAP,
    MOST_ODD,
    MOST_REPEATED,
    are_pauses,
    growing_rows,
)
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
# Stamps that keep to their mean step this much better than to the usual one are rounded.
_ROUNDED = 0.2

_log = logging.getLogger(__name__)

# Time stamps carry rounding errors; a relative difference below this is one.
_ROUNDING = 1e-9
# Digits of a resampling step that was read off jittering time stamps.
_STEP_DIGITS = 6
# Resampling fills gaps by straight lines; beyond this growth it would invent data.
_MOST_GROWTH = 2
# A curve goes through samples whose steps are between these shares of the usual one: two
# close together would shake it, and between two far apart it would invent data.
_SHORTEST_OF_CURVE, _LONGEST_OF_CURVE = 0.5, 1.5
_FEWEST_OF_CURVE = 8
# A sample within this share of a step is next to a point of the grid.
_NEXT_TO_IT = 0.05
# Clocks that differ by less than this share of their step are one, [-].
_SAME_CLOCK = 0.01
_SIGNALS = ("input", "output", "reference")
_FEWEST_SAMPLES = 20
# Two time stamps make one step; one makes none.
_FEWEST_STAMPS = 2
# A clock with so short a step has samples between those of a grid, [-].
_FASTER = 0.75


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
    columns = _without_second_clock(columns)
    _check_length(path, columns, time)
    columns = _without_repeated_rows(path, columns)
    if options.resample:
        columns = _without_odd_stamps(path, columns)
    time = columns.time or time
    steps = np.diff(time.values)
    _check_order(path, time, steps)
    median = float(np.median(steps))
    if columns.output_time is not None or _lacks_samples(columns):
        return _on_common_clock(path, columns, options)
    if options.resample and _is_faster(median, options):
        return _on_slower_grid(path, columns, time, options.sample_time_s or median)
    _check_against_options(path, median, options)
    jumps = np.abs(steps - median) > options.sampling_tolerance * median
    if not jumps.any():
        return columns, options.sample_time_s or _simplest_step(
            time.values, np.arange(time.values.size)
        )
    return _on_even_grid(path, columns, time, jumps, options)


def _is_faster(median: float, options: RecordingsOptions) -> bool:
    """Whether a clock ticks clearly faster than the stated one."""
    stated = options.sample_time_s
    return stated is not None and median < stated * (1.0 - options.sampling_tolerance)


def _on_slower_grid(
    path: Path, columns: FileColumns, time: MeasuredColumn, step: float
) -> tuple[FileColumns, float]:
    """Put a file that was sampled faster than others on their grid.

    Parameters
    ----------
    step : float, [s]
        Of that grid.
    """
    steps = np.diff(time.values)
    median = float(np.median(steps))
    _check_gaps(path, time, steps, median)
    _log.info("%s: a sample every %.9g s put on a grid of %.9g s", path, median, step)
    return _resample(columns, time.values, step), step


def _on_even_grid(
    path: Path,
    columns: FileColumns,
    time: MeasuredColumn,
    jumps: np.ndarray,
    options: RecordingsOptions,
) -> tuple[FileColumns, float]:
    """Resample where steps jump, if the configuration allows it.

    Parameters
    ----------
    jumps : ndarray of bool, shape (n_stamps - 1,)
        Steps beyond the tolerance.
    """
    steps = np.diff(time.values)
    median = float(np.median(steps))
    if not options.resample:
        _check_gaps(path, time, steps, median)
        index = int(np.argmax(jumps))
        raise MeasurementError(
            f"{place_of(path, time, index + 1)}: time steps by {steps[index]:.6g} s, "
            f"from {time.values[index]:.9g} s to {time.values[index + 1]:.9g} s; "
            f"expected {median:.6g} s within {options.sampling_tolerance:.3g} of it"
            f"{_lost(time.values)}; "
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
    if lost := missing_samples(time.values):
        _log.warning(
            "%s: %d samples are missing of %d; straight lines stand for them",
            path,
            lost,
            time.values.size + lost,
        )
    return _resample(columns, time.values, step), step


def missing_samples(stamps: np.ndarray) -> int:
    """Count the samples that a clock has ticked for and a file does not hold.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [any unit of time]
        Growing; of a clock that scatters as well as of one that is exact.

    Returns
    -------
    int, [-]

    Examples
    --------
    >>> missing_samples(np.array([0.0, 1.0, 2.0, 5.0, 6.0, 7.0, 8.0, 9.0]))
    2
    """
    steps = np.diff(stamps)
    if steps.size == 0 or not (steps > 0).all():
        return 0
    step = _grid_step(stamps, float(np.median(steps)))
    # A late stamp makes one step long and the next one short: these cancel, but for
    # their rounding, which the whole duration does not know.
    single = np.sum(np.round(steps / step) - 1.0)
    whole = np.round((stamps[-1] - stamps[0]) / step) - steps.size
    return max(int(min(single, whole)), 0)


def _lost(stamps: np.ndarray) -> str:
    count = missing_samples(stamps)
    are = "sample is" if count == 1 else "samples are"
    return f" ({count} {are} missing in the file)" if count else ""


def _without_second_clock(columns: FileColumns) -> FileColumns:
    """Drop a second clock that ticks as the first does."""
    time, other = columns.time, columns.output_time
    if time is None or other is None:
        return columns
    n = min(time.values.size, other.values.size)
    if n < _FEWEST_STAMPS or columns.output.values.size > time.values.size:
        return columns
    step = abs(float(time.values[n - 1] - time.values[0])) / (n - 1)
    far = np.max(np.abs(time.values[:n] - other.values[:n]))
    return replace(columns, output_time=None) if far <= _SAME_CLOCK * step else columns


def _without_repeated_rows(path: Path, columns: FileColumns) -> FileColumns:
    """Leave out rows that a logger wrote twice, to the last digit."""
    for group in _of_each_clock(columns):
        again = np.logical_and.reduce(
            [
                (one.values[1:] == one.values[:-1])
                | (np.isnan(one.values[1:]) & np.isnan(one.values[:-1]))
                for one in group.values()
            ]
        )
        # More of them are no slip of a logger, but a clock that is too coarse.
        if not 0.0 < np.mean(again) <= MOST_REPEATED:
            continue
        _log.warning(
            "%s: %d rows are the row before once more, and left out", path, again.sum()
        )
        columns = _kept_rows(columns, group, np.append(True, ~again))
    return columns


def _without_odd_stamps(path: Path, columns: FileColumns) -> FileColumns:
    """Leave out a few rows whose time does not go on from the rows around them."""
    for group in _of_each_clock(columns):
        time = next(iter(group.values()))
        if not np.isfinite(time.values).all():
            continue
        fits = growing_rows(time.values)
        if not 0.0 < np.mean(~fits) <= MOST_ODD:
            continue
        _log.warning(
            "%s: %d rows are left out whose time does not go on (the first: row %d)",
            path,
            np.count_nonzero(~fits),
            int(time.rows[np.argmin(fits)]),
        )
        columns = _kept_rows(columns, group, fits)
    return columns


def _of_each_clock(columns: FileColumns) -> list[dict[str, MeasuredColumn]]:
    """Each clock, and the signals beside it, where they stand in the same rows."""
    roles: list[tuple[str, ...]] = [("time", *_SIGNALS)]
    if columns.output_time is not None:
        roles = [("time", "input", "reference"), ("output_time", "output")]
    groups = [
        {role: one for role in of if (one := getattr(columns, role)) is not None}
        for of in roles
    ]
    return [
        one for one in groups if len({each.values.size for each in one.values()}) == 1
    ]


def _kept_rows(
    columns: FileColumns, group: Mapping[str, MeasuredColumn], keep: np.ndarray
) -> FileColumns:
    """Some of the rows of the columns of a clock."""
    kept = {
        role: replace(one, values=one.values[keep], rows=one.rows[keep])
        for role, one in group.items()
    }
    return replace(columns, **kept)


def _lacks_samples(columns: FileColumns) -> bool:
    signals = (columns.input, columns.output, columns.reference)
    return any(one is not None and np.isnan(one.values).any() for one in signals)


def _on_common_clock(
    path: Path, columns: FileColumns, options: RecordingsOptions
) -> tuple[FileColumns, float]:
    """Put signals that tick differently on one grid, that of the slowest of them."""
    stamps = {
        role: _stamps_of(path, columns, role)
        for role in _SIGNALS
        if getattr(columns, role) is not None
    }
    steps = {role: float(np.median(np.diff(one))) for role, one in stamps.items()}
    slowest = max(steps, key=lambda role: steps[role])
    step = options.sample_time_s or _grid_step(stamps[slowest], steps[slowest])
    if not options.resample:
        raise MeasurementError(
            f"{path}: the input has a sample every {steps['input']:.6g} s and the output "
            f"every {steps['output']:.6g} s, each at its own times; expected one clock; "
            "set recordings.resample: true, which puts them on one grid"
        )
    begin = max(float(one[0]) for one in stamps.values())
    end = min(float(one[-1]) for one in stamps.values())
    count = int((end - begin) / step * (1 + _ROUNDING)) + 1
    if count < _FEWEST_STAMPS:
        raise MeasurementError(
            f"{path}: input and output have no stretch of time in common; expected two "
            "signals of one measurement; name other columns or leave the file out"
        )
    grid = begin + step * np.arange(count)
    made = {}
    for role, known in stamps.items():
        column = getattr(columns, role)
        _check_own_gaps(path, column, known, steps[role])
        values = column.values[~np.isnan(column.values)]
        # What is slower than the grid holds nothing to average.
        is_fast = role != "output" and steps[role] < step
        put = _averaged if is_fast else partial(_interpolated, step=steps[role])
        made[role] = replace(
            array_column(column.title, put(grid, known, values)),
            unit=column.unit,
            unit_said_by=column.unit_said_by,
        )
    _log.info("%s: %s put on one grid of %.9g s", path, " and ".join(made), step)
    return replace(columns, **made, time=None, output_time=None), step


def _stamps_of(path: Path, columns: FileColumns, role: str) -> np.ndarray:
    """Times of the samples that a signal has."""
    column = getattr(columns, role)
    time = columns.time if role != "output" else columns.output_time or columns.time
    there = ~np.isnan(column.values)
    if time is None or time.values.size < there.size:
        raise MeasurementError(
            f"{path}: {column.title} has {there.size} values and its time "
            f"{0 if time is None else time.values.size}; expected a time for each; "
            "correct recordings.columns"
        )
    known = time.values[: there.size][there]
    if known.size < _FEWEST_SAMPLES:
        raise MeasurementError(
            f"{path}: {column.title} has {known.size} samples; expected a whole "
            "measurement; name another column or leave the file out"
        )
    _check_order(path, time, np.diff(time.values))
    return known


def _check_own_gaps(
    path: Path, column: MeasuredColumn, known: np.ndarray, step: float
) -> None:
    """Refuse to draw a line over a long stretch without samples."""
    gaps = np.diff(known)
    index = int(np.argmax(gaps))
    if gaps[index] > LONGEST_GAP * step:
        raise MeasurementError(
            f"{path}: {column.title} has no sample from {known[index]:.9g} s to "
            f"{known[index + 1]:.9g} s; expected one every {step:.6g} s or so; cut the "
            "file at the gap, or name rows with recordings.first_sample and last_sample"
        )


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
    is_even = np.mean(regular) >= _MOSTLY and not _is_rounded(time, ticks, median)
    if not is_even and abs(mean - median) <= _SCATTER * median:
        return _simplest_step(time, ticks)
    return float(f"{median:.{_STEP_DIGITS}g}")


def _check_length(path: Path, columns: FileColumns, time: MeasuredColumn) -> None:
    has_own = columns.output_time is not None
    others = (columns.input, None if has_own else columns.output, columns.reference)
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
            + (
                ", or set recordings.resample: true, which puts faster files on that grid"
                if median < stated and not options.resample
                else ""
            )
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


def _is_rounded(time: np.ndarray, ticks: np.ndarray, median: float) -> bool:
    """Whether stamps are a clock's, rounded: the mean step keeps to them, no gap is left.

    Most steps of rounded stamps are alike, and none is the clock's own.
    """
    drift = float(np.max(np.abs(time - time[0] - median * ticks)))
    return _misfit(time, ticks) < _ROUNDED * drift


def _misfit(time: np.ndarray, ticks: np.ndarray) -> float:
    """Largest distance of the stamps from ticks of their mean step."""
    step = float(time[-1] - time[0]) / ticks[-1]
    return float(np.max(np.abs(time - time[0] - step * ticks)))


def _check_gaps(
    path: Path, time: MeasuredColumn, steps: np.ndarray, step: float
) -> None:
    """Refuse to make up most of a recording, or what happened in a pause."""
    index = int(np.argmax(steps))
    is_paused = are_pauses(steps, step).any()
    if steps.sum() / step > _MOST_GROWTH * time.values.size or is_paused:
        raise MeasurementError(
            f"{place_of(path, time, index + 1)}: time jumps by {steps[index]:.6g} s, "
            f"from {time.values[index]:.9g} s to {time.values[index + 1]:.9g} s; "
            f"expected steps near {step:.6g} s; cut the file there into two, or, if "
            "all files pause there, make recordings of both ends (recordings.parts)"
        )


def _resample(columns: FileColumns, stamps: np.ndarray, step: float) -> FileColumns:
    """Put every column on a grid over its own stretch of time.

    What is smooth is interpolated. An input that is not is averaged over each step of the
    grid, because what it moves follows its integral: corners keep their time. Where every
    point of the grid has a sample next to it, and no others are between, means would only
    smooth the input and its noise.
    """
    is_faster = float(np.median(np.diff(stamps))) < _FASTER * step

    def resampled(column: MeasuredColumn) -> MeasuredColumn:
        known = stamps[: column.values.size]
        # The small share keeps a last sample that rounding pushed past the end.
        count = int((known[-1] - known[0]) / step * (1 + _ROUNDING)) + 1
        grid = known[0] + step * np.arange(count)
        is_averaged = (
            column is columns.input
            and (is_faster or not _have_neighbours(grid, known, step))
            and not _is_smooth(known, column.values, step)
        )
        put = _averaged if is_averaged else partial(_interpolated, step=step)
        return array_column(
            column.title,
            put(grid, known, column.values),
            unit=column.unit,
            unit_said_by=column.unit_said_by,
        )

    return replace(with_each(columns, resampled), time=None)


def _is_smooth(known: np.ndarray, values: np.ndarray, step: float) -> bool:
    """Whether a curve through every other sample tells the rest better than lines do.

    Steps, corners and noise do worse on a curve.
    """
    is_close = np.min(np.diff(known)) < _SHORTEST_OF_CURVE * step
    if is_close or values.size < _FEWEST_OF_CURVE:
        return False
    last = values.size - values.size % 2
    at, between = slice(0, last, 2), slice(1, last - 1, 2)
    curve = scipy.interpolate.CubicSpline(known[at], values[at])(known[between])
    lines = np.interp(known[between], known[at], values[at])
    left = [float(np.sum(np.square(values[between] - one))) for one in (curve, lines)]
    return left[0] < left[1]


def _interpolated(
    grid: np.ndarray, known: np.ndarray, values: np.ndarray, step: float
) -> np.ndarray:
    """Values on a grid: on a curve if smooth, on lines else and where samples are missing.

    A line lies below the top of a wave of period T by up to (2 pi h / T)^2 / 8 of its
    amplitude: at 15 samples a period that is 2 %, and more than most sensors' noise.
    """
    lines = np.interp(grid, known, values)
    if not _is_smooth(known, values, step):
        return lines
    row = np.clip(np.searchsorted(known, grid) - 1, 0, known.size - 2)
    has_gap = np.diff(known)[row] > _LONGEST_OF_CURVE * step
    return np.where(has_gap, lines, scipy.interpolate.CubicSpline(known, values)(grid))


def _have_neighbours(grid: np.ndarray, known: np.ndarray, step: float) -> bool:
    """Whether samples scatter little around the points of a grid.

    The grid begins at the first sample, which is as far off its clock as any other.
    """
    after = np.clip(np.searchsorted(known, grid), 1, known.size - 1)
    late, early = known[after] - grid, grid - known[after - 1]
    away = np.where(late < early, late, -early)
    return bool(np.max(np.abs(away - np.median(away))) <= _NEXT_TO_IT * step)


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
