"""How much of an input lies beyond what a model has seen."""

import numpy as np

# Share of the range by which an input may leave it without a word: rounding in a file.
_ROUNDING = 1e-9


def outside_share(
    signal: np.ndarray, input_range: tuple[float, float]
) -> tuple[float, float, float]:
    """How much of an input a model has never seen.

    Parameters
    ----------
    signal : ndarray, shape (n_samples,), [input unit]
    input_range : tuple of float, [input unit]
        Lowest and highest input of the model's data.

    Returns
    -------
    share : float, [-]
        Of the samples.
    lowest, highest : float, [input unit]
        Of the signal.
    """
    low, high = input_range
    margin = _ROUNDING * max(abs(low), abs(high))
    is_outside = (signal < low - margin) | (signal > high + margin)
    return float(is_outside.mean()), float(signal.min()), float(signal.max())
