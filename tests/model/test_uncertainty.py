from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from hwid_cli import parameter_covariance
from hwid_cli.model.fit import fit, fit_without_standard_errors
from hwid_cli.model.uncertainty import with_standard_errors
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import ORDERS, measured, options, plant

LINEAR = FitOptions(input_map="none", output_map="none", initial_state="zero")


def noisy(y, seed, spread):
    return y + spread * np.random.default_rng(seed).standard_normal(y.size)


def test_covariance_of_a_moving_average_is_that_of_least_squares():
    u = np.random.default_rng(0).standard_normal(400)
    y = noisy(signal.lfilter([0.5, 0.2], [1.0], u), 1, 0.1)
    recording = Recording("r", u, y, 1.0)
    result = fit([recording], Orders(2, 0, 0), LINEAR)
    regressors = np.column_stack([u, np.append(0.0, u[:-1])])
    error = y - regressors @ result.model.numerator
    expected = error @ error / 398 * np.linalg.inv(regressors.T @ regressors)
    found = parameter_covariance(result, [recording])

    assert found.names == ("b[0]", "b[1]")
    np.testing.assert_allclose(found.matrix, expected, rtol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("join", ["concatenate", "experiments"])
def test_the_diagonal_holds_the_squares_of_the_standard_errors(join):
    true = plant("dead_zone", "polynomial", "estimated")
    pair = [measured(true, 600, seed=seed, noise=0.02) for seed in (1, 2)]
    asked = options("dead_zone", "polynomial", "estimated", join=join)
    result = fit(pair, ORDERS, asked)
    found = parameter_covariance(result, pair)

    assert found.names == result.uncertainty.names
    # The second recording's initial state is estimated anew.
    np.testing.assert_allclose(
        np.sqrt(np.diag(found.matrix)), result.uncertainty.standard_errors, rtol=1e-3
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("join", "loss"),
    [
        ("concatenate", "squared"),
        ("experiments", "huber"),
        pytest.param("concatenate", "huber", marks=pytest.mark.slow),
        pytest.param("experiments", "squared", marks=pytest.mark.slow),
    ],
)
def test_standard_errors_can_be_worked_out_afterwards(join, loss):
    true = plant("dead_zone", "polynomial", "estimated")
    pair = [measured(true, 600, seed=seed, noise=0.02) for seed in (1, 2)]
    asked = options("dead_zone", "polynomial", "estimated", join=join, loss=loss)
    whole = fit(pair, ORDERS, asked)
    bare = fit_without_standard_errors(pair, ORDERS, asked)
    later = with_standard_errors(bare, pair)

    assert bare.uncertainty.names == ()
    assert bare.uncertainty.reason == "not worked out for this fit"
    assert np.isnan(bare.information.bic)
    assert bare.rmsd == whole.rmsd
    assert later.uncertainty.names == whole.uncertainty.names
    # The second recording's initial state and the threshold are found anew.
    np.testing.assert_allclose(
        later.uncertainty.standard_errors, whole.uncertainty.standard_errors, rtol=2e-2
    )
    assert later.information.bic == pytest.approx(whole.information.bic, rel=1e-3)
    with pytest.raises(ValueError, match="the fit is of"):
        with_standard_errors(bare, pair[:1])


@pytest.mark.thorough
def test_estimates_spread_as_their_covariance_says():
    u = np.random.default_rng(5).standard_normal(300)
    clean = signal.lfilter([0.0, 0.3], [1.0, -0.7], u)
    estimates, last = [], None
    for seed in range(60):
        recording = Recording("r", u, noisy(clean, seed, 0.1), 1.0)
        result = fit([recording], Orders(1, 1, 1), LINEAR)
        estimates.append([result.model.numerator[0], result.model.denominator[1]])
        last = parameter_covariance(result, [recording]).matrix
    # The correlation of 60 pairs is known to about 0.1.
    told = last[0, 1] / np.sqrt(last[0, 0] * last[1, 1])
    assert np.corrcoef(np.array(estimates).T)[0, 1] == pytest.approx(told, abs=0.25)


def test_covariance_needs_the_recordings_of_the_fit():
    recording = measured(plant())
    result = fit([recording], ORDERS, options("none", "none"))
    with pytest.raises(ValueError, match="the fit is of"):
        parameter_covariance(result, [replace(recording, name="other")])
    failed = Fit(("r1",), ORDERS, LINEAR, None, "failed", "no start")
    with pytest.raises(ValueError, match="failed"):
        parameter_covariance(failed, [recording])


def test_an_input_of_few_levels_is_named_as_the_reason():
    u = np.where(np.random.default_rng(0).random(600) < 0.5, 1.0, 2.0)
    y = noisy(signal.lfilter([0.0, 0.5], [1.0, -0.5], u), 1, 1e-3)
    asked = options("piecewise_linear", "none", free_break_points=False)
    result = fit([Recording("r", u, y, 1.0)], Orders(1, 1, 1), asked)

    flat = result.uncertainty.flat
    assert len(flat) == 2
    assert all(one.startswith("not identifiable: input_map.value[") for one in flat)
    assert all("the input visits only 2 levels" in one for one in flat)


def test_a_segment_without_samples_is_named_as_the_reason():
    rng = np.random.default_rng(0)
    u = np.where(
        rng.random(900) < 0.5, rng.uniform(-3, -2, 900), rng.uniform(2, 3, 900)
    )
    y = noisy(signal.lfilter([0.0, 0.5], [1.0, -0.5], u), 1, 1e-3)
    asked = replace(
        options("piecewise_linear", "none", free_break_points=False), units=5
    )
    result = fit([Recording("r", u, y, 1.0)], Orders(1, 1, 1), asked)

    # Break-points at -3, -2 ... 3: nothing is seen of the values at -1, 0 and 1.
    lost = {f"input_map.value[{i}]" for i in (2, 3, 4)}
    uncertainty = result.uncertainty
    nan = np.isnan(uncertainty.standard_errors)
    assert {
        name for name, is_nan in zip(uncertainty.names, nan, strict=True) if is_nan
    } == lost
    assert {one.split(", because ")[0] for one in uncertainty.flat} == {
        f"not identifiable: {name}" for name in lost
    }
    assert all("no sample of the input lies between" in one for one in uncertainty.flat)


def test_a_segment_with_one_sample_is_named_as_the_reason():
    u = np.random.default_rng(0).uniform(-3, 0, 900)
    u[450] = 3.0
    bent = np.where(u > 0, 3 * u, u)
    y = noisy(signal.lfilter([0.0, 0.5], [1.0, -0.5], bent), 1, 1e-3)
    asked = replace(options("piecewise_linear", "none"), units=2)
    result = fit([Recording("r", u, y, 1.0)], Orders(1, 1, 1), asked)

    # The bend may lie anywhere between the many samples and the one.
    sentences = result.uncertainty.flat
    assert any("input_map.break_point[" in one for one in sentences)
    assert all("sample of the input lies between" in one for one in sentences)
    # Only what these directions move is lost.
    uncertainty = result.uncertainty
    nan = np.isnan(uncertainty.standard_errors)
    ends = ("input_map.break_point[0]", "input_map.break_point[3]")
    for name, is_nan in zip(uncertainty.names, nan, strict=True):
        assert is_nan == (name in ends or any(name in one for one in sentences))


def test_coefficients_that_a_single_frequency_does_not_tell_apart_are_named():
    u = np.sin(0.2 * np.arange(800))
    y = noisy(signal.lfilter([0.0, 0.5, 0.1, 0.05, 0.02], [1.0, -0.5], u), 0, 1e-3)
    asked = FitOptions("none", "none", initial_state="estimated")
    result = fit([Recording("r", u, y, 1.0)], Orders(4, 1, 1), asked)

    *states, block = result.uncertainty.flat
    assert all("initial state" in one for one in states)
    assert "b[0]" in block
    assert block.endswith(
        "can move together, because that hardly changes the simulated output"
    )


def test_a_pole_too_many_is_not_blamed_on_the_input_alone():
    u = np.random.default_rng(4).standard_normal(600)
    y = noisy(signal.lfilter([0.0, 0.5, 0.2], [1.0, -0.9, 0.3], u), 5, 0.03)
    asked = FitOptions("none", "none", initial_state="zero")
    result = fit([Recording("r", u, y, 1.0)], Orders(3, 3, 1), asked)

    (sentence,) = result.uncertainty.flat
    assert sentence.endswith("orders may be too high, or the input too simple")


def test_a_limit_that_is_never_reached_is_named_as_the_reason():
    u = np.random.default_rng(2).uniform(-1, 1, 500)
    y = noisy(signal.lfilter([0.0, 0.5], [1.0, -0.5], np.minimum(u, 0.4)), 1, 1e-3)
    asked = options("saturation", "none")
    result = fit([Recording("r", u, y, 1.0)], Orders(1, 1, 1), asked)

    (sentence,) = result.uncertainty.flat
    assert sentence.startswith(
        "not identifiable: input_map.lower, because no sample of"
    )
    assert "the input lies below" in sentence


def test_poles_and_zeros_that_cancel_are_named_as_the_reason():
    u = np.random.default_rng(5).standard_normal(500)
    y = noisy(signal.lfilter([0.0, 0.5], [1.0, -0.5], u), 1, 0.05)
    result = fit([Recording("r", u, y, 1.0)], Orders(2, 2, 1), LINEAR)

    (sentence,) = result.uncertainty.flat
    assert sentence.startswith("hardly identifiable (standard error")
    assert "a pole and a zero nearly cancel at" in sentence
    assert "b[1]" in sentence
    assert "f[" in sentence


def test_a_model_that_the_data_determine_has_no_flat_direction():
    recording = measured(plant("dead_zone", "saturation"), noise=0.02)
    result = fit([recording], ORDERS, options("dead_zone", "saturation"))

    assert result.uncertainty.flat == ()
    assert result.uncertainty.reason == ""
