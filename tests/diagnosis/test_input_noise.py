"""Noise of the measured input: behind its filter, and in fits."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import solve_triangular, toeplitz
from scipy.optimize import least_squares, minimize_scalar
from scipy.signal import cont2discrete, dlsim, lfilter

from hwid_cli.diagnosis import input_noise as noise_of_input
from hwid_cli.diagnosis.causes import left_over
from hwid_cli.diagnosis.input_noise import (
    fit_with_input_noise,
    may_be_input_noise,
    whiteness_with_input_noise,
)
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.parameters import (
    drive_at,
    drives_at,
    first_point,
    parameter_layout,
    residuals_at,
)
from hwid_cli.diagnosis.whiteness import portmanteau, whiteness
from hwid_cli.diagnosis.whitening_filters import straight_drive
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.drive import Controller, StandIn
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    STEP_S,
    N,
    fit,
    problem,
    recordings,
    sizes,
    white,
)

# Noise of the input that moves the drive by about twice the noise of its sensor.
INPUT_NOISE = 0.05


def answer_to_a_pulse(drive=DRIVE):
    """Of the drive to one sample of the input, by another route: a textbook's model."""
    k, c, m = drive.stiffness_N_per_m, drive.damping_N_s_per_m, drive.mass_kg
    model = (
        np.array([[0.0, 1.0], [-k / m, -c / m]]),
        np.array([[0.0], [drive.force_constant_N_per_A / m]]),
        np.array([[0.0, 1.0] if drive.output == "velocity" else [1.0, 0.0]]),
        np.array([[0.0]]),
    )
    found = cont2discrete(model, STEP_S, "zoh" if drive.hold == "zero" else "foh")
    pulse = np.zeros(N)
    pulse[0] = 1.0
    return dlsim((*found[:4], STEP_S), pulse)[1][:, 0]


PULSE = answer_to_a_pulse()


def factor_of_the_noise(pulse, input_noise):
    """Lower factor of the covariance of a residual of N samples."""
    transfer = toeplitz(pulse, np.zeros(N))
    return np.linalg.cholesky(
        NOISE**2 * np.eye(N) + input_noise**2 * transfer @ transfer.T
    )


def moved_by_input_noise(seed, count=9, pulse=PULSE):
    """What noise of the input leaves, by convolution, with that of the sensor."""
    rng = np.random.default_rng(seed)
    return [
        np.convolve(pulse, INPUT_NOISE * rng.standard_normal(N))[:N]
        + NOISE * rng.standard_normal(N)
        for _ in range(count)
    ]


def alike(of):
    """As much noise in every recording."""
    return noise_of_input._Levels(np.ones(len(of.signals)), np.ones(len(of.signals)))


def innovations_by_factors(parts, pulse):
    """By another route: the covariance of the residual, inverted by its factors.

    The size of the input's noise is the most probable one, that of the output's free.
    """

    def free(power):
        factor = factor_of_the_noise(pulse, np.exp(power) * INPUT_NOISE)
        return factor, solve_triangular(factor, np.column_stack(parts), lower=True)

    def unlikely(power):
        factor, found = free(power)
        logs = 2 * len(parts) * np.sum(np.log(np.diag(factor)))
        return found.size * np.log(np.mean(found**2)) + logs

    best = minimize_scalar(unlikely, bounds=(-3.0, 0.26), method="bounded")
    return list(free(best.x)[1].T)


def each(of):
    """The drive of each recording."""
    return [of.drive] * len(of.signals)


def floor(input_rms=INPUT_NOISE):
    return replace(white(), input_rms=input_rms)


@pytest.fixture(scope="module")
def of():
    return problem()


@pytest.mark.parametrize("seed", range(4))
def test_what_noise_of_the_input_leaves_is_white_behind_the_filter(of, seed):
    parts = moved_by_input_noise(seed)
    found = whiteness_with_input_noise(parts, of, each(of), floor())
    free = innovations_by_factors(parts, PULSE)
    expected = portmanteau(free, (1.0,), n_lags=30)

    assert whiteness(parts, floor()) > 100
    assert expected < 1
    # The filter is that of a noise that has lasted for ever, the covariance that of one
    # from the first sample.
    assert found == pytest.approx(expected, abs=0.02)


FREE = {"stiffness_N_per_m": 0.0}


