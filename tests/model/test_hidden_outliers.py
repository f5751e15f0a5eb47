import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.candidates import Candidate, FitData
from hwid_cli.model.fit import fit
from hwid_cli.model.hidden_outliers import _known_states, without_hidden_outliers
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.bench_first_outliers import LINEAR, damaged, deviations
from tests.model.plants import level_input, plant


@pytest.mark.thorough
def test_early_outliers_do_not_hide_in_the_initial_state():
    # With all these the first samples were off by 3 to 16 times the noise.
    for seed in (6, 7, 9, 18, 23, 28, 32, 39):
        every, later = deviations(seed)
        assert every < 1.0, seed
        assert later < 0.5, seed


@pytest.mark.thorough
def test_early_outliers_behind_an_input_map_are_found_too():
    for seed in (7, 17, 23):
        assert deviations(seed, bent=True)[0] < 1.0, seed


def test_what_was_taken_for_an_outlier_is_said():
    recording, _, _, orders = damaged(6)
    assert (
        "of the first samples taken for outliers"
        in fit([recording], orders, LINEAR).message
    )


def test_a_machine_let_go_from_far_away_keeps_its_start():
    rng = np.random.default_rng(2)
    u = level_input(600, 3)
    denominator = np.real(np.poly([0.95, 0.9]))
    driven = lfilter([0.0, 0.01], denominator, u)
    # Twelve times further out than the input ever drives it.
    start = 12.0 * np.std(driven) * lfilter([1.0, -0.5], denominator, np.eye(1, 600)[0])
    y = driven + start
    size = 0.02 * np.std(driven)
    y = y + size * rng.standard_normal(600)
    found = fit([Recording("r", u, y, 1.0)], Orders(1, 2, 1), LINEAR)
    assert "outliers" not in found.message
    assert np.sqrt(np.mean((simulate(found.model, u) - driven - start) ** 2)) < size


@pytest.mark.parametrize("output_map", ["none", "polynomial"])
def test_known_states_go_on_from_their_sample(output_map):
    model = plant("saturation", output_map)
    u = level_input(300, 1)
    w = np.clip(u, *model.input_map.parameters)
    x = lfilter(np.r_[np.zeros(model.delay), model.numerator], model.denominator, w)
    states = _known_states(model, w, x)
    at = 300 - model.orders.n_state - len(states)
    for number in (0, 57, len(states) - 1):
        first = at + number
        again = lfilter(
            np.r_[np.zeros(model.delay), model.numerator], model.denominator, w[first:]
        ) + lfilter(states[number], model.denominator, np.eye(1, 300 - first)[0])
        # The same recursion from another sample on.
        np.testing.assert_allclose(again, x[first:], atol=1e-10)


def test_experiments_without_outliers_stay_as_they_are():
    model = plant("none", "none", "estimated")
    u = level_input(400, 4)
    y = simulate(model, u, initial_state=np.zeros(3))
    one = FitData(u, y + 0.01 * np.random.default_rng(0).standard_normal(400))
    candidate = Candidate(model, np.zeros((1, 3)))
    found, experiments, count = without_hidden_outliers(candidate, [one], 0.01)
    assert count == 0
    assert experiments[0] is one
    np.testing.assert_array_equal(found.free_responses, candidate.free_responses)


def test_squared_fits_take_nothing_for_an_outlier():
    recording, _, _, orders = damaged(6)
    squared = FitOptions(input_map="none", output_map="none")
    assert "outliers" not in fit([recording], orders, squared).message
