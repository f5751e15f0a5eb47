"""Two more routes to a linear start, tried beside the project's own (`bench_starts`).

References
----------
Soderstrom, Stoica, Instrumental Variable Methods for System Identification (1983).
Kung (1978) for the reduction of an impulse response; Chen, Ohlsson, Ljung (2012),
Automatica 48(8), for the kernel that keeps a long one smooth.
"""

import numpy as np
from scipy.linalg import hankel
from scipy.signal import lfilter

from hwid_cli.model.linear_block import is_stable, reflected

# Rounds of instruments, and taps of the long impulse response at most.
_ROUNDS, _TAPS = 3, 150
# Share of the first tap's prior variance that the last one keeps, and weight of the
# prior against the mean square of the output.
_LAST, _WEIGHT = 1e-3, 1e-2


def lags(signal, first, count):
    """Columns of a signal delayed by first ... first + count - 1 samples."""
    padded = np.concatenate([np.zeros(first + count), signal])
    n = signal.size
    return np.column_stack(
        [padded[count - j : count - j + n] for j in range(count)]
        if count
        else [np.zeros((n, 0))]
    )


def by_instruments(problem):
    """Denominator by instrumental variables: the simulated output as instrument."""
    orders = problem.orders
    parts = [(one.input, one.output) for one in problem.experiments]
    inputs = [
        np.column_stack([lags(u, orders.nk, orders.nb), np.ones(u.size)])
        for u, _ in parts
    ]
    regressors = np.vstack(
        [
            np.column_stack([-lags(y, 1, orders.nf), columns])
            for (_, y), columns in zip(parts, inputs, strict=True)
        ]
    )
    target = np.concatenate([y for _, y in parts])
    instruments = regressors
    denominator = np.eye(1, orders.nf + 1)[0]
    for _ in range(_ROUNDS):
        found = np.linalg.lstsq(
            instruments.T @ regressors, instruments.T @ target, rcond=None
        )[0]
        denominator = stable(np.append(1.0, found[: orders.nf]))
        driven = [columns @ found[orders.nf :] for columns in inputs]
        instruments = np.vstack(
            [
                np.column_stack(
                    [-lags(lfilter([1.0], denominator, w), 1, orders.nf), z]
                )
                for w, z in zip(driven, inputs, strict=True)
            ]
        )
    return denominator


def by_reduction(problem):
    """Denominator of a long impulse response that is reduced to the order asked for."""
    orders = problem.orders
    taps = min(_TAPS, min(one.output.size for one in problem.experiments) // 4)
    if taps < 2 * orders.nf + 2:
        return None
    columns = np.vstack(
        [
            np.column_stack([lags(one.input, orders.nk, taps), np.ones(one.input.size)])
            for one in problem.experiments
        ]
    )
    target = np.concatenate([one.output for one in problem.experiments])
    decay = _LAST ** (np.maximum.outer(range(taps), range(taps)) / taps)
    weight = np.zeros((taps + 1, taps + 1))
    weight[:-1, :-1] = np.linalg.inv(decay + 1e-9 * np.eye(taps))
    scale = _WEIGHT * target @ target / target.size
    response = np.linalg.solve(
        columns.T @ columns + scale * weight + 1e-9 * np.eye(taps + 1),
        columns.T @ target,
    )[:-1]
    half = taps // 2
    left, strength, _ = np.linalg.svd(hankel(response[:half], response[half - 1 :]))
    observed = left[:, : orders.nf] * np.sqrt(strength[: orders.nf])
    shift = np.linalg.lstsq(observed[:-1], observed[1:], rcond=None)[0]
    return stable(np.real(np.poly(np.linalg.eigvals(shift))))


def stable(denominator):
    """The same with its poles inside the unit circle."""
    return denominator if is_stable(denominator) else reflected(denominator, 0.9995)
