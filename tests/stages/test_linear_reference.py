"""The linear model beside the model to take is the best of the grid, not a straw man."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli import FitOptions, Orders, Recording, fit, rmsd
from hwid_cli.model.simulate import simulate, validation_output
from hwid_cli.stages.linear_reference import Roles, linear_fits, linear_reference
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, TaskDone, run_tasks

OPTIONS = FitOptions(input_map="saturation", output_map="none", initial_state="zero")


def run_here(tasks):
    return run_tasks(tasks, RunSettings(MemoryStore()))


def two_lags(name, seed, noise=1e-3):
    """Two equal lags behind nothing else: one pole is too few, whatever maps there are."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.uniform(-1, 1, 40), 15)
    lag = lfilter([0.0, 0.2], [1.0, -0.8], current)
    output = lfilter([0.2], [1.0, -0.8], lag)
    return Recording(name, current, output + noise * rng.standard_normal(600), 1e-3)


@pytest.fixture(scope="module")
def recordings():
    return [two_lags(name, seed) for seed, name in enumerate("abc")]


@pytest.mark.thorough
def test_the_best_orders_of_the_grid_are_taken_not_those_of_the_model(recordings):
    one_pole, two_poles = (
        fit(recordings[:1], orders, OPTIONS)
        for orders in (Orders(1, 1, 1), Orders(1, 2, 1))
    )
    found = linear_reference(
        one_pole,
        [one_pole, two_poles],
        recordings,
        Roles(("b",), ("c",)),
        run_here,
        nk_role="poles",
    )

    assert found.name == "linear:a/1/2"
    # A second way: the lags themselves, driven by the input, leave the noise alone.
    judge = recordings[2]
    lag = lfilter([0.0, 0.2], [1.0, -0.8], judge.input)
    exact = lfilter([0.2], [1.0, -0.8], lag)
    simulated = lfilter(
        np.r_[np.zeros(found.fit.orders.nk), found.fit.model.numerator],
        found.fit.model.denominator,
        judge.input,
    )
    assert np.std(simulated - exact) < 1e-3
    same_orders, _ = linear_fits(
        recordings[:1], [Orders(1, 1, 1), Orders(1, 2, 1)], OPTIONS, run_here
    )
    assert same_orders.rmsd > 5.0 * found.fit.rmsd


def with_gain(one, gain):
    return replace(one, model=replace(one.model, numerator=gain * one.model.numerator))


def test_the_recordings_that_chose_the_model_choose(recordings):
    """Orders whose gain is off on one recording lose there and win elsewhere."""
    larger = replace(recordings[2], output=2.0 * recordings[2].output)
    known = [*recordings[:2], larger]
    bent = fit(known[:1], Orders(1, 2, 1), OPTIONS)
    grid = [bent, fit(known[:1], Orders(2, 2, 1), OPTIONS)]

    def run(tasks):
        # The second of the grid has twice the gain: it is right on the larger recording.
        return [
            TaskDone(done.task, with_gain(done.result, gain), from_cache=False)
            for done, gain in zip(run_here(tasks), (1.0, 2.0), strict=True)
        ]

    def chosen(*by):
        return linear_reference(bent, grid, known, Roles(by), run, nk_role="poles").name

    assert chosen("b") == "linear:a/1/2"
    assert chosen("c") == "linear:a/2/2"
    # Without others the recordings of the fit itself choose, and they alone.
    assert chosen() == chosen("a") == "linear:a/1/2"


def test_of_equals_the_smallest_is_taken(recordings):
    bent = fit(recordings[:1], Orders(3, 3, 1), OPTIONS)
    smaller = fit(recordings[:1], Orders(1, 2, 1), OPTIONS)
    found = linear_reference(
        bent,
        [bent, smaller],
        recordings,
        Roles(("b", "c"), ("b", "c")),
        run_here,
        nk_role="poles",
    )

    assert found.name == "linear:a/1/2"


def test_there_is_none_beside_a_linear_model_or_one_of_a_lost_recording(recordings):
    linear = FitOptions(input_map="none", output_map="none")
    own = fit(recordings[:1], Orders(1, 2, 1), linear)
    bent = fit(recordings[:1], Orders(1, 2, 1), OPTIONS)

    assert (
        linear_reference(own, [], recordings, Roles(), run_here, nk_role="poles")
        is None
    )
    assert (
        linear_reference(bent, [], recordings[1:], Roles(), run_here, nk_role="poles")
        is None
    )


def test_a_grid_whose_linear_fits_all_fail_gives_none(recordings):
    bent = fit(recordings[:1], Orders(1, 2, 1), OPTIONS)

    def run(tasks):
        return [
            TaskDone(
                done.task,
                replace(done.result, model=None, status="failed"),
                from_cache=False,
            )
            for done in run_here(tasks)
        ]

    assert linear_reference(bent, [], recordings, Roles(), run, nk_role="poles") is None


@pytest.mark.thorough
def test_all_recordings_that_do_not_judge_are_fitted_together(recordings):
    """One recording of little motion and much noise tells less than two."""
    loud = two_lags("a", 0, noise=0.2)
    known = [loud, *recordings[1:]]
    fits = [fit([one], Orders(1, 2, 1), OPTIONS) for one in known[:2]]

    def chosen(judges):
        return linear_reference(
            fits[0], fits, known, Roles(("b",), judges), run_here, nk_role="poles"
        ).name

    assert chosen(("c",)) == "linear:a+b/1/2"
    # A recording that judges is never part of a fit.
    assert chosen(("b", "c")) == "linear:a/1/2"


@pytest.mark.thorough
def test_the_ratio_is_over_all_recordings_but_those_of_the_fit(recordings):
    # Large inputs count less: a map is worth having, on each recording in its own measure.
    bent = [replace(one, input=np.arctanh(0.95 * one.input)) for one in recordings]
    fits = [fit([one], Orders(1, 2, 1), OPTIONS) for one in bent[:2]]
    found = linear_reference(
        fits[0], fits, bent, Roles(("a", "b"), ("c",)), run_here, nk_role="poles"
    )
    errors = [
        [rmsd(one.output, validation_output(model, one)) for one in bent[1:]]
        for model in (fits[0].model, found.fit.model)
    ]
    expected = np.exp(np.mean(np.log(errors[0]) - np.log(errors[1])))
    assert expected < 0.9
    assert found.ratio == pytest.approx(expected)


def lag_with_level(name, seed, level):
    """A lag whose output stands at a level of its own, as a room's temperature."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.uniform(0, 1, 40), 15)
    output = level + lfilter([0.0, 0.1], [1.0, -0.9], current)
    return Recording(name, current, output + 1e-3 * rng.standard_normal(600), 1e-3)


def test_a_level_of_the_output_is_no_dynamics():
    own = [lag_with_level(name, seed, 20.0) for seed, name in enumerate("ab")]
    options = replace(OPTIONS, join="experiments")
    (found,) = linear_fits(own, [Orders(1, 1, 1)], options, run_here)
    assert found.rmsd == pytest.approx(1e-3, rel=0.1)
    np.testing.assert_allclose(np.roots(found.model.denominator), 0.9, atol=0.01)
    held = simulate(found.model, np.full(900, 0.5), initial_state="steady")
    np.testing.assert_allclose(held, 20.0 + 0.5, atol=0.01)


def test_no_level_is_given_where_outputs_begin_at_zero():
    own = [lag_with_level(name, seed, 0.0) for seed, name in enumerate("ab")]
    (found,) = linear_fits(own, [Orders(1, 1, 1)], OPTIONS, run_here)
    assert not found.options.has_maps
