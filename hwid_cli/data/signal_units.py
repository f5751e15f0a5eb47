"""In which unit each signal of a file is, and in which the recording shall be.

The first of these says the unit of a column: ``recordings.units``, the file (a row of
units, an attribute, the name of the column), ``recordings.input_unit`` and
``output_unit``. Time is always converted to seconds. Input and output are converted where
the configuration has a simulation, whose numbers are SI, or says ``recordings.units``;
else units are labels. What cannot be converted keeps its own unit: a diagnosis refuses it.
A column whose file names a unit of another quantity than ``recordings.units`` is refused:
most likely another column was meant.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.columns import FileColumns, MeasuredColumn
from hwid_cli.data.units import (
    QUANTITIES,
    factor_between,
    in_unit,
    is_unitless,
    quantity_of,
    unit_in_name,
    unit_of_dates,
)
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import (
    AS_FILE,
    Experiment,
    FileUnits,
    RecordingsOptions,
    SimulationOptions,
)
from hwid_cli.records.programs import ForeignSimulation
from hwid_cli.records.recordings import CalibrationLog, SignalUnit

_DAY_S = 86_400.0
# Units that differ by less are one, [-].
_SAME_FACTOR = 1e-9
# Of recordings where nothing says more.
_USUAL = {"input": "A", "output": "m"}


def time_in_seconds(
    path: Path, columns: FileColumns, options: RecordingsOptions
) -> tuple[FileColumns, tuple[SignalUnit, ...]]:
    """Give the columns with their time in seconds, and where its unit comes from.

    Parameters
    ----------
    path : Path
        For messages.

    Returns
    -------
    FileColumns
    tuple of SignalUnit
        Empty where there is no column of time.

    Raises
    ------
    MeasurementError
        If the unit is none of time.
    """
    if columns.time is None:
        return columns, ()
    stated = options.units.time
    seconds, unit = _in_seconds(path, columns.time, stated)
    columns = replace(columns, time=seconds)
    if columns.output_time is not None:
        other = _in_seconds(path, columns.output_time, stated)[0]
        columns = replace(columns, output_time=other)
    return columns, (unit,)


def _in_seconds(
    path: Path, time: MeasuredColumn, stated: str | None
) -> tuple[MeasuredColumn, SignalUnit]:
    given, said_by = time.unit, time.unit_said_by
    if stated not in (None, AS_FILE):
        given, said_by = stated, "recordings.units.time"
    elif not given or is_unitless(given):
        given = unit_of_dates(time.values)
        said_by = "its size, a date"
    if not given:
        return time, SignalUnit("time", "", "", "s")
    factor = factor_between(given, "s")
    if factor is None:
        raise MeasurementError(
            f"{path}: {said_by} says that {time.title} is in {given!r}; expected a unit "
            "of time, such as s, ms or us; correct it, or say recordings.units.time"
        )
    values = time.values
    if values.size and unit_of_dates(values):
        # Whole days hold nothing but digits that are lost in a conversion.
        day = _DAY_S / factor
        values = values - np.floor(values[0] / day) * day
    seconds = replace(time, values=in_unit(values, given, "s"))
    return seconds, SignalUnit("time", given, said_by, "s", factor)


def signal_unit(
    column: MeasuredColumn, role: str, experiment: Experiment
) -> SignalUnit:
    """Say which unit a signal has in its file, and which it shall have.

    Parameters
    ----------
    role : str
        ``input`` or ``output``.

    Raises
    ------
    MeasurementError
        If the file and ``recordings.units`` name units of different quantities.
    """
    options = experiment.recordings
    if options is None:
        raise ValueError("an experiment without recordings has no signals")
    _refuse_other_quantity(column, role, experiment.source, options)
    found = _signal_unit(column, role, experiment, options)
    is_other = _contradicts(column.unit, getattr(options.units, role))
    return replace(found, overruled=column.unit) if is_other else found


def _contradicts(unit: str, stated: str | None) -> bool:
    """Whether a file has numbers of another size than the configuration says."""
    if not unit or stated in (None, AS_FILE):
        return False
    factor = factor_between(unit, stated)
    return factor is not None and abs(factor - 1.0) > _SAME_FACTOR


def _signal_unit(
    column: MeasuredColumn,
    role: str,
    experiment: Experiment,
    options: RecordingsOptions,
) -> SignalUnit:
    """The same, whatever the file says beside."""
    simulation = experiment.simulation
    label = getattr(options, f"{role}_unit")
    given, said_by = _given(column, role, options)
    stated = getattr(options.units, role)
    if stated == AS_FILE and not given:
        raise MeasurementError(
            f"{experiment.source}: recordings.units.{role}: found {AS_FILE!r}, but a file "
            f"says no unit of its {column.title}; expected one in every file; name the "
            "unit here if it is the same in all of them, or leave out that file"
        )
    if given and is_unitless(given):
        return SignalUnit(role, given, said_by, label or given)
    if simulation is None and stated is None:
        return SignalUnit(role, given, said_by, label or given or _USUAL[role])
    target = label
    if target is None and simulation is not None:
        target = _unit_of(simulation, role)
    target = target or QUANTITIES.get(quantity_of(given), given)
    factor = factor_between(given, target) if given else 1.0
    if factor is None:
        return SignalUnit(role, given, said_by, given)
    return SignalUnit(role, given, said_by, target, factor)


def _refuse_other_quantity(
    column: MeasuredColumn, role: str, source: str, options: RecordingsOptions
) -> None:
    """Refuse a column that measures something else than the configuration says."""
    stated = getattr(options.units, role)
    own, wanted = quantity_of(column.unit), quantity_of(stated or "")
    if not own or not wanted or own == wanted:
        return
    raise MeasurementError(
        f"{source}: recordings.units.{role}: found {stated!r}, but "
        f"{column.unit_said_by} says that {column.title} is in {column.unit!r}; expected "
        f"a unit of the same quantity; name another column in recordings.columns, or "
        f"correct the unit; if the file is wrong, say recordings.{role}_unit: {stated} "
        "in place of it"
    )


def _unit_of(
    simulation: SimulationOptions | ForeignSimulation, role: str
) -> str | None:
    """Unit of a simulation's numbers: its own, or what a name like ``current_A`` says."""
    if isinstance(simulation, SimulationOptions):
        return str(getattr(simulation, f"{role}_unit"))
    name = getattr(simulation, role, None)
    return (unit_in_name(name, role) or None) if name is not None else None


