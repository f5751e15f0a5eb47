"""What the numbers of a column say about it: a clock, an input, an answer to one.

Signs, no proofs: they order the columns of a file that nobody has described, for a
person to check. All are free of units.
"""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

# Time stamps carry rounding errors and jitter; beyond this share of the step a column
# that only grows is no clock, [-].
MOST_JITTER = 0.5
# Share of the steps that may lie beyond that: gaps, [-].
MOST_GAPS = 0.02
# Two columns are multiples of each other beyond this correlation, [-].
SAME = 0.99999
# Samples looked at: more tell nothing new.
_LONGEST = 16_000
# Past values that predict the next one, and of how many samples means are looked at.
_LAGS = 4
_MEANS_OF = (1, 2, 5, 10, 25, 50)
_FEWEST_MEANS = 300
# Share of the largest that a spectral line must hold to be alone, [-].
_LINE_SHARE = 0.85
# A step's levels hold for this share of all samples at least, [-].
_HELD_SHARE = 0.8
# Rows that are written twice, and rows with a stamp that does not fit, are fewer than
# these shares, [-].
MOST_REPEATED, MOST_ODD = 0.01, 0.02
_FEWEST = 20
# Recordings in one file, and the largest ratio of their steps.
_MOST_RESTARTS, _SAME_STEP = 1000, 1.02
# Longest stretch without a sample that a straight line may cross, [steps], or where that
# is longer this share of a recording, [-].
LONGEST_GAP, _LONGEST_PAUSE = 10.0, 0.01
# Ticks of a clock that shows large ones only.
_FEWEST_TICKS = 2


@dataclass(frozen=True)
class Clock:
    """How a column ticks.

    Parameters
    ----------
    step : float, [as the column]
        Median difference.
    jitter : float, [-]
        Largest deviation of a difference from it, as a share of it.
    """

    step: float
    jitter: float


def clock_of(values: np.ndarray, *, may_be_uneven: bool = False) -> Clock | None:
    """Clock that a column may be.

    Parameters
    ----------
    values : ndarray, shape (n,)
    may_be_uneven : bool
        Whether it may grow however unevenly: stamps of events.

    Returns
    -------
    Clock or None
        None for a column that does not grow throughout, or not evenly.

    Examples
    --------
    >>> clock_of(0.5 * np.arange(100))
    Clock(step=0.5, jitter=0.0)
    >>> clock_of(np.arange(100.0) ** 2) is None
    True
    >>> clock_of(np.cumsum(np.tile([1.0, 2.0, 5.0], 20)), may_be_uneven=True).step
    2.0
    """
    steps = _growing_steps(values)
    if steps is None:
        return None
    median = float(np.median(steps))
    off = np.abs(steps - median) / median
    is_even = np.mean(off > MOST_JITTER) <= MOST_GAPS
    return Clock(median, float(off.max())) if is_even or may_be_uneven else None


def _growing_steps(values: np.ndarray) -> np.ndarray | None:
    """Differences of a column that grows but for a few rows; None for another one."""
    if values.size < _FEWEST or not np.isfinite(values).all():
        return None
    steps = np.diff(values)
    if np.median(steps) <= 0 or np.mean(steps <= 0) > MOST_ODD:
        return None
    # Rows that a logger wrote twice, or with a damaged stamp.
    fits = growing_rows(values)
    return np.diff(values[fits]) if np.mean(~fits) <= MOST_ODD else None


def growing_rows(values: np.ndarray) -> np.ndarray:
    """Rows of the longest part of a column that grows throughout.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite.

    Returns
    -------
    ndarray of bool, shape (n,)

    Examples
    --------
    >>> growing_rows(np.array([0.0, 1.0, 1.0, 2.0, 9.0, 3.0]))
    array([ True,  True, False,  True, False,  True])
    """
    if (np.diff(values) > 0).all():
        return np.ones(values.size, dtype=bool)
    # Patience sorting: the smallest end of a growing part of each length, and the row
    # before each row.
    ends: list[float] = []
    rows: list[int] = []
    before = np.full(values.size, -1)
    for row, value in enumerate(values.tolist()):
        length = bisect_left(ends, value)
        if ends[length : length + 1] == [value]:
            # Of equal ones the first stays.
            continue
        before[row] = rows[length - 1] if length else -1
        ends[length : length + 1], rows[length : length + 1] = [value], [row]
    found = np.zeros(values.size, dtype=bool)
    row = rows[-1]
    while row >= 0:
        found[row] = True
        row = int(before[row])
    return found


