"""Damaged samples of a sensor: alone or two side by side, far from their neighbours.

Limit: three damaged samples side by side stay. docs/method_calibration.md gives the
equations and the reasoning.
"""

import numpy as np
import scipy

# Median absolute deviation to standard deviation of a normal distribution, [-].
MAD_TO_SIGMA = 1.4826

# A single sample is damaged beyond this many robust standard deviations, [-]: in two
# columns of 43 records of 7500 samples, normal noise exceeds 8 sigma once in 1e9 cases.
DAMAGE_SIGMA = 8.0
# ... and beyond this share of the signal's range, [-]: flicker of the last digit of a
# converter on an otherwise constant signal is not damage.
DAMAGE_SHARE = 0.01
# ... and so many of its smallest steps, [-]: eight bits are fewer steps than a share tells.
# Steps below the second share of the range are rounding.
DAMAGE_STEPS = 2.0
ROUNDING_SHARE = 1e-6
OFTEN = 10
# Lines from the left and from the right may differ by this share of the distance, [-]:
# at the edge of a step they differ by its height, around damage they agree.
NEIGHBOURS_AGREE = 0.3
# ... or by this multiple of what is usual nearby, [-]: in a fast sine the lines from
# both sides never meet.
USUAL_DISAGREEMENT = 2.0
# A mean over up to two samples about a corner lies off both lines by up to a quarter of
# the change of slope per sample, towards that change, [-]. In a smooth bend a good sample
# lies off by a third of it: nothing there is taken for a corner. Between these two:
CORNER_SHARE = 0.3
# Window of the local error scale, [samples]: much longer than one damaged sample with
# its neighbours (5), much shorter than a record.
LOCAL_WINDOW = 41

# Weights of the samples at -2, -1, 2 and 3 in the cubic through them at 0, [-]; at 1 they
# stand in the reverse order.
PAIR_WEIGHTS = (-0.3, 1.0, 0.5, -0.2)
# Nearer than this to a pair's first sample others spoil its neighbours, [samples].
PAIR_REACH = 4
# A signal that repeats its value for more of the time holds levels, [-].
HOLDS_LEVELS = 0.5
# Each one found makes others stand out: so many rounds at most.
MOST_ROUNDS = 8


