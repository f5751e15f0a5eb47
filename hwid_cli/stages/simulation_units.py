"""Whether recordings are in the units that a simulation's numbers stand in: SI.

What can be converted was converted when the recordings were read; what is left is
refused. Where nobody says a unit, that it is taken for SI is said, unless measured and
simulated sizes differ by powers of ten and another unit explains it: then it is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.data.other_units import in_other_units
from hwid_cli.data.units import factor_between, is_unitless, quantity_of
from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.few_samples import fewer_recordings
from hwid_cli.diagnosis.problem import Compared, prepare
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import (
    AS_FILE,
    DiagnoseOptions,
    Experiment,
    SimulationOptions,
)
from hwid_cli.records.programs import ForeignSimulation
from hwid_cli.records.recordings import (
    CalibrationLog,
    RawRecording,
    Recording,
    SignalUnit,
)

# Units of a recording of which a program says none.
_USUAL = {"input": "A", "output": "m"}
_SIDES = tuple(_USUAL)
# What the force constant may count from, where the input is not the voltage of a circuit.
_INPUTS = ("A", "V", "N", "N m")
# Rotating and linear drives have the same equations.
_OTHER_AXIS = {"m": "rad", "m/s": "rad/s"}
# Sizes that differ by more are another unit, not a wrong parameter, [-].
_FAR = 300.0
# A unit that somebody has stated needs so much less misfit than one that is assumed, [-].
_BETTER = 0.9
# The simulation of a unit that explains the sizes comes so close, [-].
_NEAR = 31.7
# Sizes need no more samples than these, [samples].
_ENOUGH_SAMPLES = 40_000
# Neighbours differ by powers of ten; those that instruments use.
_LADDERS = (
    ("um", "mm", "m"),
    ("uA", "mA", "A"),
    ("mV", "V", "kV"),
    ("mN", "N", "kN"),
    ("mN m", "N m", "kN m"),
    ("us", "ms", "s"),
    ("mm/s", "m/s"),
    ("mrad", "rad"),
    ("mrad/s", "rad/s"),
)


def calibrated_in_simulation_units(
    simulation: SimulationOptions | ForeignSimulation | None,
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
) -> tuple[tuple[Recording, ...], tuple[CalibrationLog, ...]]:
    """Recordings in the units of a drive's numbers, where the experiment's are others.

    Models may be wanted in mm, and the same experiment may have a simulation, which
    counts in m.

    Parameters
    ----------
    recordings : sequence of Recording
        Calibrated.
    logs : sequence of CalibrationLog
        Theirs; some may be missing.
    """
    if not isinstance(simulation, SimulationOptions):
        return tuple(recordings), tuple(logs)
    by_name = {one.name: one for one in logs}
    units = (simulation.input_unit, simulation.output_unit)
    both = [in_other_units(one, by_name.get(one.name), units) for one in recordings]
    return (
        tuple(one for one, _ in both),
        tuple(log for _, log in both if log is not None),
    )


def refused_units(
    experiment: Experiment,
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
) -> tuple[str, ...]:
    """Say which signals are in units that contradict the simulation.

    Parameters
    ----------
    recordings : sequence of Recording
        Calibrated.
    logs : sequence of CalibrationLog
        Theirs; what is missing counts as not known.

    Returns
    -------
    tuple of str
        A line for each side at most; empty without a simulation.
    """
    simulation = experiment.drive_simulation
    if simulation is None or experiment.recordings is None:
        return ()
    found = {}
    for recording in recordings:
        for side in _SIDES:
            fault = _fault(recording, side, simulation)
            if fault and side not in found:
                origin = _origin_of(side, recording.name, logs)
                found[side] = (
                    f"{experiment.source}: {_said_by(origin, side, recording)}; {fault}"
                )
    return tuple(found.values())


def _fault(
    recording: Recording,
    side: str,
    simulation: SimulationOptions,
) -> str:
    """What was expected of a side, and what to do; empty where it is right."""
    unit, wanted = (getattr(one, f"{side}_unit") for one in (recording, simulation))
    others = _other_units(side, simulation)
    # SI units that the same equations hold in: a force constant may count from volts,
    # and a rotating axis may have the names of a straight one.
    if unit == wanted or is_unitless(unit) or unit in others:
        return ""
    meant = "" if simulation.resistance_ohm is None else " over resistance_ohm"
    expected = (
        f"expected {wanted!r}{meant * (side == 'input')}, the unit of the simulation"
    )
    if not quantity_of(unit):
        return (
            f"{expected}; name its unit in recordings.units.{side}, or convert by "
            f"recordings.{side}_scale and say recordings.{side}_unit: {wanted}"
        )
    if unit_in_si(unit, others):
        return (
            f"{expected}; name another column, or say recordings.{side}_unit: "
            f"{unit_in_si(unit, others)} if the simulation's numbers stand in it"
        )
    if side == "output" and factor_between(unit, f"{wanted}/s") is not None:
        return (
            f"{expected}; a sensor that measures the velocity is "
            "simulation.output: velocity; else name another column"
        )
    return f"{expected}; name another column, or correct recordings.units.{side}"


def _other_units(side: str, simulation: SimulationOptions) -> tuple[str, ...]:
    """What a simulation's numbers may stand in where the configuration says so."""
    if side == "output":
        other = _OTHER_AXIS.get(simulation.output_unit)
        return () if other is None else (other,)
    return _INPUTS if simulation.resistance_ohm is None else ()


