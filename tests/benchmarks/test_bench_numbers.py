"""Numbers that the benchmarks work out themselves."""

import numpy as np
import pytest

from hwid_cli.records.model import Orders
from tests.benchmarks.bench_growth import exponent
from tests.benchmarks.bench_size import calls_each
from tests.benchmarks.by_hand import fit_by_hand
from tests.benchmarks.grid_scores import Scored, n_not_monotone, n_worse_than
from tests.benchmarks.plants import random_plant


def scored(nb, nf, train, percent):
    return Scored(Orders(nb, nf, 1), train, percent, True)


def test_more_parameters_that_train_worse_are_counted():
    grid = [
        scored(1, 1, 1.0, 0.0),
        scored(1, 2, 1.1, 0.0),  # worse than [1 1]
        scored(2, 1, 0.9, 0.0),
        scored(2, 2, 1.0, 0.0),  # worse than [2 1]
        scored(3, 1, 0.9, 0.0),  # as good as [2 1]
    ]
    assert n_not_monotone(grid) == 2


def test_models_below_the_linear_one_of_their_orders_are_counted():
    linear = [scored(1, 1, 1.0, 80.0), scored(2, 1, 1.0, 90.0)]
    found = [scored(2, 1, 1.0, 89.6), scored(1, 1, 1.0, 79.4)]
    assert n_worse_than(found, linear, 0.5) == 1


def test_exponent_of_a_power():
    sizes = np.array([1.0, 3.0, 10.0, 70.0])
    assert exponent(sizes, 2.0 * sizes**1.7) == pytest.approx(1.7)


@pytest.mark.thorough
def test_the_baseline_is_a_fair_one():
    orders, u, y, u_test, y_test = random_plant(0, 500)
    for free in (False, True):
        found = fit_by_hand(orders, u, y, free=free)
        # 1 % noise; a linear model of this plant leaves far more.
        assert np.std(y_test - found.simulate(u_test)) < 0.1 * np.std(y_test)
        assert found.is_stable


@pytest.mark.thorough
def test_a_recording_costs_few_calls_however_many_there_are(tmp_path):
    few, many = (calls_each(tmp_path / str(count), count) for count in (10, 60))

    # 2100 as this was written; 4400 before files of one form were told alike, 23 700 before
    # the form of a file was told from few rows.
    assert many < 3000
    # What is done once for all counts less and less.
    assert many < 1.02 * few
