"""Share of a force that goes with a variable, for forces that are given."""

import numpy as np
import pytest

from hwid_cli.diagnosis.covariates import Variable, binned, quantile_edges, shares

SIZE = 20_000


@pytest.fixture
def three():
    rng = np.random.default_rng(0)
    names = ("displacement", "velocity", "time")
    return [Variable(name, "-", rng.normal(size=SIZE)) for name in names]


def test_what_is_linear_is_taken_off(three):
    x, v = three[0].values, three[1].values

    found, constant = shares(50 * x + 0.3 * np.sign(v), three)

    # Chance takes 15 / 20 000 of each other variable.
    assert found[0] < 0.005
    assert found[2] < 0.005
    # A normal variable's sign, its straight part taken off, within 16 bins.
    assert found[1] > 0.95
    assert constant < 0.01


def test_a_constant_has_its_own_share(three):
    noise = np.random.default_rng(1).normal(size=SIZE)

    found, constant = shares(3.0 + noise, three)

    assert constant == pytest.approx(0.9, abs=0.01)
    assert np.max(found) < 0.005


def test_no_force_has_no_shares(three):
    found, constant = shares(np.zeros(SIZE), three)

    assert not found.any()
    assert constant == 0


def test_bins_hold_mean_and_spread():
    at, mean, spread, counts = binned(
        np.array([-5.0, 0.2, 0.4, 1.2, 9.0]),
        np.array([1.0, 3.0, 5.0, 2.0, 4.0]),
        np.array([0.0, 1.0, 2.0, 3.0]),
    )

    # What lies beyond the edges is in the first and last bin.
    assert list(counts) == [3, 1, 1]
    assert at == pytest.approx([-4.4 / 3, 1.2, 9.0])
    assert mean == pytest.approx([3.0, 2.0, 4.0])
    assert spread == pytest.approx([np.sqrt(8 / 3), 0.0, 0.0])


def test_edges_of_a_constant_are_two():
    assert quantile_edges(np.ones(10), 16).size == 2