@pytest.mark.parametrize(
    "changes",
    [
        {"hold": "zero"},
        {"output": "velocity"},
        {"output": "velocity", **FREE},
        {"output": "velocity", "hold": "zero", **FREE},
        FREE,
    ],
)
def test_the_filter_is_that_of_any_reading_and_command(of, changes):
    drive = replace(of.drive, **changes)
    pulse = answer_to_a_pulse(drive)
    # Noise of the input that moves the reading about as much as the sensor's does.
    pulse *= NOISE / INPUT_NOISE / np.sqrt(np.mean(np.cumsum(pulse**2)))
    gain = pulse[5] / answer_to_a_pulse(drive)[5]
    push = gain * drive.force_constant_N_per_A
    drive = replace(drive, force_constant_N_per_A=push)
    parts = moved_by_input_noise(3, pulse=pulse)
    found = whiteness_with_input_noise(parts, of, [drive] * len(parts), floor())
    expected = portmanteau(innovations_by_factors(parts, pulse), (1.0,), n_lags=30)
    assert expected < 1
    assert found == pytest.approx(expected, abs=0.04)
    moved, _ = straight_drive(drive, STEP_S).moved(N)
    by_pulse = np.sum(pulse**2 * (1 - np.arange(N) / N))
    assert moved == pytest.approx(by_pulse, rel=1e-3)


@pytest.mark.parametrize("share", [0.5, 0.0])
def test_an_input_that_shows_less_noise_is_not_the_cause(of, share):
    parts = moved_by_input_noise(1)
    noise = floor(share * INPUT_NOISE)
    assert whiteness_with_input_noise(parts, of, each(of), noise) == np.inf


def colored(parts):
    """The same with neighbours that go together a little: behind the filter as well."""
    return [lfilter([1.0, 0.16], [1.0], one) for one in parts]


def test_noise_of_the_size_that_the_input_shows_may_be_a_little_coloured(of):
    parts = colored(moved_by_input_noise(1))
    alike = whiteness_with_input_noise(parts, of, each(of), floor())
    # A fast command looks like noise as well: the size is no evidence then.
    louder = whiteness_with_input_noise(parts, of, each(of), floor(2 * INPUT_NOISE))
    assert alike < 1 < louder
    assert louder == pytest.approx(6 * alike, rel=0.05)


