"""Effects of the user's own in a configuration: formulas, names and units are checked."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from hwid_cli.config.faults import Fault, Place, missing, refused, unknown_key, wrong
from hwid_cli.data.formula_units import (
    PLAIN,
    Unit,
    UnitsDoNotFitError,
    fits,
    unit_name,
    unit_of,
)
from hwid_cli.data.units import base_exponents
from hwid_cli.drive.catalogue import configured_effects
from hwid_cli.drive.formula import CONSTANTS, NAMED_FUNCTIONS, VARIABLES, names, parsed
from hwid_cli.files.messages import name_fault
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.axis import axis_of
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.own_effects import (
    OwnEffect,
    OwnParameter,
    named_by_id,
    own_of,
)
from hwid_cli.records.rules import Refused

# What a formula may not call a parameter.
_TAKEN = (*VARIABLES, *CONSTANTS, *NAMED_FUNCTIONS, "max", "min", "Abs")
_SHOWN = 60


def own_effect_faults(experiment: Experiment) -> Iterator[Fault]:
    """Formulas that cannot be read, with unknown names, or whose units do not fit."""
    if not experiment.own_effects:
        # Units take half a second to load.
        return
    units = _units_of_signals(experiment)
    for name, effect in experiment.own_effects.items():
        place: Place = ("own_effects", name)
        fault = name_fault(name)
        if name in configured_effects():
            yield Fault(
                place,
                "is an effect of the catalogue too",
                "a name of its own",
                f"rename it, such as own_{name}",
            )
        elif fault or not name[0].isalpha():
            why = fault or "a letter first"
            yield wrong(place, name, f"a name of letters, digits and _: {why}")
        else:
            yield from _formula_faults(effect, units, place)


def _formula_faults(
    effect: OwnEffect, units: Mapping[str, Unit], place: Place
) -> Iterator[Fault]:
    of = dict(units)
    found = list(_parameter_faults(effect, of, place))
    yield from found
    place = (*place, effect.key)
    try:
        node = parsed(effect.formula)
    except Refused as error:
        yield refused(place, error.refusal)
        return
    used = names(node)
    known = (*VARIABLES, *effect.parameters)
    unknown = sorted(used - set(known))
    if unknown:
        yield Fault(
            place,
            f"found {unknown[0]!r}, which is no variable and no parameter",
            "x, v, u, t and the names under parameters",
            did_you_mean(unknown[0], known),
        )
        return
    idle = [one for one in effect.parameters if one not in used]
    if idle:
        yield wrong(
            (*place[:-1], "parameters", idle[0]),
            idle[0],
            f"a name that the formula {_short(effect.formula)} has",
            "remove it or use it",
        )
    elif not found:
        yield from _unit_faults(effect, of, place)


def _parameter_faults(
    effect: OwnEffect, units: dict[str, Unit], place: Place
) -> Iterator[Fault]:
    """Parameters with names that mean something else, and units that are none."""
    for name, one in effect.parameters.items():
        here = (*place, "parameters", name)
        if name in _TAKEN:
            yield wrong(here, name, "a name that no variable and no function has")
            continue
        unit = base_exponents(one.unit)
        if unit is None:
            yield wrong(
                (*here, "unit"), one.unit, "a unit such as N, N/m, N s/m, m/s, or -"
            )
        elif abs(unit[1] - 1) > 1e-9:
            yield wrong(
                (*here, "unit"),
                one.unit,
                f"the SI unit {unit_name(unit[0])}, because x is in m, v in m/s and t "
                "in s",
                "convert start and bounds",
            )
        else:
            units[name] = unit[0]


def _unit_faults(
    effect: OwnEffect, units: Mapping[str, Unit], place: Place
) -> Iterator[Fault]:
    step = "correct a unit, or give a number of the formula as a parameter with a unit"
    try:
        found = unit_of(parsed(effect.formula), units)
    except UnitsDoNotFitError as error:
        told = f"found {_short(effect.formula)}: {error}"
        yield Fault(place, told, step=step)
        return
    wanted = units[{"force_N": "force", "input": "u", "output": "output"}[effect.key]]
    if not fits(found, wanted):
        yield Fault(
            place,
            f"found {_short(effect.formula)}, which is in {unit_name(found)}",
            unit_name(wanted),
            step,
        )


def _short(formula: str) -> str:
    return repr(formula if len(formula) <= _SHOWN else formula[:_SHOWN] + "...")


def _units_of_signals(experiment: Experiment) -> dict[str, Unit]:
    """Units of the variables, and of what formulas give; None where they are open."""
    drive = experiment.drive_simulation
    if drive is None:
        # Nobody says what a simulation of the user's own is in.
        nothing: dict[str, Unit] = dict.fromkeys(("x", "v", "u", "force", "output"))
        return {**nothing, "t": _known("s")}
    is_rotary = axis_of(drive) == "rotary"
    x = PLAIN if is_rotary else _known("m")
    v = _known("1/s") if is_rotary else _known("m/s")
    return {
        "x": x,
        "v": v,
        "t": _known("s"),
        "u": _known(drive.input_unit),
        "force": _known("N m" if is_rotary else "N"),
        "output": v if drive.output == "velocity" else x,
    }


def _known(unit: str) -> Unit:
    found = base_exponents(unit)
    return None if found is None else found[0]


def own_values_faults(
    name: str, effect: OwnEffect, found: Mapping[str, Any], place: Place
) -> Iterator[Fault]:
    """Values of an effect of the user's own that the simulation is said to hold."""
    for key in found:
        if key not in effect.parameters:
            yield unknown_key((*place, name, key), effect.parameters)
    for key, one in effect.parameters.items():
        here = (*place, name, key)
        if key not in found:
            yield missing(here, "a finite number")
            continue
        value = found[key]
        low, high = one.bounds or (float("-inf"), float("inf"))
        if isinstance(value, str):
            yield wrong(here, value, "a finite number")
        elif one.positive and value <= 0:
            yield wrong(here, value, "a number > 0, because positive is true")
        elif not low <= value <= high:
            yield wrong(here, value, f"a number within its bounds, {low:g} to {high:g}")


