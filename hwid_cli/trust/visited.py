"""Which part of a prediction rests on data: what recordings visited, sample by sample.

A signal has visited a cell of its range where a sample lies in it, or in the next one. It
has visited a rate there if a sample of this cell or the next ones was as fast in the same
direction. The content in frequency is taken in octaves: differences between moving means
of twice the length, and their local root mean square. A new input is inside where none of
the octaves that carry it is stronger than it ever was in the recordings.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence

import numpy as np

from hwid_cli.model.input_range import SAME_LEVEL
from hwid_cli.records.trust import Inside, Visited, VisitedPlane

# A value in the next cell counts as visited: a sentence on the range says the same.
N_CELLS = round(1 / SAME_LEVEL)
# Octaves below Nyquist's frequency; the last takes all that is slower.
N_BANDS = 11
# A rate or an amplitude may be larger by this share: noise and rounding.
_MARGIN = 0.1
# Octaves with less than this share of an input's local amplitude do not carry it.
_CARRIES = 0.1


def visited_plane(signals: Sequence[np.ndarray]) -> VisitedPlane:
    """Values and rates that signals visited.

    Parameters
    ----------
    signals : sequence of ndarray, shape (n_samples,)
        One for each recording.

    Examples
    --------
    >>> plane = visited_plane([np.array([0.0, 1.0, 1.0])])
    >>> float(plane.highest_rate[-1]), bool(np.isnan(plane.highest_rate[16]))
    (1.0, True)
    """
    values = np.concatenate(signals)
    rates = np.concatenate([rates_of(one) for one in signals])
    low, high = float(values.min()), float(values.max())
    if not low < high:
        low, high = low - 0.5, high + 0.5
    edges = np.linspace(low, high, N_CELLS + 1)
    cell = _cells(edges, values)
    lowest, highest = np.full(N_CELLS, np.inf), np.full(N_CELLS, -np.inf)
    np.minimum.at(lowest, cell, rates)
    np.maximum.at(highest, cell, rates)
    is_empty = ~np.isfinite(lowest)
    lowest[is_empty] = highest[is_empty] = np.nan
    return VisitedPlane(edges, lowest, highest)


def rates_of(signal: np.ndarray) -> np.ndarray:
    """Change from the sample before, 0 at the first.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (n_samples,), [signal's unit/sample]
    """
    return np.diff(signal, prepend=signal[:1])


def band_amplitudes(values: np.ndarray) -> np.ndarray:
    """Local amplitude of an input in octaves.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (N_BANDS, n_samples), [input unit]
        Root mean squares over twice the longest period of each octave, from Nyquist's
        frequency down; the last band holds all that is slower, without the constant.
    """
    found = np.zeros((N_BANDS, values.size))
    smooth = np.asarray(values, dtype=float)
    for band in range(N_BANDS):
        length = 2 ** (band + 1)
        smoother = _moving_mean(values, length)
        if band == N_BANDS - 1 or length >= values.size:
            smoother = np.full(values.size, float(np.mean(values)))
        found[band] = np.sqrt(_moving_mean((smooth - smoother) ** 2, 2 * length))
        smooth = smoother
        if length >= values.size:
            break
    return found


def _moving_mean(values: np.ndarray, length: int) -> np.ndarray:
    """Mean over `length` samples around each; over those that are there at the ends."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    at = np.arange(values.size)
    first = np.maximum(at - length // 2, 0)
    last = np.minimum(at + (length + 1) // 2, values.size)
    last = np.maximum(last, first + 1)
    return np.maximum((total[last] - total[first]) / (last - first), _least(values))


def _least(values: np.ndarray) -> float:
    """Rounding of the running sum must not make a mean smaller than every value."""
    return float(values.min())


def visited_by(inputs: Sequence[np.ndarray], inner: Sequence[np.ndarray]) -> Visited:
    """What recordings visited.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
    inner : sequence of ndarray, shape (n_samples,)
        What reached the output map.
    """
    bands = np.max([band_amplitudes(one).max(axis=1) for one in inputs], axis=0)
    return Visited(visited_plane(inputs), visited_plane(inner), bands)


def inside(visited: Visited, values: np.ndarray, inner: np.ndarray) -> Inside:
    """Which samples of an input rest on data.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [input unit]
    inner : ndarray, shape (n_samples,)
        What reaches the output map.
    """
    by_input, by_inner = (
        _inside_plane(plane, signal)
        for plane, signal in ((visited.input, values), (visited.inner, inner))
    )
    amplitudes = band_amplitudes(values)
    total = np.sqrt(np.sum(amplitudes**2, axis=0))
    is_stronger = amplitudes > (1.0 + _MARGIN) * visited.bands[:, None]
    carries = amplitudes > _CARRIES * np.maximum(total, 1e-300)
    return Inside(
        by_input[0] & by_inner[0],
        by_input[1] & by_inner[1],
        ~(is_stronger & carries).any(axis=0),
    )


def _inside_plane(
    plane: VisitedPlane, signal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whether each sample lies in a visited cell, and is no faster than there."""
    edges = plane.edges
    cell = _cells(edges, signal)
    width = edges[1] - edges[0]
    is_within = (signal >= edges[0] - width) & (signal <= edges[-1] + width)
    lowest, highest = _of_neighbours(plane.lowest_rate, plane.highest_rate)
    is_seen = np.isfinite(lowest)[cell]
    rates = rates_of(signal)
    # A cell that is crossed within a sample is as wide as its rate.
    slack = _MARGIN * np.nanmax(np.abs([plane.lowest_rate, plane.highest_rate]))
    with np.errstate(invalid="ignore"):
        is_slower = (rates >= lowest[cell] - slack) & (rates <= highest[cell] + slack)
    return is_within & is_seen, is_within & is_slower


def _of_neighbours(
    lowest: np.ndarray, highest: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest rate of each cell with its two neighbours; NaN in none."""
    low = np.pad(np.where(np.isnan(lowest), np.inf, lowest), 1, constant_values=np.inf)
    high = np.pad(
        np.where(np.isnan(highest), -np.inf, highest), 1, constant_values=-np.inf
    )
    low = np.minimum(np.minimum(low[:-2], low[1:-1]), low[2:])
    high = np.maximum(np.maximum(high[:-2], high[1:-1]), high[2:])
    is_empty = ~np.isfinite(low)
    low[is_empty] = high[is_empty] = np.nan
    return low, high


def _cells(edges: np.ndarray, values: np.ndarray) -> np.ndarray:
    place = (values - edges[0]) / (edges[-1] - edges[0]) * (edges.size - 1)
    return np.clip(np.nan_to_num(place), 0, edges.size - 2).astype(int)
