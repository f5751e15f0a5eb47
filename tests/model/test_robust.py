from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from hwid_cli.model import candidates, points, robust, sensitivities
from hwid_cli.model.fit import fit
from hwid_cli.model.linear_block import residuals_and_loss
from hwid_cli.model.scores import fit_percent, rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.model.uncertainty import parameter_covariance
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import MAPS, ORDERS, level_input, measured, plant

B, F = np.array([0.2, 0.1]), np.array([1.0, -1.2, 0.5])


def with_outliers(recording, share=0.05, seed=7, times=1.0):
    """Recording with gross errors of two to ten standard deviations, all upwards."""
    rng = np.random.default_rng(seed)
    y = recording.output.copy()
    bad = np.flatnonzero(rng.random(y.size) < share)
    # An initial state is known by the first few samples only: those stay good.
    bad = bad[bad > 20]
    y[bad] += np.std(y) * rng.uniform(2.0, 10.0, bad.size) * times
    return replace(recording, output=y)


def linear_recording(seed=5, share=0.05, times=1.0):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(1000)
    y = signal.lfilter(np.r_[0.0, B], F, u)
    y += 0.02 * np.std(y) * rng.standard_normal(y.size)
    return with_outliers(Recording("r", u, y, 1e-3), share, times=times)


def linear_options(loss):
    return FitOptions(input_map="none", output_map="none", loss=loss)


def test_loss_is_squared_inside_the_threshold_and_straight_beyond_it():
    e = np.linspace(-5.0, 5.0, 401)
    nothing, only = np.zeros(1), np.zeros(1, dtype=np.int64)
    values = np.array(
        [residuals_and_loss(np.array([one]), nothing, only, 2.0)[1] for one in e]
    )
    inside = np.abs(e) <= 2.0
    np.testing.assert_allclose(values[inside], e[inside] ** 2, rtol=1e-13)
    np.testing.assert_allclose(
        values[~inside], 4.0 * np.abs(e[~inside]) - 4.0, rtol=1e-13
    )


@pytest.mark.parametrize("output_map", ["polynomial", "none", "sigmoid_network"])
@pytest.mark.parametrize("rows", [300, 100])
def test_gradient_of_the_loss_agrees_with_central_differences(output_map, rows):
    model = HammersteinWiener(MAPS["polynomial"], B, F, 2, MAPS[output_map], 1.0)
    candidate = candidates.Candidate(model, np.zeros((1, 3)))
    rng = np.random.default_rng(2)
    u = level_input(300, 1)
    every = candidates.FitData(u, 4.0 * rng.standard_normal(300), threshold=1.5)
    (one,) = candidates.thinned([every], rows)
    place = candidates.columns(candidate, with_positions=True)
    point = points.point_of(candidate)

    def cost(change):
        return sensitivities.simulated(points.moved(point, change, place), [one]).cost

    found = sensitivities.simulated(point, [one])
    cut = np.abs(found.residuals[0]) > 1.5
    assert 0.1 < np.mean(cut) < 0.9
    got = sensitivities.normal_equations(point, place, [one], found)
    unit = 1e-6 * np.eye(place.total)
    expected = np.array([(cost(e) - cost(-e)) / 2e-6 for e in unit])
    # The second derivatives jump where a residual crosses the threshold.
    np.testing.assert_allclose(
        -2.0 * got.vector, expected, atol=1e-5 * np.max(np.abs(expected))
    )


def test_outliers_spoil_a_squared_fit_and_leave_a_huber_fit_alone():
    recording = linear_recording()
    errors = {}
    for loss in ("squared", "huber"):
        model = fit([recording], Orders(2, 2, 1), linear_options(loss)).model
        found = np.r_[model.numerator, model.denominator[1:]]
        errors[loss] = np.max(np.abs(found / np.r_[B, F[1:]] - 1.0))
    assert errors["huber"] < 0.02
    assert errors["squared"] > 0.05


@pytest.mark.thorough
def test_a_nonlinear_plant_is_found_behind_outliers():
    true = plant("dead_zone", "polynomial")
    clean, other = measured(true, noise=0.01), measured(true, seed=2)
    percent = {}
    for loss in ("squared", "huber"):
        result = fit([with_outliers(clean)], ORDERS, FitOptions(loss=loss))
        y = validation_output(result.model, other)
        percent[loss] = fit_percent(other.output, y)
    # Without outliers these data give 99.4 %.
    assert percent["huber"] > 99.0
    assert percent["squared"] < 90.0


@pytest.mark.thorough
def test_several_experiments_share_one_threshold():
    true = plant("dead_zone", "none")
    pair = [with_outliers(measured(true, seed=s, noise=0.01), seed=s) for s in (1, 2)]
    given = FitOptions(loss="huber", join="experiments")
    result = fit(pair, ORDERS, given)
    other = measured(true, seed=3)
    y = validation_output(result.model, other)
    assert fit_percent(other.output, y) > 99.0
    again = fit(pair, ORDERS, given, starts=[result.model])
    y = validation_output(again.model, other)
    assert fit_percent(other.output, y) > 99.0


def test_rmsd_and_fit_percent_stay_plain():
    recording = linear_recording()
    result = fit([recording], Orders(2, 2, 1), linear_options("huber"))
    y = validation_output(result.model, recording)
    # Initial states of a validation are found by another search: 1e-4.
    assert result.rmsd == pytest.approx(rmsd(recording.output, y), rel=1e-4)
    assert result.linear_rmsd == pytest.approx(result.rmsd, rel=1e-2)