def unit_in_si(unit: str, among: Sequence[str]) -> str:
    """Give the one of some units that a unit can be converted to; empty for none."""
    return next((one for one in among if factor_between(unit, one) is not None), "")


def _said_by(origin: SignalUnit | None, side: str, recording: Recording) -> str:
    unit = getattr(recording, f"{side}_unit")
    said_by = "" if origin is None else origin.said_by
    if said_by.startswith("recordings."):
        return f"{said_by}: found {unit!r}"
    said = f": {said_by} says {unit!r}" if said_by else f": is in {unit!r}"
    return f"recordings.columns.{side}{said} (recording {recording.name})"


def _origin_of(
    role: str, name: str, logs: Sequence[CalibrationLog]
) -> SignalUnit | None:
    units = [one for log in logs if log.name == name for one in log.units]
    return next((one for one in units if one.role == role), None)


def assumed_units(
    experiment: Experiment,
    recordings: Sequence[Recording],
    logs: Sequence[CalibrationLog],
) -> str:
    """Say which signals are taken for SI because nobody says their unit.

    Parameters
    ----------
    recordings, logs : sequence
        As for ``refused_units``.

    Returns
    -------
    str
        One line; empty where all units are known.
    """
    simulation, names = experiment.drive_simulation, {one.name for one in recordings}
    if simulation is None:
        return ""
    si = {"time": "s", **{side: getattr(simulation, f"{side}_unit") for side in _SIDES}}
    unknown = {
        one.role: one.said_by
        for log in logs
        for one in log.units
        if log.name in names and (not one.given or is_unitless(one.given))
    }
    roles = [role for role in ("input", "output", "time") if role in unknown]
    # Numbers that are said to have no unit.
    labels = [key for role in roles if (key := unknown[role]).endswith("_unit")]
    step = f" in place of {_listed(labels)}" if labels else ""
    if not roles:
        return ""
    keys = ", ".join(f"{role}: {si[role]}" for role in roles)
    units = _listed([si[role] for role in roles])
    return (
        f"{experiment.source}: recordings.units: nothing says the unit of the "
        f"{_listed(roles, 'the ')}: taken as {units}, as the simulation's numbers are; "
        f"correct or confirm it with recordings.units: {{{keys}}}{step}"
    )


def _listed(words: Sequence[str], article: str = "") -> str:
    *first, last = words
    return f" and {article}".join(
        [*([f", {article}".join(first)] if first else []), last]
    )


