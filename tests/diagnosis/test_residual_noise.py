"""Noise that only what a base leaves can show: no hidden effect may be taken for it."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.residual_noise import residual_noise
from hwid_cli.diagnosis.whiteness import whiteness
from tests.diagnosis.noisy_plants import (
    NOISE,
    SIZES,
    STEP_S,
    base_of,
    recordings,
)
from tests.diagnosis.small_drive import simulation
from tests.stages.diagnosed_drive import diagnosed

PLANTS = list(SIZES)
LOOPS = [one for one in PLANTS if one[1]]


def rms(compared):
    return np.sqrt(np.mean(np.concatenate([one.residual for one in compared]) ** 2))


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.thorough)])
@pytest.mark.parametrize(
    "coefficient",
    [0.3, 0.9, *(pytest.param(one, marks=pytest.mark.thorough) for one in (0.5, 0.7))],
)
@pytest.mark.parametrize(("spring", "loop"), LOOPS)
def test_coloured_noise_under_a_controller_is_told(spring, loop, coefficient, seed):
    found = recordings(spring=spring, loop=loop, coefficient=coefficient, seed=seed)
    _, compared, before = base_of(found, spring=spring, loop=loop)
    parts = [one.residual for one in compared]
    # The false alarm: differences take the noise for smaller than it is.
    assert before.method == "differences"
    assert rms(compared) > 1.25 * before.rms
    assert whiteness(parts, before) > 5.0

    noise = residual_noise(compared, before, "m")

    assert noise.method == "residuals"
    assert noise.is_coloured
    # 7200 samples, of which a hundred and more go together at 0.9.
    assert noise.rms == pytest.approx(NOISE, rel=0.06)
    assert -noise.whitening[1] == pytest.approx(coefficient, abs=0.05)
    assert whiteness(parts, noise) <= 1.0
    assert "coloured noise of" in noise.sentence
    assert "neighbouring samples correlate by 0." in noise.sentence


@pytest.mark.parametrize("coefficient", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("spring", [True, False])
def test_where_a_rest_tells_the_colour_residuals_are_not_asked(spring, coefficient):
    found = recordings(spring=spring, coefficient=coefficient)
    _, compared, noise = base_of(found, spring=spring)
    assert noise.method == "rest"
    assert whiteness([one.residual for one in compared], noise) <= 1.0
    assert residual_noise(compared, noise, "m") is None


@pytest.mark.parametrize("hides", SIZES[True, True])
@pytest.mark.parametrize(("spring", "loop", "coefficient"),
    [(*one, 0.0) for one in PLANTS]
    + [pytest.param(*one, 0.5, marks=pytest.mark.thorough) for one in LOOPS])  # fmt: skip
def test_what_a_small_hidden_effect_leaves_is_no_noise(
    spring, loop, coefficient, hides
):
    found = recordings(
        hides, SIZES[spring, loop][hides], spring=spring, loop=loop,
        coefficient=coefficient,
    )  # fmt: skip
    _, compared, noise = base_of(found, spring=spring, loop=loop)
    assert noise.method == "differences"
    assert 1.2 < rms(compared) / NOISE < 3.0
    assert residual_noise(compared, noise, "m") is None


@pytest.fixture(scope="module")
def noisy():
    """A base beside recordings that lack nothing, and their noise."""
    _, compared, noise = base_of(
        recordings(loop=True, coefficient=0.5), spring=True, loop=True
    )
    assert residual_noise(compared, noise, "m") is not None
    return compared, noise


def with_more(compared, more):
    """The same with something more in what is measured, by recording and time."""
    time = STEP_S * np.arange(compared[0].simulated.size)
    return [
        replace(one, signals=replace(
            one.signals, compared=one.signals.compared + more(row, one, time)))
        for row, one in enumerate(compared)
    ]  # fmt: skip


@pytest.mark.parametrize(
    "more",
    [
        # Larger in one recording, in one part of all, as a line, and with the motion.
        lambda row, one, time: 0.5 * one.residual if row == 4 else 0.0,
        lambda row, one, time: np.where(time > 0.6, 0.3 * one.residual, 0.0),
        lambda row, one, time: NOISE * np.sin(2 * np.pi * 50.0 * time + row),
        lambda row, one, time: 0.2 * NOISE * np.sign(one.velocity),
        lambda row, one, time: NOISE * (one.position / 5e-3) ** 2,
    ],
)
def test_noise_is_alike_everywhere_and_goes_with_nothing(noisy, more):
    compared, noise = noisy
    assert residual_noise(with_more(compared, more), noise, "m") is None


def test_noise_that_is_known_is_not_found_again(noisy):
    compared, noise = noisy
    for known in (replace(noise, method="repeats"), replace(noise, resolution=NOISE)):
        assert residual_noise(compared, known, "m") is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_white_noise_that_grows_after_the_rest_is_told(seed):
    _, compared, before = base_of(recordings(grows=4.0, seed=seed))
    # The false alarm: the rest is quieter than what follows.
    assert before.method == "rest"
    assert rms(compared) > 2.0 * before.rms
    noise = residual_noise(compared, before, "m")
    # Mean square of 1 to 4 times: 7.
    assert noise.rms == pytest.approx(NOISE * np.sqrt(7.0), rel=0.04)
    assert (noise.method, noise.is_coloured) == ("differences", False)
    assert f"shows {before.rms:.2g} m" in noise.sentence


@pytest.mark.parametrize("times", [1.0, pytest.param(3.0, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("hides", SIZES[True, False])
def test_what_a_hidden_effect_leaves_beside_growing_noise_is_no_noise(hides, times):
    found = recordings(hides, times * SIZES[True, False][hides], grows=4.0)
    _, compared, before = base_of(found)
    assert before.method == "rest"
    assert residual_noise(compared, before, "m") is None


@pytest.mark.parametrize(
    "more",
    [
        # A hum that differences see as well, and knocks, which they take for jumps.
        lambda row, one, time: NOISE * np.sin(2 * np.pi * 390.0 * time) * (time > 0.04),
        lambda row, one, time: 20 * NOISE * (np.arange(time.size) % 97 == 96),
    ],
)
def test_what_is_fast_beside_growing_noise_is_no_noise(more):
    _, compared, before = base_of(recordings(grows=4.0))
    assert residual_noise(compared, before, "m") is not None
    assert residual_noise(with_more(compared, more), before, "m") is None


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [0.5, 0.9])
def test_a_clean_machine_with_coloured_noise_in_its_loop_lacks_nothing(coefficient):
    found = diagnosed(
        recordings(spring=False, loop=True, coefficient=coefficient),
        simulation(
            stiffness_N_per_m=0.0, damping_N_s_per_m=16.0, hold="zero"
        ),
        effects=None, laws="auto",
    )  # fmt: skip
    assert (found.verdict, found.complete) == ("parameters", True), found.summary
    assert found.noise.method == "residuals"
    assert not found.next_experiment.input
    assert "coloured noise" in found.summary
    assert found.after.ratio_to_noise == pytest.approx(1.0, abs=0.05)


@pytest.mark.thorough
@pytest.mark.parametrize("hides", ["mount", "eddy"])
def test_a_hidden_effect_beside_coloured_noise_is_not_complete(hides):
    found = diagnosed(
        recordings(
            hides, SIZES[False, True][hides], spring=False, loop=True, coefficient=0.5
        ),
        simulation(stiffness_N_per_m=0.0, hold="zero"),
        effects=("sensor_saturation", "rate_limit"), laws="never",
    )  # fmt: skip
    assert found.verdict == "unknown", found.summary
    assert not found.complete
