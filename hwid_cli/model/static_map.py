"""Static nonlinearities: one table from name to functions, and what fits do with them.

Another nonlinearity is a module of its name in `maps` that gives a ``RULE``, and a line
in the table ``MAP_KINDS`` of `records.maps`.

References
----------
docs/method.md, eqs. (2)-(4f).
"""

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module

import numpy as np

from hwid_cli.model.maps.piecewise_linear import (
    piecewise_linear,
    piecewise_linear_value,
)
from hwid_cli.model.maps.rule import Derivatives, MapRule, Shape
from hwid_cli.records.maps import MAP_KINDS, Extrapolation, MapOptions, StaticMap

RULES: dict[str, MapRule] = {
    kind: import_module(f"hwid_cli.model.maps.{kind}").RULE for kind in MAP_KINDS
}


def evaluate(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    """Value of a static map.

    Parameters
    ----------
    argument : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)

    References
    ----------
    docs/method.md, eqs. (2)-(4f).

    Examples
    --------
    >>> evaluate(StaticMap("dead_zone", np.array([-1.0, 2.0])), np.array([-3.0, 0, 5]))
    array([-2.,  0.,  3.])
    """
    rule = RULES[static_map.kind]
    if static_map.extrapolation is not None:
        return _extrapolated(static_map, argument, rule.evaluate)
    return rule.evaluate(static_map, argument)


def evaluate_repeatably(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    """Value that a program elsewhere can repeat to the last bit.

    A search needs values and derivatives of whole arrays fast; a simulation is what a
    model that leaves the program is compared with, so its arithmetic has one order.

    Parameters
    ----------
    argument : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
        That of `evaluate` but for rounding.

    Examples
    --------
    >>> line = StaticMap("cubic_spline", np.array([0.0, 1.0, 0.0, 2.0]), (0.0, 1.0))
    >>> evaluate_repeatably(line, np.array([-1.0, 0.25]))
    array([-2. ,  0.5])
    """
    rule = RULES[static_map.kind]
    law = rule.repeatable or rule.evaluate
    if static_map.extrapolation is not None:
        return _extrapolated(static_map, argument, law)
    return law(static_map, argument)


def _extrapolated(
    one: StaticMap, argument: np.ndarray, law: Callable[..., np.ndarray]
) -> np.ndarray:
    """Value by the law where samples were, by straight lines elsewhere."""
    one = RULES[one.kind].outlined(one)
    argument = np.ascontiguousarray(argument, dtype=float)
    if one.extrapolation is None:
        return law(one, argument)
    lines = one.extrapolation
    value = piecewise_linear_value(argument, lines.arguments, lines.values)
    inside = is_visited(one, argument)
    value[inside] = law(one, argument[inside])
    return value


def is_visited(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    """Tell at which arguments the law of a map's kind holds.

    Parameters
    ----------
    argument : ndarray, shape (n,)

    Returns
    -------
    ndarray of bool, shape (n,)
        True everywhere for a map without an extrapolation.
    """
    if one.extrapolation is None:
        return np.ones(argument.shape, dtype=bool)
    inside = np.zeros(argument.shape, dtype=bool)
    for low, high in one.extrapolation.stretches:
        inside |= (argument >= low) & (argument <= high)
    return inside


def differentiate(
    static_map: StaticMap,
    argument: np.ndarray,
    out: np.ndarray,
    first: int,
    *,
    with_positions: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope of a static map; its derivatives by its parameters into `out`.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    out : ndarray, shape (n, at least first + n_active)
        Receives one column for each active parameter. Written in place, because fresh
        memory for every call would cost more than the arithmetic.
    first : int
        First column to write.
    with_positions : bool
        Whether positions, such as break-points, count as parameters.

    Returns
    -------
    value, slope : ndarray, shape (n,)
    """
    rule = RULES[static_map.kind]
    return rule.differentiate(static_map, argument, with_positions, out, first)


def derivatives(
    static_map: StaticMap, argument: np.ndarray, *, with_positions: bool
) -> Derivatives:
    """Value, slope and derivatives of a static map by its active parameters.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    with_positions : bool
        Whether the break-points of a piecewise linear map count as parameters.

    Returns
    -------
    Derivatives
        Value and slope are also right where a map is extrapolated; the parameters' columns
        are those of the law.
    """
    rule = RULES[static_map.kind]
    if static_map.extrapolation is not None:
        return _extrapolated_derivatives(static_map, argument, with_positions)
    if rule.derivatives is not None:
        return rule.derivatives(static_map, argument, with_positions)
    active = active_parameters(static_map, with_positions=with_positions)
    count = active.stop - active.start
    shares = np.empty((argument.size, count))
    value, slope = rule.differentiate(static_map, argument, with_positions, shares, 0)
    first = np.zeros(argument.size, dtype=np.int64)
    return Derivatives(value, slope, first, shares, count)


def _extrapolated_derivatives(
    one: StaticMap, argument: np.ndarray, with_positions: bool
) -> Derivatives:
    one = RULES[one.kind].outlined(one)
    law = replace(one, extrapolation=None)
    found = derivatives(law, argument, with_positions=with_positions)
    lines = one.extrapolation
    if lines is None:
        return found
    value, slope, _ = piecewise_linear(argument, lines.arguments, lines.values)
    inside = is_visited(one, argument)
    return replace(
        found,
        value=np.where(inside, found.value, value),
        slope=np.where(inside, found.slope, slope),
    )


def starting_maps(
    kind: str,
    options: MapOptions,
    lowest: float,
    highest: float,
    *,
    shape: Shape = lambda argument: argument,
) -> tuple[StaticMap, ...]:
    """Maps from which a fit can start.

    Parameters
    ----------
    lowest, highest : float
        Range of the argument; widened where it is empty.
    shape : callable (ndarray) -> ndarray
        What kinds with a free shape should look like; the identity unless given.
    """
    lowest, highest = _widened(float(lowest), float(highest))
    return RULES[kind].starts(options, lowest, highest, shape)


def identity(kind: str, options: MapOptions, argument: np.ndarray) -> StaticMap:
    """Map that passes an argument on unchanged.

    Parameters
    ----------
    argument : ndarray, shape (n,)
    """
    lowest, highest = _widened(float(np.min(argument)), float(np.max(argument)))
    rule = RULES[kind]
    if rule.identity is None:
        return rule.starts(options, lowest, highest, np.asarray)[0]
    return rule.identity(options, lowest, highest)


def _widened(lowest: float, highest: float) -> tuple[float, float]:
    """A range that is not empty."""
    if lowest < highest:
        return lowest, highest
    half = 0.5 * max(abs(lowest), 1.0)
    return lowest - half, highest + half


def active_parameters(static_map: StaticMap, *, with_positions: bool) -> slice:
    """Which parameters a fit may move."""
    first = 0 if with_positions else RULES[static_map.kind].n_positions(static_map)
    return slice(first, static_map.parameters.size)


def move(static_map: StaticMap, step: np.ndarray) -> StaticMap:
    """Map after a step of its active parameters, put into a legal order.

    Parameters
    ----------
    step : ndarray, shape (n_active,)
        Of its last parameters: positions, which may stay, come first.
    """
    if step.size == 0:
        return static_map
    parameters = static_map.parameters.copy()
    parameters[parameters.size - step.size :] += step
    RULES[static_map.kind].settle(static_map, parameters)
    return StaticMap(
        static_map.kind, parameters, static_map.domain, static_map.function
    )


def with_domain(static_map: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map, with the range of an argument as its domain.

    Parameters
    ----------
    argument : ndarray, shape (n,)
        A constant one leaves the map as it is.

    Returns
    -------
    StaticMap
        Gives the same values.
    """
    lowest, highest = float(np.min(argument)), float(np.max(argument))
    if not lowest < highest:
        return static_map
    return RULES[static_map.kind].with_domain(static_map, (lowest, highest))


def stretch(static_map: StaticMap, factor: float) -> StaticMap:
    """The map ``v -> factor * map(v / factor)``: another unit for argument and value.

    Parameters
    ----------
    factor : float
        Positive.
    """
    low, high = static_map.domain
    domain = (low * factor, high * factor)
    function, lines = static_map.function, static_map.extrapolation
    if function is not None:
        # Nobody knows the units of its parameters: the function keeps its own.
        kept = replace(function, unit=function.unit * factor)
        return replace(static_map, function=kept, domain=domain)
    # Every other parameter has the unit of argument or value, whatever the kind.
    return replace(
        static_map,
        parameters=static_map.parameters * factor,
        domain=domain,
        extrapolation=lines
        and Extrapolation(
            lines.visited * factor, lines.arguments * factor, lines.values * factor
        ),
    )


def outlined(static_map: StaticMap) -> StaticMap:
    """Same map, its parameters alone giving its values everywhere.

    Returns
    -------
    StaticMap
        A piecewise linear map has the lines of its extrapolation as segments; other kinds
        come back as they are.
    """
    return RULES[static_map.kind].outlined(static_map)


def straightened(static_map: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map where samples have been, as straight elsewhere as they allow.

    Parameters
    ----------
    argument : ndarray, shape (n,)
        What reaches the map.

    References
    ----------
    docs/method.md, section "Where no sample has been".
    """
    return RULES[static_map.kind].straightened(static_map, argument)


def has_free_shape(kind: str) -> bool:
    """Tell whether maps of a kind follow any shape, with gain and offset of their own."""
    return RULES[kind].follows_shape


def parameter_names(static_map: StaticMap) -> tuple[str, ...]:
    """Names of a map's parameters, in their order."""
    return RULES[static_map.kind].names(static_map)
