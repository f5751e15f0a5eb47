"""Innovations of what noise of the input and of the output makes, by a second way."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.input_noise import whiteness_with_input_noise
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals
from hwid_cli.diagnosis.whitening_filters import noisy_drives, straight_drive
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import StandIn

STEP_S, N = 0.005, 240
HARD = StandIn(
    0.5, 1.5, 60.0, 4.0, quadratic_N_per_m2=-20.0, cubic_N_per_m3=900.0
)  # fmt: skip
SOFT = replace(HARD, quadratic_N_per_m2=0.0, cubic_N_per_m3=0.0)
WAY = 0.35 * np.sin(2 * np.pi * 0.9 * STEP_S * np.arange(N))


def drive_of(one, step_s=STEP_S):
    signals = Signals("r", "", 0 * WAY, WAY, 0 * WAY, WAY, step_s)
    return noisy_drives([one], [signals])[0]


def answers(one, step_s=STEP_S):
    """Reading of every sample to each sample's unit of input noise: a lower triangle.

    In 40 Euler steps a sample along the motion, its input a straight line between samples.
    """
    steps, way = 40, WAY
    stiffness = one.stiffness_N_per_m + 2 * one.quadratic_N_per_m2 * way
    stiffness = stiffness + 3 * one.cubic_N_per_m3 * way**2
    stiffness = stiffness + 0 * way
    found = np.zeros((N, N))
    noise = np.eye(N)
    x = v = np.zeros(N)
    h = step_s / steps
    for n in range(N):
        found[n] = x
        if n + 1 == N:
            break
        for j in range(steps):
            share = (j + 0.5) / steps
            u = (1 - share) * noise[n] + share * noise[n + 1]
            v = v + h * (4.0 * u - 1.5 * v - stiffness[n] * x) / 0.5
            x = x + h * v
    return found


# It pushes away at both ends of its way.
GIVES_WAY = replace(HARD, quadratic_N_per_m2=0.0, cubic_N_per_m3=-300.0)


# In the longer step a sample of the input moves its own reading, too.
@pytest.mark.parametrize(
    ("one", "step_s"),
    [
        (SOFT, STEP_S),
        (HARD, STEP_S),
        (GIVES_WAY, STEP_S),
        (SOFT, 10 * STEP_S),
        (HARD, 10 * STEP_S),
    ],
)
def test_innovations_are_those_of_the_whole_covariance(one, step_s):
    """Cholesky's factor of the covariance of all samples does the same at once."""
    strength = 2e4
    through = answers(one, step_s)
    whole = np.eye(N) + strength * through @ through.T
    factor = np.linalg.cholesky(whole)
    rng = np.random.default_rng(5)
    values = factor @ rng.standard_normal(N)
    expected = np.linalg.solve(factor, values)
    whitening = drive_of(one, step_s).whitening(strength)
    found = whitening(values)
    # The start apart: the filter begins as if the noise had always been there.
    n = N // 3
    np.testing.assert_allclose(found.values[n:], expected[n:], atol=0.02)
    assert found.log_variances == pytest.approx(
        2 * np.log(np.diag(factor)).sum(), rel=0.05
    )


LONG = 4000
NOISE, INPUT_NOISE = 1e-5, 0.02


def recording_of(seed):
    """A motion along the curved spring, and what noise of its input has moved it by."""
    rng = np.random.default_rng(seed)
    way = 0.4 * np.sin(2 * np.pi * (0.4 + 0.2 * seed) * STEP_S * np.arange(LONG))
    noise = INPUT_NOISE * rng.standard_normal(LONG)
    stiffness = HARD.stiffness_N_per_m - 40.0 * way + 2700.0 * way**2
    moved, x, v, steps = np.zeros(LONG), 0.0, 0.0, 20
    h = STEP_S / steps
    for n in range(LONG - 1):
        for j in range(steps):
            u = noise[n] + (j + 0.5) / steps * (noise[n + 1] - noise[n])
            v += h * (4.0 * u - 1.5 * v - stiffness[n] * x) / 0.5
            x += h * v
        moved[n + 1] = x
    sensor = NOISE * rng.standard_normal(LONG)
    signals = Signals(f"r{seed}", "", noise, way + sensor, noise, way + sensor, STEP_S)
    return signals, moved + sensor


@pytest.mark.parametrize(("one", "is_noise"), [(HARD, True), (SOFT, False)])
def test_noise_of_the_input_is_told_along_a_curved_spring(one, is_noise):
    signals, parts = zip(*(recording_of(seed) for seed in range(4)), strict=True)
    noise = NoiseFloor(
        NOISE, "differences", 0.0, False, (1.0,), "", input_rms=INPUT_NOISE
    )
    problem = DiagnosisProblem(signals, one)
    found = whiteness_with_input_noise(parts, problem, [one] * 4, noise)
    assert (found < 1) is is_noise


@pytest.mark.parametrize("one", [SOFT, HARD])
def test_how_far_noise_moves_the_reading(one):
    expected = np.mean(np.sum(answers(one) ** 2, axis=1))
    assert drive_of(one).moved(N)[0] == pytest.approx(expected, rel=0.05)


def test_a_spring_that_hardly_bends_is_one():
    little = replace(HARD, quadratic_N_per_m2=0.0, cubic_N_per_m3=1e-3)
    found = drive_of(little)
    straight = straight_drive(little, STEP_S)
    np.testing.assert_array_equal(found.a, straight.a)
    assert not hasattr(found, "tables")
    assert hasattr(drive_of(HARD), "tables")


def test_the_spring_is_that_of_the_samples_that_are_evaluated():
    signals = Signals("r", "", 0 * WAY, WAY, 0 * WAY, WAY, STEP_S, skip=90)
    (found,) = noisy_drives([HARD], [signals])
    (whole,) = noisy_drives([HARD], [replace(signals, skip=0)])
    assert found.at.size == N - 90
    np.testing.assert_allclose(found.at, whole.at[90:])
