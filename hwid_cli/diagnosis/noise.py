"""Noise floor of the measurements, without any model, and whether residuals hold more.

From repeats where there are some; else from differences of high order, which remove any
smooth motion; from the rest before the input moves where the noise there is coloured,
because differences see only its fast part. Where there is no rest to read, as under a
controller that feeds the noise back, from what the re-fitted base leaves, if that has all
marks of noise. Colour is correlation between neighbouring samples; a filter removes it.
All is pooled over pieces of different length.
docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np
import scipy

from hwid_cli.diagnosis.problem import (
    Compared,
    DiagnosisProblem,
    Signals,
    rest_length,
)
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import StandIn
from hwid_cli.records.units import behind
from hwid_cli.trust.repeats import is_same_input

# Chance of calling white noise coloured, and what remains of it something missing.
FALSE_ALARM = 1e-3
_LAGS_OF_COLOUR = 10
_HIGHEST_ORDER = 20
_LAGS = 30
# Fewest samples for each coefficient of a filter.
_SAMPLES_PER_COEFFICIENT = 20
_FEWEST_AT_REST = 30
_FEWEST_RESTS = 3
# Orders of differences: the second where the first still sees motion or colour.
_ORDER, _HIGHER_ORDER = 6, 16
_SEES_MOTION = 0.7
# Recordings whose noise differs by no more than this have the same: differences of a few
# hundred samples tell it no better.
_ALIKE = 1.5
# A recording counts as no quieter than this share of all of them: what it leaves there
# may be rounding.
_QUIETEST = 0.01
# A difference that is larger than this many standard deviations is a jump.
_JUMP = 5.0
# Bends of a signal below this share of its size are rounding.
_ROUNDING = 1e-9
# The grid of a sensor limits it while it makes this share of the noise or more: below,
# the other noise moves the reading over several steps, and the error of rounding is
# noise like any other.
_GRID_SHARE = 0.5
# Values that all differ lie on a grid where their distances are so many multiples of the
# smallest one: of values on none already a few are not.
_FEWEST_MULTIPLES = 5
# A piece in which this much more happens than in the quietest one is no rest.
_MORE_THAN_QUIETEST = 3.0
# Repeats that differ this much more in motion than at rest differ by more than noise.
# Slow noise reads a little less in a short rest.
_MORE_IN_MOTION = 2.0
# Filters of sensors and amplifiers are of a low order. What is left of a missing effect
# beside noise takes more.
_ORDER_OF_SENSOR = 3
# Parts of each recording in which what is left has to have the same spectrum.
_PARTS = 4
# Samples behind which a missing effect may show in the innovations of what is left.
_LATER = (1, 2, 3)
# Correlations that make the size of coloured noise less sure, at most.
_MOST_LAGS = 200
# Directions of columns that make up less than this share of the largest are rounding.
_LEAST_COLUMN = 1e-10


def noise_floor(problem: DiagnosisProblem, *, rests: bool = True) -> NoiseFloor:
    """How much of what is compared is noise.

    Parameters
    ----------
    rests : bool
        Whether what is read before the input moves is noise.

    Returns
    -------
    NoiseFloor
        Never NaN; next to 0 where the recordings hold none.
    """
    pieces = [
        one.compared[one.evaluated] for one in problem.signals if one.n_evaluated > 0
    ]
    grid = _grid(pieces)
    step = grid / np.sqrt(12)
    differences = _from_differences(pieces, step)
    is_limited = grid > 0 and step >= _GRID_SHARE * max(differences, step)
    repeats = _from_repeats(problem.signals, differences)
    may_move = problem.start == "estimated"
    rest = None if is_limited or not rests else _from_rest(problem.signals, may_move)
    # Below its grid a sensor shows nothing: a reading that stands still is no less noise.
    if rest is not None and rest.rms < step:
        rest = None
    if repeats is not None and repeats.rms >= step:
        found, method = repeats, "repeats"
    elif rest is not None and rest.is_coloured:
        found, method = rest, "rest"
    else:
        rms = differences
        if rest is not None and 0 < rest.rms < _SEES_MOTION * differences:
            rms, method = rest.rms, "rest"
        else:
            method = "differences"
        if is_limited:
            rms = max(step, _upper_quartile(pieces, step))
        found = _Stretch(rms, False, (1.0,))
    unit = problem.unit
    resolution = float(grid) if is_limited else 0.0
    sentence = _sentence(found, method, resolution, unit)
    return NoiseFloor(
        float(found.rms), method, resolution, found.is_coloured, found.whitening,
        sentence, _input_rms(problem),
    )  # fmt: skip


def noise_levels(problem: DiagnosisProblem, noise: NoiseFloor) -> np.ndarray:
    """How much noise each recording holds, beside all of them together.

    Sensors have ranges, and some noise goes with the motion. The size of all together is
    that of the noise floor; their ratios are those of differences of high order.

    Returns
    -------
    ndarray, shape (n_recordings,), [-]
        Mean square over all samples 1; all of them 1 where noise is alike in all.
    """
    counts = np.array([one.n_evaluated for one in problem.signals])
    alike = np.ones(counts.size)
    # A grid is the same in all, and what a base leaves was tested to be.
    if noise.resolution > 0 or noise.method == "residuals" or counts.sum() == 0:
        return alike
    found = np.array(
        [
            _from_differences([one.compared[one.evaluated]], 0.0)
            for one in problem.signals
        ]
    )
    least = _QUIETEST * float(found.max(initial=0.0))
    found = np.maximum(found, least)
    if least <= 0 or found.max() <= _ALIKE * found.min():
        return alike
    return np.asarray(found / np.sqrt(np.sum(counts * found**2) / counts.sum()))


def whiteness(
    residuals: Sequence[np.ndarray], noise: NoiseFloor, lags: int = _LAGS
) -> float:
    """Whether residuals hold more than noise.

    Where the grid of the sensor is the limit, what lies within half a step counts as
    zero: the reading stands still there although the motion goes on.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (n_samples,), [output unit]

    Returns
    -------
    float, [-]
        Portmanteau statistic over its 99.9 % limit: about 0.5 for noise, above 1
        something remains; infinite where a residual is not finite.
    """
    pieces = [np.asarray(one, dtype=np.float64) for one in residuals]
    if not all(np.isfinite(piece).all() for piece in pieces):
        return float("inf")
    largest = max((float(np.max(np.abs(one))) for one in pieces if one.size), default=0)
    if largest == 0:
        return 0.0
    # Scaled, because the statistic goes with the fourth power.
    pieces = [piece / largest for piece in pieces]
    least = 0.0
    if noise.resolution > 0:
        half = noise.resolution / (2 * largest)
        pieces = [np.sign(one) * np.maximum(np.abs(one) - half, 0.0) for one in pieces]
        least = (noise.rms / largest) ** 2
    return portmanteau(pieces, noise.whitening, n_lags=lags, least_variance=least)


def residual_noise(
    compared: Sequence[Compared], noise: NoiseFloor, unit: str
) -> NoiseFloor | None:
    """Noise of one colour that is all that a base leaves; None where more may be left.

    Noise is alike in all recordings and all along them, and does not know what the drive
    does. A filter of low order, from the training recordings, has to make white what is
    left of all; its innovations must then have the same power in every octave of every
    part of a recording, and must not go with input and motion.

    Parameters
    ----------
    compared : sequence of Compared
        With the re-fitted base.
    noise : NoiseFloor
        As found without a model: from differences, which see no colour.

    References
    ----------
    docs/method_diagnosis.md, eq. (D28b).
    """
    parts = [one.residual for one in compared]
    shortest = min(one.size for one in parts)
    is_told = noise.method != "differences" or noise.resolution > 0
    if is_told or shortest < _PARTS * _FEWEST_AT_REST:
        return None
    size = _rms(parts)
    if not (np.isfinite(size) and size > 0):
        return None
    parts = [one / size for one in parts]
    train = [part for part, one in zip(parts, compared, strict=True)
             if not one.signals.is_held_out] or parts  # fmt: skip
    taps, _ = _short_filter(train, _highest_order(train, _ORDER_OF_SENSOR))
    whitening = tuple(float(tap) for tap in taps)
    order = len(whitening) - 1
    white = [scipy.signal.lfilter(taps, [1.0], one)[order:] for one in parts]
    is_noise = (
        order > 0
        and portmanteau(parts, whitening, n_lags=_LAGS) <= 1.0
        and _is_even(white)
        and not _goes_with_motion(white, compared)
    )
    if not is_noise:
        return None
    sentence = _sentence(_Stretch(size, True, whitening), "residuals", 0.0, unit)
    return replace(
        noise, rms=size, method="residuals", is_coloured=True, whitening=whitening,
        sentence=f"{sentence} ({_colour(parts, size, unit)})",
    )  # fmt: skip


def _is_even(white: Sequence[np.ndarray]) -> bool:
    """Whether each octave of each part of each piece has the same power, but for chance.

    The periodogram of white noise has independent ordinates, exponentially distributed.
    Fisher's sum of the logarithms of all chances, and the least of them.
    """
    variance = _rms(white) ** 2
    chances = []
    for piece in white:
        for part in np.array_split(piece, _PARTS):
            power = np.abs(np.fft.rfft(part)[1 : (part.size + 1) // 2]) ** 2
            power /= part.size * variance
            edges = 2 ** np.arange(int(np.log2(max(power.size, 1))) + 1) - 1
            for octave in np.split(power, edges[1:]):
                chances.append(scipy.special.gammaincc(octave.size, octave.sum()))
    found = np.maximum(chances, 1e-300)
    together = scipy.special.gammaincc(found.size, -np.sum(np.log(found)))
    return bool(together >= FALSE_ALARM and found.min() >= FALSE_ALARM / found.size)


def _goes_with_motion(
    white: Sequence[np.ndarray], compared: Sequence[Compared]
) -> bool:
    """Whether innovations go with what was before them: with input or motion.

    Before them only: under a controller the input holds the noise of its own sample.
    """
    width = len(_LATER) * _functions_of_motion(compared[0]).shape[1]
    gram, along = np.zeros((width, width)), np.zeros(width)
    for piece, one in zip(white, compared, strict=True):
        table = _functions_of_motion(one)[one.signals.evaluated]
        rows = np.arange(table.shape[0] - piece.size, table.shape[0])
        block = np.hstack([table[np.maximum(rows - lag, 0)] for lag in _LATER])
        gram += block.T @ block
        along += block.T @ piece
    lengths = np.sqrt(np.diag(gram))
    lengths[lengths == 0] = 1.0
    sizes, basis = np.linalg.eigh(gram / np.outer(lengths, lengths))
    used = sizes > _LEAST_COLUMN * sizes[-1]
    scores = basis[:, used].T @ (along / lengths) / np.sqrt(sizes[used])
    statistic = float(scores @ scores) / _rms(white) ** 2
    return _chance_of(statistic, scores.size) < FALSE_ALARM


def _chance_of(statistic: float, freedom: int) -> float:
    """Chance of a chi-squared statistic as large as this one."""
    return float(scipy.special.gammaincc(freedom / 2.0, statistic / 2.0))


def _functions_of_motion(one: Compared) -> np.ndarray:
    """What missing forces and sensors go with, of the simulated motion and the input."""
    u, x, v = one.signals.driven_by, one.position, one.velocity
    time = one.signals.sample_time_s * np.arange(x.size)
    return np.column_stack(
        [
            np.ones(x.size), time, time**2,
            u, np.abs(u), u**2, u**3, u * x, u * x**2,
            x, np.abs(x), x**2, x**3, np.sign(x),
            v, np.abs(v), v * np.abs(v), np.sign(v), v * x,
        ]
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Noise that was set free from the signal: pieces around zero, and its colour."""

    rms: float
    is_coloured: bool
    whitening: tuple[float, ...]


