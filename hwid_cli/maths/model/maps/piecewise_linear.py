"""Piecewise linear map: break-points and the values there, linear beyond the ends.

References
----------
docs/method.md, eq. (2).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.maths.model.maps.kernels import (
    piecewise_linear,
    piecewise_linear_jacobian,
)
from hwid_cli.maths.model.maps.rule import MapRule, Shape
from hwid_cli.records.maps import MapOptions, StaticMap

# A step of the fit may shrink a segment to this share of its width at most, so that
# break-points stay in order and can still come close to each other over several steps.
_LEAST_SHRINK = 0.2
# Segments narrower than this share of the whole would be jumps, not slopes.
_LEAST_WIDTH = 1e-4


def break_points_and_values(static_map: StaticMap) -> tuple[np.ndarray, np.ndarray]:
    """Split a piecewise linear map's parameters.

    Parameters
    ----------
    static_map : StaticMap

    Returns
    -------
    break_points, values : ndarray, shape (units,)
    """
    units = static_map.parameters.size // 2
    return static_map.parameters[:units], static_map.parameters[units:]


def _evaluate(static_map: StaticMap, argument: np.ndarray) -> np.ndarray:
    argument = np.ascontiguousarray(argument, dtype=float)
    return piecewise_linear(argument, *break_points_and_values(static_map))[0]


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


def _starts(
    options: MapOptions, lowest: float, highest: float, shape: Shape
) -> tuple[StaticMap, ...]:
    points = np.linspace(lowest, highest, options.units)
    parameters = np.concatenate([points, shape(points)])
    return (StaticMap("piecewise_linear", parameters, (lowest, highest)),)


def _names(static_map: StaticMap) -> tuple[str, ...]:
    units = static_map.parameters.size // 2
    points = tuple(f"break_point[{i}]" for i in range(units))
    return points + tuple(f"value[{i}]" for i in range(units))


def _amplify(static_map: StaticMap, factor: float) -> StaticMap:
    points, values = break_points_and_values(static_map)
    return replace(static_map, parameters=np.concatenate([points, values * factor]))


def _compress(static_map: StaticMap, factor: float) -> StaticMap:
    points, values = break_points_and_values(static_map)
    low, high = (edge / factor for edge in static_map.domain)
    points = points / factor
    if factor < 0:
        points, values, low, high = points[::-1], values[::-1], high, low
    return replace(
        static_map, parameters=np.concatenate([points, values]), domain=(low, high)
    )


def _size(static_map: StaticMap) -> tuple[float, np.ndarray]:
    points, values = break_points_and_values(static_map)
    low, high = static_map.domain
    gradient = np.zeros(static_map.parameters.size)
    gradient[points.size + np.argmax(values)] = 1.0 / (high - low)
    gradient[points.size + np.argmin(values)] = -1.0 / (high - low)
    return float(np.ptp(values) / (high - low)), gradient


def in_order(old: np.ndarray, proposed: np.ndarray) -> np.ndarray:
    """Positions after a step, kept in their order.

    Parameters
    ----------
    old : ndarray, shape (n,)
        Rising.
    proposed : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
        Rising; the proposed ones where none comes too close to its neighbour.
    """
    old_widths = old[1:] - old[:-1]
    least = np.maximum(_LEAST_SHRINK * old_widths, _LEAST_WIDTH * (old[-1] - old[0]))
    least = np.minimum(least, old_widths)
    widths = proposed[1:] - proposed[:-1]
    if (widths >= least).all():
        return proposed
    laid_out = np.concatenate([[0.0], np.cumsum(np.maximum(widths, least))])
    # Keep the mean, so that widening pushes to both sides alike.
    return laid_out + (proposed.mean() - laid_out.mean())


def _settle(old: StaticMap, proposed: StaticMap) -> StaticMap:
    """Keep the break-points in order."""
    points, values = break_points_and_values(proposed)
    kept = in_order(break_points_and_values(old)[0], points)
    if kept is points:
        return proposed
    return replace(proposed, parameters=np.concatenate([kept, values]))


RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    identity=lambda options, low, high: _starts(options, low, high, np.asarray)[0],
    with_domain=lambda one, domain: replace(one, domain=domain),
    names=_names,
    amplify=_amplify,
    compress=_compress,
    size=_size,
    n_positions=lambda static_map: static_map.parameters.size // 2,
    settle=_settle,
    corners=lambda static_map: break_points_and_values(static_map)[0],
    # The outermost ones may slide along the straight line beyond them.
    held=lambda static_map: (0, static_map.parameters.size // 2 - 1),
)
