"""Tests of residuals: whether they are white, and independent of the input.

White residuals that do not know the input leave nothing to model. Residuals that follow
the input show missing dynamics, or a missing nonlinearity where they follow its square.
Residuals that are coloured and follow neither are noise of the sensor or the machine,
which an output-error model need not describe, or follow the input in a way that neither
test sees; its standard errors are wrong in both cases.

A fit takes the part of the noise with it that its parameters can follow, so residuals
correlate even where the noise is white, by ``-tr(P S_k)`` with P the projection on the
derivatives of the fit (see `leverage`). With fifty parameters and a thousand samples
that alone is more than the band; it is taken off.

References
----------
docs/method.md, eqs. (29)-(32). Ljung and Box, Biometrika 65 (1978), p. 297. Ljung (1999),
section 16.6. Box and Jenkins, Time Series Analysis, chapter on transfer functions.
"""

import numpy as np
import scipy

from hwid_cli.records.residuals import Correlation, ResidualTests

# Chance of a false alarm in each test.
LEVEL = 0.05
# Lags as in the common tools, [samples]; fewer for short recordings.
_MOST_LAGS, _SAMPLES_PER_LAG = 25, 5
# Order of the filter that whitens the input, and the white noise that it takes the input
# to have, as a share of its variance: a pure sine cannot be whitened.
_WHITENING_ORDER, _SAMPLES_PER_COEFFICIENT, _FLOOR = 20, 20, 1e-3
# A square whose own part is below this share of its variance is the input again.
_LEAST_SQUARE = 1e-6
# Colour that two signals share by chance must not make a band vanish.
_LEAST_COLOUR = 0.5


def residual_tests(
    residual: np.ndarray,
    input: np.ndarray,  # noqa: A002 - the field's word
    *,
    pull: np.ndarray | None = None,
) -> ResidualTests:
    """Test the residuals of one recording.

    Parameters
    ----------
    residual : ndarray, shape (n_samples,), [output unit]
        Measured minus simulated, as it is: a mean that is left counts.
    input : ndarray, shape (n_samples,), [input unit]
    pull : ndarray, shape (at least n_lags + 1,), optional, [-]
        ``leverage.pull`` of the fit, where the model was fitted to this recording; its
        first value is the number of parameters.

    Raises
    ------
    ValueError
        If the lengths differ or there are fewer than ten samples.

    References
    ----------
    docs/method.md, eqs. (29)-(32).
    """
    if residual.shape != input.shape or residual.size < 2 * _SAMPLES_PER_LAG:
        raise ValueError(
            f"residual {residual.shape} and input {input.shape} must be equally long, "
            f"with at least {2 * _SAMPLES_PER_LAG} samples"
        )
    n_lags = n_tested_lags(residual.size)
    taken = np.zeros(n_lags + 1) if pull is None else pull[: n_lags + 1]
    with_itself, statistic = _with_itself(residual, taken)
    with_input, leads = _with_signal(residual, input - input.mean(), n_lags)
    with_square, _ = _with_signal(residual, _own_square(input), n_lags)
    return ResidualTests(
        with_itself,
        with_input,
        with_square,
        statistic,
        is_white=not with_itself.p_value < LEVEL,
        follows_input=with_input.p_value < LEVEL,
        follows_square=with_square.p_value < LEVEL,
        leads_input=leads,
    )