@pytest.mark.thorough
def test_standard_errors_with_outliers_are_those_of_the_estimates():
    deviations = []
    for seed in range(12):
        recording = linear_recording(seed)
        result = fit([recording], Orders(2, 2, 1), linear_options("huber"))
        found = np.r_[result.model.numerator, result.model.denominator[1:]]
        truth = np.r_[B, F[1:]]
        deviations.append((found - truth) / result.uncertainty.standard_errors)
        covariance = parameter_covariance(result, [recording]).matrix
        # The threshold is worked out anew from the stored model.
        np.testing.assert_allclose(
            np.sqrt(np.diag(covariance)),
            result.uncertainty.standard_errors,
            rtol=0.05,
        )
    # 48 numbers tell a standard deviation to 10 %; outliers to one side only leave a
    # small bias. With the plain variance this would be 0.03.
    assert 0.6 < np.sqrt(np.mean(np.square(deviations))) < 1.5


@pytest.mark.parametrize("seed", range(3))
def test_criteria_find_the_true_orders_behind_outliers(seed):
    recording = linear_recording(seed, times=8.0)
    fits = [
        fit([recording], Orders(n, n, 1), linear_options("huber")) for n in (1, 2, 3)
    ]
    n = recording.n_samples
    plain = [
        n * np.log(one.rmsd**2) + one.information.n_parameters * np.log(n)
        for one in fits
    ]

    assert np.argmin([one.information.bic for one in fits]) == 1
    # RMSDs count outliers in full, which drown the better model.
    assert np.argmin(plain) == 0


def test_criteria_without_outliers_are_nearly_those_of_squares():
    recording = linear_recording(share=0.0)
    squared, huber = (
        fit([recording], Orders(2, 2, 1), linear_options(loss)).information
        for loss in ("squared", "huber")
    )

    # 95 % efficient: the variance is twentieth larger, give or take.
    assert huber.fpe == pytest.approx(1.05 * squared.fpe, rel=0.05)


def test_threshold_is_that_of_normal_residuals():
    rng = np.random.default_rng(0)
    y = 0.3 * rng.standard_normal(20001)
    model = HammersteinWiener(MAPS["none"], [0.0], [1.0], 0, MAPS["none"], 1.0)
    candidate = candidates.Candidate(model, np.zeros((1, 0)))
    one = candidates.FitData(np.ones(y.size), y, threshold=1.0)
    (found,) = robust.renewed([one], [candidate])
    # The median of 20001 samples is known to 1 %.
    assert found.threshold == pytest.approx(1.345 * 0.3, rel=0.03)


def test_squared_loss_has_no_threshold():
    one = candidates.FitData(np.ones(3), np.ones(3))
    assert robust.with_loss([one], FitOptions())[0].threshold == np.inf


def test_an_unknown_loss_is_refused():
    with pytest.raises(
        ValueError, match="loss must be one of squared, huber, got 'l1'"
    ):
        FitOptions(loss="l1")


SLOW_F = np.poly([0.92 + 0.1j, 0.92 - 0.1j]).real
SLOW_B = np.array([1.0, 0.6]) / 1.6 * SLOW_F.sum()


def resting(seed, rest):
    """Two slow poles, moved by levels after a share of rest; input and output."""
    rng = np.random.default_rng(seed)
    n = 1000
    u = np.zeros(n)
    moving = n - int(rest * n)
    held = np.repeat(rng.uniform(-1.0, 1.0, moving), rng.integers(10, 40, moving))
    u[n - moving :] = held[:moving]
    return u, signal.lfilter(np.r_[0.0, SLOW_B], SLOW_F, u), rng


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_movement_after_a_long_rest_is_not_taken_for_outliers(seed):
    u, y, rng = resting(seed, 0.8)
    bad = rng.random(y.size) < 0.1
    y = y + 0.003 * rng.standard_normal(y.size)
    y[bad] += rng.choice([-1.0, 1.0], bad.sum()) * rng.uniform(1.0, 3.0, bad.sum())
    asked = replace(linear_options("huber"), initial_state="zero")
    result = fit([Recording("r", u, y, 1e-3)], Orders(2, 2, 1), asked)

    found = np.r_[result.model.numerator, result.model.denominator[1:]]
    np.testing.assert_allclose(found, np.r_[SLOW_B, SLOW_F[1:]], atol=0.01)


def test_a_sensor_that_repeats_itself_at_rest_hides_no_errors():
    """As long as a stepped sensor rests its residuals are zero: not the errors' size."""
    deviations = []
    for seed in range(8):
        u, y, rng = resting(seed, 0.6)
        y = np.round((y + 0.001 * rng.standard_normal(y.size)) / 0.01) * 0.01
        asked = replace(linear_options("huber"), initial_state="zero")
        result = fit([Recording("r", u, y, 1e-3)], Orders(2, 2, 1), asked)
        found = np.r_[result.model.numerator, result.model.denominator[1:]]
        errors = found - np.r_[SLOW_B, SLOW_F[1:]]
        deviations.append(errors / result.uncertainty.standard_errors)
    # Errors of rounding are not white, so they are somewhat larger than foretold.
    assert np.sqrt(np.mean(np.square(deviations))) < 3.0
