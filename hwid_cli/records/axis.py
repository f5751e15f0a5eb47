"""Straight and rotating axes: the same equations under other names and units.

Inside of the program every axis is straight: m stands for rad, N for N m and kg for
kg m^2 where it rotates.
"""

from collections.abc import Collection, Mapping
from dataclasses import astuple, dataclass
from typing import Any, Protocol

from hwid_cli.records.rules import Refusal, Refused

AXES = ("linear", "rotary")
# Names of a rotating axis by those of a straight one.
ROTARY_NAMES = {
    "mass_kg": "inertia_kg_m2",
    "damping_N_s_per_m": "damping_N_m_s_per_rad",
    "stiffness_N_per_m": "stiffness_N_m_per_rad",
    "force_constant_N_per_A": "torque_constant_N_m_per_A",
    "back_emf_V_s_per_m": "back_emf_V_s_per_rad",
}
INERTIA = ROTARY_NAMES["mass_kg"]
# What units of a straight axis are on a rotating one.
_ROTARY_UNITS = {"m": "rad", "N": "N m", "kg": "kg m^2"}
# Sensors' effects whose lengths are what is read; of all others they are ways.
_OF_READING = ("sensor_saturation", "sensor_hum", "sensor_drift")


@dataclass(frozen=True)
class MotionUnits:
    """Units of a force, of the displacement and of the input."""

    force: str = "N"
    length: str = "m"
    source: str = "A"


class HasAxis(Protocol):
    """What states a base by the names of either axis."""

    @property
    def inertia_kg_m2(self) -> float | None:
        """None where the axis is straight."""


def axis_of(options: HasAxis) -> str:
    """One of ``AXES``."""
    return "linear" if options.inertia_kg_m2 is None else "rotary"


def base_of(options: HasAxis) -> dict[str, Any]:
    """Base of a simulation by the names of a straight axis, and its axis.

    Parameters
    ----------
    options : object
        With a field for each name of either axis.

    Returns
    -------
    dict
        Without what is not stated on a rotating axis.
    """
    axis = axis_of(options)
    named = {name: getattr(options, name_on(axis, name)) for name in ROTARY_NAMES}
    stated = {name: value for name, value in named.items() if value is not None}
    return {"axis": axis, **stated}


def name_on(axis: str, name: str) -> str:
    """Name of a parameter of the base on an axis.

    Parameters
    ----------
    name : str
        Of a straight axis.

    Examples
    --------
    >>> name_on("rotary", "mass_kg"), name_on("linear", "mass_kg")
    ('inertia_kg_m2', 'mass_kg')
    """
    return ROTARY_NAMES.get(name, name) if axis == "rotary" else name


def name_inside(name: str) -> str:
    """Name of a parameter of the base on a straight axis.

    Examples
    --------
    >>> name_inside("torque_constant_N_m_per_A"), name_inside("mass_kg")
    ('force_constant_N_per_A', 'mass_kg')
    """
    return {new: old for old, new in ROTARY_NAMES.items()}.get(name, name)


def unit_on(axis: str, unit: str) -> str:
    """Unit on an axis, of what has this one on a straight axis.

    Examples
    --------
    >>> unit_on("rotary", "N s^2/m^2"), unit_on("rotary", "A s/m")
    ('N m s^2/rad^2', 'A s/rad')
    >>> unit_on("rotary", "N m"), unit_on("linear", "N/m")
    ('N m', 'N/m')
    """
    if axis == "linear":
        return unit
    above, slash, below = unit.partition("/")
    return _rotary(above) + slash + _rotary(below)


def _rotary(product: str) -> str:
    """A product of units; torques and inertias stay as they are."""
    parts = product.split(" ")
    found = []
    for place, part in enumerate(parts):
        unit, _, power = part.partition("^")
        after = parts[place + 1] if place + 1 < len(parts) else ""
        before = parts[place - 1] if place else ""
        is_whole = (unit, after) in (("N", "m"), ("kg", "m^2"))
        is_whole = is_whole or (before, part) in (("N", "m"), ("kg", "m^2"))
        new = unit if is_whole else _ROTARY_UNITS.get(unit, unit)
        found.append(f"{new}^{power}" if power else new)
    return " ".join(found)


