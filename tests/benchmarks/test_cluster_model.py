"""The model of a cluster against cases that can be worked out by hand."""

import pytest

from tests.benchmarks.cluster_model import Costs, Round, grid_rounds, play

FREE = Costs(0.0, 0.0, 0.0, 0.0, 0.0)


def test_one_worker_takes_the_sum_of_all_tasks():
    found = play((Round(50, 2.0, 0.0, 1),), 1, FREE, ahead=3)
    assert found.wall_s == pytest.approx(100.0)
    assert found.workers_busy == pytest.approx(1.0)


def test_equal_tasks_divide_among_workers_and_a_rest_is_waited_for():
    assert play((Round(40, 1.0, 0.0, 1),), 8, FREE, ahead=3).wall_s == pytest.approx(5)
    assert play((Round(41, 1.0, 0.0, 1),), 8, FREE, ahead=3).wall_s == pytest.approx(6)


def test_a_round_waits_for_the_one_before():
    rounds = (Round(1, 1.0, 0.0, 1), Round(8, 1.0, 0.0, 1))
    assert play(rounds, 8, FREE, ahead=3).wall_s == pytest.approx(2.0)


def test_a_parent_that_is_busy_all_the_time_sets_the_pace():
    costs = Costs(0.001, 0.002, 0.007, 0.0, 0.0)
    found = play((Round(2000, 0.1, 0.0, 1),), 1000, costs, ahead=3)
    assert found.wall_s == pytest.approx(2000 * 0.010, rel=0.01)
    assert found.parent_busy > 0.99


def test_a_scheduler_that_is_busy_all_the_time_sets_the_pace():
    costs = Costs(0.0, 0.0, 0.0, 0.01, 0.0)
    found = play((Round(1000, 0.1, 0.0, 1),), 500, costs, ahead=3)
    assert found.wall_s == pytest.approx(10.0, rel=0.02)


def test_larger_chunks_share_the_way():
    costs = Costs(0.005, 0.005, 0.0, 0.0, 0.0)
    alone = play((Round(4000, 0.01, 0.0, 1),), 100, costs, ahead=3).wall_s
    together = play((Round(4000, 0.01, 0.0, 10),), 100, costs, ahead=3).wall_s
    assert alone == pytest.approx(40.0, rel=0.05)
    assert together == pytest.approx(4.0, rel=0.1)


def test_tasks_of_different_length_have_the_mean_that_is_asked_for():
    found = play((Round(20_000, 0.5, 1.0, 1),), 1, FREE, ahead=3)
    assert found.wall_s == pytest.approx(10_000, rel=0.05)


def test_a_grid_grows_by_its_diagonals():
    rounds = grid_rounds(2, 3, 2, seconds=1.0, spread=0.0, chunk=1)
    assert [one.tasks for one in rounds] == [2, 4, 4, 2]
