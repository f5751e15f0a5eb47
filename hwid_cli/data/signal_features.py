"""What calibration must know about a signal: damage, onset, period, mean over a period.

A raw record begins with a lead-in at rest, carries constant offsets, and holds a few
damaged samples, alone or two side by side. These functions find them; ``calibration``
makes recipes of them.

Limits: three damaged samples side by side stay; a lead-in shorter than ``LEAST_QUIET``
samples is not seen; a period needs two level crossings.
docs/method_calibration.md gives the equations and the reasoning.
"""

import numpy as np
import scipy

from hwid_cli.data.column_signs import held_share

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

# 80 % of normal deviates lie within this many standard deviations, [-]. In 20 samples
# this knows the noise better than their median, and still ignores one damaged sample.
P80_TO_SIGMA = 1.2816
# Fewest samples that make a rest, [samples].
LEAST_QUIET = 20
# A rest stays within this many robust standard deviations of its level, [-] ...
QUIET_SIGMA = 6.0
# ... or within this share of the signal's range, [-], whichever is wider.
QUIET_SHARE = 0.005
# A level known no better than to this share of the range is no rest, [-].
RESTLESS_SHARE = 0.25
# Samples that must follow a departure from rest, and how many of them must be away,
# [samples]: one damaged sample is no onset.
DEPARTURE_WINDOW, DEPARTURE_COUNT = 5, 3
# A lead-in is longer than any later quiet stretch by this factor, [-]; otherwise it
# may be the first level of an excitation that holds its levels.
LEAD_IN_FACTOR = 1.5

# Share of the range by which a signal must pass its middle to count as a crossing, [-].
HYSTERESIS_SHARE = 0.2
# Distances between crossings may differ from their median by this share, [-].
PERIOD_SPREAD = 0.25
# Of a whole period this share may be missing at the end, [-]: noise moves the period
# found in k periods, and cutting twice must not lose one of them.
MISSING_SHARE = 0.02


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
    if may_hold or held_share(values) > HOLDS_LEVELS:
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


def find_onset(values: np.ndarray, *, quiet_is_rest: bool) -> int | None:
    """Find the first sample of an excitation after a lead-in at rest.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [any]
        The input.
    quiet_is_rest : bool
        True if a quiet start is always a rest, as before a step. False if the
        excitation itself may begin with a quiet stretch, such as a random signal that
        holds its levels: then a lead-in must be clearly longer than those.

    Returns
    -------
    int or None, [samples]
        0 if there is no lead-in, None if the signal never leaves its rest.

    References
    ----------
    docs/method_calibration.md, eq. (C3).
    """
    if values.size < LEAST_QUIET:
        return 0
    spread = float(np.ptp(values))
    start = values[:LEAST_QUIET]
    level, tolerance = _rest_of(start, spread)
    if tolerance > RESTLESS_SHARE * spread and spread > 0.0:
        return 0
    onset = _first_departure(values, level, tolerance)
    if onset is not None and onset >= LEAST_QUIET:
        # The whole quiet stretch knows its level better than the start alone.
        level, tolerance = _rest_of(values[:onset], spread)
        onset = _first_departure(values, level, tolerance)
    if onset is None:
        return None
    if onset < LEAST_QUIET:
        return 0
    if not quiet_is_rest and _rests_elsewhere(values, onset, level, tolerance):
        return 0
    return onset


def _rest_of(quiet: np.ndarray, spread: float) -> tuple[float, float]:
    """Level of a quiet stretch and how far a sample may stray from it."""
    steps = np.diff(quiet)
    # Differences, so that a slow slope is not mistaken for noise.
    deviation = np.percentile(np.abs(steps - np.median(steps)), 80.0)
    sigma = float(deviation) / P80_TO_SIGMA / np.sqrt(2.0)
    tolerance = max(QUIET_SIGMA * sigma, QUIET_SHARE * spread)
    return float(np.median(quiet)), tolerance


