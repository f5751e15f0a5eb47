"""Where break-points are put: many for a while, then those that a map needs most.

docs/method.md, section "The search".
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.points import before_output_map, point_of
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import FitOptions, StaticMap

# Break-points of the fine maps from which the final ones are chosen, for each final one.
_FINE_FACTOR = 3
# Least distance of fine break-points, as a share of the range.
_LEAST_GAP = 2e-3
# Pieces into which a segment is cut, and their least width as a share of the range: a
# map that jumps needs two break-points far nearer than any even grid has.
_PIECES, _LEAST_CUT = 3, 1e-4


def reaching(
    candidate: Candidate, experiments: Sequence[FitData]
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
    experiments: Sequence[FitData],
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
    candidate: Candidate, experiments: Sequence[FitData], options: FitOptions
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
    placing = RULES[one.kind].placing
    if placing is None or not argument.min() < argument.max():
        return one
    old = placing.corners(one)
    points = np.union1d(old, _spread(argument, (_FINE_FACTOR - 1) * old.size))
    apart = _apart(points, _LEAST_GAP * np.ptp(points))
    return placing.finer(one, apart, argument)


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
    placing = RULES[one.kind].placing
    if placing is None or not argument.min() < argument.max():
        return one
    old = placing.corners(one)
    ordered = np.sort(argument)
    pieces = np.split(ordered, np.searchsorted(ordered, old))[1:-1]
    inner = [
        np.quantile(piece, np.arange(1, _PIECES) / _PIECES)
        for piece in pieces
        if piece.size >= 2 * _PIECES
    ]
    points = np.union1d(old, np.concatenate([old, *inner]))
    apart = _apart(points, _LEAST_CUT * np.ptp(argument))
    return placing.finer(one, apart, argument)


def _apart(points: np.ndarray, least_gap: float) -> np.ndarray:
    """Those of rising points that do not come too close to the one before."""
    return points[np.diff(points, prepend=-np.inf) > least_gap]


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
    placing = RULES[one.kind].placing
    return one if placing is None else placing.coarser(one, argument, units)
