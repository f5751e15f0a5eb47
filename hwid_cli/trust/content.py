"""What an input visits: the largest amplitude in each octave, around each value.

A nonlinear drive answers otherwise at another amplitude, another frequency and another
working point. So an input is told by a table: octaves of its content, cells of its value,
and in each the largest local amplitude that it reaches there. What several recordings
visited is the largest entry of each cell. The share of a goal's table that is visited is
one number between 0 and 1 that grows with every recording, and by less the more is known.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence

import numpy as np

from hwid_cli.trust.visited import N_BANDS, band_amplitudes

N_VALUES = 12


def value_edges(inputs: Sequence[np.ndarray]) -> np.ndarray:
    """Edges of equal cells over the range of several inputs.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (N_VALUES + 1,), [input unit]
    """
    low = min(float(one.min()) for one in inputs)
    high = max(float(one.max()) for one in inputs)
    if not low < high:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, N_VALUES + 1)


def content(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """What an input visits.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [input unit]
    edges : ndarray, shape (N_VALUES + 1,), [input unit]

    Returns
    -------
    ndarray, shape (N_BANDS, N_VALUES), [input unit]
        Zero where it never is.

    Examples
    --------
    >>> table = content(np.tile([1.0, -1.0], 50), np.linspace(-1.0, 1.0, 13))
    >>> [int(place) for place in np.unravel_index(np.argmax(table), table.shape)]
    [0, 0]
    """
    place = (values - edges[0]) / (edges[-1] - edges[0]) * N_VALUES
    cell = np.clip(place, 0, N_VALUES - 1).astype(int)
    found = np.zeros((N_BANDS, N_VALUES))
    for band, amplitude in enumerate(band_amplitudes(values)):
        np.maximum.at(found[band], cell, amplitude)
    return found


def joined(tables: Sequence[np.ndarray]) -> np.ndarray:
    """What several inputs visit together.

    Parameters
    ----------
    tables : sequence of ndarray, shape (N_BANDS, N_VALUES)

    Returns
    -------
    ndarray, shape (N_BANDS, N_VALUES)
    """
    if not len(tables):
        return np.zeros((N_BANDS, N_VALUES))
    return np.max(np.asarray(tables), axis=0)


def visited_share(visited: np.ndarray, reachable: np.ndarray) -> float:
    """Share of what could be visited that is; every octave counts alike.

    Parameters
    ----------
    visited, reachable : ndarray, shape (N_BANDS, N_VALUES), [input unit]

    Returns
    -------
    float, [-]
        1 where nothing can be visited.
    """
    largest = reachable.max(axis=1, keepdims=True)
    carries = (largest > 0.0)[:, 0]
    if not carries.any():
        return 1.0
    # Fast octaves are weak in every input, and matter all the same.
    wanted = reachable[carries] / largest[carries]
    seen = np.minimum(visited[carries] / largest[carries], wanted)
    return float(seen.sum() / wanted.sum())
