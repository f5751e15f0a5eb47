"""What calibration must know about a signal: onset, period, mean over a period.

A raw record begins with a lead-in at rest and carries constant offsets. These functions
find them; ``calibration`` makes recipes of them.

Limits: a lead-in shorter than ``LEAST_QUIET`` samples is not seen; a period needs two
level crossings.
docs/method_calibration.md gives the equations and the reasoning.
"""

import numpy as np
import scipy

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
