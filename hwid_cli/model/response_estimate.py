"""Delay and number of poles from the data alone, by a linear model of high order.

A long ARX model describes any linear drive with any noise well enough for a first look.
The delay is the largest one that the recording does not contradict: how many of the
newest inputs the output does without (F test). A smooth input tells its past from its
present only roughly, so the true delay may be shorter; static maps do not move it. The
poles are counted on the impulse response: the Hankel matrix of a response with n poles
has n singular values, the rest is noise, and between them lies the deepest fall.

References
----------
docs/method.md, eqs. (35)-(36). Ljung (1999), sections 4.2 and 10.6 (subspace methods).
"""

from collections.abc import Sequence

import numpy as np
import scipy

from hwid_cli.records.order import ResponseEstimate
from hwid_cli.records.recordings import Recording

# Past outputs, and past inputs beyond the delays that are tried; fewer where the
# recording is short.
_ORDER, MOST_DELAY, _SAMPLES_PER_COEFFICIENT = 16, 20, 8
# Noise that signals are taken to have at least, as a share of their size.
_LEAST_NOISE = 1e-4
# Chance of taking a coefficient of the noise for an answer.
_FALSE_ALARM = 1e-3
# A response is followed until it stays below this share of its largest value, for so many
# samples at most; about so many of them make the matrix.
_DECAYED, _LONGEST, _ROWS = 0.01, 4000, 40
# Most poles that are counted, and singular values below this share that are rounding.
_MOST_POLES, _ROUNDING = 8, 1e-9


def estimate_response(recording: Recording) -> ResponseEstimate:
    """Estimate the delay and the number of poles of a recording.

    References
    ----------
    docs/method.md, eqs. (35)-(36).
    """
    order = min(
        _ORDER,
        (recording.n_samples // _SAMPLES_PER_COEFFICIENT - MOST_DELAY) // 2,
    )
    nothing = ResponseEstimate(recording.name, -1, np.zeros(0), 0)
    if order < 1:
        return nothing
    regressors, target = _arx_equations(recording, order)
    basis, triangle = np.linalg.qr(regressors)
    shares = basis.T @ target
    residual = float(target @ target - shares @ shares)
    delay = _delay(shares, max(residual, 0.0), recording.n_samples - shares.size)
    if delay < 0:
        return nothing
    kept = shares.size - delay
    solution = scipy.linalg.solve_triangular(triangle[:kept, :kept], shares[:kept])
    past, newest_last = solution[1 : order + 1], solution[order + 1 :]
    response = _impulse_response(np.append(1.0, -past), newest_last[::-1])
    values = _hankel_values(response)
    return ResponseEstimate(recording.name, delay, values, _count_poles(values))


def longest_delay(responses: Sequence[ResponseEstimate]) -> int:
    """Longest delay that three quarters of the recordings do not contradict.

    Returns
    -------
    int, [samples]
        -1 where no output answers its input.
    """
    found = [one.delay for one in responses if one.delay >= 0]
    return int(np.quantile(found, 0.25, method="inverted_cdf")) if found else -1


def _arx_equations(recording: Recording, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns: a constant, past outputs, inputs from the oldest to the newest."""
    u, y = recording.input, recording.output
    longest = order + MOST_DELAY
    rows = np.arange(longest, y.size)
    columns = [np.ones(rows.size)]
    columns += [y[rows - lag] / np.std(y) for lag in range(1, order + 1)]
    columns += [u[rows - lag] / np.std(u) for lag in range(longest, -1, -1)]
    # As if both were measured with this noise: without any the equations are singular.
    n_columns = len(columns)
    noise = _LEAST_NOISE * np.sqrt(rows.size) * np.eye(n_columns)
    return (
        np.vstack([np.column_stack(columns), noise]),
        np.concatenate([y[rows] / np.std(y), np.zeros(n_columns)]),
    )


def _delay(shares: np.ndarray, residual: float, freedom: int) -> int:
    """Most of the newest inputs that the output does without; -1 if all of them."""
    newest_first = shares[::-1] ** 2
    gains = np.cumsum(newest_first[: MOST_DELAY + 1])
    counts = np.arange(1, gains.size + 1)
    noise = residual / freedom
    if noise == 0.0:
        # Nothing but the model: any answer counts.
        is_needed = gains > 0.0
    else:
        is_needed = (
            scipy.special.fdtrc(counts, freedom, gains / counts / noise) < _FALSE_ALARM
        )
    return int(np.argmax(is_needed)) if is_needed.any() else -1


def _impulse_response(denominator: np.ndarray, numerator: np.ndarray) -> np.ndarray:
    """Response until it has decayed; empty where it never does."""
    if (np.abs(np.roots(denominator)) >= 1.0).any():
        return np.zeros(0)
    pulse = np.zeros(_LONGEST)
    pulse[0] = 1.0
    response = scipy.signal.lfilter(numerator, denominator, pulse)
    large = np.flatnonzero(np.abs(response) > _DECAYED * np.abs(response).max())
    if large.size == 0 or large[-1] > 0.9 * _LONGEST:
        return np.zeros(0)
    return response[: large[-1] + 1]


def _hankel_values(response: np.ndarray) -> np.ndarray:
    """Relative singular values of the Hankel matrix of a response."""
    if response.size == 0:
        return np.zeros(0)
    # Every n-th value of a response has as many poles as all of them.
    stride = max(1, response.size // (2 * _ROWS))
    thinned = response[::stride]
    first = (thinned.size + 1) // 2
    values = scipy.linalg.svdvals(
        scipy.linalg.hankel(thinned[:first], thinned[first - 1 :])
    )
    return values / values[0]


def _count_poles(values: np.ndarray) -> int:
    """Singular values before the deepest fall; 0 without any response."""
    if values.size < 2:
        return 0
    floored = np.maximum(values[: _MOST_POLES + 1], _ROUNDING)
    return 1 + int(np.argmax(floored[:-1] / floored[1:]))
