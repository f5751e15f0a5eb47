import numpy as np
import pytest
from scipy import signal

from hwid_cli.model.frequency_response import (
    frequency_response,
    response_frequencies,
    zeros,
)
from hwid_cli.records.model import HammersteinWiener, StaticMap

NONE = StaticMap("none", np.zeros(0))
SAMPLE_TIME_S = 1e-3


def block(numerator, denominator, delay=1):
    return HammersteinWiener(NONE, numerator, denominator, delay, NONE, SAMPLE_TIME_S)


RESONANT = block([0.3, -0.1], np.real(np.poly(0.999 * np.exp([0.2j, -0.2j]))), delay=3)


def test_the_response_is_that_of_another_program():
    frequency = np.geomspace(1.0, 400.0, 50)
    found = frequency_response(RESONANT, frequency)

    coefficients = np.concatenate([np.zeros(3), RESONANT.numerator])
    _, expected = signal.freqz(
        coefficients, RESONANT.denominator, 2 * np.pi * frequency * SAMPLE_TIME_S
    )
    # Two ways of summing five terms.
    np.testing.assert_allclose(found.magnitude, np.abs(expected), rtol=1e-9)
    turn = np.exp(1j * np.radians(found.phase_deg))
    np.testing.assert_allclose(turn, expected / np.abs(expected), atol=1e-9)


def test_a_long_delay_does_not_confuse_the_phase():
    # One degree for each sample and 1/360 of the sampling frequency, on a grid on which
    # the phase turns by more than half a turn from point to point.
    found = frequency_response(block([1.0], [1.0], delay=90), np.array([10.0, 20, 40]))

    np.testing.assert_allclose(found.phase_deg, [-324.0, -648.0, -1296.0])


def test_frequencies_end_at_half_the_sampling_frequency():
    frequencies = response_frequencies(RESONANT, 0.5)

    assert frequencies[0] == 0.5
    assert frequencies[-1] == pytest.approx(500.0)
    assert (np.diff(frequencies) > 0).all()


def test_a_narrow_resonance_is_not_missed():
    frequencies = response_frequencies(RESONANT, 0.5)
    peak = frequency_response(RESONANT, frequencies).magnitude.max()
    fine = frequency_response(RESONANT, np.linspace(25.0, 40.0, 20_001))

    # The top of the peak is flat over a tenth of its width.
    assert peak == pytest.approx(fine.magnitude.max(), rel=0.02)


@pytest.mark.parametrize(
    ("numerator", "expected"),
    [([1.0, -0.5], [0.5]), ([0.0, 2.0, 1.0], [-0.5]), ([3.0], []), ([0.0, 1.0], [])],
)
def test_zeros_are_those_of_the_numerator(numerator, expected):
    np.testing.assert_allclose(zeros(np.array(numerator)), expected)
