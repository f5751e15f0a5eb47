import numpy as np
import pytest
from scipy import signal
from scipy.stats import chi2

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import Candidate, FitData, columns
from hwid_cli.model.fit import fit
from hwid_cli.model.leverage import output_derivatives, pull
from hwid_cli.model.residual_tests import n_tested_lags, residual_tests
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import ORDERS, measured, options, plant

SEEDS = 400
LINEAR = FitOptions(input_map="none", output_map="none", initial_state="zero")


def white(seed, n_samples=500):
    return np.random.default_rng(seed).standard_normal(n_samples)


def first_order(u):
    return signal.lfilter([0.0, 0.1], [1.0, -0.9], u)


def judged(result, recording):
    residual = (
        recording.output
        - sensitivities.simulated_outputs(
            Candidate(result.model, result.model.free_response[None]),
            [FitData(recording.input, recording.output)],
        )[0]
    )
    pulled = pull(
        result.model,
        recording,
        n_tested_lags(residual.size),
        free_break_points=result.options.free_break_points,
    )
    return residual_tests(residual, recording.input, pull=pulled)


def test_the_statistic_is_that_of_ljung_and_box():
    residual = np.array([1.0, -1.0, 2.0, 0.0, -2.0, 1.0, 1.0, -1.0, 0.0, 1.0])
    found = residual_tests(residual, white(0, 10))
    # By hand: sum of squares 14; lag 1: -1 -2 +0 +0 -2 +1 -1 +0 +0 = -5; lag 2:
    # 2 +0 -4 +0 -2 -1 +0 -1 = -6; Q = 10 * 12 * ((5/14)^2 / 9 + (6/14)^2 / 8).
    expected = 120 * ((5 / 14) ** 2 / 9 + (6 / 14) ** 2 / 8)

    assert found.with_itself.lags.tolist() == [1, 2]
    np.testing.assert_allclose(found.with_itself.values, [-5 / 14, -6 / 14])
    assert found.ljung_box == pytest.approx(expected)
    assert found.with_itself.p_value == pytest.approx(chi2.sf(expected, 2))


@pytest.mark.thorough
def test_white_noise_is_called_coloured_in_one_of_twenty_cases():
    found = [residual_tests(white(seed), white(seed + 10_000)) for seed in range(SEEDS)]
    # 400 cases at 5 %: standard deviation 1.1 %; chi2 is a limit, hence three of them.
    assert np.mean([not one.is_white for one in found]) == pytest.approx(
        0.05, abs=0.033
    )
    assert np.mean([one.follows_input for one in found]) == pytest.approx(
        0.05, abs=0.033
    )
    assert np.mean([one.follows_square for one in found]) < 0.085
    assert np.mean([one.leads_input for one in found]) < 0.085


def test_each_band_covers_nineteen_of_twenty_values():
    inside = []
    for seed in range(100):
        found = residual_tests(white(seed), white(seed + 10_000))
        inside += [
            np.abs(one.values) < one.band
            for one in (found.with_itself, found.with_input, found.with_square)
        ]
    # More than ten thousand values: 0.2 %; the kurtosis of a square adds a little.
    assert np.mean(np.concatenate(inside)) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("kind", ["steps", "sine", "slow"])
def test_coloured_noise_that_does_not_know_the_input_is_told_from_missing_dynamics(
    kind,
):
    wrong = 0
    for seed in range(60):
        u = {
            "steps": np.repeat(white(seed, 25), 20),
            "sine": np.sin(0.1 * np.arange(500)) + 0.01 * white(seed),
            "slow": signal.lfilter([0.05], [1.0, -0.95], white(seed)),
        }[kind]
        noise = signal.lfilter([1.0], [1.0, -0.8], white(seed + 10_000))
        found = residual_tests(noise, u)
        assert not found.is_white
        wrong += found.follows_input
    # 5 % expected: three of sixty; nine are beyond 99.8 % of cases.
    assert wrong <= 8


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
def test_derivatives_are_those_of_the_search(initial_state):
    true = plant("polynomial", "piecewise_linear", initial_state)
    recording = measured(true, 300)
    found = output_derivatives(true, recording.input, free_break_points=True)
    candidate = Candidate(true, true.free_response[None])
    expected = sensitivities.equations(
        candidate,
        [FitData(recording.input, recording.output)],
        with_positions=True,
    ).matrix
    place = columns(candidate, with_positions=True)
    parts = ("output_map", "free_responses", "input_map", "numerator", "denominator")
    order = np.concatenate(
        [np.arange(*getattr(place, one).indices(place.total)) for one in parts]
    )
    expected = expected[np.ix_(order, order)]
    # Another order of summation, and differences of columns that are nearly equal.
    np.testing.assert_allclose(
        found.T @ found, expected, rtol=1e-6, atol=1e-9 * np.max(expected)
    )