def in_simulation_units(
    recordings: Sequence[Recording], simulation: SimulationOptions
) -> tuple[Recording, ...]:
    """Give recordings of a program in the units of a simulation.

    A, m and no unit are taken as they are: recordings have them unless a program says
    more.

    Raises
    ------
    ConfigError
        If a unit contradicts the simulation.
    """
    units = (simulation.input_unit, simulation.output_unit)
    for one in recordings:
        for side in _SIDES:
            _refuse_other_quantity(one, side, simulation)
    return tuple(in_other_units(one, None, units)[0] for one in recordings)


def _refuse_other_quantity(
    recording: Recording, side: str, simulation: SimulationOptions
) -> None:
    unit, wanted = (getattr(one, f"{side}_unit") for one in (recording, simulation))
    accepted = (_USUAL[side], *_other_units(side, simulation))
    if (
        unit in accepted
        or is_unitless(unit)
        or factor_between(unit, wanted) is not None
    ):
        return
    raise ConfigError(
        f"recording {recording.name!r}: {side}_unit: found {unit!r}; expected "
        f"{wanted!r}, the unit of the simulation, or one that goes into it"
    )


def refused_sizes(
    experiment: Experiment,
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    logs: Sequence[CalibrationLog] = (),
) -> str:
    """Say which unit that nobody states contradicts the sizes of a simulation.

    Parameters
    ----------
    logs : sequence of CalibrationLog
        Of the recordings; what is missing counts as not known.

    Returns
    -------
    str
        One line; empty where sizes are similar, no other unit brings them together, or
        the unit in question is stated: then somebody has to decide, see
        ``doubtful_sizes``.
    """
    doubt = _doubted(recordings, simulation, options, logs)
    if doubt is None or doubt.is_stated:
        return ""
    return (
        f"{experiment.source}: recordings.units.{doubt.role}: nothing says the unit of "
        f"the {doubt.role}, and {doubt.now} contradicts the simulation: {doubt.much}; "
        f"write recordings.units: {{{doubt.role}: {doubt.unit}}} if it is in "
        f"{doubt.unit}, or {{{doubt.role}: {doubt.now}}} and check the parameters"
    )


def doubtful_sizes(
    experiment: Experiment,
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    logs: Sequence[CalibrationLog] = (),
) -> str:
    """Say which unit that somebody states would have to be another one.

    Parameters
    ----------
    logs : sequence of CalibrationLog
        Of the recordings; what is missing counts as not known.

    Returns
    -------
    str
        One line; empty where measurement and simulation are of similar size, no other
        unit brings them together, or ``refused_sizes`` refuses it.
    """
    doubt = _doubted(recordings, simulation, options, logs)
    if doubt is None or not doubt.is_stated:
        return ""
    return (
        f"{experiment.source}: simulation: {doubt.much}; is the {doubt.role} in "
        f"{doubt.unit}, not {doubt.now}? Then write recordings.units: "
        f"{{{doubt.role}: {doubt.unit}}}; else check the parameters"
    )


@dataclass(frozen=True)
class _Doubt:
    """A unit that does not go with the sizes, and the one that does."""

    role: str
    now: str
    unit: str
    is_stated: bool
    much: str


def _doubted(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    logs: Sequence[CalibrationLog],
) -> _Doubt | None:
    ratio = _size_ratio(recordings, simulation, options)
    if not np.isfinite(ratio) or 1 / _FAR <= ratio <= _FAR:
        return None
    assumed, stated = _units_of_files(recordings[0], logs)
    likely = _likely_unit(recordings, simulation, options, [*assumed, *stated])
    if likely is None:
        return None
    role, now, unit = likely
    much = (
        f"what was measured is {max(ratio, 1 / ratio):.2g} times "
        f"{'larger' if ratio > 1 else 'smaller'} than what the simulation gives with "
        "its parameters"
    )
    return _Doubt(role, now, unit, (role, now) in stated, much)


def _units_of_files(
    first: Recording, logs: Sequence[CalibrationLog]
) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Role and unit of each signal's numbers in the files: what is assumed, and stated."""
    assumed, stated = [], []
    for role in ("output", "input", "time"):
        origin = _origin_of(role, first.name, logs)
        if origin is not None and quantity_of(origin.given):
            stated.append((role, origin.given))
        else:
            unit = "s" if role == "time" else getattr(first, f"{role}_unit")
            assumed.append((role, unit))
    return assumed, stated