def coarse_clock_of(values: np.ndarray) -> float | None:
    """Step from sample to sample of a clock that shows its large ticks only.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    float or None
        None where ticks are not evenly apart, or hold unequal numbers of samples.

    Examples
    --------
    >>> coarse_clock_of(np.repeat([10.0, 11.0, 12.0, 13.0], 500))
    0.002
    >>> coarse_clock_of(np.arange(2000.0)) is None
    True
    """
    if values.size < _FEWEST or not np.isfinite(values).all():
        return None
    begins = np.flatnonzero(np.diff(values)) + 1
    if begins.size < _FEWEST_TICKS:
        return None
    ticks = np.diff(values[begins])
    # The first and the last one may be cut.
    held = np.diff(begins)
    ends = max(begins[0], values.size - begins[-1])
    is_even = np.ptp(ticks) <= MOST_JITTER * ticks[0] and ticks[0] > 0
    is_even = is_even and values[begins[0]] - values[0] == ticks[0]
    is_even = is_even and np.ptp(held) <= 1 and held.min() > 1 and ends <= held.max()
    return float(ticks.sum() / held.sum()) if is_even else None


def are_pauses(steps: np.ndarray, step: float) -> np.ndarray:
    """Which steps of a clock are pauses of a recording, and no samples that were lost.

    Parameters
    ----------
    steps : ndarray, shape (n,), [any unit of time]
    step : float, [as steps]
        The usual one.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    least = max(LONGEST_GAP, _LONGEST_PAUSE * steps.size)
    return np.asarray(steps > least * step)


def restarts_of(values: np.ndarray) -> tuple[int, ...]:
    """Samples at which a column begins to tick again, from the start or after a pause.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    tuple of int
        Empty for one clock, and for what is none between two of them.

    Examples
    --------
    >>> restarts_of(np.tile(0.5 * np.arange(100), 3))
    (100, 200)
    >>> restarts_of(np.r_[0:100, 150:250])
    (100,)
    """
    if not np.isfinite(values).all():
        return ()
    steps = np.diff(values)
    usual = float(np.median(steps)) if steps.size else 0.0
    begins = np.flatnonzero((steps < 0) | are_pauses(steps, usual)) + 1
    if not 0 < begins.size <= _MOST_RESTARTS:
        return ()
    clocks = [clock_of(one) for one in np.split(values, begins)]
    ticks = [one.step for one in clocks if one is not None]
    is_one = len(ticks) == len(clocks) and max(ticks) <= _SAME_STEP * min(ticks)
    return tuple(int(one) for one in begins) if is_one else ()


def blocks_of(values: np.ndarray) -> tuple[int, ...]:
    """Samples at which a column of whole numbers, each held for long, goes on to the next.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Examples
    --------
    >>> blocks_of(np.repeat([1.0, 2.0, 5.0], 100)), blocks_of(np.arange(100.0))
    ((100, 200), ())
    """
    if not np.isfinite(values).all() or (values != np.round(values)).any():
        return ()
    begins = np.flatnonzero(np.diff(values)) + 1
    lengths = np.diff(begins, prepend=0, append=values.size)
    is_block = 0 < begins.size <= _MOST_RESTARTS and lengths.min() >= _FEWEST
    return tuple(int(one) for one in begins) if is_block else ()


def changes(values: np.ndarray) -> bool:
    """Whether a column holds numbers that are not all the same.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    known = values[np.isfinite(values)]
    return known.size >= _FEWEST and bool(np.ptp(known) > 0)


def is_constant(values: np.ndarray) -> bool:
    """Whether a column holds one number in every row that has any.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    known = values[np.isfinite(values)]
    return known.size >= _FEWEST and bool(np.ptp(known) == 0)


def held_share(values: np.ndarray) -> float:
    """Share of samples that repeat the one before.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    float, [-]
    """
    return float(np.mean(np.diff(values) == 0)) if values.size > 1 else 0.0


def roughness(values: np.ndarray) -> float:
    """How much of a column's spread happens from sample to sample.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    float, [-]
        0 for a slow signal, 1.4 for white noise.
    """
    spread = float(np.std(values))
    return float(np.std(np.diff(values))) / spread if spread > 0 else 0.0


def are_same(one: np.ndarray, other: np.ndarray, *, least: float = SAME) -> bool:
    """Whether a column is a multiple of another one, apart from an offset.

    Parameters
    ----------
    one, other : ndarray, shape (n,)
    least : float, [-]
        Correlation beyond which it is one.
    """
    return one.size == other.size and abs(_correlation(one, other)) > least


def answers(first: np.ndarray, second: np.ndarray) -> float:
    """How clearly the second column answers to the first, and not the reverse.

    Each column is predicted from its own past and from that of the other (models with
    an exogenous input, both ways); the gain is the logarithm of the error's fall by the
    other column. Means of more and more samples show what the sampling hides.

    Parameters
    ----------
    first, second : ndarray, shape (n,)

    Returns
    -------
    float, [-]
        From 1, where only the second answers to the first, to -1, where only the first
        answers to the second; near 0 where the numbers do not tell.
    """
    forward, backward, chance = _gains(first, second)
    return (forward - backward) / (forward + backward + chance)


def are_unrelated(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether neither of two columns tells more of the other than chance does.

    Parameters
    ----------
    first, second : ndarray, shape (n,)
    """
    forward, backward, chance = _gains(first, second)
    return forward + backward < chance


