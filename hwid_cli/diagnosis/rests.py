"""Where signals rest at the start of a recording: for how long, and at which level."""

import numpy as np

# Share of the range of a signal below which a change is rest.
_REST = 1e-3
# Samples whose level is that of a rest, and the standard errors by which that of their
# halves may differ: so far a slow rise moves it by less than one sample's noise.
_LEAST_REST, _SAME_LEVEL = 40, 2.0
# Share of the way of a recording beyond which it has moved before its input has.
_FAR = 0.01


def with_level_of_rest(driven_by: np.ndarray) -> np.ndarray:
    """Copy of an input that begins with the level at which it rests.

    A drive starts in equilibrium with the first sample. The noise of that one sample would
    move it, and where friction holds it there it stays.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,)

    Returns
    -------
    ndarray, shape (n_samples,)
        The same numbers where the input is free of noise, or moves at once.
    """
    found = np.array(driven_by, dtype=float)
    found[0] = level_of_rest(driven_by)
    return found


def level_of_rest(values: np.ndarray) -> float:
    """Level of the first samples, for as long as a signal rests.

    Parameters
    ----------
    values : ndarray, shape (n_samples,)

    Returns
    -------
    float
        The first sample itself where the signal is free of noise, or moves at once.
    """
    found = float(values[0])
    n = _LEAST_REST
    # As long as both halves have the same level, the signal rests.
    while n <= values.size:
        first, second = (float(np.mean(one)) for one in np.split(values[:n], 2))
        bends = np.diff(values[:n], 4)
        # White noise is 70 times as strong in its fourth differences.
        noise = float(np.sqrt(np.mean(bends**2) / 70.0))
        if noise == 0.0 or abs(second - first) > _SAME_LEVEL * 2.0 * noise / n**0.5:
            break
        found = (first + second) / 2.0
        n *= 2
    return found


def position_of_rest(driven_by: np.ndarray, output: np.ndarray) -> float:
    """Level of a position before its input moves, or before it goes far itself.

    A free axis moves under an input that is constant from its first sample on.

    Parameters
    ----------
    driven_by, output : ndarray, shape (n_samples,)

    Returns
    -------
    float, [output unit]
    """
    rest = output[: max(1, rest_length(driven_by))]
    return level_of_rest(rest) if _goes_far(rest, output) else float(rest.mean())


def _goes_far(rest: np.ndarray, output: np.ndarray) -> bool:
    """Whether an output moves before its input does: nothing holds it there."""
    if rest.size < _LEAST_REST:
        return False
    first, *_, last = np.array_split(rest, 4)
    way = abs(float(last.mean() - first.mean()))
    return way > _FAR * float(np.ptp(output))


def rest_length(driven_by: np.ndarray) -> int:
    """Count the samples before an input first moves.

    Parameters
    ----------
    driven_by : ndarray, shape (n_samples,)

    Returns
    -------
    int, [samples]
        The sample from which it moves counts as well: there it has not moved yet.
    """
    size = float(np.max(np.abs(driven_by - driven_by[0])))
    moved = np.flatnonzero(np.abs(driven_by - driven_by[0]) > _REST * size)
    return int(moved[0]) if moved.size else int(driven_by.size)