def _first_departure(values: np.ndarray, level: float, tolerance: float) -> int | None:
    """First sample away from the level that others follow; None if there is none."""
    is_away = np.abs(values - level) > tolerance
    padded = np.concatenate([is_away, np.repeat(is_away[-1:], DEPARTURE_WINDOW - 1)])
    followers = np.lib.stride_tricks.sliding_window_view(padded, DEPARTURE_WINDOW)
    departures = np.flatnonzero(is_away & (followers.sum(axis=1) >= DEPARTURE_COUNT))
    return int(departures[0]) if departures.size else None


def _rests_elsewhere(
    values: np.ndarray, onset: int, level: float, tolerance: float
) -> bool:
    """Whether a stretch about as long as the lead-in is quiet at another level."""
    window = int(np.ceil(onset / LEAD_IN_FACTOR))
    rest = values[onset:]
    if rest.size < window:
        return False
    stretches = slice(window // 2, rest.size - (window - 1) // 2)
    high = scipy.ndimage.maximum_filter1d(rest, window)[stretches]
    low = scipy.ndimage.minimum_filter1d(rest, window)[stretches]
    is_quiet = high - low <= 2.0 * tolerance
    is_elsewhere = np.abs(0.5 * (high + low) - level) > 2.0 * tolerance
    return bool(np.any(is_quiet & is_elsewhere))


def find_period(values: np.ndarray) -> float | None:
    """Find the period of a signal that swings about its middle.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [any]

    Returns
    -------
    float or None, [samples]
        None if the signal holds less than one period or its swings differ in length.

    References
    ----------
    docs/method_calibration.md, section "Period".
    """
    if values.size < 3:
        return None
    low, high = np.percentile(values, [1.0, 99.0])
    middle, margin = 0.5 * (low + high), HYSTERESIS_SHARE * 0.5 * (high - low)
    upward = _upward_crossings(values - middle, margin)
    downward = _upward_crossings(middle - values, margin)
    crossings = max(upward, downward, key=len)
    if crossings.size >= 2:
        lengths = np.diff(crossings)
        typical = np.median(lengths)
        if np.max(np.abs(lengths - typical)) > PERIOD_SPREAD * typical:
            return None
        period = (crossings[-1] - crossings[0]) / lengths.size
    elif upward.size == 1 and downward.size == 1:
        period = 2.0 * abs(upward[0] - downward[0])
    else:
        return None
    is_whole = whole_periods(values.size, period) > 0
    return float(period) if period > 2.0 and is_whole else None


def _upward_crossings(centred: np.ndarray, margin: float) -> np.ndarray:
    """Interpolated times at which a signal rises through 0 from -margin to margin."""
    side = np.where(centred > margin, 1, np.where(centred < -margin, -1, 0))
    decided = np.flatnonzero(side)
    rises = np.flatnonzero(np.diff(side[decided]) == 2)
    times = []
    for before, after in zip(decided[rises], decided[rises + 1], strict=True):
        stretch = centred[before : after + 1]
        # Noise may cross several times: the mean of the first and the last crossing.
        up = np.flatnonzero((stretch[:-1] <= 0.0) & (stretch[1:] > 0.0))
        ends = up[[0, -1]]
        share = -stretch[ends] / (stretch[ends + 1] - stretch[ends])
        times.append(before + float(np.mean(ends + share)))
    return np.array(times)


def mean_over_period(values: np.ndarray, period_samples: float) -> float:
    """Mean over the first whole period, by the trapezoidal rule.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [any]
    period_samples : float, [samples]
        The end of the period lies between samples; beyond the last sample the signal
        is taken to stay as it is.

    Returns
    -------
    float, [as values]
    """
    times = np.append(np.arange(np.ceil(period_samples)), period_samples)
    period = np.interp(times, np.arange(values.size), values)
    return float(scipy.integrate.trapezoid(period, times)) / period_samples


def whole_periods(n_samples: int, period_samples: float) -> int:
    """Count the samples that hold as many whole periods as fit.

    Parameters
    ----------
    n_samples : int, [samples]
    period_samples : float, [samples]

    Returns
    -------
    int, [samples]
        Rounded to a sample; a period counts as whole if ``MISSING_SHARE`` of it or half
        a sample is missing.
    """
    missing = max(0.5, MISSING_SHARE * period_samples)
    periods = int((n_samples + missing) / period_samples)
    return min(n_samples, round(periods * period_samples))
