from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.records.experiment import OrderOptions
from hwid_cli.records.maps import OwnFunction
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.map_choice import candidate_maps, fit_maps, recommend_maps
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings
from hwid_cli.tasks.workers import Workers

FIT = FitOptions(initial_state="zero")
ORDERS = Orders(1, 2, 1)


def recordings(count, *, noise=0.02, samples=600):
    """A dead zone before two poles, nothing behind them."""
    found = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-2.0, 2.0, samples // 10), 10)
        y = lfilter([0.0, 0.3], [1.0, -1.2, 0.5], u - np.clip(u, -0.6, 0.6))
        y = y + noise * np.std(y) * rng.standard_normal(u.size)
        found.append(Recording(f"r{seed}", u, y, 1.0))
    return found


def advice_on(chosen, options, *, settings=None):
    settings = settings or RunSettings(MemoryStore(), Workers(1))
    candidates = candidate_maps(FIT, options)
    fits = fit_maps(chosen, ORDERS, candidates, settings)
    return recommend_maps(fits, chosen, chosen, options.tolerance, settings)


def test_candidates_are_all_pairs_with_sizes_for_kinds_that_have_them():
    found = candidate_maps(FIT, OrderOptions(maps=("none", "polynomial"), units=(3,)))
    sides = {(one.input_map, one.input_units) for one in found}

    assert sides == {
        ("piecewise_linear", 10), ("piecewise_linear", 3), ("none", 10), ("polynomial", 10),
    }  # fmt: skip
    assert len(found) == len(set(found)) == 16
    assert found[0].of_input == FIT.of_input
    assert found[0].of_output == FIT.of_output


def test_both_sides_begin_with_their_own_kind_and_size():
    own = OwnFunction("curve", "")
    fit = replace(
        FIT, input_map="own_function", input_function=own, output_map="none", units=4
    )
    found = candidate_maps(fit, OrderOptions(units=(3,)))

    assert [(one.input_map, one.output_map) for one in found] == [
        ("own_function", "none")
    ]


def test_nothing_is_compared_unless_asked_for():
    assert len(candidate_maps(FIT, OrderOptions())) == 1


@pytest.mark.thorough
def test_the_maps_of_the_plant_are_recommended():
    options = OrderOptions(maps=("none", "dead_zone"), units=(3,))
    advice = advice_on(recordings(4), options)

    assert (advice.chosen.input_map, advice.chosen.output_map) == ("dead_zone", "none")
    assert advice.chosen.n_parameters == min(
        one.n_parameters for one in advice.candidates if one.factor < 1.05
    )
    assert advice.candidates[0].factor == 1.0
    assert (advice.given.input_units, advice.given.output_units) == (10, 10)
    assert advice.evidence.n_validation == 4


@pytest.mark.thorough
def test_too_many_units_for_few_data_are_not():
    chosen = recordings(4, noise=0.2, samples=120)
    advice = advice_on(chosen, OrderOptions(maps=("none",), units=(2, 4)))

    assert advice.chosen.n_parameters < advice.given.n_parameters
    assert advice.given.factor > 1.05


@pytest.mark.thorough
def test_a_lone_recording_leaves_the_choice_to_bic():
    options = OrderOptions(maps=("none", "dead_zone"))
    advice = advice_on(recordings(1), options)

    assert advice.evidence.n_validation == 0
    assert advice.chosen.bic == min(one.bic for one in advice.candidates)
    assert (advice.chosen.input_map, advice.chosen.output_map) == ("dead_zone", "none")
    # By its own RMSD the largest maps would have won.
    assert advice.candidates[0].n_parameters > advice.chosen.n_parameters


@pytest.mark.thorough
def test_all_comes_from_the_store_the_second_time():
    done = []
    settings = RunSettings(MemoryStore(), Workers(1), on_done=done.append)
    options, chosen = OrderOptions(maps=("none",)), recordings(2)
    first = advice_on(chosen, options, settings=settings)
    count = len(done)
    second = advice_on(chosen, options, settings=settings)

    assert first == second
    assert count == 2 * 4 + 2 * 2
    assert not any(one.from_cache for one in done[:count])
    assert all(one.from_cache for one in done[count:])


def test_recordings_that_a_model_cannot_be_fitted_to_give_no_advice():
    short = [
        replace(one, input=one.input[:5], output=one.output[:5])
        for one in recordings(2)
    ]

    assert advice_on(short, OrderOptions(maps=("none",))) is None


@pytest.mark.parametrize("join", ["concatenate", "experiments"])
def test_the_rule_for_joining_is_no_part_of_a_fit_of_one(join):
    settings, (one,) = RunSettings(MemoryStore(), Workers(1)), recordings(1)
    linear = FitOptions(input_map="none", output_map="none", join=join)
    ((fit,),) = fit_maps([one], ORDERS, [linear], settings)

    assert fit.options.join == "concatenate"
