"""White noise of a signal that moves: differences of high order see no smooth motion."""

from collections.abc import Sequence
from math import comb

import numpy as np

# Orders of differences: the second where the first still sees motion or colour.
ORDER, _HIGHER_ORDER = 6, 16
SEES_MOTION = 0.7
# A difference that is larger than this many standard deviations is a jump.
_JUMP = 5.0


def differences_rms(pieces: Sequence[np.ndarray], step: float) -> float:
    """RMS of white noise, from differences of one order or a higher one.

    The higher order where the lower one sees motion.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
        Of signals with their motion.
    step : float
        Of the sensor's grid, as noise; smaller differences are its rounding.
    """
    low = difference_rms(pieces, ORDER, step)
    high = difference_rms(pieces, _HIGHER_ORDER, step)
    return high if 0 < high < SEES_MOTION * low else low


def difference_rms(pieces: Sequence[np.ndarray], order: int, step: float) -> float:
    """RMS of white noise from pooled differences of one order, without jumps.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n_samples,)
        Of signals with their motion.
    step : float
        As of ``differences_rms``.
    """
    longer = [piece for piece in pieces if piece.size > order]
    if not longer:
        return 0.0
    scale = np.sqrt(comb(2 * order, order))
    found = [np.diff(piece, order) / scale for piece in longer]
    # Of each piece: beside quiet ones, all of a noisy one would be jumps.
    kept = np.concatenate([_without_jumps(one, step) for one in found])
    return float(np.sqrt(np.mean(np.square(kept)))) if kept.size else 0.0


def _without_jumps(differences: np.ndarray, step: float) -> np.ndarray:
    """Differences without those that are far larger than most."""
    size = np.abs(differences)
    # 1.4826: from the median of the magnitudes to a standard deviation.
    limit = _JUMP * max(1.4826 * float(np.median(size)), step)
    return differences[size <= limit] if limit > 0 else differences
