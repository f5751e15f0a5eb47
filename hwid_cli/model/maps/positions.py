"""Positions along the argument of a map: in order after a step, and fewer of them.

What holds for the break-points of a piecewise linear map holds for the edges of a
piecewise constant one.
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled

# Sweeps that put break-points into order.
_SWEEPS = 4
# Share of the samples that every break-point counts for beyond those near it when the
# needless ones go, so that the ends of a map, which few samples reach, keep theirs.
WEIGHT_OF_SHAPE = 1e-3
# A step of the fit may shrink a segment to this share of its width at most, so that
# break-points stay in order and can still come close to each other over several steps.
_LEAST_SHRINK = 0.2
# Segments narrower than this share of the whole would be jumps, not slopes.
_LEAST_WIDTH = 1e-4


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


@compiled()
def settled_break_points(
    old: np.ndarray, proposed: np.ndarray, least_shrink: float, least_width: float
) -> None:
    """Put break-points into order again, in place.

    Parameters
    ----------
    old, proposed : ndarray, shape (units,)
    least_shrink : float, [-]
        Share of its old width that a segment keeps at least.
    least_width : float, [-]
        Share of the whole that it keeps at least.
    """
    whole = old[-1] - old[0]
    least = np.empty(old.size - 1)
    for i in range(least.size):
        width = old[i + 1] - old[i]
        least[i] = min(max(least_shrink * width, least_width * whole), width)
    # Neighbours that came too close part to both sides alike; what that does to the
    # next ones is mended in further sweeps, and the last one is one-sided.
    for sweep in range(_SWEEPS):
        is_legal = True
        for i in range(least.size):
            lack = least[i] - (proposed[i + 1] - proposed[i])
            if lack > 0.0:
                is_legal = False
                share = 0.5 if sweep < _SWEEPS - 1 else 0.0
                proposed[i] -= share * lack
                proposed[i + 1] += (1.0 - share) * lack
        if is_legal:
            return


@compiled()
def thinned_break_points(
    break_points: np.ndarray, values: np.ndarray, weights: np.ndarray, count: int
) -> np.ndarray:
    """Choose the break-points that a coarser map needs most.

    One after the other, the inner break-point goes whose absence adds least to the
    weighted squared error at all given break-points.

    Parameters
    ----------
    break_points, values, weights : ndarray, shape (n,)
    count : int
        How many stay.

    Returns
    -------
    ndarray of int, shape (count,)
        Their indices.
    """
    kept = np.arange(break_points.size)
    while kept.size > count:
        cheapest, least = 1, np.inf
        for j in range(1, kept.size - 1):
            first, middle, last = kept[j - 1], kept[j], kept[j + 1]
            added = 0.0
            for i in range(first + 1, last):
                near, far = (first, middle) if i <= middle else (middle, last)
                with_it = _between(break_points, values, near, far, i)
                without = _between(break_points, values, first, last, i)
                added += weights[i] * (
                    (without - values[i]) ** 2 - (with_it - values[i]) ** 2
                )
            if added < least:
                cheapest, least = j, added
        for j in range(cheapest, kept.size - 1):
            kept[j] = kept[j + 1]
        kept = kept[: kept.size - 1]
    return kept


@compiled(**INNER)
def _between(
    points: np.ndarray, values: np.ndarray, first: int, last: int, at: int
) -> float:
    """Straight line through two break-points, read at a third."""
    share = (points[at] - points[first]) / (points[last] - points[first])
    return values[first] + share * (values[last] - values[first])
