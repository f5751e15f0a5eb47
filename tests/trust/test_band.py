from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.fit import fit
from hwid_cli.model.parameter_steps import (
    parameter_steps,
    parameter_vector,
    with_parameters,
)
from hwid_cli.model.simulate import estimated_state, simulate, validation_output
from hwid_cli.model.uncertainty import parameter_covariance
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.trust.band import error_terms, prediction_band
from hwid_cli.trust.judged import model_trust, recording_trust

LINEAR = FitOptions(input_map="none", output_map="none", initial_state="zero")
NOISE = 0.05


def recording(name, seed, *, n=600, size=1.0, noise=NOISE, curve=lambda u: u):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-size, size, n // 10 + 1), 10)[:n]
    y = lfilter([0.0, 0.3], [1.0, -0.7], curve(u))
    return Recording(name, u, y + noise * rng.standard_normal(n), 0.01)


@pytest.fixture(scope="module")
def linear():
    own = recording("own", 1)
    return own, fit([own], Orders(1, 1, 1), LINEAR)


def test_steps_multiply_to_the_covariance_of_the_parameters(linear):
    own, found = linear
    steps, reason = parameter_steps(found, [own])

    # The same numbers another way; steps are taken by differences of 1e-4.
    expected = parameter_covariance(found, [own]).matrix
    assert reason == ""
    assert np.allclose(steps.T @ steps, expected, rtol=1e-5)


@pytest.mark.thorough
def test_the_parameters_part_is_the_scatter_of_refitted_models(linear):
    own, found = linear
    new = recording("new", 77, noise=0.0)
    trust = model_trust(found, [own], [recording("judge", 2)])
    terms = error_terms(outlined_model(found.model), trust, new.input)
    clean = recording("own", 1, noise=0.0)
    outputs = []
    for seed in range(60):
        noise = NOISE * np.random.default_rng([5, seed]).standard_normal(600)
        again = fit(
            [replace(clean, output=clean.output + noise)], Orders(1, 1, 1), LINEAR
        )
        outputs.append(simulate(again.model, new.input))

    ratio = np.mean(np.var(outputs, axis=0, ddof=1)) / np.mean(terms.parameters)
    # Sixty draws of two parameters: a standard error of about 13 %, at three of them.
    assert 0.6 < ratio < 1.4


