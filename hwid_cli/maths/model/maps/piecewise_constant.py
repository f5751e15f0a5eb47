"""Piecewise constant map: levels between edges, constant beyond the outer ones.

Parameters are the edges, which stay where they are in the first phase of a fit, then the
levels. By its levels the map has derivatives; by its argument and its edges it has none
that could tell a search anything. There a stand-in serves: narrow ramps instead of the
jumps, and their derivatives. The cost is always that of the map itself, so a step counts
only where it lowers that. What this finds has no standard errors: edges count as known,
and behind such an output map there are none.

References
----------
docs/method.md, eq. (4e).
"""

from dataclasses import replace

import numpy as np

from hwid_cli.maths.model.maps.piecewise_linear import put_in_order
from hwid_cli.maths.model.maps.positions_and_values import (
    amplified,
    compressed,
    mean_slope,
)
from hwid_cli.maths.model.maps.rule import MapRule, Shape
from hwid_cli.records.maps import MapOptions, StaticMap

# Half width of a ramp as a share of the narrower cell beside it. Wide ramps blur where an
# edge is, narrow ones do not feel an edge that is far off; measured between 0.1 and 0.5.
_RAMP_SHARE = 0.15


def edges_and_levels(one: StaticMap) -> tuple[np.ndarray, np.ndarray]:
    """Split a piecewise constant map's parameters.

    Parameters
    ----------
    one : StaticMap

    Returns
    -------
    edges : ndarray, shape (units - 1,)
    levels : ndarray, shape (units,)
    """
    count = one.parameters.size // 2
    return one.parameters[:count], one.parameters[count:]


def ramps(one: StaticMap) -> np.ndarray:
    """Half widths of the ramps that stand in for the jumps where a search needs slopes.

    Parameters
    ----------
    one : StaticMap

    Returns
    -------
    ndarray, shape (units - 1,)
    """
    edges, _ = edges_and_levels(one)
    if edges.size == 1:
        return np.array([0.5 * _RAMP_SHARE * (one.domain[1] - one.domain[0])])
    cells = np.diff(edges)
    cells = np.concatenate([cells[:1], cells, cells[-1:]])
    return _RAMP_SHARE * np.minimum(cells[1:], cells[:-1])


def _cells(edges: np.ndarray, argument: np.ndarray) -> np.ndarray:
    return np.searchsorted(edges, argument, side="right")


def _evaluate(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    edges, levels = edges_and_levels(one)
    return levels[_cells(edges, argument)]


def _differentiate(
    one: StaticMap,
    argument: np.ndarray,
    with_positions: bool,
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    edges, levels = edges_and_levels(one)
    half = ramps(one)
    steep = np.diff(levels) / (2.0 * half)
    by_edges = -steep * (np.abs(argument[:, None] - edges) < half)
    if with_positions:
        out[:, first : first + edges.size] = by_edges
        first += edges.size
    cells = _cells(edges, argument)
    out[:, first : first + levels.size] = cells[:, None] == np.arange(levels.size)
    return levels[cells], -by_edges.sum(axis=1)


def _starts(
    options: MapOptions, lowest: float, highest: float, shape: Shape
) -> tuple[StaticMap, ...]:
    ends = np.linspace(lowest, highest, options.units + 1)
    levels = shape(0.5 * (ends[1:] + ends[:-1]))
    parameters = np.concatenate([ends[1:-1], levels])
    return (StaticMap("piecewise_constant", parameters, (lowest, highest)),)


def _names(one: StaticMap) -> tuple[str, ...]:
    edges, levels = edges_and_levels(one)
    return (
        *(f"edge[{i}]" for i in range(edges.size)),
        *(f"level[{i}]" for i in range(levels.size)),
    )


def _settle(old: StaticMap, parameters: np.ndarray) -> None:
    """Keep the edges in order."""
    edges, _ = edges_and_levels(old)
    put_in_order(edges, parameters[: edges.size])


RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    identity=lambda options, low, high: _starts(options, low, high, np.asarray)[0],
    with_domain=lambda one, domain: replace(one, domain=domain),
    names=_names,
    amplify=lambda one, factor: amplified(one, one.parameters.size // 2, factor),
    compress=lambda one, factor: compressed(one, one.parameters.size // 2, factor),
    size=lambda one: mean_slope(one, one.parameters.size // 2),
    n_positions=lambda one: one.parameters.size // 2,
    settle=_settle,
    corners=lambda one: edges_and_levels(one)[0],
    held=lambda one: tuple(range(one.parameters.size // 2)),
    has_slope=False,
)
