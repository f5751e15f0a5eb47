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

from hwid_cli.model.maps.positions import WEIGHT_OF_SHAPE, put_in_order
from hwid_cli.model.maps.positions_and_values import amplified, compressed, mean_slope
from hwid_cli.model.maps.rule import (
    MapRule,
    Part,
    Placing,
    Portable,
    Shape,
    displaces,
    raises,
)
from hwid_cli.records.maps import MapOptions, StaticMap

# Half width of a ramp as a share of the narrower cell beside it. Wide ramps blur where an
# edge is, narrow ones do not feel an edge that is far off; measured between 0.1 and 0.5.
_RAMP_SHARE = 0.15
# Places for an edge of a start, for each level.
_PIECES = 12
# Slope, as a share of a curve's range, that is added where pieces are chosen.
_TILT = 1e-3


def edges_and_levels(one: StaticMap) -> tuple[np.ndarray, np.ndarray]:
    """Split a piecewise constant map's parameters.

    Returns
    -------
    edges : ndarray, shape (units - 1,)
    levels : ndarray, shape (units,)
    """
    count = one.parameters.size // 2
    return one.parameters[:count], one.parameters[count:]


def ramps(one: StaticMap) -> np.ndarray:
    """Half widths of the ramps that stand in for the jumps where a search needs slopes.

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
    ends = np.linspace(lowest, highest, _PIECES * options.units + 1)
    values = shape(0.5 * (ends[1:] + ends[:-1]))
    cuts = nearest_steps(values, options.units)
    levels = [np.mean(piece) for piece in np.split(values, cuts)]
    parameters = np.concatenate([ends[cuts], levels])
    return (StaticMap("piecewise_constant", parameters, (lowest, highest)),)


def nearest_steps(
    values: np.ndarray, count: int, weights: np.ndarray | None = None
) -> np.ndarray:
    """Cut a curve so that its pieces' means come closest to it.

    Parameters
    ----------
    values : ndarray, shape (n,)
    count : int
        Pieces, at most n.
    weights : ndarray, shape (n,), optional
        Positive; of the squared distances.

    Returns
    -------
    ndarray of int, shape (count - 1,)
        First value of each piece but the first; equal pieces for a straight line.

    References
    ----------
    Bellman (1961), On the approximation of curves by line segments using dynamic
    programming.
    """
    n = values.size
    # Where a curve asks for fewer pieces, a slight slope spreads the others.
    values = values + _TILT * (np.ptp(values) or 1.0) * np.linspace(0.0, 1.0, n)
    weights = np.ones(n) if weights is None else weights
    weight, sums, squares = (
        np.concatenate([[0.0], np.cumsum(weights * values**power)])
        for power in (0, 1, 2)
    )
    # Of a piece from one place (row) up to another (column).
    inside = np.tri(n + 1, k=-1).T > 0
    size = np.where(inside, weight - weight[:, None], 1.0)
    error = squares - squares[:, None] - (sums - sums[:, None]) ** 2 / size
    error[~inside] = np.inf
    least, best = error[0], []
    for _ in range(count - 1):
        through = least[:, None] + error
        best.append(np.argmin(through, axis=0))
        least = np.min(through, axis=0)
    cuts, end = [], n
    for step in reversed(best):
        end = int(step[end])
        cuts.append(end)
    return np.array(cuts[::-1], dtype=int)


def _finer(one: StaticMap, corners: np.ndarray, argument: np.ndarray) -> StaticMap:
    """Same map with more edges, each half way between neighbouring samples.

    On a sample, rounding would decide on which side of the edge it lies.
    """
    old, _ = edges_and_levels(one)
    known = np.unique(argument)
    place = np.clip(np.searchsorted(known, corners), 1, known.size - 1)
    edges = np.union1d(old, 0.5 * (known[place - 1] + known[place]))
    levels = _evaluate(one, np.concatenate([edges[:1] - 1.0, edges]))
    domain = (float(argument.min()), float(argument.max()))
    return StaticMap(one.kind, np.concatenate([edges, levels]), domain)


def _coarser(one: StaticMap, argument: np.ndarray, units: int) -> StaticMap:
    """Map with so many levels; those that many samples reach weigh more."""
    if one.parameters.size <= 2 * units:
        return one
    edges, _ = edges_and_levels(one)
    cells = np.searchsorted(np.sort(argument), edges)
    weights = np.diff(cells, prepend=0, append=argument.size)
    weights = weights + WEIGHT_OF_SHAPE * argument.size
    return with_fewer_levels(one, weights, units)


def with_fewer_levels(one: StaticMap, weights: np.ndarray, count: int) -> StaticMap:
    """Map with so many levels, the nearest to those that it has.

    Parameters
    ----------
    weights : ndarray, shape (units,)
        Of its levels; positive.
    """
    edges, levels = edges_and_levels(one)
    cuts = nearest_steps(levels, count, weights)
    means = [
        np.average(piece, weights=weight)
        for piece, weight in zip(
            np.split(levels, cuts), np.split(weights, cuts), strict=True
        )
    ]
    return replace(one, parameters=np.concatenate([edges[cuts - 1], means]))


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


_C = """\
/* Piecewise constant: levels between edges and beyond them. */
static const double @side@_edges[@size_edges@] = {@edges@};
static const double @side@_levels[@size_edges@ + 1] = {@levels@};

static double @side@_map(double v)
{
    int low = 0, high = @size_edges@;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (v >= @side@_edges[middle]) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return @side@_levels[low];
}
"""

_MATLAB = """\
place = ones(size(v));
for edge = map.edges(:)'
    place = place + (v >= edge);
end
v = reshape(map.levels(place), size(v));
"""

RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    names=_names,
    amplify=lambda one, factor: amplified(one, one.parameters.size // 2, factor),
    compress=lambda one, factor: compressed(one, one.parameters.size // 2, factor),
    displaced=displaces(lambda one: slice(0, one.parameters.size // 2)),
    raised=raises(lambda one: slice(one.parameters.size // 2, None)),
    size=lambda one: mean_slope(one, one.parameters.size // 2),
    follows_shape=True,
    n_positions=lambda one: one.parameters.size // 2,
    settle=_settle,
    corners=lambda one: edges_and_levels(one)[0],
    held=lambda one: tuple(range(one.parameters.size // 2)),
    has_slope=False,
    placing=Placing(lambda one: edges_and_levels(one)[0], _finer, _coarser),
    portable=Portable(
        (
            Part(
                "edges",
                lambda total: total // 2,
                "Rising arguments at which the value jumps; an edge belongs to the level "
                "above it.",
                least=1,
                is_rising=True,
            ),
            Part(
                "levels",
                lambda total: total - total // 2,
                "Values, one more than edges.",
                least=2,
            ),
        ),
        "one level more than edges, at least two",
        c=_C,
        matlab=_MATLAB,
    ),
)