def _gains(first: np.ndarray, second: np.ndarray) -> tuple[float, float, float]:
    """What each column tells of the other, and what past values without meaning would."""
    known = np.isfinite(first[: second.size]) & np.isfinite(second[: first.size])
    # Of a long record means: the signals may begin to move late.
    block = -(-int(known.sum()) // _LONGEST)
    one, other = (
        _means(values[: known.size][known], max(block, 1)) for values in (first, second)
    )
    forward = backward = chance = 0.0
    for n in _MEANS_OF:
        count = one.size // n
        if count < _FEWEST_MEANS and n > 1:
            break
        a, b = (_standard(_means(values, n)) for values in (one, other))
        forward += _gain(b, a)
        backward += _gain(a, b)
        # Past values without any meaning give a quarter of this.
        chance += 4.0 * _LAGS / max(count, 1)
    return forward, backward, chance


def is_stepwise(values: np.ndarray) -> bool:
    """Whether a signal holds few levels for most of the time.

    Parameters
    ----------
    values : ndarray, shape (n,)
        May carry noise.
    """
    low, high = np.percentile(values, [1.0, 99.0])
    if high <= low:
        return False
    rounded = np.round(12.0 * (values - low) / (high - low))
    counts = np.sort(np.unique(rounded, return_counts=True)[1])[::-1]
    moves = np.abs(np.diff(rounded)) > 1
    # A flank of several samples is one jump.
    jumps = int(np.sum(np.diff(moves, prepend=False) & moves))
    return bool(counts[:3].sum() >= _HELD_SHARE * values.size and jumps <= 6)


def is_sine(values: np.ndarray) -> bool:
    """Whether one frequency holds nearly all of a signal's variance.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    window = np.hanning(values.size)
    power = np.abs(np.fft.rfft(window * (values - np.mean(values)))) ** 2
    top = int(np.argmax(power))
    # A window spreads a line over its neighbours.
    line = power[max(0, top - 2) : top + 3].sum()
    return bool(top > 2 and line > _LINE_SHARE * power.sum())


def memory_samples(values: np.ndarray) -> int:
    """Samples after which a signal has forgotten most of its value.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    int, [samples]
        First lag at which its autocorrelation lies below 1/e; its length if none does.
    """
    centred = values - np.mean(values)
    size = 1 << int(2 * centred.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[: centred.size]
    if correlation[0] <= 0:
        return int(centred.size)
    below = np.flatnonzero(correlation < correlation[0] / np.e)
    return int(below[0]) if below.size else int(centred.size)


def shared_power(one: np.ndarray, other: np.ndarray) -> float:
    """How much of the power of two signals lies in the same third octaves.

    Parameters
    ----------
    one, other : ndarray, shape (n,)

    Returns
    -------
    float, [-]
        From 0 to 1, where both have the same share of their power in each; 1 where a
        signal stands still.
    """
    shares = []
    for values in (one, other):
        power = np.abs(np.fft.rfft(values - np.mean(values))[1:]) ** 2
        octave = np.log2(np.arange(1, power.size + 1))
        bands = np.bincount(np.round(3.0 * octave).astype(int), power)
        if not bands.sum() > 0:
            return 1.0
        shares.append(bands / bands.sum())
    return float(np.minimum(*shares).sum())


def runs_away(values: np.ndarray) -> bool:
    """Whether a signal mostly moves in one direction, as an integrator does.

    Parameters
    ----------
    values : ndarray, shape (n,)
    """
    n = values.size
    return abs(_correlation(values, np.arange(n, dtype=float))) > 0.95


def _standard(values: np.ndarray) -> np.ndarray:
    spread = np.std(values)
    return (values - np.mean(values)) / (spread if spread > 0 else 1.0)


def _gain(target: np.ndarray, other: np.ndarray) -> float:
    """Fall of the error's logarithm when the other column's past is known too."""
    n = target.size
    if n < 4 * _LAGS:
        return 0.0
    columns: list[np.ndarray] = [
        np.ones(n - _LAGS),
        *(target[_LAGS - lag : n - lag] for lag in range(1, _LAGS + 1)),
        *(other[_LAGS - lag : n - lag] for lag in range(1, _LAGS + 1)),
        target[_LAGS:],
    ]
    # What each column leaves of the last one stands in its row.
    triangle = np.asarray(np.linalg.qr(np.column_stack(columns), mode="r"))
    left = triangle[:, -1] ** 2 / n
    # The least that rounding leaves keeps the logarithm finite.
    alone, together = left[_LAGS + 1 :].sum() + 1e-12, left[-1] + 1e-12
    return float(np.log(alone / together))


def _means(values: np.ndarray, n: int) -> np.ndarray:
    """Means of n samples each; an incomplete last block goes."""
    return values[: values.size // n * n].reshape(-1, n).mean(axis=1)


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    a, b = one - np.mean(one), other - np.mean(other)
    norm = float(np.sqrt(np.sum(a**2) * np.sum(b**2)))
    return float(np.sum(a * b)) / norm if norm > 0 else 0.0
