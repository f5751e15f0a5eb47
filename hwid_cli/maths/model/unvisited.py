"""Piecewise linear maps where no sample has been: as straight as the data allow.

What a search leaves there depends on where it began: data without noise stop it before
the prior has any say. Of all values that agree with the map wherever a sample has been,
those with the smallest bends are taken. Positions stay.

References
----------
docs/method.md, section "Where no sample has been".
"""

from dataclasses import replace

import numpy as np

from hwid_cli.maths.model.maps.break_points.kernels import bends
from hwid_cli.maths.model.maps.piecewise_linear import break_points_and_values
from hwid_cli.records.model import StaticMap

# Share of a segment over which its samples must spread to tell its slope, and strength
# of a direction, as a share of the strongest, below which the samples do not see it.
_LEAST_SPREAD, _UNSEEN = 1e-3, 1e-6


def straightened(one: StaticMap, argument: np.ndarray) -> StaticMap:
    """Same map where samples have been, with the smallest bends elsewhere.

    Parameters
    ----------
    one : StaticMap
        Kinds other than piecewise linear come back as they are.
    argument : ndarray, shape (n,)
        What reaches the map.

    Returns
    -------
    StaticMap
        The same one where samples tell the slope of every segment.

    Examples
    --------
    >>> bent = StaticMap("piecewise_linear", np.array([0.0, 1, 2, 3, 0, 1, 9, 3]))
    >>> straightened(bent, np.array([0.0, 0.5, 1.0, 3.0])).parameters[4:].round(6)
    array([0., 1., 2., 3.])
    """
    if one.kind != "piecewise_linear" or one.parameters.size < 6:
        return one
    points, values = break_points_and_values(one)
    if not np.isfinite(argument).all():
        return one
    levels = np.sort(argument)
    if _is_told(points, levels):
        return one
    seen = _shares(points, np.unique(levels))
    _, strength, directions = np.linalg.svd(np.linalg.qr(seen, mode="r"))
    rank = int(np.sum(strength > _UNSEEN * strength[0]))
    unseen = directions[rank:].T
    if unseen.shape[1] == 0:
        return one
    bend, jacobian = bends(points, values, False)
    steps = np.linalg.lstsq(jacobian @ unseen, -bend, rcond=None)[0]
    return replace(one, parameters=np.concatenate([points, values + unseen @ steps]))


def _is_told(points: np.ndarray, levels: np.ndarray) -> bool:
    """Tell whether the samples in every segment spread enough to know its line."""
    inner = np.searchsorted(levels, points[1:-1], side="left")
    first, end = np.append(0, inner), np.append(inner, levels.size)
    if np.any(first == end):
        return False
    spread = levels[end - 1] - levels[first]
    return bool(np.all(spread > _LEAST_SPREAD * np.diff(points)))


def _shares(points: np.ndarray, argument: np.ndarray) -> np.ndarray:
    """How much the value at each break-point counts for a map's values."""
    segment = np.clip(
        np.searchsorted(points, argument, side="right") - 1, 0, points.size - 2
    )
    share = (argument - points[segment]) / (points[segment + 1] - points[segment])
    rows = np.zeros((argument.size, points.size))
    at = np.arange(argument.size)
    rows[at, segment], rows[at, segment + 1] = 1.0 - share, share
    return rows
