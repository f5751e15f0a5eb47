"""Which column of a file is the time, and how it ticks: a guess that says why.

Names come first, then units, then content: what grows evenly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.data import column_signs as signs
from hwid_cli.data.column_words import Meaning, meaning_of
from hwid_cli.data.table_heads import sample_time_named
from hwid_cli.data.units import factor_between, unit_in_name, unit_of_dates
from hwid_cli.records.starter import FoundColumn, Role

# Jitter up to here is rounding of time stamps; more needs resampling, [-].
ROUND_STAMPS = 0.009
# A measurement has more samples than this; shorter columns are settings, [samples].
FEWEST_SAMPLES = 60
# Clocks that agree within this share tick alike, [-].
_SAME_STEP = 0.01
# Where other units of dates begin than in 1970.
_BEGINS = {"d": "1900 (or the year 0)", "100ns": "1601"}
# Whole-numbered stamps without a unit: a step from so many on is in the next smaller one.
_WHOLE_STEPS = ((1.0, "ms"), (200.0, "us"), (2e5, "ns"))


@dataclass(frozen=True)
class TimeGuess:
    """How a file tells time.

    Parameters
    ----------
    role : Role or None
        The column.
    sample_time_s : float or None, [s]
        Where there is no such column.
    notes : tuple of str
        What is not sure.
    column : FoundColumn or None
        The same as the role, with its numbers.
    """

    role: Role | None
    sample_time_s: float | None
    resample: bool
    reason: str
    notes: tuple[str, ...] = ()
    column: FoundColumn | None = None


def long_columns(columns: Sequence[FoundColumn]) -> list[FoundColumn]:
    """Columns that are as long as a measurement.

    Returns
    -------
    list of FoundColumn
        In their order, apart from columns that end early.
    """
    return [one for one in columns if one.values.size > FEWEST_SAMPLES]


def unit_of_column(column: FoundColumn, role: str) -> str:
    """Unit that a file states for a column, or that its name says; empty without one."""
    return column.unit or unit_in_name(column.title, role)


def guess_time(columns: Sequence[FoundColumn]) -> TimeGuess:
    """Find out how a file tells time.

    Parameters
    ----------
    columns : sequence of FoundColumn
        All of the file, single numbers too.
    """
    stated = _stated_sample_times(columns)
    for column, meaning, clock in clocks_of(columns):
        unit, why, notes = _unit_of_clock(column, clock, stated)
        is_counter = clock.step == 1.0 and clock.jitter == 0.0 and not unit
        is_other = meaning.role != "time" and (meaning.role or is_counter)
        # Unless something beside it says its unit.
        if unit is None or (is_other and not why and not _is_in_time(column)):
            continue
        grows = "it grows evenly" if clock.jitter <= signs.MOST_JITTER else "it grows"
        named = f"named so, and {grows}" if meaning.role else grows
        role = Role(column.key, column.title, unit, named + why)
        is_rough = clock.jitter > ROUND_STAMPS
        return TimeGuess(role, None, is_rough, named + why, notes, column)
    for title, step_s in stated:
        return TimeGuess(None, step_s, False, f"the file's {title}")
    for title, step_s in _coarse_clocks(columns).items():
        why = f"{title!r} shows whole ticks, each held for many samples"
        note = (
            f"NOT SURE: a sample every {step_s:.6g} s, if the samples between two ticks of "
            f"{title!r} are evenly apart"
        )
        return TimeGuess(None, step_s, False, why, (note,))
    return TimeGuess(None, None, False, "nothing in the file tells the time")


def unused_times(columns: Sequence[FoundColumn]) -> tuple[str, ...]:
    """Say why columns that are named after time are no clocks."""
    notes = []
    coarse = _coarse_clocks(columns)
    for one in _named_after_time(columns):
        if one.title in coarse:
            continue
        with np.errstate(invalid="ignore"):
            bad = np.flatnonzero(~(np.diff(one.values) > 0))
        what = f"does not grow at sample {bad[0] + 1}" if bad.size else "grows unevenly"
        notes.append(
            f"NOT USED: {one.title!r} is named after time, but {what}; sort the rows, or "
            "export the file again"
        )
    return tuple(notes)


def _named_after_time(columns: Sequence[FoundColumn]) -> list[FoundColumn]:
    return [
        one
        for one in long_columns(columns)
        if meaning_of(one.title, one.unit).role == "time" or _is_in_time(one)
    ]


def _coarse_clocks(columns: Sequence[FoundColumn]) -> dict[str, float]:
    """Sample times in s that columns named after time tell by their large ticks."""
    found = {}
    for one in _named_after_time(columns):
        unit = unit_of_column(one, "time") or unit_of_dates(one.values) or "s"
        step = signs.coarse_clock_of(one.values)
        if step is not None:
            found[one.title] = step * (factor_between(unit, "s") or 1.0)
    return found


def clocks_of(
    columns: Sequence[FoundColumn],
) -> list[tuple[FoundColumn, Meaning, signs.Clock]]:
    """Columns that grow evenly, those that are named after time first."""
    found = [
        (one, meaning_of(one.title, one.unit), clock)
        for one in long_columns(columns)
        if (clock := clock_of_column(one)) is not None
    ]
    return sorted(
        found, key=lambda one: one[1].role != "time" and not _is_in_time(one[0])
    )


def clock_of_column(column: FoundColumn) -> signs.Clock | None:
    """How a column ticks; one that is named after time may begin again, or be uneven."""
    clock = signs.clock_of(column.values)
    named = meaning_of(column.title, column.unit).role == "time" or _is_in_time(column)
    if clock is not None or not named:
        return clock
    if begins := signs.restarts_of(column.values):
        return signs.clock_of(column.values[: begins[0]])
    return signs.clock_of(column.values, may_be_uneven=True)


def _is_in_time(column: FoundColumn) -> bool:
    unit = unit_of_column(column, "time")
    return bool(unit) and factor_between(unit, "s") is not None


def _stated_sample_times(columns: Sequence[FoundColumn]) -> list[tuple[str, float]]:
    named = [
        (one.title, sample_time_named(one.title, float(one.values[0]), one.unit))
        for one in columns
        if one.values.size == 1
    ]
    return [(title, step_s) for title, step_s in named if step_s is not None]


def _unit_of_clock(
    column: FoundColumn, clock: signs.Clock, stated: Sequence[tuple[str, float]]
) -> tuple[str | None, str, tuple[str, ...]]:
    """Unit of a clock (None for a mere counter), why, and what is not sure."""
    unit = unit_of_column(column, "time")
    if unit:
        return unit, "", ()
    since = unit_of_dates(column.values)
    if since:
        return since, f"; its size says {since} since {_BEGINS.get(since, 1970)}", ()
    for title, stated_s in stated:
        for unit in ("s", "ms", "us", "ns"):
            step_s = clock.step * (factor_between(unit, "s") or 1.0)
            if abs(step_s - stated_s) <= _SAME_STEP * stated_s:
                return unit, f"; {title} says its unit", ()
    if stated and clock.step == 1.0:
        return None, "", ()
    is_whole = bool((column.values == np.round(column.values)).all())
    if clock.step < 1.0 or not is_whole:
        return "", "", _slow_note(clock.step)
    role = meaning_of(column.title).role
    is_named = bool(column.title) and role not in ("", "time")
    if role != "time" and (is_named or clock.step == 1.0):
        # Of samples, or no clock at all.
        return "", "", ()
    unit = next(unit for least, unit in reversed(_WHOLE_STEPS) if clock.step >= least)
    note = (
        f"NOT SURE: the time has whole numbers, {clock.step:g} apart, and no unit; taken "
        f"for {unit}; if it is seconds, write units: {{time: s}}"
    )
    return unit, f"; whole numbers look like {unit}", (note,)


def _slow_note(step_s: float) -> tuple[str, ...]:
    if step_s < 0.1:
        return ()
    return (
        f"NOT SURE: the time has no unit and is taken for seconds, a sample every "
        f"{step_s:g} s; if it is milliseconds, write units: {{time: ms}}",
    )
