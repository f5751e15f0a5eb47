"""Units of formulas of the user's own: what each part is in, and whether parts fit.

A unit is its exponents of kg, m, s and A; an angle counts as a plain number here.
"""

from collections.abc import Mapping
from functools import cache

from hwid_cli.data.units import base_exponents
from hwid_cli.drive.formula import CONSTANTS, Node, as_text

# Exponents of kg, m, s and A; None for what fits any.
Unit = tuple[float, ...] | None
PLAIN = (0.0, 0.0, 0.0, 0.0)
_SAME = 1e-9
# Names of the usual ones, for messages.
_NAMES = (
    "N", "N m", "m", "m/s", "m/s^2", "s", "A", "V", "kg", "1/s", "1/m", "N/m", "N s/m",
    "N/m^2", "N/m^3", "N s^2/m^2", "N/A", "N/s", "1/A", "N m/A", "N m s", "m/A", "N/V",
)  # fmt: skip
_ANY_TO_PLAIN = ("sign", "Heaviside")
_SAME_AS_PART = ("abs", "Max", "Min", "neg", "+", "-")


class UnitsDoNotFitError(ValueError):
    """Parts of a formula whose units do not fit, in words."""


def unit_of(node: Node, units: Mapping[str, Unit]) -> Unit:
    """Unit of a formula.

    Parameters
    ----------
    units : mapping of str to Unit
        Of its variables and parameters.

    Raises
    ------
    UnitsDoNotFitError
        Naming the parts that do not.
    """
    if node.is_number:
        # Nothing is nothing in any unit.
        return PLAIN if node.value else None
    if node.is_name:
        return PLAIN if node.name in CONSTANTS else units[node.name]
    found = [unit_of(one, units) for one in node.parts]
    if node.name in _ANY_TO_PLAIN:
        return PLAIN
    if node.name in _SAME_AS_PART:
        return _common(node, found)
    if node.name in ("*", "/"):
        sign = 1 if node.name == "*" else -1
        return _sum(found[0], found[1], sign)
    if node.name == "**":
        return _power(node, found)
    if node.name == "sqrt":
        return _times(found[0], 0.5)
    if not _fits(found[0], PLAIN):
        raise UnitsDoNotFitError(
            f"{as_text(node.parts[0])} in {node.name}(...) is in {unit_name(found[0])}; "
            "expected a plain number or rad there"
        )
    return PLAIN


def _common(node: Node, found: list[Unit]) -> Unit:
    for one, other, part in zip(found, found[1:], node.parts[1:], strict=False):
        if not _fits(one, other):
            raise UnitsDoNotFitError(
                f"{as_text(node.parts[0])} is in {unit_name(one)}, {as_text(part)} in "
                f"{unit_name(other)}; expected terms of one unit"
            )
    return next((one for one in found if one is not None), None)


def _power(node: Node, found: list[Unit]) -> Unit:
    base, exponent = found
    if not _fits(exponent, PLAIN):
        raise UnitsDoNotFitError(
            f"the exponent {as_text(node.parts[1])} is in {unit_name(exponent)}; expected "
            "a plain number"
        )
    if node.parts[1].is_number:
        return _times(base, node.parts[1].value)
    if node.parts[1].name == "neg" and node.parts[1].parts[0].is_number:
        return _times(base, -node.parts[1].parts[0].value)
    if not _fits(base, PLAIN):
        raise UnitsDoNotFitError(
            f"{as_text(node)} takes a power that is fitted of what is in "
            f"{unit_name(base)}; expected a plain number there, such as (x/x0)**n"
        )
    return PLAIN


def _times(unit: Unit, factor: float) -> Unit:
    return None if unit is None else tuple(factor * one for one in unit)


def _sum(one: Unit, other: Unit, sign: int) -> Unit:
    if one is None or other is None:
        return None
    return tuple(a + sign * b for a, b in zip(one, other, strict=True))


def fits(one: Unit, other: Unit) -> bool:
    """Whether two units are the same, as far as both are known."""
    return _fits(one, other)


def _fits(one: Unit, other: Unit) -> bool:
    if one is None or other is None:
        return True
    return all(abs(a - b) < _SAME for a, b in zip(one, other, strict=True))


@cache
def unit_name(unit: Unit) -> str:
    """A unit in words.

    Examples
    --------
    >>> unit_name((1.0, 0.0, -2.0, 0.0)), unit_name(PLAIN), unit_name((0, 0.5, 0, 0))
    ('N/m', 'plain numbers', 'm^0.5')
    """
    if unit is None:
        return "any unit"
    if _fits(unit, PLAIN):
        return "plain numbers"
    for name in _NAMES:
        found = base_exponents(name)
        if found is not None and _fits(found[0], unit):
            return name
    parts = [
        base if exponent == 1 else f"{base}^{exponent:g}"
        for base, exponent in zip(("kg", "m", "s", "A"), unit, strict=True)
        if exponent
    ]
    return " ".join(parts)