def _autocovariances(
    pieces: Sequence[np.ndarray], n_lags: int
) -> tuple[np.ndarray, np.ndarray]:
    """Pooled sums of products at each lag, and how many products each has.

    Pieces are used as they are: no mean is taken off.
    """
    sums, counts = np.zeros(n_lags + 1), np.zeros(n_lags + 1)
    for piece in pieces:
        for lag in range(min(n_lags + 1, piece.size)):
            sums[lag] += piece[: piece.size - lag] @ piece[lag:]
            counts[lag] += piece.size - lag
    return sums, counts


def _is_white(pieces: Sequence[np.ndarray], *, n_removed: int = 1) -> bool:
    """Whether neighbouring samples do not go together.

    By the pooled portmanteau statistic of the first ten lags; ``n_removed`` regressors,
    the mean among them, were taken off each piece.
    """
    sums, counts = _autocovariances(_of_one_size(pieces), _LAGS_OF_COLOUR)
    if sums[0] <= 0 or counts[-1] == 0:
        return True
    # Taking off one regressor pulls every correlation down by one over the length.
    pulled = n_removed * sum(piece.size > _LAGS_OF_COLOUR for piece in pieces)
    correlations = sums[1:] / counts[1:] * counts[0] / sums[0] + pulled / counts[1:]
    statistic = float(np.sum(counts[1:] * np.square(correlations)))
    return statistic < 2.0 * scipy.special.gammaincinv(
        _LAGS_OF_COLOUR / 2.0, 1 - FALSE_ALARM
    )