def test_the_pull_begins_with_the_number_of_parameters():
    recording = measured(
        plant("piecewise_linear", "polynomial", "estimated"), noise=0.02
    )
    asked = options("piecewise_linear", "polynomial", "estimated")
    result = fit([recording], ORDERS, asked)
    pulled = pull(result.model, recording, 3, free_break_points=True)

    assert pulled[0] == pytest.approx(result.information.n_parameters, abs=1.001)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seeds", "most_off"),
    # Three standard deviations of a share of 5 %, and what chi2 as a limit is off.
    [(100, 0.07), pytest.param(SEEDS, 0.04, marks=pytest.mark.slow)],
)
def test_residuals_of_a_fit_with_many_parameters_are_white_where_the_noise_is(
    seeds, most_off
):
    white_ones = []
    u = white(0, 400)
    # Forty slow waves: what a fit of a fast sampled drive can follow.
    waves = np.cos(np.pi * np.outer(np.arange(400) + 0.5, np.arange(40)) / 400)
    basis, _ = np.linalg.qr(waves)
    pulled = np.array([np.sum(basis[: 400 - k] * basis[k:]) for k in range(26)])
    for seed in range(seeds):
        noise = white(seed, 400)
        residual = noise - basis @ (basis.T @ noise)
        white_ones.append(
            [
                residual_tests(residual, u, pull=one).is_white
                for one in (pulled, np.zeros(26))
            ]
        )
    with_pull, without = 1.0 - np.mean(white_ones, axis=0)
    # Forty parameters of 400 samples; without the correction white noise is lost.
    assert with_pull == pytest.approx(0.05, abs=most_off)
    assert without > 0.15


def test_a_model_that_misses_a_pole_is_caught():
    u = white(1, 1500)
    y = signal.lfilter([0.0, 0.1], np.poly([0.9, 0.6]), u) + 0.005 * white(2, 1500)
    recording = Recording("r", u, y, 1.0)
    complete = judged(fit([recording], Orders(1, 2, 1), LINEAR), recording)
    poor = judged(fit([recording], Orders(1, 1, 1), LINEAR), recording)

    assert complete.is_white
    assert not complete.follows_input
    assert not poor.is_white
    assert poor.follows_input
    assert 1 <= poor.with_input.last_lag <= 25


def test_a_model_that_misses_a_square_is_caught():
    u = white(1, 1500)
    y = first_order(u + 0.3 * u**2) + 0.01 * white(2, 1500)
    recording = Recording("r", u, y, 1.0)
    found = judged(fit([recording], Orders(1, 1, 1), LINEAR), recording)

    assert found.follows_square


def test_an_input_that_follows_the_residual_is_feedback():
    noise = white(1)
    found = residual_tests(noise, np.roll(noise, 3) + white(2))

    assert found.leads_input
    assert not found.follows_input


def test_the_square_of_a_step_says_nothing_new():
    step = np.where(np.arange(300) < 40, 0.0, 2.0)
    found = residual_tests(white(0, 300), step)

    assert found.with_square.lags.size == 0
    assert not found.follows_square


def test_a_perfect_fit_has_nothing_to_test():
    found = residual_tests(np.zeros(100), white(0, 100))

    assert np.isnan(found.with_itself.p_value)
    assert found.is_white
