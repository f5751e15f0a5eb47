"""Least squares of several experiments beside the dense solution of numpy."""

import numpy as np
import pytest

from hwid_cli.model.joint_least_squares import Equations, solved


def equations(rng, n_own, counts=(40, 31, 55)):
    return [
        Equations(
            rng.standard_normal((n, 4)) * [1.0, 1e3, 1e-4, 1.0],
            rng.standard_normal((n, n_own)),
            rng.standard_normal(n),
        )
        for n in counts
    ]


def dense(parts):
    """All columns side by side, those of one experiment zero in the others."""
    n_own = parts[0].own.shape[1]
    rows = []
    for number, one in enumerate(parts):
        own = np.zeros((one.target.size, len(parts), n_own))
        own[:, number] = one.own
        rows.append(np.hstack([one.shared, own.reshape(one.target.size, -1)]))
    columns = np.vstack(rows)
    target = np.concatenate([one.target for one in parts])
    found = np.linalg.lstsq(columns, target, rcond=None)[0]
    return found, float(np.sum((target - columns @ found) ** 2))


@pytest.mark.parametrize("n_own", [0, 1, 5])
def test_it_is_the_dense_solution(n_own):
    parts = equations(np.random.default_rng(3), n_own)
    found, (wanted, cost) = solved(parts), dense(parts)
    assert found.shared == pytest.approx(wanted[:4], rel=1e-8)
    assert found.own == pytest.approx(wanted[4:].reshape(3, n_own), rel=1e-7)
    assert found.cost == pytest.approx(cost, rel=1e-12)


def test_a_column_of_zeros_has_no_part_in_it():
    parts = equations(np.random.default_rng(4), 2)
    for one in parts:
        one.shared[:, 1] = 0.0
    found = solved(parts)
    assert found.shared[1] == 0.0
    assert np.isfinite(found.cost)


@pytest.mark.parametrize("which", ["shared", "own"])
def test_what_is_not_finite_has_no_solution(which):
    parts = equations(np.random.default_rng(5), 2)
    getattr(parts[1], which)[3, 1] = np.inf
    found = solved(parts)
    assert found.cost == np.inf
    assert not found.shared.any()
    assert not found.own.any()
