import numpy as np
import pytest
from scipy import signal
from scipy.stats import norm

from hwid_cli.model.fit import fit
from hwid_cli.model.information import information
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import ORDERS, measured, options, plant


def test_aic_and_bic_are_those_of_the_gaussian_likelihood_at_its_maximum():
    residual = np.random.default_rng(0).normal(scale=0.3, size=250)
    found = information(float(residual @ residual), 250, 7)
    spread = np.sqrt(np.mean(residual**2))
    log_likelihood = np.sum(norm.logpdf(residual, scale=spread))

    # Two ways to the same sums of 250 terms: rounding.
    assert found.aic == pytest.approx(-2 * log_likelihood + 2 * 7, rel=1e-12)
    assert found.bic == pytest.approx(-2 * log_likelihood + 7 * np.log(250), rel=1e-12)
    assert found.aicc - found.aic == pytest.approx(2 * 7 * 8 / (250 - 8), rel=1e-9)


@pytest.mark.thorough
def test_fpe_of_a_linear_regression_is_its_error_on_new_data():
    rng = np.random.default_rng(1)
    regressors = rng.normal(size=(60, 12))
    told, new = [], []
    for _ in range(2000):
        first, second = rng.normal(size=(2, 60))
        error = first - regressors @ np.linalg.lstsq(regressors, first)[0]
        told.append(information(float(error @ error), 60, 12).fpe)
        guess = regressors @ np.linalg.lstsq(regressors, first)[0]
        new.append(np.mean((second - guess) ** 2))
    # 2000 means of 60 squares: 0.4 % each.
    assert np.mean(told) == pytest.approx(np.mean(new), rel=0.02)


def test_a_perfect_fit_is_better_than_any_other():
    perfect = information(0.0, 100, 5)

    assert perfect.aic == perfect.bic == -np.inf
    assert perfect.fpe == 0.0


def test_more_parameters_than_samples_have_no_criteria():
    assert np.isnan(information(1.0, 10, 10).bic)


@pytest.mark.parametrize(
    ("input_map", "output_map", "initial_state", "expected"),
    [
        # nb + nf; the initial state of [2 2 2] has three coefficients.
        ("none", "none", "zero", 4),
        ("none", "none", "estimated", 7),
        # Two limits each; nothing is shared but what B takes.
        ("dead_zone", "none", "zero", 6),
        # 4 coefficients, one gain shared.
        ("polynomial", "none", "zero", 7),
        # 8 + 8 numbers of the maps, less four outermost positions and two gains.
        ("piecewise_linear", "piecewise_linear", "zero", 4 + 16 - 4 - 2),
        # A constant may move between the maps, too.
        ("piecewise_linear", "piecewise_linear", "estimated", 4 + 3 + 16 - 4 - 3),
    ],
)
def test_only_parameters_that_the_data_determine_count(
    input_map, output_map, initial_state, expected
):
    recording = measured(plant(input_map, output_map, initial_state), noise=0.01)
    result = fit([recording], ORDERS, options(input_map, output_map, initial_state))

    assert result.information.n_parameters == expected
    assert result.information.n_samples == recording.n_samples
    assert result.information.fpe > result.rmsd**2


def test_bic_chooses_the_true_number_of_poles():
    u = np.random.default_rng(2).standard_normal(600)
    noise = 0.05 * np.random.default_rng(3).standard_normal(600)
    y = signal.lfilter([0.0, 0.4, 0.2], [1.0, -1.3, 0.6], u) + noise
    recording = Recording("r", u, y, 1e-3)
    linear = FitOptions(input_map="none", output_map="none")
    bic = [
        fit([recording], Orders(2, nf, 1), linear).information.bic for nf in range(1, 6)
    ]

    assert np.argmin(bic) == 1


def test_a_failed_fit_has_no_criteria():
    u = np.ones(200)
    result = fit([Recording("r", u, np.arange(200.0), 1.0)], ORDERS, FitOptions())

    assert np.isnan(result.information.aic)