def test_a_fast_command_shows_its_noise_where_it_rests(of):
    rng = np.random.default_rng(4)
    noise = INPUT_NOISE * rng.standard_normal(N)
    fast = np.r_[np.zeros(N // 4), rng.standard_normal(N - N // 4)]
    signals = [replace(one, driven_by=noise + fast) for one in of.signals]
    parts = colored(moved_by_input_noise(1))
    resting = replace(of, signals=tuple(signals))
    found = whiteness_with_input_noise(parts, resting, each(of), floor(1.0))
    assert found < 1 < whiteness_with_input_noise(parts, of, each(of), floor(1.0))


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_residuals_as_large_as_the_noise_behind_the_filter_makes_them(of, share):
    parts = moved_by_input_noise(1)
    filters = noise_of_input._Filters(of, each(of), NOISE, alike(of))
    likeliest = filters.likeliest(parts, 2 * INPUT_NOISE / NOISE)
    assert filters.is_as_large(parts, likeliest)
    assert not filters.is_as_large(parts, share * likeliest)


def test_one_recording_with_more_than_its_input_can_shake_is_something(of):
    parts = moved_by_input_noise(1)
    louder = [*parts[:-1], 1.5 * parts[-1]]
    assert whiteness_with_input_noise(parts, of, each(of), floor()) < 1.0
    assert whiteness_with_input_noise(louder, of, each(of), floor()) == np.inf


def test_an_output_with_more_than_its_noise_holds_something(of):
    rng = np.random.default_rng(5)
    parts = [
        one + 1.5 * NOISE * rng.standard_normal(N) for one in moved_by_input_noise(1)
    ]
    assert whiteness_with_input_noise(parts, of, each(of), floor()) == np.inf


def test_under_a_controller_the_input_is_not_the_cause(of):
    held = replace(of, drive=replace(of.drive, controller=Controller(20.0, 30.0)))
    parts = moved_by_input_noise(1)
    assert whiteness_with_input_noise(parts, held, each(held), floor()) == np.inf


def test_the_cause_is_told_with_what_is_left(of):
    assert left_over(moved_by_input_noise(2), of, each(of), floor())[1] == "input_noise"
    rng = np.random.default_rng(2)
    alone = [NOISE * rng.standard_normal(N) for _ in range(9)]
    assert left_over(alone, of, each(of), floor())[1] == ""


@pytest.mark.parametrize("force", [0.3, 0.8])
def test_missing_friction_is_no_noise_of_the_input(force):
    given = recordings({"coulomb_friction": {"force_N": force}})
    rng = np.random.default_rng(5)
    noisy = [
        replace(one, input=one.input + 0.01 * np.r_[0, rng.standard_normal(N - 1)])
        for one in given
    ]
    of = problem(noisy)
    layout, point, parts = at(of, fit(of))
    for input_rms in (0.01, 0.1):
        left, cause = left_over(
            parts, of, drives_at(of, layout, point), floor(input_rms)
        )
        assert (cause, left > 1) == ("", True)


def at(of, found):
    """Layout, point and residuals of a fit of the base."""
    layout = parameter_layout(of, (), {}, sizes(of))
    point = first_point(of, layout, replace(of.drive, **base_of(found)), {})
    return layout, point, residuals_at(of, layout, point)


def base_of(found):
    return {
        one.parameter: value
        for one, value in zip(found.names, found.values, strict=True)
    }


@pytest.mark.thorough
def test_a_fit_that_knows_of_the_noise_of_the_input_is_the_weighted_one():
    rng = np.random.default_rng(3)
    # It rests under its first sample, which is read without noise.
    given = [
        replace(one, input=one.input + 0.3 * np.r_[0, rng.standard_normal(N - 1)])
        for one in recordings(noise=NOISE)
    ]
    of = as_recorded(problem(given))
    layout, plain, _ = at(of, fit(of))
    found = fit_with_input_noise(of, layout, plain, floor(0.3))
    weighted = fit_by_factors(of, layout, plain, 0.3)
    expected, started, ended = (
        np.array([drive.damping_N_s_per_m, drive.stiffness_N_per_m])
        for drive in (drive_at(of, layout, one) for one in (weighted, plain, found))
    )
    # It takes the size of the noise from the residuals, 2 % off.
    assert np.all(np.abs(ended - expected) < 0.1 * np.abs(started - expected))


def as_recorded(of):
    """A problem whose drives start under the first sample, not under a level of rest."""
    as_read = [replace(one, driven_by=one.input) for one in of.signals]
    return replace(of, signals=as_read)


def fit_by_factors(of, layout, point, input_noise):
    """Weighted with the covariance of the noise at each trial of the parameters."""

    def errors(shared):
        trial = replace(point, shared=shared)
        pulse = answer_to_a_pulse(drive_at(of, layout, trial))
        parts = np.column_stack(residuals_at(of, layout, trial))
        factor = factor_of_the_noise(pulse, input_noise)
        return solve_triangular(factor, parts, lower=True).ravel()

    return replace(point, shared=least_squares(errors, point.shared).x)


def test_both_noises_may_go_with_the_range_of_a_recording(monkeypatch):
    rng = np.random.default_rng(7)
    given = [
        replace(
            one,
            # It starts in equilibrium with the first sample.
            input=one.input
            + level * INPUT_NOISE * np.r_[0, rng.standard_normal(N - 1)],
            output=one.output + level * NOISE * rng.standard_normal(N),
        )
        for one, level in zip(recordings(noise=0.0), [2.0, 0.25, 1.0] * 3, strict=True)
    ]
    of = problem(given)
    fit_layout = parameter_layout(of, (), {}, sizes(of))
    point = first_point(of, fit_layout, of.drive, {})
    parts = residuals_at(of, fit_layout, point)
    noise = noise_floor(of)
    assert left_over(parts, of, each(of), noise)[1] == "input_noise"
    # As if each held as much: one leaves far more than all together.
    monkeypatch.setattr(noise_of_input._Levels, "of", lambda of, noise: alike(of))
    assert left_over(parts, of, each(of), noise)[1] == ""


def test_every_recording_is_seen_through_a_filter_of_its_own_noise(of):
    # The noise of the input of every second one is eight times as large.
    ratio = np.array([2.0, 0.25] * 5)[:9]
    rng = np.random.default_rng(7)
    parts = [
        np.convolve(PULSE, 30 * level * INPUT_NOISE * rng.standard_normal(N))[:N]
        + NOISE * rng.standard_normal(N)
        for level in ratio
    ]
    share = 30 * INPUT_NOISE / NOISE
    levels = noise_of_input._Levels(np.ones(9), ratio)
    filters = noise_of_input._Filters(of, each(of), NOISE, levels)
    sizes_found = [np.std(one) for one in filters.in_deviations(parts, share)]
    assert sizes_found == pytest.approx([1.0] * 9, abs=0.15)
    assert filters.is_as_large(parts, share)

    # As much more as the squares of the levels say.
    usual = noise_of_input._Filters(of, each(of), NOISE, alike(of))
    twice = noise_of_input._Levels(np.ones(9), 2 * np.ones(9))
    more = noise_of_input._Filters(of, each(of), NOISE, twice)
    expected = usual._expected(parts, share, NOISE**2)[0]
    assert more._expected(parts, share, NOISE**2)[0] == pytest.approx(4 * expected)


def test_what_a_stand_in_leaves_at_steps_is_no_noise_of_a_clean_input():
    of = problem(recordings())
    of = replace(of, drive=StandIn(**vars(DRIVE), own_units=MotionUnits()))
    left = moved_by_input_noise(2)
    assert left_over(left, of, each(of), floor())[1] == "stand_in"

    rng = np.random.default_rng(3)
    noisy = [
        replace(one, driven_by=one.driven_by + INPUT_NOISE * rng.standard_normal(N))
        for one in of.signals
    ]
    of = replace(of, signals=tuple(noisy))
    assert left_over(left, of, each(of), floor())[1] == "input_noise"


def test_a_search_under_input_noise_stays_within_the_bounds(monkeypatch):
    # Far beyond them a stiffness has so short a period that a simulation has no end.
    asked = []

    def far_away(scaled, start, **options):
        assert options["max_nfev"] <= 100
        for way in (1e3, -1e3):
            scaled(start + way)
        return SimpleNamespace(x=start)

    def noted(of, fit_layout, point):
        asked.append(drive_at(of, fit_layout, point).stiffness_N_per_m)
        return residuals_at(of, fit_layout, point)

    monkeypatch.setattr("scipy.optimize.least_squares", far_away)
    monkeypatch.setattr(noise_of_input, "residuals_at", noted)
    of = problem(recordings(noise=10 * NOISE))
    fit_layout = parameter_layout(of, (), {}, sizes(of))
    point = first_point(of, fit_layout, of.drive, {})
    fit_with_input_noise(of, fit_layout, point, replace(white(NOISE), input_rms=1e3))

    known = DRIVE.stiffness_N_per_m
    assert max(asked) == pytest.approx(1e4 * known)
    assert min(asked) == pytest.approx(1e-4 * known)


def test_a_search_under_input_noise_has_few_steps(monkeypatch):
    # SciPy's "lm" does not count the simulations for derivatives in every version.
    calls = []

    def noted(of, fit_layout, point):
        calls.append(point)
        return residuals_at(of, fit_layout, point)

    monkeypatch.setattr(noise_of_input, "residuals_at", noted)
    monkeypatch.setattr(noise_of_input, "_MOST_STEPS", 2)
    of = problem(recordings(noise=10 * NOISE))
    fit_layout = parameter_layout(of, (), {}, sizes(of))
    point = first_point(of, fit_layout, of.drive, {})
    fit_with_input_noise(of, fit_layout, point, replace(white(NOISE), input_rms=1e3))
    # Two searches; in each one at the start, two steps with derivatives.
    size = point.shared.size + point.own.size
    assert 0 < len(calls) <= 2 * (2 + 3 * (size + 2))


def with_own_starts(count):
    """A problem whose recordings each have a position and a velocity at the start."""
    options = DiagnoseOptions(initial_state="estimated")
    of = problem(recordings(noise=10 * NOISE)[:count], options=options)
    fit_layout = parameter_layout(of, (), {}, sizes(of))
    return of, fit_layout, first_point(of, fit_layout, of.drive, {})


def test_derivatives_behind_the_filter_are_those_of_one_coordinate_after_another():
    of, fit_layout, point = with_own_starts(4)
    search = noise_of_input._Search(of, fit_layout, point, NOISE, 0.5, alike(of))
    at = np.concatenate([point.shared, point.own.ravel()])
    assert point.own.size > 4
    expected = least_squares(search.deviations, at, max_nfev=1).jac

    assert search.jacobian(at) == pytest.approx(
        expected, abs=1e-5 * np.abs(expected).max()
    )


def test_derivatives_behind_the_filter_cost_no_more_with_more_recordings(monkeypatch):
    costs = []
    for count in (3, 9):
        of, fit_layout, point = with_own_starts(count)
        calls = []

        def noted(*args, calls=calls):
            calls.append(args)
            return residuals_at(*args)

        monkeypatch.setattr(noise_of_input, "residuals_at", noted)
        search = noise_of_input._Search(of, fit_layout, point, NOISE, 0.5, alike(of))
        search.jacobian(np.concatenate([point.shared, point.own.ravel()]))
        costs.append(len(calls))
    assert costs[0] == costs[1] > 2


@pytest.mark.parametrize(("times", "may_be"), [(0.5, True), (1.0, True), (12.0, False)])
def test_what_noise_of_the_input_cannot_make_is_not_fitted_with_it(times, may_be):
    # Noise of that size moves the drive by about twice the noise of its sensor.
    rng = np.random.default_rng(5)
    slow = 2 * times * NOISE * np.cos(np.linspace(0, 6, N))
    found = [
        replace(one, output=one.output + slow + NOISE * rng.standard_normal(N))
        for one in recordings(noise=0.0)
    ]
    of = problem(found)
    fit_layout = parameter_layout(of, (), {}, sizes(of))
    point = first_point(of, fit_layout, of.drive, {})
    noise = replace(white(NOISE), input_rms=INPUT_NOISE)

    assert may_be_input_noise(of, fit_layout, point, noise) is may_be
