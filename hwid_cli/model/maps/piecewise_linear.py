"""Piecewise linear map: break-points and the values there, linear beyond the ends.

A map of n units changes its slope at n break-points, as in the reference toolbox. Its
two ends, at which nothing breaks, are stored like break-points.

References
----------
docs/method.md, eq. (2).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.model.maps.break_points import settled_break_points
from hwid_cli.model.maps.positions_and_values import amplified, compressed, mean_slope
from hwid_cli.model.maps.rule import Derivatives, MapRule, Shape
from hwid_cli.model.maps.segments import (
    columns_of_segments,
    piecewise_linear,
    piecewise_linear_jacobian,
    piecewise_linear_shares,
    piecewise_linear_value,
)
from hwid_cli.records.maps import MapOptions, StaticMap

# Ends of a map, stored beside the break-points between them.
N_ENDS = 2
# A step of the fit may shrink a segment to this share of its width at most, so that
# break-points stay in order and can still come close to each other over several steps.
_LEAST_SHRINK = 0.2
# Segments narrower than this share of the whole would be jumps, not slopes.
_LEAST_WIDTH = 1e-4
# Share of the domain: break-points closer to its ends are taken for them.
_EDGE = 1e-9


def break_points_and_values(static_map: StaticMap) -> tuple[np.ndarray, np.ndarray]:
    """Split a piecewise linear map's parameters.

    Returns
    -------
    break_points, values : ndarray, shape (units,)
    """
    units = static_map.parameters.size // 2
    return static_map.parameters[:units], static_map.parameters[units:]


def outlined(static_map: StaticMap) -> StaticMap:
    """Same map with nothing but break-points and values, also beyond its domain.

    Parameters
    ----------
    static_map : StaticMap
        Piecewise linear.

    Returns
    -------
    StaticMap
        Itself where its outermost segments go on. Else the domain's ends are break-points,
        and what lies beyond them is one straight line on each side.

    Examples
    --------
    >>> one = StaticMap("piecewise_linear", np.array([0.0, 1, 0, 5]), (0.0, 1.0))
    >>> outlined(replace(one, slopes_beyond=(1.0, 2.0))).parameters
    array([-1.,  0.,  1.,  2., -1.,  0.,  5.,  7.])
    """
    if static_map.slopes_beyond is None:
        return static_map
    (low, high), (below, above) = static_map.domain, static_map.slopes_beyond
    width = high - low
    points, values = break_points_and_values(static_map)
    at_ends = piecewise_linear_value(np.array([low, high]), points, values)
    near = _EDGE * width
    inside = (points > low + near) & (points < high - near)
    # The ends of a map in a fit are no break-points.
    inside[[0, -1]] = False
    points = np.concatenate([[low - width, low], points[inside], [high, high + width]])
    values = np.concatenate(
        [
            [at_ends[0] - below * width, at_ends[0]],
            values[inside],
            [at_ends[1], at_ends[1] + above * width],
        ]
    )
    return replace(
        static_map, parameters=np.concatenate([points, values]), slopes_beyond=None
    )


def _evaluate(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    argument = np.ascontiguousarray(argument, dtype=float)
    plain = outlined(static_map)
    return piecewise_linear_value(argument, *break_points_and_values(plain))


def _differentiate(
    static_map: StaticMap,
    argument: np.ndarray,
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    points, values = break_points_and_values(static_map)
    value, slope, segment = piecewise_linear(argument, points, values)
    piecewise_linear_jacobian(
        argument, points, (slope, segment), with_positions, out, first
    )
    return value, slope


def _derivatives(
    static_map: StaticMap, argument: np.ndarray, with_positions: bool
) -> Derivatives:
    points, values = break_points_and_values(static_map)
    spacing = 2 if with_positions else 1
    found = piecewise_linear_shares(argument, points, values, spacing)
    if not with_positions:
        return Derivatives(*found, count=points.size)
    return Derivatives(
        *found, 2 * (points.size - 1), columns_of_segments(points, values)
    )


def _starts(
    options: MapOptions, lowest: float, highest: float, shape: Shape
) -> tuple[StaticMap, ...]:
    points = np.linspace(lowest, highest, options.units + N_ENDS)
    parameters = np.concatenate([points, shape(points)])
    return (StaticMap("piecewise_linear", parameters, (lowest, highest)),)


def _names(static_map: StaticMap) -> tuple[str, ...]:
    units = static_map.parameters.size // 2
    points = tuple(f"break_point[{i}]" for i in range(units))
    return points + tuple(f"value[{i}]" for i in range(units))


def put_in_order(old: np.ndarray, proposed: np.ndarray) -> None:
    """Keep positions in their order after a step, in place.

    Parameters
    ----------
    old : ndarray, shape (n,)
        Rising.
    proposed : ndarray, shape (n,)
        Stay as they are where none comes too close to its neighbour.
    """
    settled_break_points(old, proposed, _LEAST_SHRINK, _LEAST_WIDTH)


def _settle(old: StaticMap, parameters: np.ndarray) -> None:
    """Keep the break-points in order."""
    points, _ = break_points_and_values(old)
    put_in_order(points, parameters[: points.size])


def _with_domain(one: StaticMap, domain: tuple[float, float]) -> StaticMap:
    """Outermost break-points beyond the domain come back to its ends.

    They may slide along their line while a search runs, as far as a hundred ranges away.
    """
    points, _ = break_points_and_values(one)
    ends = points.copy()
    if points[0] < domain[0] < points[1]:
        ends[0] = domain[0]
    if points[-2] < domain[1] < points[-1]:
        ends[-1] = domain[1]
    values = _evaluate(replace(one, slopes_beyond=None), ends)
    return replace(one, parameters=np.concatenate([ends, values]), domain=domain)


RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    identity=lambda options, low, high: _starts(options, low, high, np.asarray)[0],
    with_domain=_with_domain,
    names=_names,
    amplify=lambda one, factor: amplified(one, one.parameters.size // 2, factor),
    compress=lambda one, factor: compressed(one, one.parameters.size // 2, factor),
    size=lambda one: mean_slope(one, one.parameters.size // 2),
    n_positions=lambda static_map: static_map.parameters.size // 2,
    settle=_settle,
    corners=lambda static_map: break_points_and_values(outlined(static_map))[0],
    derivatives=_derivatives,
    # The outermost ones may slide along the straight line beyond them.
    held=lambda static_map: (0, static_map.parameters.size // 2 - 1),
)