def _given(
    column: MeasuredColumn, role: str, options: RecordingsOptions
) -> tuple[str, str]:
    """Unit of a column's numbers, times their scale, and who says so."""
    stated = getattr(options.units, role)
    if stated == AS_FILE:
        return column.unit, column.unit_said_by
    if stated is not None:
        return stated, f"recordings.units.{role}"
    label = getattr(options, f"{role}_unit")
    is_scaled = abs(getattr(options, f"{role}_scale")) != 1.0
    is_other = label is not None and factor_between(column.unit, label) is None
    # A scale takes the numbers to the unit of the configuration; a name that contradicts
    # the configuration is overruled by it.
    if column.unit and not is_scaled and not is_other:
        return column.unit, column.unit_said_by
    return (label, f"recordings.{role}_unit") if label is not None else ("", "")


def converted(column: MeasuredColumn, unit: SignalUnit) -> MeasuredColumn:
    """Give a column in the unit that its recording shall have."""
    if unit.factor == 1.0:
        return column
    return replace(column, values=in_unit(column.values, unit.given, unit.unit))


def as_files_are(
    options: RecordingsOptions, logs: Sequence[CalibrationLog]
) -> RecordingsOptions:
    """Give options that state the units of the files, and scales that convert them.

    Parameters
    ----------
    logs : sequence of CalibrationLog
        Of the recordings that were read from these files.
    """
    changes: dict[str, Any] = {}
    units = {one.role: one for log in reversed(logs) for one in log.units}
    for side in ("input", "output"):
        if side in units:
            scale = getattr(options, f"{side}_scale")
            changes[f"{side}_scale"] = scale * units[side].factor
    given = {role: one.given or None for role, one in units.items()}
    return replace(options, units=FileUnits(**given), **changes)


def reference_unit(
    column: MeasuredColumn, output: SignalUnit, experiment: Experiment
) -> SignalUnit:
    """Say the unit of a reference: its own, else that of the output.

    Raises
    ------
    MeasurementError
        If the two measure different things.
    """
    own = signal_unit(column, "output", experiment)
    is_label = experiment.simulation is None and own.unit != output.unit
    if not own.given or is_label:
        return output
    if own.unit != output.unit and output.given:
        raise MeasurementError(
            f"{experiment.source}: recordings.columns.reference: {own.said_by} says "
            f"{own.given!r}; expected {output.unit!r} as the output has; name another "
            "column, or say recordings.units.output"
        )
    return own