def _likely_unit(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    units: Sequence[tuple[str, str]],
) -> tuple[str, str, str] | None:
    """Role, unit and the unit whose simulation comes closest to what was measured."""
    best, least = None, np.inf
    for role, unit in units:
        for other in _neighbours(unit):
            factor = factor_between(other, unit)
            if factor is None:
                continue
            changed = [_rescaled(one, role, factor) for one in recordings]
            compared = _compared(changed, simulation, options)
            ratio, misfit = _ratio_of(compared), _misfit(compared)
            if 1 / _NEAR <= ratio <= _NEAR and misfit < _BETTER * least:
                best, least = (role, unit, other), misfit
    return best


def _neighbours(unit: str) -> list[str]:
    ladder = next((one for one in _LADDERS if unit in one), ())
    return [one for one in ladder if one != unit]


def _rescaled(recording: Recording, role: str, factor: float) -> Recording:
    """The recording as it would be if its numbers stood in another unit."""
    if role == "time":
        return replace(recording, sample_time_s=recording.sample_time_s * factor)
    changes = {role: getattr(recording, role) * factor}
    if role == "output" and recording.reference is not None:
        changes["reference"] = recording.reference * factor
    return replace(recording, **changes)


def _compared(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> list[Compared]:
    # Wherever they start, recordings have a size; finding the start would take long.
    options = replace(options, initial_state="rest")
    problem = prepare(recordings, simulation, options, ())
    with np.errstate(all="ignore"):
        return compared_as_given(fewer_recordings(problem, _ENOUGH_SAMPLES))


def _size_ratio(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> float:
    """Size of what was measured over that of what is simulated."""
    return _ratio_of(_compared(recordings, simulation, options))


def _ratio_of(compared: Sequence[Compared]) -> float:
    ratios = [
        _swing(one.signals.compared) / swing
        for one in compared
        if np.isfinite(swing := _swing(one.simulated)) and swing > 0
    ]
    return float(np.median(ratios)) if ratios else float("nan")


def _swing(values: np.ndarray) -> float:
    with np.errstate(all="ignore"):
        return float(np.std(values))


def _misfit(compared: Sequence[Compared]) -> float:
    """Median share of what was measured that the simulation leaves."""
    left = [one.rms / max(_swing(one.signals.compared), 1e-300) for one in compared]
    return float(np.median(left)) if left else float("inf")


def overruled_units(
    source: str, read: Sequence[RawRecording | CalibrationLog]
) -> list[str]:
    """Units of a configuration that files contradict: a factor that nobody sees later.

    Parameters
    ----------
    source : str
        Of the configuration.
    read : sequence of RawRecording or CalibrationLog
        Of one experiment.

    Returns
    -------
    list of str
        One line for all recordings that contradict it alike.
    """
    found: dict[SignalUnit, list[str]] = {}
    for each in read:
        for one in each.units:
            if one.overruled:
                found.setdefault(one, []).append(each.name)
    return [
        f"{source}: {one.said_by}: found {one.given!r}, but {_files_of(names)} "
        f"{one.overruled!r}; expected the same; {one.given!r} counts: "
        + (
            "correct it, unless the file is wrong"
            if len(names) == len(read)
            else f"say {AS_FILE!r} there, so that each file's own unit counts, or correct "
            "the file"
        )
        for one, names in found.items()
    ]


def _files_of(names: Sequence[str]) -> str:
    """The first of some files and how many more, and that they say.

    Examples
    --------
    >>> _files_of(["a"]), _files_of(["a", "b", "c"])
    ('the file of a says', 'the files of a and 2 others say')
    """
    if len(names) == 1:
        return f"the file of {names[0]} says"
    others = "another" if len(names) == 2 else f"{len(names) - 1} others"
    return f"the files of {names[0]} and {others} say"
