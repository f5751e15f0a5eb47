"""Colour of noise: correlation between neighbouring samples, and what removes it.

Everything is pooled over pieces of different length. docs/method_diagnosis.md.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.stats import chi2

# Chance of calling white noise coloured, and what remains of it something missing.
FALSE_ALARM = 1e-3
_LAGS_OF_COLOUR = 10
_HIGHEST_ORDER = 20
# Fewest samples for each coefficient of a filter.
_SAMPLES_PER_COEFFICIENT = 20


def autocovariances(
    pieces: Sequence[np.ndarray], n_lags: int
) -> tuple[np.ndarray, np.ndarray]:
    """Pooled sums of products at each lag, and how many products each has.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
        Used as they are: no mean is taken off.
    n_lags : int

    Returns
    -------
    sums : ndarray, shape (n_lags + 1,)
    counts : ndarray, shape (n_lags + 1,)
    """
    sums, counts = np.zeros(n_lags + 1), np.zeros(n_lags + 1)
    for piece in pieces:
        for lag in range(min(n_lags + 1, piece.size)):
            sums[lag] += piece[: piece.size - lag] @ piece[lag:]
            counts[lag] += piece.size - lag
    return sums, counts


def is_white(pieces: Sequence[np.ndarray], *, n_removed: int = 1) -> bool:
    """Whether neighbouring samples do not go together.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
    n_removed : int
        Number of regressors, the mean among them, that were taken off each piece.

    Returns
    -------
    bool
        By the pooled portmanteau statistic of the first ten lags.
    """
    sums, counts = autocovariances(pieces, _LAGS_OF_COLOUR)
    if sums[0] <= 0 or counts[-1] == 0:
        return True
    # Taking off one regressor pulls every correlation down by one over the length.
    pulled = n_removed * sum(piece.size > _LAGS_OF_COLOUR for piece in pieces)
    correlations = sums[1:] / counts[1:] * counts[0] / sums[0] + pulled / counts[1:]
    statistic = float(np.sum(counts[1:] * np.square(correlations)))
    return statistic < chi2.ppf(1 - FALSE_ALARM, _LAGS_OF_COLOUR)


def whitening_filter(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Autoregressive filter that makes coloured noise white.

    Either of an order up to 20, or the long one of slow noise beside white noise,
    ``(1 - phi/z) / (1 - theta/z)``, whichever has the lowest information criterion.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
        Noise around zero.

    Returns
    -------
    ndarray, shape (order + 1,), [-]
        The first is 1.

    References
    ----------
    Least squares on earlier samples; criterion of Schwarz.
    """
    total = sum(piece.size for piece in pieces)
    shortest = min(piece.size for piece in pieces)
    highest = min(_HIGHEST_ORDER, shortest // 2, total // _SAMPLES_PER_COEFFICIENT)
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
    long, remaining = _long_filter(pieces, highest)
    if remaining > 0 and count * np.log(remaining) + 2 * np.log(count) < lowest:
        return long
    return best


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
        return lfilter([1.0, -phi], [1.0, -theta], block, axis=1)[weight]

    fit = least_squares(remaining, np.arctanh([0.9, 0.5]), method="lm", max_nfev=100)
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
    least_variance: float = 0.0,
) -> float:
    """Pooled portmanteau statistic over its limit; above 1 something remains.

    The coefficients of the filter are estimates. To first order an error of theirs adds
    the columns ``h(k - j)`` to the correlations, h the answer of the filter's inverse
    to an impulse; these directions are left out, which costs a degree of freedom each.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
    whitening : sequence of float
    n_lags : int
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
        white.append(lfilter(taps, [1.0], piece)[unknown:])
    sums, counts = autocovariances(white, n_lags)
    if counts[0] == 0:
        return 0.0
    variance = max(sums[0] / counts[0], least_variance)
    used = counts[1:] > 0
    if variance == 0 or not used.any():
        return 0.0
    scores = sums[1:][used] / (variance * np.sqrt(counts[1:][used]))
    basis = np.linalg.qr(_errors_of(taps, scores.size))[0]
    scores = scores - basis @ (basis.T @ scores)
    free = max(scores.size - basis.shape[1], 1)
    return float(scores @ scores / chi2.ppf(1 - FALSE_ALARM, free))


def _errors_of(taps: np.ndarray, n_lags: int) -> np.ndarray:
    """What errors of a filter's estimated coefficients add to the correlations."""
    impulse = np.zeros(n_lags)
    impulse[0] = 1.0
    order = taps.size - 1
    if order > _HIGHEST_ORDER and taps[1] != 0:
        theta = taps[2] / taps[1]
        phi = theta - taps[1]
        return np.column_stack(
            [lfilter([1.0], [1.0, -root], impulse) for root in (phi, theta)]
        )
    answer = lfilter([1.0], taps, impulse)
    columns = [np.concatenate([np.zeros(j), answer[: n_lags - j]])
               for j in range(min(order, n_lags - 1))]  # fmt: skip
    return np.array(columns).reshape(-1, n_lags).T
