"""Noise floor and whiteness without a model, against noise that is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.diagnosis.noise import (
    _without_common_motion,
    noise_floor,
    noise_levels,
)
from hwid_cli.diagnosis.whiteness import whiteness
from hwid_cli.drive.simulation import simulate_drive
from tests.diagnosis.diagnosed import (
    DRIVE,
    FULL_SCALE,
    SAMPLE_TIME_S,
    inputs,
    problem_of,
    white,
)
from tests.diagnosis.small_drive import problem, recordings

# Correlation over 20 samples.
PHI = float(np.exp(-1 / 20))


@pytest.fixture(scope="module")
def driven_by():
    return list(inputs().values())


@pytest.fixture(scope="module")
def motions(driven_by):
    return [
        simulate_drive(u, DRIVE, sample_time_s=SAMPLE_TIME_S).output for u in driven_by
    ]


def slow_noise(rng, size, rms):
    waves = rng.normal(0, np.sqrt(1 - PHI**2), size + 500)
    return rms * lfilter([1.0], [1.0, -PHI], waves)[500:]


def mixed_noise(rng, size, rms):
    """Half of the power slow, half white."""
    half = rms * np.sqrt(0.5)
    return slow_noise(rng, size, half) + rng.normal(0, half, size)


@pytest.mark.parametrize("share", [0.001, 0.01, 0.03])
def test_white_noise_is_read_within_two_percent(motions, driven_by, share):
    rng = np.random.default_rng(0)
    sigma = share * FULL_SCALE
    measured = [y + rng.normal(0, sigma, y.size) for y in motions]

    noise = noise_floor(problem_of(measured, driven_by))

    # 39 000 sixth differences: one standard error is 0.64 %.
    assert noise.rms == pytest.approx(sigma, rel=0.02)
    assert noise.method == "differences"
    assert noise.whitening == (1.0,)
    assert "white noise" in noise.sentence


def test_single_jumps_are_no_noise(motions, driven_by):
    rng = np.random.default_rng(1)
    measured = [y + rng.normal(0, 1e-5, y.size) for y in motions]
    measured = [np.where(np.arange(y.size) == 700, y + 1e-2, y) for y in measured]

    # Without the rest, which would tell as well.
    moving = slice(101, None)
    noise = noise_floor(
        problem_of([y[moving] for y in measured], [u[moving] for u in driven_by])
    )

    # As above, and the 13 samples around a jump that are lost are 1 % of all.
    assert noise.rms == pytest.approx(1e-5, rel=0.02)


def test_without_noise_there_is_next_to_none_and_no_nan(motions, driven_by):
    noise = noise_floor(problem_of(motions, driven_by))

    # Far below what a double resolves of 28 mm.
    assert 0 <= noise.rms < 1e-15
    assert not noise.is_coloured


def test_constant_recordings_have_no_noise():
    noise = noise_floor(problem_of([np.ones(50)] * 4, [np.zeros(50)] * 4))

    assert noise.rms == 0
    assert noise.resolution == 0
    assert noise.sentence.startswith("no noise")


@pytest.mark.thorough
def test_slow_noise_is_read_from_the_rest(motions, driven_by):
    found = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        measured = [y + mixed_noise(rng, y.size, 2.8e-4) for y in motions]
        noise = noise_floor(problem_of(measured, driven_by))
        assert noise.method == "rest"
        assert noise.is_coloured
        found.append(noise.rms / 2.8e-4)

    # 27 rests of 100 samples hold 70 independent values of the slow half: one standard
    # error is 4 %, and the common mean costs 1 %. Differences alone read 0.71.
    assert np.max(np.abs(np.array(found) - 1)) < 0.15
    assert np.mean(found) == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize("step_share", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("noise_share", [0.0, 0.2, 0.4])
def test_a_coarse_sensor_is_recognised(motions, driven_by, step_share, noise_share):
    rng = np.random.default_rng(2)
    step = step_share * FULL_SCALE
    measured = [
        step * np.round((y + rng.normal(0, noise_share * step, y.size)) / step)
        for y in motions
    ]

    noise = noise_floor(problem_of(measured, driven_by))

    assert noise.resolution == pytest.approx(step, rel=1e-6)
    # Rounding and the noise before it add up; slow recordings rest on one level and
    # show less of the noise, by up to 5 %.
    expected = step * np.sqrt(1 / 12 + noise_share**2)
    assert noise.rms == pytest.approx(expected, rel=0.06)
    assert "steps of" in noise.sentence


def fast_motions(n_samples=1000, n_recordings=6):
    """Inputs, and motions so fast that hardly a level of a grid is met twice, [m]."""
    times = 1e-3 * np.arange(n_samples)
    inputs, motions = [], []
    for number in range(n_recordings):
        start = 0.1 * (times > 0.08) * (times - 0.08)
        phase = 2 * np.pi * (1.1 + 0.23 * number)
        inputs.append(np.where(times > 0.08, 1.0 + number, 0.0))
        motions.append(start * (1 + np.sin(phase * times)) * (3 + number))
    return inputs, motions


def test_a_grid_is_seen_where_a_fast_motion_meets_no_level_twice():
    step = 2e-5
    inputs, motions = fast_motions()
    rng = np.random.default_rng(12)
    measured = [
        step * np.round((y + rng.normal(0, 0.2 * step, y.size)) / step) for y in motions
    ]
    moving = [np.unique(y).size / y.size for y in measured]
    assert np.median(moving) > 0.75

    noise = noise_floor(problem_of(measured, inputs))

    assert noise.resolution == pytest.approx(step, rel=1e-6)
    # Rounding and the noise before it; one standard error of six recordings is 2 %.
    assert noise.rms == pytest.approx(step * np.sqrt(1 / 12 + 0.04), rel=0.06)


def test_multiples_of_a_motion_without_noise_are_no_grid():
    times = np.arange(1000.0)
    # Way under a constant force: its distances are 1, 3, 5, ... times the first one.
    forces = [np.full(1000, 1.0 + number) for number in range(5)]
    measured = [1e-6 * force * times**2 for force in forces]

    noise = noise_floor(problem_of(measured, forces))

    assert noise.resolution == 0
    # What doubles resolve of 5 m.
    assert noise.rms < 1e-14


def test_a_rest_on_one_level_is_no_noise_below_the_grid():
    step = 2e-5
    inputs, motions = fast_motions()
    rng = np.random.default_rng(13)
    # The motion shakes the sensor; at rest the reading hardly leaves its level.
    size = [np.where(u == 0.0, 0.2, 2.5) * step for u in inputs]
    measured = [
        step * np.round((y + rng.normal(0, 1, y.size) * one) / step)
        for y, one in zip(motions, size, strict=True)
    ]

    noise = noise_floor(problem_of(measured, inputs))

    assert noise.rms >= step / np.sqrt(12)


def test_noise_above_the_grid_is_noise(motions, driven_by):
    rng = np.random.default_rng(3)
    step = 1e-5
    measured = [
        step * np.round((y + rng.normal(0, 2 * step, y.size)) / step) for y in motions
    ]

    noise = noise_floor(problem_of(measured, driven_by))

    assert noise.resolution == 0
    assert noise.rms == pytest.approx(step * np.sqrt(4 + 1 / 12), rel=0.02)


@pytest.mark.thorough
def test_repeats_that_drift_show_their_noise_alone(motions, driven_by):
    rng = np.random.default_rng(4)
    ramp = np.linspace(-1, 1, motions[0].size)
    measured, repeated = [], []
    for u, y in list(zip(driven_by, motions, strict=True))[:6]:
        for _ in range(3):
            drift = rng.normal(0, 1e-3) + rng.normal(0, 1e-3) * ramp
            measured.append(y + drift + rng.normal(0, 1e-5, y.size))
            repeated.append(u)

    noise = noise_floor(problem_of(measured, repeated))

    # 6 groups x 2 degrees of freedom x 1450 samples: one standard error is 0.5 %.
    assert noise.method == "repeats"
    assert noise.rms == pytest.approx(1e-5, rel=0.02)
    assert not noise.is_coloured


@pytest.mark.thorough
def test_repeats_show_slow_noise(motions, driven_by):
    rng = np.random.default_rng(5)
    pairs = [(u, y) for u, y in zip(driven_by, motions, strict=True) for _ in range(2)]
    measured = [y + mixed_noise(rng, y.size, 1e-4) for _, y in pairs]

    noise = noise_floor(problem_of(measured, [u for u, _ in pairs]))

    assert noise.method == "repeats"
    assert noise.is_coloured
    # A line taken off 1450 samples takes 5 % of the slow half.
    assert noise.rms == pytest.approx(1e-4, rel=0.06)


@pytest.mark.thorough
def test_repeats_that_move_differently_are_no_noise(motions, driven_by):
    rng = np.random.default_rng(6)
    measured, repeated = [], []
    for u, y in zip(driven_by, motions, strict=True):
        for gain in (0.97, 1.03):
            measured.append(gain * y + rng.normal(0, 1e-5, y.size))
            repeated.append(u)

    noise = noise_floor(problem_of(measured, repeated))

    assert noise.method == "differences"
    assert noise.rms == pytest.approx(1e-5, rel=0.02)


def test_a_periodic_force_at_rest_is_no_noise(motions, driven_by):
    rng = np.random.default_rng(7)
    t = SAMPLE_TIME_S * np.arange(motions[0].size)
    measured = [
        y
        + 3e-4 * np.sin(2 * np.pi * 17.3 * t + rng.uniform(0, 2 * np.pi))
        + rng.normal(0, 1e-4, y.size)
        for y in motions
    ]

    noise = noise_floor(problem_of(measured, driven_by))

    assert not noise.is_coloured
    assert noise.rms == pytest.approx(1e-4, rel=0.02)


def test_a_swing_while_the_input_stands_is_no_noise(motions, driven_by):
    rng = np.random.default_rng(8)
    t = SAMPLE_TIME_S * np.arange(motions[0].size)
    swing = 1e-3 * np.exp(-5 * t) * np.cos(60 * t)
    measured = [
        y + (swing if number % 3 else 0.0) + rng.normal(0, 1e-5, y.size)
        for number, y in enumerate(motions)
    ]
    given = problem_of(measured, driven_by)

    noise = noise_floor(replace(given, start="estimated"))

    assert not noise.is_coloured
    assert noise.rms == pytest.approx(1e-5, rel=0.05)
    # A user who says that all is at rest is believed.
    assert noise_floor(given).rms > 1e-4


@pytest.mark.thorough
@pytest.mark.parametrize(
    "count", [100, pytest.param(300, marks=pytest.mark.slow)], ids=["few", "many"]
)
def test_white_residuals_raise_a_false_alarm_in_less_than_one_percent(driven_by, count):
    noise, found = white(1.0), []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        found.append(whiteness([rng.normal(size=u.size) for u in driven_by], noise))

    # 0.1 % by design: more than 3 of 300 has a chance of 3e-4.
    assert np.mean(np.array(found) > 1) <= 0.01
    # The middle of chi squared of 30 over its 99.9 % quantile is 29.3 / 59.7.
    assert np.median(found) == pytest.approx(0.491, abs=0.03)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seeds", "most"),
    # Over 120 seeds 0 and 1 were above 1; two of 60 are more than chance at 1 %.
    [(range(6), 0), pytest.param(range(60), 2, marks=pytest.mark.slow)],
    ids=["few", "many"],
)
@pytest.mark.parametrize("make", [slow_noise, mixed_noise])
def test_residuals_of_slow_noise_pass_after_the_estimated_whitening(
    motions, driven_by, make, seeds, most
):
    found = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        parts = [make(rng, y.size, 3e-4) for y in motions]
        measured = [y + part for y, part in zip(motions, parts, strict=True)]
        noise = noise_floor(problem_of(measured, driven_by))
        found.append(whiteness(parts, noise))

    assert np.sum(np.array(found) > 1) <= most
    assert np.median(found) == pytest.approx(0.5, abs=0.1)


def test_a_coarse_sensor_leaves_nothing_where_the_motion_is_right(motions, driven_by):
    step = 0.01 * FULL_SCALE
    measured = [step * np.round(y / step) for y in motions]
    noise = noise_floor(problem_of(measured, driven_by))
    right = [a - b for a, b in zip(measured, motions, strict=True)]
    wrong = [a - 1.03 * b for a, b in zip(measured, motions, strict=True)]

    assert whiteness(right, noise) < 1
    assert whiteness(right, white(noise.rms)) > 1
    # The error of 3 % is at most 3 steps.
    assert whiteness(wrong, noise) > 1


def test_what_is_missing_is_seen_far_below_the_noise(motions, driven_by):
    rng = np.random.default_rng(8)
    parts = [rng.normal(0, 1e-3, y.size) + 0.02 * y for y in motions]

    # The RMS is up by less than 3 %.
    rms = np.sqrt(np.mean(np.concatenate(parts) ** 2))
    assert rms < 1.03e-3
    assert whiteness(parts, white(1e-3)) > 1


def test_whiteness_of_what_is_not_finite_is_infinite():
    assert whiteness([np.array([1.0, np.nan])], white(1.0)) == np.inf
    assert whiteness([np.array([1.0, np.inf])], white(1.0)) == np.inf


def test_whiteness_of_nothing_is_zero():
    assert whiteness([np.zeros(100)], white(0.0)) == 0
    assert whiteness([], white(1.0)) == 0


@pytest.mark.thorough
def test_noise_that_differs_between_recordings_is_white_as_often_as_alike_noise():
    # One recording in eight is thirty times as noisy: pooled by size, its samples alone
    # would speak, and their chance correlations would count eight times too much.
    rng = np.random.default_rng(5)
    sizes = [30.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    floor = white(1.0)
    found = [
        whiteness([size * rng.standard_normal(300) for size in sizes], floor)
        for _ in range(300)
    ]
    # 0.1 % by design.
    assert np.mean(np.array(found) > 1.0) <= 0.01
    assert 0.4 < np.median(found) < 0.6


def test_what_remains_in_one_quiet_recording_is_seen():
    rng = np.random.default_rng(6)
    pieces = [30.0 * rng.standard_normal(300) for _ in range(7)]
    hum = np.sin(2 * np.pi * 0.05 * np.arange(300))
    assert whiteness([*pieces, rng.standard_normal(300) + 2 * hum], white(1.0)) > 1.5


def test_levels_of_noise_are_those_of_the_recordings():
    noises = (2e-5, 2e-5, 8e-5, 2e-5, 2e-5, 2e-5, 2e-5, 2e-5, 4e-6)
    given = [recordings(noise=noise, seed=3 + n)[n] for n, noise in enumerate(noises)]
    of = problem(given)
    floor = noise_floor(of)
    true = np.array(noises) / np.sqrt(np.mean(np.square(noises)))
    assert noise_levels(of, floor) == pytest.approx(true, rel=0.25)
    assert floor.rms == pytest.approx(np.sqrt(np.mean(np.square(noises))), rel=0.1)
    alike = problem(recordings())
    np.testing.assert_array_equal(noise_levels(alike, noise_floor(alike)), 1.0)


@pytest.mark.parametrize("rounded", [None, 3])
def test_steps_and_corners_of_a_command_are_no_noise_of_the_input(rounded):
    # Held levels, ramps and sines as a generator makes them, each step far above a noise.
    time = SAMPLE_TIME_S * np.arange(1000)
    commands = [
        np.repeat(np.random.default_rng(2).uniform(-3, 3, 20), 50),
        np.interp(time, [0.0, 0.3, 0.6, 1.0], [0.0, 2.0, -2.0, 0.0]),
        2.0 * np.sin(30.0 * time),
    ]
    if rounded is not None:
        # As files hold them: at most half a step of 1e-3 A is an error.
        commands = [np.round(one, rounded) for one in commands]
    found = noise_floor(problem_of([np.sin(one) for one in commands], commands))
    assert found.input_rms <= (1e-9 if rounded is None else 1e-3)


def test_noise_of_an_input_in_steps_is_read():
    rng = np.random.default_rng(3)
    levels = [np.repeat(rng.uniform(-3, 3, 20), 50) for _ in range(4)]
    read = [one + 0.02 * rng.standard_normal(one.size) for one in levels]
    found = noise_floor(problem_of([np.sin(one) for one in levels], read))
    # The smallest of the steps are below the limit of jumps, and make it more.
    assert 0.02 <= found.input_rms <= 1.2 * 0.02


@pytest.mark.parametrize("is_common", [True, False])
def test_a_motion_that_all_rests_begin_with_is_no_noise(is_common):
    """A brake lets go at the first sample, and the load settles before anything moves."""
    rng = np.random.default_rng(9)
    of = problem(recordings({}, noise=0.0))
    time = np.arange(60)
    signals = []
    for one in of.signals:
        n = one.driven_by.size + time.size
        size = 1.0 if is_common else rng.uniform(-2.0, 2.0)
        sag = 2e-3 * size * (1 - np.exp(-np.arange(n) / 20))
        moved = np.r_[np.zeros(time.size), one.compared] + sag
        output = moved + 2e-5 * rng.standard_normal(n)
        u = np.r_[np.zeros(time.size), one.driven_by]
        signals.append(
            replace(one, driven_by=u, input=u, output=output, compared=output)
        )
    found = noise_floor(replace(of, signals=tuple(signals)))
    if is_common:
        assert found.rms == pytest.approx(2e-5, rel=0.3)
    else:
        # Each its own: slow noise looks like that.
        assert found.method == "rest"
        assert found.rms > 2e-4


def test_slow_noise_of_few_rests_hardly_ever_passes_for_a_common_motion():
    rng = np.random.default_rng(0)
    taken = 0
    for _ in range(300):
        shocks = rng.standard_normal((3, 340))
        slow = list(lfilter([1.0], [1.0, -0.99], shocks, axis=1)[:, 300:])
        taken += _without_common_motion(slow) is not slow
    # By their RMS alone it is one of twenty.
    assert taken <= 7


def on_a_grid(outputs, step):
    return [step * np.round(one / step) for one in outputs]


def test_slow_noise_on_a_coarse_grid_is_read_from_the_rest(motions, driven_by):
    """A resolver that wanders, read by an encoder: the grid is the smaller part."""
    rng = np.random.default_rng(5)
    step = 0.02 * FULL_SCALE
    noisy = [y + slow_noise(rng, y.size, 1.2 * step) for y in motions]
    noise = noise_floor(problem_of(on_a_grid(noisy, step), driven_by))
    assert (noise.method, noise.is_coloured) == ("rest", True)
    assert noise.rms == pytest.approx(1.2 * step, rel=0.2)
    assert noise.resolution == pytest.approx(step)


def test_a_reading_that_jumps_between_two_values_at_rest_shows_its_grid_alone(
    motions, driven_by
):
    """Slow noise far below the step looks slow and large where it crosses one."""
    rng = np.random.default_rng(6)
    step = 0.02 * FULL_SCALE
    noisy = [0.5 * step + y + slow_noise(rng, y.size, 0.1 * step) for y in motions]
    noise = noise_floor(problem_of(on_a_grid(noisy, step), driven_by))
    assert noise.rms == pytest.approx(step / np.sqrt(12), rel=0.2)