def n_tested_lags(n_samples: int) -> int:
    """Number of lags that are tested.

    Parameters
    ----------
    n_samples : int, [samples]

    Returns
    -------
    int, [samples]
    """
    return min(_MOST_LAGS, n_samples // _SAMPLES_PER_LAG)


def _with_itself(residual: np.ndarray, pull: np.ndarray) -> tuple[Correlation, float]:
    """Autocorrelation from lag 1, and the statistic of Ljung and Box."""
    n_lags = pull.size - 1
    lags = np.arange(1, n_lags + 1)
    power = float(residual @ residual)
    if power == 0.0:
        return _no_correlation(lags), 0.0
    # What the fit's parameters have taken is no longer there to be correlated.
    free = max(residual.size - pull[0], float(_SAMPLES_PER_LAG))
    sums = np.array([residual[:-lag] @ residual[lag:] for lag in lags])
    values = sums / power + pull[1:] / free
    deviation = np.sqrt(np.maximum(free - lags, 1.0) / (free * (free + 2.0)))
    statistic = float(np.sum((values / deviation) ** 2))
    p_value = float(scipy.special.chdtrc(n_lags, statistic))
    return _banded(lags, values, deviation, p_value), statistic


def _with_signal(
    residual: np.ndarray, signal: np.ndarray, n_lags: int
) -> tuple[Correlation, bool]:
    """Correlation with a signal, both whitened; and whether it follows the residual."""
    if not signal.any() or not residual.any():
        return _no_correlation(np.zeros(0, dtype=int)), False
    whitening = _whitening_filter(signal)
    skip = whitening.size - 1
    e = scipy.signal.lfilter(whitening, 1.0, residual)[skip:]
    a = scipy.signal.lfilter(whitening, 1.0, signal)[skip:]
    lags = np.arange(-n_lags, n_lags + 1)
    power_e, power_a = float(e @ e), float(a @ a)
    if power_e == 0.0 or power_a == 0.0:
        return _no_correlation(np.zeros(0, dtype=int)), False
    norm_of_both = np.sqrt(power_e * power_a)
    values = np.array([_lagged(e, a, lag) for lag in lags]) / norm_of_both
    # The share of the signal that meets a residual at this lag: all of it where it is
    # spread out, none where it is a single jump too near to the end.
    share = np.array([_lagged(np.ones(e.size), a**2, lag) for lag in lags]) / power_a
    deviation = np.sqrt(_shared_colour(e, a, n_lags) * share / e.size)
    causal = lags >= 0
    size = np.abs(values) / np.maximum(deviation, 1e-300)
    size[share < 1.0 / e.size] = 0.0
    correlation = _banded(
        lags, values, deviation, _p_of_largest(size[causal]), counted=causal
    )
    return correlation, _p_of_largest(size[~causal]) < LEVEL


def _lagged(e: np.ndarray, a: np.ndarray, lag: int | np.integer) -> float:
    """Sum of e(t + lag) a(t)."""
    if lag < 0:
        return float(e[:lag] @ a[-lag:])
    return float(e[lag:] @ a[: a.size - lag])


def _whitening_filter(signal: np.ndarray) -> np.ndarray:
    """Coefficients of the filter that leaves of a signal what its past does not tell."""
    order = min(_WHITENING_ORDER, signal.size // _SAMPLES_PER_COEFFICIENT)
    if order == 0:
        return np.ones(1)
    sums = np.array(
        [signal[: signal.size - lag] @ signal[lag:] for lag in range(order + 1)]
    )
    sums[0] *= 1.0 + _FLOOR
    return np.append(1.0, -scipy.linalg.solve_toeplitz(sums[:-1], sums[1:]))


def _shared_colour(e: np.ndarray, a: np.ndarray, n_lags: int) -> float:
    """Factor on the variance of a cross-correlation: 1 where either is white."""
    total = 1.0
    for lag in range(1, n_lags + 1):
        of_e, of_a = (
            float(one[:-lag] @ one[lag:]) / float(one @ one) for one in (e, a)
        )
        total += 2.0 * of_e * of_a
    return max(total, _LEAST_COLOUR)


def _own_square(signal: np.ndarray) -> np.ndarray:
    """What the squared input has beyond the input; zeros where there is nothing."""
    centred = signal - signal.mean()
    square = centred**2 - np.mean(centred**2)
    power = float(centred @ centred)
    if power == 0.0:
        return np.zeros(signal.size)
    own = square - centred * (float(centred @ square) / power)
    is_new = float(own @ own) > _LEAST_SQUARE * float(square @ square)
    return own if is_new else np.zeros(signal.size)


def _p_of_largest(sizes: np.ndarray) -> float:
    """Probability that the largest of so many normal variables is as large."""
    if sizes.size == 0:
        return float("nan")
    single = 2.0 * scipy.special.ndtr(-float(sizes.max()))
    return float(-np.expm1(sizes.size * np.log1p(-min(single, 1.0 - 1e-16))))


def _banded(
    lags: np.ndarray,
    values: np.ndarray,
    deviation: np.ndarray,
    p_value: float,
    *,
    counted: np.ndarray | None = None,
) -> Correlation:
    """Correlation with its bands."""
    counted = np.ones(lags.size, dtype=bool) if counted is None else counted
    each = 1.0 - (1.0 - LEVEL) ** (1.0 / max(int(counted.sum()), 1))
    common = -scipy.special.ndtri(each / 2.0) * deviation
    outside = lags[counted & (np.abs(values) > common) & (common > 0.0)]
    return Correlation(
        lags,
        values,
        -scipy.special.ndtri(LEVEL / 2.0) * deviation,
        common,
        p_value,
        int(outside.max(initial=-1)),
    )


def _no_correlation(lags: np.ndarray) -> Correlation:
    nothing = np.zeros(lags.size)
    return Correlation(lags, nothing, nothing, nothing, float("nan"), -1)
