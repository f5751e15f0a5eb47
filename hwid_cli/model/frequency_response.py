"""Frequency response, step response, poles and zeros of the linear block.

References
----------
docs/method.md, eq. (23).
"""

import numpy as np

from hwid_cli.model.linear_block import filtered, poles
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.report import FrequencyResponse, StepResponse

# Frequencies spread evenly on a logarithmic axis, [-]: a curve without corners.
_COUNT = 300
# A step response is shown until its slowest part has fallen to this share, and so much
# longer; and over so many samples at least and at most, [-], [samples].
_SETTLED, _LONGER, _LEAST_SAMPLES, _MOST_SAMPLES = 0.01, 1.3, 20, 4000


def frequency_response(
    model: HammersteinWiener, frequency_Hz: np.ndarray
) -> FrequencyResponse:
    """Response of the linear block, from w to x.

    Parameters
    ----------
    frequency_Hz : ndarray, shape (n,), [Hz]
        Rising; the phase is unwrapped along it.

    References
    ----------
    docs/method.md, eq. (23).

    Examples
    --------
    >>> from hwid_cli.records.model import StaticMap
    >>> none = StaticMap("none", np.zeros(0))
    >>> delay = HammersteinWiener(none, [1.0], [1.0], 1, none, 1e-3)
    >>> frequency_response(delay, np.array([250.0, 500.0])).phase_deg
    array([ -90., -180.])
    """
    angle = 2.0 * np.pi * frequency_Hz * model.sample_time_s
    backwards = np.exp(-1j * angle)
    # Rising powers of q^-1; polyval wants falling ones.
    ratio = np.polyval(model.numerator[::-1], backwards) / np.polyval(
        model.denominator[::-1], backwards
    )
    # The delay is added after unwrapping: its own phase may turn faster than the grid.
    phase = np.unwrap(np.angle(ratio)) - model.delay * angle
    return FrequencyResponse(frequency_Hz, np.abs(ratio), np.degrees(phase))


def response_frequencies(model: HammersteinWiener, lowest_Hz: float) -> np.ndarray:
    """Frequencies that show a linear block up to half the sampling frequency.

    Parameters
    ----------
    lowest_Hz : float, [Hz]
        Positive; a recording of T seconds tells nothing below 1/T.

    Returns
    -------
    ndarray, shape (n,), [Hz]
        Evenly spaced on a logarithmic axis, with more points around the poles: a lightly
        damped one is narrower than the spacing.
    """
    nyquist = 0.5 / model.sample_time_s
    lowest = min(lowest_Hz, 0.5 * nyquist)
    found = poles(model.denominator)
    peaks = np.abs(np.angle(found)) / (2.0 * np.pi * model.sample_time_s)
    widths = np.abs(1.0 - np.abs(found)) / (2.0 * np.pi * model.sample_time_s)
    around = peaks[:, None] + widths[:, None] * np.linspace(-3.0, 3.0, 13)
    every = np.concatenate([np.geomspace(lowest, nyquist, _COUNT), around.ravel()])
    return np.unique(every[(every >= lowest) & (every <= nyquist)])


def step_response(model: HammersteinWiener) -> StepResponse:
    """Response of the linear block to a unit step, from w to x, until it has settled.

    Examples
    --------
    >>> from hwid_cli.records.model import StaticMap
    >>> none = StaticMap("none", np.zeros(0))
    >>> model = HammersteinWiener(none, [0.5], [1.0, -0.5], 1, none, 1e-3)
    >>> step_response(model).value[:4]
    array([0.   , 0.5  , 0.75 , 0.875])
    """
    radius = max((abs(one) for one in poles(model.denominator)), default=0.0)
    count = float(_MOST_SAMPLES)
    if radius < 1.0:
        count = _LONGER * np.log(_SETTLED) / np.log(max(radius, _SETTLED))
    n_samples = int(np.clip(count, _LEAST_SAMPLES, _MOST_SAMPLES))
    n_samples += model.delay + model.numerator.size
    value = filtered(
        np.ones(n_samples), model.numerator, model.denominator, model.delay
    )
    return StepResponse(model.sample_time_s * np.arange(n_samples), value)


def zeros(numerator: np.ndarray) -> np.ndarray:
    """Zeros of the block, those at the origin that only delay left out.

    Parameters
    ----------
    numerator : ndarray, shape (nb,)

    Returns
    -------
    ndarray of complex, shape (at most nb - 1,)
        Sorted by magnitude, largest first, then by angle.
    """
    leading = np.trim_zeros(numerator, "f")
    return poles(leading / leading[0]) if leading.size > 1 else np.zeros(0, complex)