def unit_in(units: MotionUnits, unit: str) -> str:
    """Unit of a quantity in a simulation that has its own units.

    Examples
    --------
    >>> unit_in(MotionUnits("V", "mm", "V"), "N s^2/m^2")
    'V s^2/mm^2'
    >>> unit_in(MotionUnits("N", "rev/min", "%"), "m/A")
    '(rev/min)/%'
    >>> unit_in(MotionUnits(), "N/m")
    'N/m'

    Beside an angle a force is a torque:

    >>> turning = MotionUnits("N m", "rad", "V")
    >>> unit_in(turning, "N m"), unit_in(turning, "N s/m^2"), unit_in(turning, "A")
    ('N m', 'N m s/rad^2', 'V')
    """
    if units.force == _ROTARY_UNITS["N"]:
        there = unit_on("rotary", unit)
        return unit_in(MotionUnits(source=units.source), there)
    of = dict(zip(astuple(MotionUnits()), astuple(units), strict=True))

    def own(factor: str) -> str:
        base, _, power = factor.partition("^")
        new = of.get(base, base)
        # Of the unit itself a quotient is as it is; in a product it is one factor.
        new = f"({new})" if "/" in new and factor != unit else new
        return f"{new}^{power}" if power else new

    return "/".join(" ".join(map(own, part.split(" "))) for part in unit.split("/"))


def way_unit(of_velocity: str) -> str:
    """Unit of the way that a velocity of this unit leads along.

    Examples
    --------
    >>> way_unit("m/s"), way_unit("rad/s"), way_unit("rpm"), way_unit("")
    ('m', 'rad', 'rpm s', '')
    """
    way, _, time = of_velocity.rpartition("/")
    if way and time == "s":
        return way
    return f"{of_velocity} s" if of_velocity else ""


def unit_of_effect(
    identifier: str, unit: str, *, axis: str, output: str, units: MotionUnits
) -> str:
    """Unit of a parameter of an effect, from that at the end of its name.

    Parameters
    ----------
    identifier : str
        Id of the effect.
    output : str
        What is measured; one of ``drive.OUTPUTS``.
    units : MotionUnits
        Force and displacement of a straight axis; the unit of the input.

    Examples
    --------
    >>> unit_of_effect("input_dead_zone", "A", axis="rotary", output="position",
    ...                units=MotionUnits(source="N m"))
    'N m'
    >>> si = MotionUnits()
    >>> unit_of_effect("sensor_drift", "m/s", axis="linear", output="velocity", units=si)
    'm/s^2'
    >>> unit_of_effect("end_stop", "N/m", axis="rotary", output="velocity", units=si)
    'N m/rad'
    """
    if output == "velocity" and identifier in _OF_READING:
        unit = {"m": "m/s", "m/s": "m/s^2"}.get(unit, unit)
    return unit_in(units, unit_on(axis, unit))


def units_note(*, axis: str, output: str) -> str:
    """Say what the units at the end of names stand for; empty where for themselves.

    Examples
    --------
    >>> units_note(axis="rotary", output="position")
    'm stands for rad, N for N m, kg for kg m^2'
    """
    said = []
    if axis == "rotary":
        pairs = [f"{old} for {new}" for old, new in _ROTARY_UNITS.items()]
        said.append(
            f"{pairs[0].replace(' for', ' stands for')}, {', '.join(pairs[1:])}"
        )
    if output == "velocity":
        said.append("lengths that a sensor reads are velocities")
    return "; ".join(said)


def check_axis(given: Mapping[str, Any] | Collection[str]) -> None:
    """Refuse names of both axes together, and a rotating axis without inertia.

    Parameters
    ----------
    given : mapping or collection of str
        Names that are stated, with their values or without.

    Raises
    ------
    Refused
    """
    linear = [old for old in ROTARY_NAMES if old in given]
    rotary = [new for new in ROTARY_NAMES.values() if new in given]
    if linear and rotary:
        name = linear[0]
        found = given[name] if isinstance(given, Mapping) else name
        raise Refused(
            Refusal(
                found,
                "names of one axis, straight or rotating",
                (name,),
                said=f"found {{}} beside {rotary[0]}",
                step=f"write {ROTARY_NAMES[name]}",
            )
        )
    if rotary and INERTIA not in rotary:
        expected = f"the inertia, because {rotary[0]} is of a rotating axis"
        raise Refused(
            Refusal(None, expected, (INERTIA,), said="missing", step="add the key")
        )
