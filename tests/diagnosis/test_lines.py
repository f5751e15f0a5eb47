"""Lines of an error, in time and along the way."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.problem import Compared
from hwid_cli.diagnosis.scales import line_frequencies, line_share, waves_along
from tests.diagnosis.small_drive import STEP_S, problem, white

TIME = STEP_S * np.arange(400)


def compared(residuals):
    """Recordings of which a simulation leaves given residuals."""
    signals = problem().signals
    return [
        Compared(one, one.compared - left, one.output, np.gradient(one.output, STEP_S))
        for one, left in zip(signals, residuals, strict=False)
    ]


def test_a_line_takes_its_share_whatever_its_phases():
    rng = np.random.default_rng(5)
    left = [
        np.sin(2 * np.pi * 31 * TIME + phase) + 0.5 * rng.standard_normal(400)
        for phase in range(9)
    ]
    pairs = compared(left)
    (frequency, *_) = line_frequencies(pairs, white(0.5))
    assert frequency == pytest.approx(31, abs=0.3)
    # 1/2 against 1/2 + 1/4.
    assert line_share(pairs, frequency) == pytest.approx(2 / 3, abs=0.03)


def test_slow_noise_has_no_line():
    rng = np.random.default_rng(6)
    left = [np.cumsum(rng.standard_normal(400)) for _ in range(9)]
    slow = [one - np.convolve(one, np.ones(50) / 50, "same") for one in left]
    pairs = compared(slow)
    assert line_share(pairs, line_frequencies(pairs, white(1.0))[0]) < 0.2


def test_nothing_has_no_line():
    assert line_share(compared([np.zeros(400)] * 3), 20.0) == 0.0


@pytest.mark.parametrize(("period", "phase"), [(0.0019, 0.4), (0.0031, -2.5)])
def test_a_force_that_repeats_along_the_way_is_read_off(period, phase):
    pairs = compared([np.zeros(400)] * 9)
    rng = np.random.default_rng(7)
    smoothed = []
    for one in pairs:
        force = 0.7 * np.sin(2 * np.pi * one.position / period + phase)
        # Something slow beside it, and noise.
        force += 30.0 * one.position + 0.1 * rng.standard_normal(400)
        smoothed.append(Smoothed(force, one.position, one.velocity, 0 * force))
    best = waves_along(pairs, smoothed)[0]

    assert best.period_m == pytest.approx(period, rel=2e-3)
    assert best.amplitude_N == pytest.approx(0.7, rel=0.1)
    apart = np.angle(np.exp(1j * (best.phase_rad - phase)))
    assert abs(apart) < 0.2


def test_without_motion_nothing_repeats():
    (one,) = compared([np.zeros(400)])[:1]
    still = Smoothed(np.ones(400), np.zeros(400), np.zeros(400), np.zeros(400))
    assert waves_along([replace(one, position=np.zeros(400))], [still]) == ()