def own_id_faults(
    identifier: str, found: Mapping[str, Any], place: Place
) -> Iterator[Fault]:
    """An id that holds no formula, or values that do not belong to it."""
    try:
        name, stated = own_of(identifier)
        unknown = names(parsed(stated.formula)) - {*VARIABLES, *stated.parameters}
    except (ValueError, TypeError, KeyError, AttributeError):
        unknown, name, stated = (
            {identifier},
            "",
            OwnEffect(force_N="x", parameters=_ANY),
        )
    if unknown:
        yield wrong(place, identifier[:_SHOWN], "an effect with its formula")
    else:
        yield from own_values_faults(name, stated, found, place)


_ANY = {"a": OwnParameter()}


def with_own_effects(experiment: Experiment) -> Experiment:
    """The same with effects of the user's own by their ids, and their units read."""
    if not experiment.own_effects:
        return experiment
    own = {name: _with_units(one) for name, one in experiment.own_effects.items()}
    changes: dict[str, Any] = {"own_effects": own}
    if experiment.simulation is not None:
        effects = named_by_id(experiment.simulation.effects, own)
        changes["simulation"] = replace(experiment.simulation, effects=effects)
    if experiment.diagnose is not None:
        changes["diagnose"] = replace(experiment.diagnose, own_effects=own)
    return replace(experiment, **changes)


def _with_units(effect: OwnEffect) -> OwnEffect:
    parameters = {}
    for name, one in effect.parameters.items():
        unit = base_exponents(one.unit)
        parameters[name] = replace(one, exponents=unit[0] if unit else ())
    return replace(effect, parameters=parameters)
