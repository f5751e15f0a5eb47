"""How alike two inputs are: their mean and their amplitudes in octave bands.

An input is told by twelve numbers: its mean, which keeps its sign, and the amplitude
that it has around Nyquist's frequency, half of it, a quarter and so on; the last of the
eleven bands holds all that is slower. The bands overlap: a frequency between two
centres gives its power to both, so that two sines at nearly one frequency never fall
apart at the edge of a band.

Powers are per sample, so records of different length compare. What happens when is not
seen: two inputs whose parts stand in another order are alike. Frequencies are counted
in cycles per sample; the inputs must share their sample time.

References
----------
docs/method.md, eqs. (18)-(20).
"""

import numpy as np

# Octaves below Nyquist's frequency that are told apart, [-]: at 1 kHz down to 0.5 Hz,
# below the slowest excitation of a servo drive.
N_OCTAVES = 10


def input_signature(values: np.ndarray) -> np.ndarray:
    """Mean and band amplitudes of an input.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [input unit]

    Returns
    -------
    ndarray, shape (N_OCTAVES + 2,), [input unit]
        The mean, then the bands from Nyquist's frequency down. Its norm is the root
        mean square of the input.

    Raises
    ------
    ValueError
        If there are no samples, or they are not 1-D.

    References
    ----------
    docs/method.md, eqs. (18) and (19).

    Examples
    --------
    >>> signature = input_signature(np.array([4.0, 2.0, 4.0, 2.0]))
    >>> signature[:4].tolist()
    [3.0, 1.0, 0.0, 0.0]
    """
    signal = np.asarray(values, dtype=float)
    if signal.ndim != 1 or signal.size == 0:
        raise ValueError(f"input must be a 1-D array with samples, got {signal.shape}")
    mean = float(np.mean(signal))
    half = np.abs(np.fft.rfft(signal - mean)[1:] / signal.size) ** 2
    cycles = np.arange(1, half.size + 1)
    # All frequencies but Nyquist's stand for their negative twin too.
    power = np.where(2 * cycles == signal.size, half, 2.0 * half)
    octaves_down = np.clip(np.log2(0.5 * signal.size / cycles), 0.0, N_OCTAVES)
    upper = np.minimum(octaves_down.astype(int), N_OCTAVES - 1)
    to_lower = octaves_down - upper
    bands = np.zeros(N_OCTAVES + 1)
    np.add.at(bands, upper, (1.0 - to_lower) * power)
    np.add.at(bands, upper + 1, to_lower * power)
    return np.append(mean, np.sqrt(bands))


def input_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Distance between two inputs, relative to the larger one.

    Parameters
    ----------
    one, other : ndarray, shape (N_OCTAVES + 2,), [input unit]
        As ``input_signature`` gives them.

    Returns
    -------
    float, [-]
        0 for equal ones, between 1 and 1.4 for inputs that have nothing in common, 2
        for a constant and its opposite.

    References
    ----------
    docs/method.md, eq. (20).

    Examples
    --------
    >>> step = input_signature(np.full(100, 2.0))
    >>> input_distance(step, input_signature(np.full(50, 1.5)))
    0.25
    """
    larger = max(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
    if larger == 0.0:
        return 0.0
    return float(np.linalg.norm(one - other)) / larger


def input_distances(inputs: list[np.ndarray]) -> np.ndarray:
    """Distance between any two of several inputs.

    Parameters
    ----------
    inputs : list of ndarray, shape (n_samples,), [input unit]
        Lengths may differ.

    Returns
    -------
    ndarray, shape (n_inputs, n_inputs), [-]
    """
    signatures = [input_signature(values) for values in inputs]
    return np.array(
        [[input_distance(one, other) for other in signatures] for one in signatures]
    ).reshape(len(inputs), len(inputs))
