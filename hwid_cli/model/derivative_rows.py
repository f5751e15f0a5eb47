"""Compiled rows of a model's derivatives and sums over them; nothing else compiles here."""

import numpy as np

from hwid_cli.compiled import INNER, MAKING, compiled

# Decaying responses end in subnormal numbers, which processors handle a hundred times
# slower; anything this small is far below the rounding of the values it is added to.
_TINY = 1e-200
# Samples between two looks for such numbers, and samples worked on at a time: the
# recursions of all columns over a chunk stay in the cache.
_FLUSH, _CHUNK = 64, 256
# Where fewer than one sample in so many counts, B is applied to those alone.
_DENSE = 2


@compiled()
def derivative_rows(
    signals: tuple[np.ndarray, np.ndarray],
    block: tuple[np.ndarray, np.ndarray, int],
    basis: tuple[np.ndarray, np.ndarray, int],
    start: tuple[bool, int, int, int],
    weights: np.ndarray,
    counted: np.ndarray,
    out: np.ndarray,
) -> None:
    """Derivatives of x by input map, initial states, B and F, times a weight.

    Everything obeys ``F(q) column = ...``, so all runs through one recursion. Those of
    the input map are then combined by B, and those of the initial states, B and F are
    differences of three of its columns.

    Parameters
    ----------
    signals : tuple of ndarray, shape (n,)
        Before and after the linear block.
    block : tuple of numerator (nb,), monic denominator (nf + 1,), delay
    basis : tuple of first (n,), shares (n, width), count
        Derivatives of the input map: at sample t they are ``shares[t]`` in the columns
        from ``first[t]`` on, and zero in the others of `count` columns.
    start : tuple of bool, int, int, int
        Whether it is steady, the number of initial states, the place of the first of
        this experiment among those of all, and how many these are.
    weights : ndarray, shape (n_rows,)
        For the rows that are written.
    counted : ndarray of int, shape (n_rows,)
        Rising; the samples that have a row.
    out : ndarray, shape (n_rows, at least count + n_states + nb + nf)
        Columns of the input map, the initial states, B and F are written.
    """
    w, x = signals
    numerator, denominator, delay = block
    first, shares, count = basis
    steady, n_state, own_state, n_states = start
    n, nb, nf, width = w.size, numerator.size, denominator.size - 1, shares.shape[1]
    taps = np.zeros(max(4, nf))
    for j in range(nf):
        taps[j] = denominator[1 + j]
    zeros = np.zeros(4 * ((nb + 3) // 4))
    for i in range(nb):
        zeros[i] = numerator[i]
    pad = max(taps.size, zeros.size + delay, n_state) + 1
    wide = 4 * ((count + 3 + 3) // 4)
    chunk = min(n, _CHUNK)
    lines = np.zeros((pad + chunk, wide))
    if steady:
        below = denominator.sum()
        # A block that integrates rests at zero only, whatever moves.
        gain = 1.0 / below if below != 0.0 else 0.0
        level = numerator.sum() * gain
        for t in range(pad):
            for m in range(width):
                lines[t, first[0] + m] += shares[0, m] * gain
            lines[t, count] = w[0] * gain
            lines[t, count + 1] = w[0] * level * gain
    passed = np.empty((chunk, wide))
    table = np.empty((n_state + nb + nf, chunk + max(nb, nf, n_state, 1)))
    r = 0
    for begin in range(0, n, chunk):
        length = min(chunk, n - begin)
        for k in range(length):
            t, row = begin + k, lines[pad + k]
            for m in range(wide):
                row[m] = 0.0
            for m in range(width):
                row[first[t] + m] = shares[t, m]
            row[count] = w[t]
            row[count + 1] = x[t]
        if begin == 0:
            lines[pad, count + 2] = 1.0
        all_pole(lines, pad, length, taps)
        last, stop = length - 1, r
        while stop < counted.size and counted[stop] < begin + length:
            stop += 1
        if _DENSE * (stop - r) < length:
            for k in range(r, stop):
                at = counted[k] - begin
                first_value = (pad - delay + at) * wide
                _all_zero(lines.ravel(), first_value, zeros, wide, passed[at])
        else:
            _all_zero(lines.ravel(), (pad - delay) * wide, zeros, wide, passed.ravel())
        differences(lines, pad, count + 2, n_state, length, table)
        differences(lines, pad - delay, count, nb, length, table[n_state:])
        differences(lines, pad - 1, count + 1, nf, length, table[n_state + nb :])
        while r < stop:
            k = counted[r] - begin
            row, source, weight = out[r], passed[k], weights[r]
            for m in range(count):
                row[m] = weight * source[m]
            for m in range(count, count + n_states):
                row[m] = 0.0
            place = count + own_state
            for m in range(n_state):
                row[place + m] = weight * table[m, k]
            place = count + n_states
            for m in range(nb):
                row[place + m] = weight * table[n_state + m, k]
            place += nb
            for m in range(nf):
                row[place + m] = -weight * table[n_state + nb + m, k]
            r += 1
        for k in range(pad):
            for m in range(wide):
                lines[k, m] = lines[last + 1 + k, m]


@compiled()
def all_pole(lines: np.ndarray, begin: int, length: int, taps: np.ndarray) -> None:
    """Subtract from each row its predecessors times the taps, in place.

    Two rows at a time, whose predecessors are nearly the same, and four taps at a time.

    Parameters
    ----------
    lines : ndarray, shape (n, width)
    begin, length : int
        The rows; the first has as many predecessors as there are taps.
    taps : ndarray, shape (n_taps,)
        At least four.
    """
    wide = lines.shape[1]
    for k in range(begin, begin + length - 1, 2):
        row, after = lines[k], lines[k + 1]
        grouped = taps.size // 4 * 4
        for j in range(grouped, taps.size):
            f1, s0, s1 = taps[j], lines[k - j], lines[k - j - 1]
            for m in range(wide):
                row[m] -= f1 * s1[m]
                after[m] -= f1 * s0[m]
        for j in range(4, grouped, 4):
            f1, f2, f3, f4 = taps[j], taps[j + 1], taps[j + 2], taps[j + 3]
            s0, s1, s2 = lines[k - j], lines[k - j - 1], lines[k - j - 2]
            s3, s4 = lines[k - j - 3], lines[k - j - 4]
            for m in range(wide):
                v1, v2, v3 = s1[m], s2[m], s3[m]
                row[m] -= f1 * v1 + f2 * v2 + f3 * v3 + f4 * s4[m]
                after[m] -= f1 * s0[m] + f2 * v1 + f3 * v2 + f4 * v3
        f1, f2, f3, f4 = taps[0], taps[1], taps[2], taps[3]
        s1, s2, s3, s4 = lines[k - 1], lines[k - 2], lines[k - 3], lines[k - 4]
        for m in range(wide):
            v1, v2, v3 = s1[m], s2[m], s3[m]
            value = row[m] - (f1 * v1 + f2 * v2 + f3 * v3 + f4 * s4[m])
            row[m] = value
            after[m] -= f1 * value + f2 * v1 + f3 * v2 + f4 * v3
        if k % _FLUSH < 2:
            for j in range(taps.size):
                _flush(lines[k + 1 - j])
    if length % 2:
        row = lines[begin + length - 1]
        for j in range(taps.size):
            source = lines[begin + length - 2 - j]
            for m in range(wide):
                row[m] -= taps[j] * source[m]


@compiled(**INNER)
def _flush(row: np.ndarray) -> None:
    """Set what has all but died away to zero."""
    for m in range(row.size):
        row[m] = 0.0 if abs(row[m]) < _TINY else row[m]


@compiled(**INNER)
def _all_zero(
    lines: np.ndarray, at: int, zeros: np.ndarray, wide: int, out: np.ndarray
) -> None:
    """Write rows and their predecessors times the coefficients of B, four at a time.

    The rows lie one after the other, so that one loop runs over all of them.
    """
    n = out.size
    for i in range(0, zeros.size, 4):
        b0, b1, b2, b3 = zeros[i], zeros[i + 1], zeros[i + 2], zeros[i + 3]
        first = at - i * wide
        s0, s1 = lines[first : first + n], lines[first - wide : first - wide + n]
        first -= 2 * wide
        s2, s3 = lines[first : first + n], lines[first - wide : first - wide + n]
        if i == 0:
            for m in range(n):
                out[m] = b0 * s0[m] + b1 * s1[m] + b2 * s2[m] + b3 * s3[m]
        else:
            for m in range(n):
                out[m] += b0 * s0[m] + b1 * s1[m] + b2 * s2[m] + b3 * s3[m]


@compiled(**MAKING)
def differences(
    lines: np.ndarray, at: int, column: int, count: int, length: int, table: np.ndarray
) -> None:
    """Write ``(1 - q^-1)^j`` of a column from row `at` on into row j of a table.

    Parameters
    ----------
    lines : ndarray, shape (n, width)
        With at least `count` rows before row `at`.
    table : ndarray, shape (at least count, at least length)
    """
    if count == 0:
        return
    before = np.empty(count)
    for j in range(count):
        before[j] = lines[at - 1 - j, column]
    for order in range(1, count):
        for j in range(count - 1, order - 1, -1):
            before[j] = before[j - 1] - before[j]
    for k in range(length):
        table[0, k] = lines[at + k, column]
    for j in range(1, count):
        lower, higher = table[j - 1], table[j]
        higher[0] = lower[0] - before[j - 1]
        for k in range(1, length):
            higher[k] = lower[k] - lower[k - 1]


@compiled()
def local_sums(
    first: np.ndarray, shares: np.ndarray, rows: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Products of columns that are zero but in few places with dense ones.

    Parameters
    ----------
    first : ndarray of int, shape (n,)
    shares : ndarray, shape (n, width)
        At row t the local columns are ``shares[t]`` from column ``first[t]`` on.
    rows : ndarray, shape (n, n_dense)
    count : int
        Number of local columns.

    Returns
    -------
    own : ndarray, shape (count, count)
        Local columns times local columns.
    cross : ndarray, shape (count, n_dense)
        Local columns times dense ones.
    """
    own = np.zeros((count, count))
    cross = np.zeros((count, rows.shape[1]))
    width = shares.shape[1]
    for t in range(first.size):
        at = first[t]
        row = rows[t]
        for m in range(width):
            share = shares[t, m]
            for k in range(m + 1):
                own[at + m, at + k] += share * shares[t, k]
            into = cross[at + m]
            for k in range(row.size):
                into[k] += share * row[k]
    for m in range(count):
        for k in range(m):
            own[k, m] = own[m, k]
    return own, cross
