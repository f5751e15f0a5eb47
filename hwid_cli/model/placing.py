"""Where break-points are put: many for a while, then those that a map needs most.

docs/method.md, section "The search".
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, Experiment
from hwid_cli.model.maps.break_points import thinned_break_points
from hwid_cli.model.maps.piecewise_constant import (
    edges_and_levels,
    with_edges,
    with_fewer_levels,
)
from hwid_cli.model.maps.piecewise_linear import N_ENDS, break_points_and_values
from hwid_cli.model.points import before_output_map, point_of
from hwid_cli.records.model import FitOptions, StaticMap

# Kinds whose break-points or edges are put where they matter.
PLACED = ("piecewise_linear", "piecewise_constant")
# Break-points of the fine maps from which the final ones are chosen, for each final one.
_FINE_FACTOR = 3
# Least distance of fine break-points, as a share of the range.
_LEAST_GAP = 2e-3
# Pieces into which a segment is cut, and their least width as a share of the range: a
# map that jumps needs two break-points far nearer than any even grid has.
_PIECES, _LEAST_CUT = 3, 1e-4
# Share of the samples that every fine break-point counts for beyond those near it, so
# that the ends of a map, which few samples reach, keep theirs.
_WEIGHT_OF_SHAPE = 1e-3


def reaching(
    candidate: Candidate, experiments: Sequence[Experiment]
) -> tuple[np.ndarray, np.ndarray]:
    """Signals that reach the input map and the output map.

    Returns
    -------
    u, x : ndarray, shape (n,)
        Of all experiments, one after the other.
    """
    u = np.concatenate([one.input for one in experiments])
    return u, before_output_map(point_of(candidate), experiments)


def with_maps(
    candidate: Candidate,
    experiments: Sequence[Experiment],
    change: Callable[[StaticMap, np.ndarray], StaticMap],
    change_output: Callable[[StaticMap, np.ndarray], StaticMap] | None = None,
) -> Candidate:
    """Candidate with both maps changed, given the arguments that reach them.

    Parameters
    ----------
    change : callable (StaticMap, ndarray) -> StaticMap
    change_output : callable, optional
        For the output map, if it is another one.
    """
    model = candidate.model
    u, x = reaching(candidate, experiments)
    changed = replace(
        model,
        input_map=change(model.input_map, u),
        output_map=(change_output or change)(model.output_map, x),
    )
    return replace(candidate, model=changed)


def coarser(
    candidate: Candidate, experiments: Sequence[Experiment], options: FitOptions
) -> Candidate:
    """Candidate whose maps have as many break-points as asked for."""
    return with_maps(
        candidate,
        experiments,
        lambda one, argument: thinner(one, argument, options.of_input.units),
        lambda one, argument: thinner(one, argument, options.of_output.units),
    )


def finer(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map with more break-points, spread over what reaches it.

    Parameters
    ----------
    one : StaticMap
        Kinds that are not placed come back as they are.
    argument : ndarray, shape (n,)
    """
    if one.kind not in PLACED or not argument.min() < argument.max():
        return one
    old = _corners(one)
    points = np.union1d(old, _spread(argument, (_FINE_FACTOR - 1) * old.size))
    return _at(one, old, points, _LEAST_GAP * np.ptp(points), argument)


def cut(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map with every segment cut into pieces that equally many samples reach.

    Parameters
    ----------
    one : StaticMap
        Kinds that are not placed come back as they are.
    argument : ndarray, shape (n,)

    Returns
    -------
    StaticMap
        Segments of few samples stay whole.
    """
    if one.kind not in PLACED or not argument.min() < argument.max():
        return one
    old = _corners(one)
    ordered = np.sort(argument)
    pieces = np.split(ordered, np.searchsorted(ordered, old))[1:-1]
    inner = [
        np.quantile(piece, np.arange(1, _PIECES) / _PIECES)
        for piece in pieces
        if piece.size >= 2 * _PIECES
    ]
    points = np.union1d(old, np.concatenate([old, *inner]))
    return _at(one, old, points, _LEAST_CUT * np.ptp(argument), argument)


def _corners(one: StaticMap) -> np.ndarray:
    """Break-points or edges."""
    if one.kind == "piecewise_constant":
        return edges_and_levels(one)[0]
    return break_points_and_values(one)[0]


def _at(
    one: StaticMap,
    old: np.ndarray,
    points: np.ndarray,
    least_gap: float,
    argument: np.ndarray,
) -> StaticMap:
    """Same map with more break-points; new ones that make segments of no samples fall."""
    apart = np.diff(points, prepend=-np.inf) > least_gap
    domain = (float(argument.min()), float(argument.max()))
    if one.kind == "piecewise_constant":
        return with_edges(one, _between_samples(points[apart], argument, old), domain)
    points = np.union1d(old, points[apart])
    values = static_map.evaluate(one, points)
    return StaticMap(one.kind, np.concatenate([points, values]), domain)


def _between_samples(
    edges: np.ndarray, argument: np.ndarray, old: np.ndarray
) -> np.ndarray:
    """Edges half way between neighbouring samples, and the old ones.

    On a sample, rounding would decide on which side of the edge it lies.
    """
    known = np.unique(argument)
    place = np.clip(np.searchsorted(known, edges), 1, known.size - 1)
    return np.union1d(old, 0.5 * (known[place - 1] + known[place]))


def _spread(argument: np.ndarray, count: int) -> np.ndarray:
    """Points half equally spaced, half where the samples are.

    A signal that rarely goes far spends most samples in a small part of its range.
    """
    even = np.linspace(argument.min(), argument.max(), count - count // 2)
    ordered = np.sort(argument)
    places = np.linspace(0.0, argument.size - 1.0, count // 2 + 2)[1:-1]
    dense = np.interp(places, np.arange(argument.size), ordered)
    return np.concatenate([even, dense])


def thinner(one: StaticMap, argument: np.ndarray, units: int) -> StaticMap:
    """Map with fewer break-points, those that it needs most.

    Parameters
    ----------
    one : StaticMap
        Kinds that are not placed come back as they are.
    argument : ndarray, shape (n,)
        What reaches the map; break-points near many samples weigh more.
    units : int
        Break-points that stay between the ends.
    """
    if one.kind == "piecewise_constant" and one.parameters.size > 2 * units:
        cells = np.searchsorted(np.sort(argument), _corners(one))
        weights = np.diff(cells, prepend=0, append=argument.size)
        weights = weights + _WEIGHT_OF_SHAPE * argument.size
        return with_fewer_levels(one, weights, units)
    count = units + N_ENDS
    if one.kind != "piecewise_linear" or one.parameters.size <= 2 * count:
        return one
    points, values = break_points_and_values(one)
    below = np.searchsorted(np.sort(argument), 0.5 * (points[1:] + points[:-1]))
    near = np.diff(below, prepend=0, append=argument.size)
    weights = near + _WEIGHT_OF_SHAPE * argument.size
    kept = thinned_break_points(points, values, weights, count)
    return replace(one, parameters=np.concatenate([points[kept], values[kept]]))
