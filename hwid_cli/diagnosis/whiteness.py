"""Whether samples go together, and filters that make coloured noise white.

Colour is correlation between neighbouring samples; a filter removes it. All is pooled over
pieces of different length. docs/method_diagnosis.md.
"""

from collections.abc import Sequence

import numpy as np
import scipy

from hwid_cli.records.diagnosis import NoiseFloor

# Chance of calling white noise coloured, and what remains of it something missing.
FALSE_ALARM = 1e-3
LAGS = 30
_LAGS_OF_COLOUR = 10
_HIGHEST_ORDER = 20
# Fewest samples for each coefficient of a filter.
_SAMPLES_PER_COEFFICIENT = 20
# A piece counts as no quieter than this share of all of them: what it leaves there may be
# rounding.
QUIETEST = 0.01
# A piece in which this much more happens than in the quietest one is of another size.
MORE_THAN_QUIETEST = 3.0
# The statistic may be so many times its limit where the size of the noise is right by a
# second route.
WHITE_BY_TWO_ROUTES = 6.0


def whiteness(
    residuals: Sequence[np.ndarray], noise: NoiseFloor, lags: int = LAGS
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
    sums, counts = autocovariances(_of_one_size(white, least_variance), n_lags)
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


def is_white(pieces: Sequence[np.ndarray], *, n_removed: int = 1) -> bool:
    """Whether neighbouring samples do not go together.

    By the pooled portmanteau statistic of the first ten lags; ``n_removed`` regressors,
    the mean among them, were taken off each piece.
    """
    sums, counts = autocovariances(_of_one_size(pieces), _LAGS_OF_COLOUR)
    if sums[0] <= 0 or counts[-1] == 0:
        return True
    # Taking off one regressor pulls every correlation down by one over the length.
    pulled = n_removed * sum(piece.size > _LAGS_OF_COLOUR for piece in pieces)
    correlations = sums[1:] / counts[1:] * counts[0] / sums[0] + pulled / counts[1:]
    statistic = float(np.sum(counts[1:] * np.square(correlations)))
    return statistic < 2.0 * scipy.special.gammaincinv(
        _LAGS_OF_COLOUR / 2.0, 1 - FALSE_ALARM
    )


def whitening_filter(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Coefficients of an autoregressive filter that makes noise white; the first is 1.

    Either of an order up to 20, or the long one of slow noise beside white noise,
    ``(1 - phi/z) / (1 - theta/z)``, whichever has the lowest information criterion of
    Schwarz.
    """
    highest = highest_order(pieces, _HIGHEST_ORDER)
    best, lowest = short_filter(pieces, highest)
    count = sum(piece.size - highest for piece in pieces)
    long, remaining = _long_filter(pieces, highest)
    if remaining > 0 and count * np.log(remaining) + 2 * np.log(count) < lowest:
        return long
    return best


def highest_order(pieces: Sequence[np.ndarray], most: int) -> int:
    """Order of a filter that pieces have enough samples for."""
    total = sum(piece.size for piece in pieces)
    shortest = min(piece.size for piece in pieces)
    return min(most, shortest // 2, total // _SAMPLES_PER_COEFFICIENT)


def short_filter(
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


def autocovariances(
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


def _of_one_size(
    pieces: Sequence[np.ndarray], least_variance: float = 0.0
) -> list[np.ndarray]:
    """Pieces over their own RMS: each then says as much as it has samples.

    Otherwise those with the most noise outvote the others, and chance is taken for
    correlation: so few samples scatter more.
    """
    pooled, floor = pooled_rms(pieces), float(np.sqrt(least_variance))
    least = max(QUIETEST * pooled, floor)
    if least <= 0:
        return list(pieces)
    sizes = [max(pooled_rms([one]), least) for one in pieces]
    if max(sizes) <= MORE_THAN_QUIETEST * min(sizes):
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


def pooled_rms(pieces: Sequence[np.ndarray]) -> float:
    """RMS of all samples."""
    total = sum(piece.size for piece in pieces)
    return float(np.sqrt(sum(piece @ piece for piece in pieces) / max(total, 1)))
