import numpy as np
import pytest

from hwid_cli.maths.model import candidates, sensitivities, static_map
from hwid_cli.records.model import MAP_KINDS, HammersteinWiener
from tests.maths.model.plants import MAPS, WITHOUT_SLOPE, level_input

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
        candidates.Experiment(level_input(200, seed), np.zeros(200)) for seed in (1, 2)
    ]


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
@pytest.mark.parametrize(("input_map", "output_map"), PAIRS)
def test_jacobian_agrees_with_central_differences(input_map, output_map, initial_state):
    candidate = make_candidate(input_map, output_map, initial_state)
    experiments = make_experiments()
    for index, one in enumerate(experiments):
        jacobian, _ = sensitivities.jacobian_and_residual(
            candidate, index, one, with_positions=True
        )
        step = 1e-6
        for k in range(jacobian.shape[1]):
            change = np.zeros(jacobian.shape[1])
            change[k] = step
            above, below = (
                sensitivities.simulated_outputs(
                    candidates.moved(candidate, sign * change, with_positions=True),
                    experiments,
                )[index]
                for sign in (1.0, -1.0)
            )
            difference = (above - below) / (2.0 * step)
            # A sample within a step of a kink has no derivative: leave those few out.
            far = np.abs(difference - jacobian[:, k]) > 1e-6 * np.ptp(jacobian[:, k])
            assert np.mean(far & (np.abs(difference - jacobian[:, k]) > 1e-6)) < 0.01


@pytest.mark.parametrize("with_positions", [True, False])
def test_normal_equations_are_those_of_all_experiments(with_positions):
    candidate = make_candidate("piecewise_linear", "polynomial", "estimated")
    experiments = make_experiments()
    parts = [
        sensitivities.jacobian_and_residual(
            candidate, index, one, with_positions=with_positions
        )
        for index, one in enumerate(experiments)
    ]
    jacobian = np.concatenate([part[0] for part in parts])
    residual = np.concatenate([part[1] for part in parts])
    got = sensitivities.equations(candidate, experiments, with_positions=with_positions)
    np.testing.assert_allclose(got.matrix, jacobian.T @ jacobian, rtol=1e-10)
    np.testing.assert_allclose(got.vector, jacobian.T @ residual, rtol=1e-10)


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
    experiment = candidates.Experiment(np.ones(200), np.zeros(200))
    candidate = candidates.Candidate(model, np.zeros((1, 0)))
    assert sensitivities.cost(candidate, [experiment]) == np.inf


def test_each_experiment_depends_on_its_own_initial_state_only():
    candidate = make_candidate("none", "none", "estimated")
    place = candidates.columns(candidate, with_positions=True)
    jacobian, _ = sensitivities.jacobian_and_residual(
        candidate, 1, make_experiments()[1], with_positions=True
    )
    free = jacobian[:, place.free_responses].reshape(200, 2, place.n_state)
    assert np.all(free[:, 0] == 0.0)
    assert np.all(np.any(free[:, 1] != 0.0, axis=0))


def test_a_step_of_zero_changes_nothing():
    candidate = make_candidate("piecewise_linear", "piecewise_linear", "estimated")
    place = candidates.columns(candidate, with_positions=True)
    same = candidates.moved(candidate, np.zeros(place.total), with_positions=True)
    np.testing.assert_array_equal(same.model.denominator, DENOMINATOR)
    np.testing.assert_array_equal(
        static_map.evaluate(same.model.input_map, np.ones(1)),
        static_map.evaluate(candidate.model.input_map, np.ones(1)),
    )
