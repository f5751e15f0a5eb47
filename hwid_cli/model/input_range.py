"""How much of an input lies beyond what a model has seen."""

import numpy as np

# Share of the range by which an input may leave it without a word: rounding in a file.
_ROUNDING = 1e-9
# Share of its width by which an input may leave the range where people are told: the
# noise of a level that both hold, and the offset of a sensor. No map turns within that.
# What `trust.visited` calls visited is told in cells of this width, too.
SAME_LEVEL = 1 / 32


def outside_share(
    signal: np.ndarray, input_range: tuple[float, float], *, same: float = 0.0
) -> tuple[float, float, float]:
    """How much of an input a model has never seen.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,), [input unit]
    input_range : tuple of float, [input unit]
        Lowest and highest input of the model's data.
    same : float, [-]
        Share of the range's width within which a value beyond it counts as inside.

    Returns
    -------
    share : float, [-]
        Of the samples.
    lowest, highest : float, [input unit]
        Of the signal.
    """
    low, high = input_range
    margin = max(_ROUNDING * max(abs(low), abs(high)), same * (high - low))
    is_outside = (signal < low - margin) | (signal > high + margin)
    return float(is_outside.mean()), float(signal.min()), float(signal.max())
