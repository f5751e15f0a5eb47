"""Compiled rows of the regressions that find linear blocks; nothing else compiles here."""

import numpy as np
from numba import njit

from hwid_cli.maths.model.rows.kernels import all_pole


@njit(cache=True)
def regression_rows(
    output: np.ndarray,
    basis: tuple[np.ndarray, np.ndarray, int, int],
    denominator: np.ndarray,
    delay: int,
    counts: tuple[int, int, int, int],
    counted: np.ndarray,
    rows: np.ndarray,
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
    rows : ndarray, shape (n_rows, n_columns)
        Columns: past outputs, the expanded input (order by order of its differences),
        initial states, the filtered level, the level, the filtered output, the output.
    """
    first, shares, count, skipped = basis
    nb, n_state, own_state, n_states = counts
    n, n_poles, width = output.size, denominator.size - 1, shares.shape[1]
    inputs = count - skipped
    used = count + 3
    wide = 4 * ((used + 3) // 4)
    taps = np.zeros(4 * max(1, (n_poles + 3) // 4))
    for j in range(n_poles):
        taps[j] = denominator[1 + j]
    pad = max(taps.size + 1, nb + delay, n_state) + 1
    lines = np.zeros((pad + n, wide))
    table = np.empty((max(nb, n_poles, n_state, 1), inputs))
    for t in range(n):
        row = lines[pad + t]
        for m in range(width):
            row[first[t] + m] = shares[t, m]
        row[count] = 1.0
        row[count + 1] = output[t]
    lines[pad, count + 2] = 1.0
    all_pole(lines, pad, n, taps)
    for r in range(counted.size):
        t = counted[r]
        out, at = rows[r], pad + t
        for j in range(n_poles):
            table[j, 0] = lines[at - 1 - j, count + 1]
        _difference(table, n_poles, 1)
        for j in range(n_poles):
            out[j] = -table[j, 0]
        for j in range(nb):
            for m in range(inputs):
                table[j, m] = lines[at - delay - j, skipped + m]
        _difference(table, nb, inputs)
        place = n_poles
        for j in range(nb):
            for m in range(inputs):
                out[place + m] = table[j, m]
            place += inputs
        for m in range(n_states):
            out[place + m] = 0.0
        for j in range(n_state):
            table[j, 0] = lines[at - j, count + 2]
        _difference(table, n_state, 1)
        for j in range(n_state):
            out[place + own_state + j] = table[j, 0]
        place += n_states
        out[place] = lines[at, count]
        out[place + 1] = 1.0
        out[place + 2] = lines[at, count + 1]
        out[place + 3] = output[t]


@njit(cache=True)
def _difference(table: np.ndarray, count: int, width: int) -> None:
    """Turn values at rising lags into differences of rising order."""
    for order in range(1, count):
        for j in range(count - 1, order - 1, -1):
            for m in range(width):
                table[j, m] = table[j - 1, m] - table[j, m]
