"""Compiled columns of the regressions that find linear blocks; nothing else compiles here."""

import numpy as np
from numba import njit

from hwid_cli.maths.model.rows.kernels import all_pole, differences


@njit(cache=True)
def regression_columns(
    output: np.ndarray,
    basis: tuple[np.ndarray, np.ndarray, int, int],
    denominator: np.ndarray,
    delay: int,
    counts: tuple[int, int, int, int],
    counted: np.ndarray,
    columns: np.ndarray,
) -> None:
    """Signals filtered by 1/F and their differences, at the samples that count.

    Parameters
    ----------
    output : ndarray, shape (n,)
    basis : tuple of first (n,), shares (n, width), count, skipped
        The input expanded: ``shares[t]`` stand in the columns from ``first[t]`` on, of
        `count`, of which the first `skipped` are left out.
    denominator : ndarray, shape (n_poles + 1,)
        Monic.
    delay : int, [samples]
    counts : tuple of int
        Numerator coefficients, initial states, the column of the first of this
        experiment's, and those of all experiments.
    counted : ndarray of int, shape (n_rows,)
    columns : ndarray, shape (n_columns, n_rows)
        Each in a row of its own: the filtered level, past outputs, the expanded input (order by order of
        its differences), initial states, the level, the filtered output, the output.
    """
    first, shares, count, skipped = basis
    nb, n_state, own_state, n_states = counts
    n, n_poles, width = output.size, denominator.size - 1, shares.shape[1]
    inputs = count - skipped
    used = count + 3
    wide = 4 * ((used + 3) // 4)
    taps = np.zeros(max(4, n_poles))
    for j in range(n_poles):
        taps[j] = denominator[1 + j]
    pad = max(taps.size + 1, nb + delay, n_state) + 1
    lines = np.zeros((pad + n, wide))
    for t in range(n):
        row = lines[pad + t]
        for m in range(width):
            row[first[t] + m] = shares[t, m]
        row[count] = 1.0
        row[count + 1] = output[t]
    lines[pad, count + 2] = 1.0
    all_pole(lines, pad, n, taps)
    table = np.empty((max(nb, n_poles, n_state), n))
    _pick(lines[pad:, count], counted, 1.0, columns[0])
    differences(lines, pad - 1, count + 1, n_poles, n, table)
    for j in range(n_poles):
        _pick(table[j], counted, -1.0, columns[1 + j])
    place = 1 + n_poles
    for m in range(inputs):
        differences(lines, pad - delay, skipped + m, nb, n, table)
        for j in range(nb):
            _pick(table[j], counted, 1.0, columns[place + j * inputs + m])
    place += nb * inputs
    columns[place : place + n_states] = 0.0
    differences(lines, pad, count + 2, n_state, n, table)
    for j in range(n_state):
        _pick(table[j], counted, 1.0, columns[place + own_state + j])
    place += n_states
    columns[place] = 1.0
    _pick(lines[pad:, count + 1], counted, 1.0, columns[place + 1])
    _pick(output, counted, 1.0, columns[place + 2])


@njit(cache=True)
def _pick(
    signal: np.ndarray, counted: np.ndarray, factor: float, out: np.ndarray
) -> None:
    """Write a signal at the samples that count, times a factor."""
    for r in range(counted.size):
        out[r] = factor * signal[counted[r]]
