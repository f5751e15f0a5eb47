from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.model.initial_candidates import nested_candidates
from hwid_cli.model.problem import scaled
from hwid_cli.model.scores import fit_percent
from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import FitOptions, LinearBlock, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.identify import identify_all
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers
from tests.model.plants import measured, plant

ANY = FitOptions(delays=(1, 2, 3, 4), units=6)


def delayed(delay, output_map="polynomial", input_map="dead_zone"):
    """A plant whose first coefficient is large: its delay can be told."""
    return replace(plant(input_map, output_map), delay=delay)


@pytest.mark.parametrize(
    "delay", [1, *(pytest.param(one, marks=pytest.mark.slow) for one in (2, 3)), 4]
)
@pytest.mark.parametrize(
    ("input_map", "output_map"),
    [("dead_zone", "polynomial"), ("none", "saturation"), ("polynomial", "none")],
)
def test_the_delay_of_a_nonlinear_plant_is_found(delay, input_map, output_map):
    true = delayed(delay, output_map, input_map)
    recording = measured(true, noise=0.01)
    # Two coefficients of B leave no room to make up for a wrong delay.
    result = fit([recording], Orders(2, 2, 1), ANY)
    assert result.orders == result.model.orders == Orders(2, 2, delay)
    alone = fit([recording], Orders(2, 2, delay), FitOptions(units=6))
    # Other starts lead to the same optimum within what two small gains may leave.
    assert result.rmsd < 1.02 * alone.rmsd


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
def test_a_linear_model_has_the_delay_too(initial_state):
    true = plant("none", "none", initial_state)
    linear = FitOptions(input_map="none", output_map="none", delays=(1, 2, 3))
    options = replace(linear, initial_state=initial_state)
    result = fit([measured(true)], Orders(2, 2, 1), options)
    assert result.orders.nk == 2
    assert result.rmsd < 1e-9


def test_one_delay_is_that_delay():
    recording = measured(delayed(3), noise=0.01)
    listed = fit([recording], Orders(2, 2, 1), FitOptions(delays=(3,), units=6))
    plain = fit([recording], Orders(2, 2, 3), FitOptions(units=6))
    assert listed.orders == plain.orders
    assert listed.rmsd == plain.rmsd


@pytest.mark.thorough
def test_more_parameters_never_fit_worse_whatever_delays_are_found():
    recording = measured(delayed(3), noise=0.01)
    small = fit([recording], Orders(1, 2, 1), ANY)
    for orders in (Orders(2, 2, 1), Orders(1, 3, 1), Orders(4, 3, 1)):
        large = fit([recording], orders, ANY, contained=[small.model])
        assert large.rmsd <= small.rmsd * (1.0 + 1e-9)
        assert large.orders.nk in ANY.delays


@pytest.mark.thorough
def test_a_group_begins_with_members_of_different_delays():
    pair = [measured(delayed(3), seed=seed, noise=0.01) for seed in (1, 2)]
    given = replace(ANY, join="experiments")
    right = fit(pair[:1], Orders(2, 2, 1), given).model
    wrong = fit(pair[1:], Orders(2, 2, 2), FitOptions(units=6)).model
    result = fit(pair, Orders(2, 2, 1), given, starts=[wrong, right])
    assert result.orders == Orders(2, 2, 3)
    other = measured(delayed(3), seed=3)
    y = simulate(result.model, other.input, initial_state=np.zeros(0))
    assert fit_percent(other.output, y) > 97.0


def test_a_start_of_a_delay_that_is_not_tried_is_refused():
    recording = measured(delayed(3), noise=0.01)
    model = fit([recording], Orders(2, 2, 3), FitOptions(units=6)).model
    with pytest.raises(ValueError, match="a start must have the orders"):
        fit([recording], Orders(2, 2, 1), replace(ANY, delays=(1, 2)), starts=[model])


@pytest.mark.thorough
def test_a_given_block_starts_with_every_delay_that_contains_it():
    true = delayed(2)
    recording = measured(true, noise=0.01)
    block = LinearBlock(tuple(true.numerator), tuple(true.denominator), 2)
    given = replace(ANY, linear_block=block)
    assert fit([recording], Orders(2, 2, 1), given).orders.nk == 2


@pytest.mark.parametrize("delays", [(-1,), (1.5,)])
def test_delays_that_are_none_are_refused(delays):
    with pytest.raises(ValueError, match="delays must be integers >= 0"):
        FitOptions(delays=delays)


def test_delays_are_sorted_and_counted_once():
    assert FitOptions(delays=(3, 1, 3)).delays == (1, 3)


@pytest.mark.thorough
def test_a_smaller_model_keeps_its_own_delay_where_that_is_needed():
    recording = measured(plant("dead_zone", "polynomial"), noise=0.01)
    options = FitOptions(units=4, delays=(1, 2, 3))
    small = fit([recording], Orders(1, 2, 1), FitOptions(units=4)).model
    problem = scaled([recording], options)
    (one,) = nested_candidates(problem, Orders(2, 2, 3), options, [small])
    assert one.model.orders == Orders(2, 2, 1)
    assert one.free_responses.shape == (1, 2)


FOUR = (10, 11, 12, 13)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("delays", "seeds"),
    [
        pytest.param((1, 2, 3, 4, 5), FOUR, marks=pytest.mark.slow),
        pytest.param((2, 3, 4), FOUR, marks=pytest.mark.slow),
        pytest.param((2, 3), FOUR, marks=pytest.mark.slow),
        ((2, 3), (10, 12)),
    ],
)
def test_the_cells_of_a_grid_find_the_delays_of_fits_alone(delays, seeds):
    # A short screening alone takes another delay in some of them.
    options = FitOptions(input_map="dead_zone", output_map="saturation", delays=delays)
    settings = RunSettings(store=MemoryStore(), workers=Workers(jobs=1))
    recordings = [late_plant(seed) for seed in seeds]
    grid = OrdersOptions(nb=(1, 2), nk=(1, 2))
    for found in identify_all(recordings, grid, options, settings):
        (recording,) = (one for one in recordings if one.name == found.name)
        alone = fit([recording], replace(found.orders, nk=1), options)
        assert found.rmsd < 1.1 * alone.rmsd


def late_plant(seed):
    """Dead zone, block with three samples of delay, saturation; levels held."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-2.5, 2.5, 60), rng.integers(3, 30, 60))
    block = ([0.0, 0.0, 0.0, 0.05, 0.03], [1.0, -1.6, 0.68])
    y = np.clip(lfilter(*block, u - np.clip(u, -0.4, 0.4)), -1.2, 1.2)
    noise = 0.01 * np.std(y) * rng.standard_normal(u.size)
    return Recording(f"r{seed}", u, y + noise, 1e-3)