def _whitening_filter(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Coefficients of an autoregressive filter that makes noise white; the first is 1.

    Either of an order up to 20, or the long one of slow noise beside white noise,
    ``(1 - phi/z) / (1 - theta/z)``, whichever has the lowest information criterion of
    Schwarz.
    """
    highest = _highest_order(pieces, _HIGHEST_ORDER)
    best, lowest = _short_filter(pieces, highest)
    count = sum(piece.size - highest for piece in pieces)
    long, remaining = _long_filter(pieces, highest)
    if remaining > 0 and count * np.log(remaining) + 2 * np.log(count) < lowest:
        return long
    return best


def _highest_order(pieces: Sequence[np.ndarray], most: int) -> int:
    """Order of a filter that pieces have enough samples for."""
    total = sum(piece.size for piece in pieces)
    shortest = min(piece.size for piece in pieces)
    return min(most, shortest // 2, total // _SAMPLES_PER_COEFFICIENT)


def _short_filter(
    pieces: Sequence[np.ndarray], highest: int
) -> tuple[np.ndarray, float]:
    """Filter of the best order up to the highest, and Schwarz's criterion.

    Least squares on earlier samples.
    """
    # All orders predict the same samples, or their criteria could not be compared.
    windows = [np.lib.stride_tricks.sliding_window_view(one, highest + 1)[:, ::-1]
               for one in pieces]  # fmt: skip
    table = np.concatenate(windows)
    gram = table.T @ table
    count = table.shape[0]
    best, lowest = np.ones(1), count * np.log(gram[0, 0] / count)
    for order in range(1, highest + 1):
        past = slice(1, order + 1)
        taps = np.linalg.lstsq(gram[past, past], gram[past, 0], rcond=None)[0]
        remaining = (gram[0, 0] - taps @ gram[past, 0]) / count
        if remaining <= 0:
            break
        criterion = count * np.log(remaining) + order * np.log(count)
        if criterion < lowest:
            best, lowest = np.concatenate([[1.0], -taps]), criterion
    return best, float(lowest)


def _long_filter(pieces: Sequence[np.ndarray], first: int) -> tuple[np.ndarray, float]:
    """Filter of slow noise beside white noise, and the variance that it leaves."""
    longest = max(piece.size for piece in pieces)
    block = np.zeros((len(pieces), longest))
    weight = np.zeros((len(pieces), longest), dtype=bool)
    for row, piece in enumerate(pieces):
        block[row, : piece.size] = piece
        weight[row, first : piece.size] = True

    def remaining(point: np.ndarray) -> np.ndarray:
        # The hyperbolic tangent keeps both roots inside the unit circle.
        phi, theta = np.tanh(point)
        return scipy.signal.lfilter([1.0, -phi], [1.0, -theta], block, axis=1)[weight]

    fit = scipy.optimize.least_squares(
        remaining, np.arctanh([0.9, 0.5]), method="lm", max_nfev=100
    )
    phi, theta = np.tanh(fit.x)
    size = max(abs(theta), 1e-3)
    # Long enough that what is cut off is nothing beside the errors of estimation.
    length = int(np.clip(np.log(1e-4) / np.log(size), _HIGHEST_ORDER + 1, 200))
    taps = np.concatenate([[1.0], (theta - phi) * theta ** np.arange(length)])
    return taps, float(np.mean(np.square(remaining(fit.x))))


def portmanteau(
    pieces: Sequence[np.ndarray],
    whitening: Sequence[float],
    *,
    n_lags: int,
    n_linked: int = 0,
    least_variance: float = 0.0,
) -> float:
    """Pooled portmanteau statistic over its limit; above 1 something remains.

    The coefficients of the filter are estimates. To first order an error of theirs adds
    the columns ``h(k - j)`` to the correlations, h the answer of the filter's inverse
    to an impulse; these directions are left out, which costs a degree of freedom each.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
    n_linked : int
        First lags that are left out.
    least_variance : float
        The variance is taken as at least this.

    Returns
    -------
    float, [-]
        0 where the pieces are zero throughout.

    References
    ----------
    Box and Pierce (1970), with its correction for estimated coefficients.
    """
    taps = np.asarray(whitening, dtype=np.float64)
    white = []
    for piece in pieces:
        # The filter does not know what came before the first samples.
        unknown = min(taps.size - 1, piece.size // 4)
        white.append(scipy.signal.lfilter(taps, [1.0], piece)[unknown:])
    sums, counts = _autocovariances(_of_one_size(white, least_variance), n_lags)
    used = (counts[1:] > 0) & (np.arange(n_lags) >= n_linked)
    if sums[0] == 0 or not used.any():
        return 0.0
    scores = sums[1:][used] / np.sqrt(counts[1:][used])
    basis = np.linalg.qr(_errors_of(taps, n_lags)[used])[0]
    scores = scores - basis @ (basis.T @ scores)
    free = max(scores.size - basis.shape[1], 1)
    return float(
        scores @ scores / (2.0 * scipy.special.gammaincinv(free / 2.0, 1 - FALSE_ALARM))
    )


def _of_one_size(
    pieces: Sequence[np.ndarray], least_variance: float = 0.0
) -> list[np.ndarray]:
    """Pieces over their own RMS: each then says as much as it has samples.

    Otherwise those with the most noise outvote the others, and chance is taken for
    correlation: so few samples scatter more.
    """
    pooled, floor = _rms(pieces), float(np.sqrt(least_variance))
    least = max(_QUIETEST * pooled, floor)
    if least <= 0:
        return list(pieces)
    sizes = [max(_rms([one]), least) for one in pieces]
    if max(sizes) <= _MORE_THAN_QUIETEST * min(sizes):
        # They may as well be alike: the sizes of short pieces scatter.
        sizes = [max(pooled, floor)] * len(sizes)
    return [one / size for one, size in zip(pieces, sizes, strict=True)]


def _errors_of(taps: np.ndarray, n_lags: int) -> np.ndarray:
    """What errors of a filter's estimated coefficients add to the correlations."""
    impulse = np.zeros(n_lags)
    impulse[0] = 1.0
    order = taps.size - 1
    if order > _HIGHEST_ORDER and taps[1] != 0:
        theta = taps[2] / taps[1]
        phi = theta - taps[1]
        return np.column_stack(
            [
                scipy.signal.lfilter([1.0], [1.0, -root], impulse)
                for root in (phi, theta)
            ]
        )
    answer = scipy.signal.lfilter([1.0], taps, impulse)
    columns = [np.concatenate([np.zeros(j), answer[: n_lags - j]])
               for j in range(min(order, n_lags - 1))]  # fmt: skip
    return np.array(columns).reshape(-1, n_lags).T


def _input_rms(problem: DiagnosisProblem) -> float:
    """Noise that the measured input may hold; a fast command makes it more.

    A command that is held or goes in straight lines most of the time has none: its steps
    and corners are not noise. Beside a stand-in they count: it follows
    a simulation through a step only to a part of a sample, which leaves the same.
    """
    pieces = [one.driven_by[one.skip :] for one in problem.signals]
    if isinstance(problem.drive, StandIn):
        return float(_from_differences(pieces, 0.0))
    noisy = [piece for piece in pieces if not _is_mostly_straight(piece)]
    counts = [piece.size for piece in pieces]
    share = sum(piece.size for piece in noisy) / max(sum(counts), 1)
    return float(_from_differences(noisy, 0.0) * np.sqrt(share)) if noisy else 0.0


def _is_mostly_straight(piece: np.ndarray) -> bool:
    """Whether most of a signal is on straight lines, up to rounding."""
    bends = np.abs(np.diff(piece, _ORDER))
    rounding = _ROUNDING * float(np.max(np.abs(piece), initial=0.0))
    return bends.size > 0 and float(np.median(bends)) <= rounding


def _from_differences(pieces: Sequence[np.ndarray], step: float) -> float:
    """RMS of white noise from the higher order where the lower one sees motion."""
    low = _difference_rms(pieces, _ORDER, step)
    high = _difference_rms(pieces, _HIGHER_ORDER, step)
    return high if 0 < high < _SEES_MOTION * low else low


def _difference_rms(pieces: Sequence[np.ndarray], order: int, step: float) -> float:
    """RMS of white noise from pooled differences of one order, without jumps."""
    longer = [piece for piece in pieces if piece.size > order]
    if not longer:
        return 0.0
    scale = np.sqrt(comb(2 * order, order))
    found = [np.diff(piece, order) / scale for piece in longer]
    # Of each piece: beside quiet ones, all of a noisy one would be jumps.
    kept = np.concatenate([_without_jumps(one, step) for one in found])
    return float(np.sqrt(np.mean(np.square(kept)))) if kept.size else 0.0


def _without_jumps(differences: np.ndarray, step: float) -> np.ndarray:
    """Differences without those that are far larger than most."""
    size = np.abs(differences)
    # 1.4826: from the median of the magnitudes to a standard deviation.
    limit = _JUMP * max(1.4826 * float(np.median(size)), step)
    return differences[size <= limit] if limit > 0 else differences


def _upper_quartile(pieces: Sequence[np.ndarray], step: float) -> float:
    """RMS of noise on a grid: only fast recordings step through it and show it."""
    found = [_difference_rms([piece], _ORDER, step) for piece in pieces]
    return float(np.quantile(found, 0.75))


def _grid(pieces: Sequence[np.ndarray]) -> float:
    """Step of a sensor that reads on a grid; 0 if it does not."""
    steps = [_grid_of(piece) for piece in pieces]
    found = [step for step in steps if step > 0]
    return float(np.median(found)) if 2 * len(found) > len(steps) else 0.0


def _grid_of(piece: np.ndarray) -> float:
    """Step of the grid of one recording; 0 if there is none."""
    levels = np.unique(piece)
    steps = np.diff(levels)
    # What is left over from rounding is no step.
    steps = steps[steps > 1e-9 * max(float(np.ptp(levels)), 1e-300)]
    if steps.size < 1:
        return 0.0
    smallest = float(np.min(steps))
    ratios = steps / smallest
    # Wide gaps are left out, over which the rounding of the file adds up.
    ratios = ratios[ratios <= 20]
    if (np.abs(ratios - np.round(ratios)) >= 0.05).any():
        return 0.0
    comes_again = 4 * (steps.size + 1) <= 3 * piece.size
    if comes_again and 2 * ratios.size > steps.size:
        return smallest
    # A fast motion meets no level twice. What rounding leaves of it is noise; without
    # that it is a motion whose own steps are multiples, as under a constant force.
    has_many = np.unique(np.round(ratios[ratios > 1.5])).size >= _FEWEST_MULTIPLES
    rounding = smallest / np.sqrt(12)
    is_rounded = _difference_rms([piece], _ORDER, rounding) >= _GRID_SHARE * rounding
    return smallest if has_many and is_rounded else 0.0


def _from_repeats(all_signals: Sequence[Signals], white_rms: float) -> _Stretch | None:
    """Noise by which recordings of the same input differ; None if there are none."""
    deviations, at_rest = [], []
    for group in _groups(all_signals):
        length = min(one.compared.size for one in group)
        start = max(one.skip for one in group)
        stack = np.array([one.compared[start:length] for one in group])
        if stack.shape[1] < _FEWEST_AT_REST:
            continue
        # One degree of freedom of the group goes into its mean.
        gain = np.sqrt(len(group) / (len(group) - 1))
        rows = gain * (stack - stack.mean(axis=0))
        still = min(rest_length(one.driven_by) for one in group) - start
        deviations += [_detrended(row, 1) for row in rows]
        if still >= _FEWEST_AT_REST:
            at_rest += [_detrended(row[:still], 0) for row in rows]
    if not deviations:
        return None
    rms = _rms(deviations)
    if rms > 1.1 * white_rms and at_rest and rms > _MORE_IN_MOTION * _rms(at_rest):
        return None
    return _stretch(deviations, deviations)


def _groups(all_signals: Sequence[Signals]) -> list[list[Signals]]:
    """Recordings of the same input, which is not zero throughout."""
    groups: list[list[Signals]] = []
    for one in all_signals:
        if not np.any(one.driven_by):
            continue
        for group in groups:
            if _is_same_input(group[0], one):
                group.append(one)
                break
        else:
            groups.append([one])
    return [group for group in groups if len(group) > 1]


def _is_same_input(one: Signals, other: Signals) -> bool:
    """Whether two recordings are repeats of each other."""
    if not np.isclose(one.sample_time_s, other.sample_time_s, rtol=1e-3):
        return False
    return is_same_input(one.driven_by, other.driven_by)


def _from_rest(all_signals: Sequence[Signals], may_move: bool) -> _Stretch | None:
    """Noise before the input first moves; None where too little is seen of it.

    Parameters
    ----------
    may_move : bool
        Whether a recording may begin in the middle of a motion. Such a one is told by
        the quietest: noise is alike in all.
    """
    pieces = [
        one.compared[one.skip : rest_length(one.driven_by)]
        for one in all_signals
        if rest_length(one.driven_by) < one.driven_by.size
    ]
    pieces = [piece for piece in pieces if piece.size >= _FEWEST_AT_REST]
    if may_move:
        sizes = [_rms([piece - piece.mean()]) for piece in pieces]
        most = _MORE_THAN_QUIETEST * min(sizes, default=0.0)
        pieces = [one for one, size in zip(pieces, sizes, strict=True) if size <= most]
    if len(pieces) < _FEWEST_RESTS:
        return None
    own = [piece - piece.mean() for piece in pieces]
    if _rms(own) <= 1e-12 * max(float(np.max(np.abs(one.compared)))
                                for one in all_signals):  # fmt: skip
        return None
    # A short piece's own mean takes slow noise away. The common mean keeps it, if all
    # start from one place: their means differ by less than the noise.
    means = np.array([piece.mean() for piece in pieces])
    is_common = float(np.std(means)) < _rms(own)
    around = [piece - np.mean(np.concatenate(pieces)) for piece in pieces]
    return _stretch(own, around if is_common else own)


def _stretch(own: list[np.ndarray], around: list[np.ndarray]) -> _Stretch:
    """Colour of noise; a drift or a common sine is no noise and is taken off."""
    # The degree of freedom of each piece's mean is given back to the variance.
    for free, n_removed in (
        (own, 1),
        ([_detrended(one, 1) for one in own], 2),
        (_without_sine(own), 3),
    ):
        if _is_white(free, n_removed=n_removed):
            total = sum(one.size for one in free)
            share = total / max(total - n_removed * len(free), 1)
            return _Stretch(_rms(free) * float(np.sqrt(share)), False, (1.0,))
    taps = tuple(float(tap) for tap in _whitening_filter(around))
    return _Stretch(_rms(around), len(taps) > 1, taps)


def _detrended(piece: np.ndarray, degree: int) -> np.ndarray:
    """A piece without its polynomial in time."""
    times = np.linspace(-1.0, 1.0, piece.size)
    columns = np.vander(times, degree + 1)
    return piece - columns @ np.linalg.lstsq(columns, piece, rcond=None)[0]


def _without_sine(pieces: list[np.ndarray]) -> list[np.ndarray]:
    """Pieces without the sine of one frequency that takes most of all of them."""
    length = min(4096, max(piece.size for piece in pieces))
    cut = [piece[:length] for piece in pieces]
    power = sum(np.abs(np.fft.rfft(piece, 8 * length)) ** 2 for piece in cut)
    peak = int(np.argmax(power))
    # In a short rest, of a period or two, its mean moves the peak.
    near = (peak + np.linspace(-4.0, 4.0, 65)) / (8 * length)
    tried = [_without_line(pieces, line) for line in near if line > 0]
    return min(tried, key=_rms)


def _without_line(pieces: list[np.ndarray], line: float) -> list[np.ndarray]:
    """Pieces without their sine of a frequency in periods per sample."""
    free = []
    for piece in pieces:
        angles = 2 * np.pi * line * np.arange(piece.size)
        columns = np.column_stack([np.ones(piece.size), np.cos(angles), np.sin(angles)])
        free.append(piece - columns @ np.linalg.lstsq(columns, piece, rcond=None)[0])
    return free


def _rms(pieces: Sequence[np.ndarray]) -> float:
    """RMS of all samples."""
    total = sum(piece.size for piece in pieces)
    return float(np.sqrt(sum(piece @ piece for piece in pieces) / max(total, 1)))


def _sentence(found: _Stretch, method: str, resolution: float, unit: str) -> str:
    """What was found, in words."""
    if resolution > 0 and not found.is_coloured:
        return (
            f"the sensor shows steps of {resolution:.2g}{behind(unit)}, which is a noise of "
            f"{found.rms:.2g}{behind(unit)}"
        )
    source = {
        "repeats": "from what repeats differ by",
        "rest": "from the rest before the input moves",
        "differences": "from sixth differences",
        "residuals": "from what the re-fitted simulation leaves",
    }[method]
    if found.rms == 0:
        return f"no noise, {source}"
    colour = "coloured" if found.is_coloured else "white"
    return f"{colour} noise of {found.rms:.2g}{behind(unit)}, {source}"


def _colour(parts: Sequence[np.ndarray], size: float, unit: str) -> str:
    """How sure the size of coloured noise is, and how its samples go together.

    ``parts`` have an RMS of 1, ``size`` is that of the noise.
    """
    n_lags = min(min(one.size for one in parts) // _PARTS, _MOST_LAGS)
    sums, counts = _autocovariances(parts, n_lags)
    correlations = sums[1:] / counts[1:]
    # Bartlett: of Gaussian noise the mean square has the variance 2 sum r^2 / n.
    together = 1.0 + 2.0 * float(correlations @ correlations)
    reach = 1.96 * float(np.sqrt(together / (2.0 * counts[0])))
    return (
        f"95 % interval {size * (1 - reach):.3g} to {size * (1 + reach):.3g}"
        f"{behind(unit)}; neighbouring samples correlate by {correlations[0]:.2f}; alike in "
        "all recordings and all along them, and it goes with neither input nor motion"
    )
