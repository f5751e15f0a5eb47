import numpy as np
import pytest

from hwid_cli.model.candidates import Candidate, FitData, columns
from hwid_cli.model.normal_equations import solved
from hwid_cli.model.points import moved, point_of
from hwid_cli.model.sensitivities import normal_equations, simulated
from tests.model.plants import level_input, plant


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_initial_states_are_eliminated_without_a_change(count):
    rng = np.random.default_rng(count)
    n_state, before, after = 3, 4, 5
    part = slice(before, before + count * n_state)
    size = part.stop + after
    # Rows of one experiment know its own initial state only.
    matrix = np.zeros((size, size))
    for k in range(count):
        rows = rng.standard_normal((40, size))
        rows[:, before : before + k * n_state] = 0.0
        rows[:, before + (k + 1) * n_state : part.stop] = 0.0
        matrix += rows.T @ rows
    vector = rng.standard_normal(size)
    found = solved(matrix, vector, 0.3, (part, n_state))
    expected = np.linalg.solve(matrix + 0.3 * np.eye(size), vector)
    # Two ways of the same elimination differ by rounding.
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)
    bad = matrix - 10.0 * np.max(matrix) * np.eye(size)
    assert solved(bad, vector, 0.3, (part, n_state)) is None


@pytest.mark.parametrize(
    "kinds", [("none", "none"), ("piecewise_linear", "polynomial")]
)
def test_equations_of_many_experiments_are_those_of_differences(kinds):
    model = plant(*kinds, "estimated")
    rng = np.random.default_rng(3)
    experiments = [
        FitData(level_input(60 + 10 * k, k), rng.standard_normal(60 + 10 * k))
        for k in range(4)
    ]
    candidate = Candidate(model, 0.3 * rng.standard_normal((4, 3)))
    place = columns(candidate, with_positions=True)
    point = point_of(candidate)
    found = simulated(point, experiments)

    def residual(change):
        at = moved(point, change, place)
        return np.concatenate(simulated(at, experiments).residuals)

    unit = 1e-6 * np.eye(place.total)
    jacobian = -np.array([(residual(e) - residual(-e)) / 2e-6 for e in unit]).T
    equations = normal_equations(point, place, experiments, found)
    # Central differences of 1e-6 have errors of 1e-9; sums over 300 samples. At a
    # break-point both one-sided slopes are derivatives: those rows are few.
    scale = np.max(np.abs(jacobian.T @ jacobian))
    np.testing.assert_allclose(
        equations.matrix, jacobian.T @ jacobian, atol=1e-5 * scale
    )
    own = place.free_responses
    blocks = equations.matrix[own, own].reshape(4, 3, 4, 3)
    for k in range(4):
        for other in range(4):
            assert (other == k) == bool(np.any(blocks[k, :, other] != 0.0))