def axis(name, seed, *, noise=NOISE, n=400):
    """A place that a speed command moves: a lag and a pole at 1."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, n // 20), 20)
    y = 40.0 + lfilter([0.0, 0.03], np.convolve([1.0, -0.7], [1.0, -1.0]), u)
    return Recording(name, u, y + noise * rng.standard_normal(n), 0.01)


@pytest.mark.thorough
def test_beside_a_measured_start_an_axis_is_as_sure_as_refitted_models_agree():
    options = replace(LINEAR, initial_state="estimated", join="experiments")
    own, orders = [axis("a", 1), axis("b", 2)], Orders(1, 2, 1)
    found = fit(own, orders, options)
    new = axis("new", 7)
    state = estimated_state(found.model, new)
    trust = model_trust(found, own, [axis("judge", 3)])
    terms = error_terms(outlined_model(found.model), trust, new.input, state=state)
    outputs = []
    for seed in range(40):
        again = []
        for one in own:
            clean = axis(one.name, 1 + (one.name == "b"), noise=0.0).output
            rng = np.random.default_rng([9, seed, one.name == "b"])
            noisy = clean + NOISE * rng.standard_normal(clean.size)
            again.append(replace(one, output=noisy))
        outputs.append(validation_output(fit(again, orders, options).model, new))
    ratio = np.mean(np.var(outputs, axis=0, ddof=1)) / np.mean(terms.parameters)
    assert 0.5 < ratio < 2.0
    # With a start that stays where it is it would be thousands of times as much.
    held = error_terms(
        replace(outlined_model(found.model), free_response=state), trust, new.input
    )
    assert np.mean(held.parameters) > 100.0 * np.mean(terms.parameters)


def test_vector_and_model_are_two_forms_of_one():
    own = recording("own", 3, curve=np.tanh)
    model = outlined_model(fit([own], Orders(1, 1, 1), FitOptions(units=4)).model)

    back = with_parameters(model, parameter_vector(model))

    assert np.array_equal(simulate(back, own.input), simulate(model, own.input))


def test_a_band_of_a_right_model_holds_what_it_promises(linear):
    own, found = linear
    judges = [recording(f"judge {k}", 10 + k) for k in range(4)]
    trust = model_trust(found, [own], judges)

    held = [
        recording_trust("m", found.model, trust, recording("new", 100 + k))[0].coverage
        for k in range(10)
    ]

    # 6000 samples of white noise: 90 % within 1 %; the scale is never below 1.
    assert 0.88 < np.mean(held) < 0.97
    assert trust.judged_on == tuple(one.name for one in judges)


def test_a_band_is_wider_beyond_the_recordings():
    def curve(u):
        return u - np.clip(u, -0.4, 0.4)

    own = recording("own", 4, curve=curve)
    found = fit([own], Orders(1, 1, 1), FitOptions(units=5))
    trust = model_trust(found, [own], [recording("judge", 5, curve=curve)])
    model = outlined_model(found.model)

    widths = [
        np.mean(band.upper - band.lower)
        for size in (1.0, 3.0)
        for band in [prediction_band(model, trust, size * own.input)]
    ]

    assert widths[1] > 1.5 * widths[0]


def test_repeats_that_differ_have_a_band_as_wide_as_the_recordings_scatter():
    # The machine changes from recording to recording; the judge goes beyond the fit.
    own, repeat = recording("own", 1, noise=1e-4), recording("own", 1, noise=1e-4)
    found = fit([own], Orders(1, 1, 1), FitOptions(units=5))
    judge = recording("judge", 2, size=3.0, noise=1e-4)
    judge = replace(judge, output=1.1 * judge.output)
    trust = model_trust(found, [own], [judge])
    changed = replace(repeat, name="repeat", output=1.05 * repeat.output)
    model = outlined_model(found.model)

    row, band = recording_trust("m", model, trust, changed)

    assert trust.scatter > 0.02
    assert (band.upper - band.lower >= 2 * trust.scatter).all()
    assert row.coverage > 0.85


def test_a_model_of_the_wrong_structure_has_a_wide_band():
    def squared(u):
        return u + 0.8 * u**2

    own, judge = (recording(str(k), k, curve=squared, noise=0.01) for k in (6, 7))
    straight = fit([own], Orders(1, 1, 1), LINEAR)
    trust = model_trust(straight, [own], [judge])
    row, band = recording_trust(
        "m", straight.model, trust, recording("n", 8, curve=squared, noise=0.01)
    )

    # Its error is ten times the noise: so is the band.
    assert row.coverage > 0.8
    assert np.mean(band.upper - band.lower) > 20 * 0.01


def test_without_other_recordings_thirds_of_the_own_one_judge(linear):
    own, found = linear

    trust = model_trust(found, [own], [])

    assert trust.judged_on == ("own, part 1", "own, part 2", "own, part 3")
    held = [
        recording_trust("m", found.model, trust, recording("new", 200 + k))[0].coverage
        for k in range(5)
    ]
    # A right model and white noise: three thousand samples, never below 1 deviation.
    assert 0.85 < np.mean(held) < 0.99


def test_recordings_of_a_joint_fit_judge_in_turn():
    pair = [recording("a", 11), recording("b", 12)]
    joint = fit(pair, Orders(1, 1, 1), replace(LINEAR, join="experiments"))

    assert model_trust(joint, pair, []).judged_on == ("a", "b")


@pytest.mark.thorough
def test_a_piecewise_constant_output_map_has_no_steps_and_says_why():
    own = recording("own", 13, curve=np.tanh)
    options = FitOptions(input_map="none", output_map="piecewise_constant", units=4)
    found = fit([own], Orders(1, 1, 1), options)

    steps, reason = parameter_steps(found, [own])

    assert steps.size == 0
    assert "no slope" in reason
    assert model_trust(found, [own], []).reason == reason


def test_extrapolated_maps_take_steps_too():
    own = Recording("own", *step_pair(), 0.01)
    found = fit([own], Orders(1, 1, 1), FitOptions(units=5))
    assert found.model.input_map.extrapolation is not None

    steps, _ = parameter_steps(found, [own])
    model = outlined_model(found.model)

    assert steps.shape[1] == parameter_vector(model).size
    assert np.abs(steps).max() > 0.0


def step_pair():
    rng = np.random.default_rng(21)
    u = np.repeat([0.0, 1.0, 0.4], 100) + 0.01 * rng.standard_normal(300)
    return u, lfilter([0, 0.3], [1, -0.7], np.tanh(u)) + 0.01 * rng.standard_normal(300)


def test_an_error_is_no_share_of_a_motion_that_is_not_foreseen(linear):
    own, found = linear
    judge = recording("judge", 10)
    # The machine moves a hundred times as far as the model foresees.
    judge = replace(judge, output=100.0 * judge.output)
    assert model_trust(found, [own], [judge]).gain == 1.0
