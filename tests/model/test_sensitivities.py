import numpy as np
import pytest

from hwid_cli.model import candidates, points, sensitivities, static_map
from hwid_cli.records.model import MAP_KINDS, HammersteinWiener
from tests.model.plants import MAPS, WITHOUT_SLOPE, level_input

DENOMINATOR = np.real(np.poly([0.95, 0.8 * np.exp(0.5j), 0.8 * np.exp(-0.5j)]))
PAIRS = [(kind, kind) for kind in MAP_KINDS if kind not in WITHOUT_SLOPE] + [
    ("piecewise_linear", "saturation"),
    ("dead_zone", "polynomial"),
]


def make_candidate(input_map, output_map, initial_state, n_experiments=2):
    rng = np.random.default_rng(3)
    model = HammersteinWiener(
        MAPS[input_map],
        np.array([0.02, 0.01]),
        DENOMINATOR,
        2,
        MAPS[output_map],
        sample_time_s=1.0,
        initial_state=initial_state,
    )
    n_state = model.orders.n_state if initial_state == "estimated" else 0
    return candidates.Candidate(model, rng.standard_normal((n_experiments, n_state)))


def make_experiments():
    return [
        candidates.FitData(level_input(200, seed), np.zeros(200)) for seed in (1, 2)
    ]


def numerical_jacobian(candidate, experiments, *, with_positions, step=1e-6):
    """Central differences of the simulated outputs, all experiments joined."""
    place = candidates.columns(candidate, with_positions=with_positions)
    point = points.point_of(candidate)

    def outputs(change):
        there = points.candidate_at(points.moved(point, change, place), candidate)
        return np.concatenate(sensitivities.simulated_outputs(there, experiments))

    unit = step * np.eye(place.total)
    return np.stack([(outputs(e) - outputs(-e)) / (2.0 * step) for e in unit], axis=1)


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
@pytest.mark.parametrize(("input_map", "output_map"), PAIRS)
def test_normal_equations_agree_with_central_differences(
    input_map, output_map, initial_state
):
    for with_positions in (True, False):
        assert_agree(input_map, output_map, initial_state, with_positions)


def assert_agree(input_map, output_map, initial_state, with_positions):
    candidate = make_candidate(input_map, output_map, initial_state)
    experiments = make_experiments()
    jacobian = numerical_jacobian(candidate, experiments, with_positions=with_positions)
    residual = np.concatenate([one.output for one in experiments]) - np.concatenate(
        sensitivities.simulated_outputs(candidate, experiments)
    )
    got = sensitivities.equations(candidate, experiments, with_positions=with_positions)
    size = np.sqrt(np.outer(np.diag(got.matrix), np.diag(got.matrix)))
    # A sample within a step of a kink has no derivative: hence not closer.
    assert np.all(np.abs(got.matrix - jacobian.T @ jacobian) <= 2e-2 * size + 1e-9)
    norm = np.sqrt(np.diag(got.matrix)) * np.linalg.norm(residual)
    assert np.all(np.abs(got.vector - jacobian.T @ residual) <= 2e-2 * norm + 1e-9)


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
def test_normal_equations_of_smooth_maps_are_exact(initial_state):
    candidate = make_candidate("polynomial", "polynomial", initial_state)
    experiments = make_experiments()
    jacobian = numerical_jacobian(candidate, experiments, with_positions=True)
    got = sensitivities.equations(candidate, experiments, with_positions=True)
    size = np.sqrt(np.outer(np.diag(got.matrix), np.diag(got.matrix)))
    assert np.all(np.abs(got.matrix - jacobian.T @ jacobian) <= 1e-6 * size)


@pytest.mark.parametrize("output_map", ["piecewise_linear", "polynomial"])
def test_thinned_equations_are_those_of_the_samples_that_count(output_map):
    candidate = make_candidate("piecewise_linear", output_map, "estimated")
    experiments = make_experiments()
    few = candidates.thinned(experiments, 130)
    counted = few[0].counted
    np.testing.assert_array_equal(counted, np.r_[np.arange(50), np.arange(50, 200, 3)])
    got = sensitivities.equations(candidate, few, with_positions=True)
    jacobian = numerical_jacobian(candidate, experiments, with_positions=True)
    kept = jacobian[np.r_[counted, 200 + counted]]
    expected = 2.0 * kept.T @ kept
    size = np.sqrt(np.outer(np.diag(got.matrix), np.diag(got.matrix)))
    assert np.all(np.abs(got.matrix - expected) <= 3e-2 * size + 1e-9)


@pytest.mark.parametrize("stride", [2, 3, 40])
def test_rows_of_few_samples_are_those_rows_of_all(stride):
    """B is applied to whole chunks or to single rows; both are the same sums."""
    candidate = make_candidate("piecewise_linear", "saturation", "estimated", 1)
    point = points.point_of(candidate)
    place = candidates.columns(candidate, with_positions=True)
    # Three chunks of the recursions, the last one short.
    whole = candidates.FitData(level_input(600, 1), np.zeros(600))
    found = sensitivities.simulated(point, [whole])
    before = static_map.derivatives(point.input_map, whole.input, with_positions=True)

    def rows(counted):
        x = found.signals[0][1][counted]
        after = static_map.derivatives(point.output_map, x, with_positions=True)
        few = sensitivities.Simulated(found.signals, (np.zeros(counted.size),), 0.0)
        return sensitivities._rows(point, place, (before, after), (0, few, counted))

    counted = np.arange(1, 600, stride)
    np.testing.assert_array_equal(
        rows(counted)[:, :-1], rows(np.arange(600))[counted, :-1]
    )


def test_cost_is_the_sum_of_squared_residuals():
    candidate = make_candidate("none", "none", "zero")
    experiments = make_experiments()
    simulated = np.concatenate(sensitivities.simulated_outputs(candidate, experiments))
    assert sensitivities.cost(candidate, experiments) == pytest.approx(
        float(simulated @ simulated), rel=1e-13
    )


def test_cost_of_a_diverging_candidate_is_infinite():
    model = HammersteinWiener(
        MAPS["none"], np.ones(1), np.array([1.0, -1e9]), 1, MAPS["none"], 1.0
    )
    experiment = candidates.FitData(np.ones(200), np.zeros(200))
    candidate = candidates.Candidate(model, np.zeros((1, 0)))
    assert sensitivities.cost(candidate, [experiment]) == np.inf


def test_each_experiment_depends_on_its_own_initial_state_only():
    candidate = make_candidate("none", "none", "estimated")
    place = candidates.columns(candidate, with_positions=True)
    got = sensitivities.equations(candidate, make_experiments(), with_positions=True)
    block = got.matrix[place.free_responses, place.free_responses]
    own = place.n_state
    assert np.all(block[:own, own:] == 0.0)
    assert np.all(np.diag(block) > 0.0)


def test_a_step_of_zero_changes_nothing():
    candidate = make_candidate("piecewise_linear", "piecewise_linear", "estimated")
    place = candidates.columns(candidate, with_positions=True)
    same = points.moved(points.point_of(candidate), np.zeros(place.total), place)
    np.testing.assert_array_equal(same.denominator, DENOMINATOR)
    np.testing.assert_array_equal(
        static_map.evaluate(same.input_map, np.ones(1)),
        static_map.evaluate(candidate.model.input_map, np.ones(1)),
    )