def repaired(
    values: np.ndarray, *, may_hold: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Replace damaged samples until none is left: each one widens the scale.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [any]
    may_hold : bool
        As for ``find_damaged``.

    Returns
    -------
    ndarray, shape (n_samples,), [as values]
    ndarray of int, shape (n_damaged,), [samples]
        Which were replaced.
    """
    indices: list[int] = []
    for _ in range(MOST_ROUNDS):
        damaged = find_damaged(values, may_hold=may_hold)
        if damaged.size == 0:
            break
        values = replace_damaged(values, damaged)
        indices += damaged.tolist()
    return values, np.array(sorted(set(indices)), dtype=int)


def find_damaged(values: np.ndarray, *, may_hold: bool = True) -> np.ndarray:
    """Find damaged samples, alone or two side by side.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [any]
    may_hold : bool
        Whether two equal samples may be a short level on purpose, as in an input.

    Returns
    -------
    ndarray of int, shape (n_damaged,), [samples]
        In their order; what is alone does not stand beside a pair.

    References
    ----------
    docs/method_calibration.md, eqs. (C1), (C2), (C2a).
    """
    single = _single_damaged(values)
    pairs = _damaged_pairs(values, may_hold=may_hold)
    # What is found alone is surer: it has good samples on both sides.
    apart = [
        first
        for first in pairs.tolist()
        if not np.any(np.abs(single - first - 0.5) < PAIR_REACH)
        and np.sum(np.abs(pairs - first) < PAIR_REACH) == 1
    ]
    return np.sort([*single, *apart, *(first + 1 for first in apart)]).astype(int)


def _damaged_pairs(values: np.ndarray, *, may_hold: bool) -> np.ndarray:
    """First samples of damaged pairs: the same conditions as for a single one.

    Both samples lie far from the cubic and from the lines through two good ones on each
    side.
    """
    if values.size < 6:
        return np.zeros(0, dtype=int)
    a, b, c, d = values[:-5], values[1:-4], values[4:-1], values[5:]
    both = np.array([values[2:-3], values[3:-2]])
    from_left = np.array([2.0 * b - a, 3.0 * b - 2.0 * a])
    from_right = np.array([3.0 * c - 2.0 * d, 2.0 * c - d])
    low, high = np.minimum(from_left, from_right), np.maximum(from_left, from_right)
    # The first and the last samples begin no pair with neighbours.
    error, beyond, disagreement, bend = np.zeros((4, values.size))
    inner = slice(2, -3)
    error[inner] = np.abs(both - _pair_of(values)).min(axis=0)
    beyond[inner] = np.maximum(both - high, low - both).min(axis=0)
    disagreement[inner] = (high - low).max(axis=0)
    bend[inner] = np.abs((d - c) - (b - a))
    limit = _limit(error, values)
    agree = disagreement < np.maximum(
        NEIGHBOURS_AGREE * beyond, USUAL_DISAGREEMENT * _local_median(disagreement)
    )
    is_far = (error > limit) & (beyond > limit) & (beyond > CORNER_SHARE * bend)
    if may_hold or np.mean(np.diff(values) == 0) > HOLDS_LEVELS:
        apart = np.abs(np.diff(values, append=values[-1]))
        is_far &= apart > NEIGHBOURS_AGREE * beyond
    return np.flatnonzero(is_far & agree)


def _pair_of(values: np.ndarray) -> np.ndarray:
    """Values of the cubic through i-2, i-1, i+2, i+3 at i and i+1, for every inner i."""
    around = np.array([values[:-5], values[1:-4], values[4:-1], values[5:]])
    weights = np.array(PAIR_WEIGHTS)
    return np.array([weights @ around, weights[::-1] @ around])


def _limit(error: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Distance from the cubic beyond which a sample is damaged, at each sample."""
    scale = MAD_TO_SIGMA * np.maximum(_local_median(error), np.median(error))
    least = max(
        DAMAGE_SHARE * _robust_range(values), DAMAGE_STEPS * _resolution(values)
    )
    return np.maximum(DAMAGE_SIGMA * scale, least)


def _resolution(values: np.ndarray) -> float:
    """Smallest step from sample to sample, if it comes again and again; else 0."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > ROUNDING_SHARE * np.ptp(values)]
    if not steps.size:
        return 0.0
    least = float(steps.min())
    return least if np.sum(steps < 1.5 * least) >= OFTEN else 0.0


def _single_damaged(values: np.ndarray) -> np.ndarray:
    """Find single damaged samples.

    Returns
    -------
    ndarray of int, shape (n_damaged,), [samples]
        Indices of samples that lie far from the cubic through their two neighbours on
        each side, and far beyond the straight lines through the two on the left and the
        two on the right, while these lines agree. Far is measured in usual distances
        from the cubic. What the rounded corner of a ramp shows is not far.
    """
    if values.size < 5:
        return np.zeros(0, dtype=int)
    error, beyond, disagreement = np.zeros((3, values.size))
    from_left = 2.0 * values[1:-3] - values[:-4]
    from_right = 2.0 * values[3:-1] - values[4:]
    disagreement[2:-2] = np.abs(from_left - from_right)
    error[2:-2] = np.abs(values[2:-2] - _cubic_through_neighbours(values))
    # At the edge of a step and in the corner of a ramp one of the two lines is right.
    beyond[2:-2] = np.maximum(
        values[2:-2] - np.maximum(from_left, from_right),
        np.minimum(from_left, from_right) - values[2:-2],
    )
    limit = _limit(error, values)
    agree = disagreement < np.maximum(
        NEIGHBOURS_AGREE * beyond, USUAL_DISAGREEMENT * _local_median(disagreement)
    )
    # Two equal samples side by side are no single one: a short level between others.
    steps = np.abs(np.diff(values))
    alone = np.zeros(values.size)
    alone[1:-1] = np.minimum(steps[:-1], steps[1:])
    stands_alone = alone > NEIGHBOURS_AGREE * beyond
    is_corner = beyond < CORNER_SHARE * _bend(values, from_left, from_right)
    is_far = (error > limit) & (beyond > limit)
    return np.flatnonzero(is_far & agree & stands_alone & ~is_corner)


def _bend(
    values: np.ndarray, from_left: np.ndarray, from_right: np.ndarray
) -> np.ndarray:
    """Change of slope about each sample where the sample lies towards it, else 0."""
    slopes = np.diff(values)
    change = slopes[3:] - slopes[:-3]
    above = values[2:-2] > np.maximum(from_left, from_right)
    bend = np.zeros(values.size)
    bend[2:-2] = np.maximum(np.where(above, change, -change), 0.0)
    return bend


def _local_median(values: np.ndarray) -> np.ndarray:
    return scipy.ndimage.median_filter(values, LOCAL_WINDOW, mode="nearest")


def replace_damaged(values: np.ndarray, damaged: np.ndarray) -> np.ndarray:
    """Replace samples by the cubic through two good neighbours on each side.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [any]
    damaged : ndarray of int, shape (n_damaged,), [samples]
        As ``find_damaged`` gives them: never among the outer two samples.

    Returns
    -------
    ndarray, shape (n_samples,), [as values]
    """
    repaired = values.copy()
    repaired[damaged] = _cubic_through_neighbours(values)[damaged - 2]
    pairs = damaged[:-1][np.diff(damaged) == 1]
    if pairs.size:
        first, second = _pair_of(values)
        repaired[pairs], repaired[pairs + 1] = first[pairs - 2], second[pairs - 2]
    return repaired


def _cubic_through_neighbours(values: np.ndarray) -> np.ndarray:
    """Value of the cubic through samples i-2, i-1, i+1, i+2 at every inner i."""
    outer = values[:-4] + values[4:]
    inner = values[1:-3] + values[3:-1]
    return (4.0 * inner - outer) / 6.0


def _robust_range(values: np.ndarray) -> float:
    """Range without the outer percent, so that damage does not widen it."""
    low, high = np.percentile(values, [1.0, 99.0])
    return float(high - low)
