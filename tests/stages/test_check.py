from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import GroupOptions, OrdersOptions
from hwid_cli.records.groups import Group
from hwid_cli.records.model import FitOptions, LinearBlock, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.fit_seconds import (
    MEASURED,
    fit_seconds,
    map_seconds,
    share_of_round,
    time_fits,
)
from hwid_cli.stages.group import group_bound
from hwid_cli.stages.group_search import search_groups
from hwid_cli.stages.run_seconds import with_start

NAMES = tuple("abcdefg")


def widest_search(start, options, *, is_ordered):
    """Number of groups on each level if all of a level are equally good."""
    counts = {}

    def score(tried):
        counts[len(tried[0])] = len(tried)
        return [
            Group(
                recordings=one,
                coverage=len(one),
                nb=1,
                nk=1,
                rmsd=0.1,
                validation_rmsd=0.1,
                n_models=1,
                n_self_passed=1,
                n_cross_passed=1,
                is_kept=False,
            )
            for one in tried
        ]

    search_groups(start, NAMES, options, score, n_validate=99, is_ordered=is_ordered)
    return tuple(counts.get(level, 0) for level in range(2, options.max_level + 1))


@pytest.mark.parametrize("is_ordered", [True, False])
@pytest.mark.parametrize("start", [None, ("a", "b", "c")])
@pytest.mark.parametrize(
    "keep",
    [{"top": 2}, {"best": True}, {"top": (3, 1)}, {"coverage_at_least": 1}],
    ids=str,
)
def test_no_search_tries_more_groups_than_the_bound(start, keep, is_ordered):
    options = GroupOptions(start=start, keep=keep, max_level=4)
    tried = widest_search(start, options, is_ordered=is_ordered)
    n_start = len(start or NAMES)
    bounds = group_bound(n_start, len(NAMES), options, is_ordered=is_ordered)

    assert all(most >= one for most, one in zip(bounds, tried, strict=True))
    # Of groups that are told apart by their order, the bound is what a search does.
    if is_ordered and keep != {"best": True}:
        assert bounds == tried


def test_time_grows_with_every_size():
    orders = Orders(3, 3, 1)
    usual = fit_seconds(MEASURED, orders, 4000, units=10)

    assert usual > fit_seconds(MEASURED, orders, 2000, units=10)
    assert usual > fit_seconds(MEASURED, orders, 4000, units=5)
    assert usual > fit_seconds(MEASURED, Orders(1, 2, 1), 4000, units=10)
    assert usual < fit_seconds(MEASURED, orders, 4000, units=10, n_recordings=2)


def test_a_fit_of_the_timed_size_takes_the_timed_seconds():
    cost = replace(MEASURED, seconds=0.3, n_samples=50_000)

    assert fit_seconds(cost, Orders(3, 3, 1), 50_000, units=10) == pytest.approx(0.3)
    # Beyond 20 000 samples the time grows with their number.
    assert fit_seconds(cost, Orders(3, 3, 1), 100_000, units=10) == pytest.approx(0.6)


def test_the_grid_of_a_group_is_searched_in_fewer_rounds():
    fourth = 3

    assert share_of_round(fourth) == share_of_round(1)
    assert share_of_round(fourth, of_group=True) == share_of_round(9)
    assert share_of_round(fourth - 1, of_group=True) == share_of_round(1)


def test_a_fit_that_keeps_a_block_is_timed_with_the_orders_of_that_block():
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1.0, 1.0, 30), 10)
    recording = Recording("r", u, lfilter([0.0, 0.1, 0.05], [1.0, -1.5, 0.6], u), 1e-3)
    block = LinearBlock((0.1, 0.05), (1.0, -1.5, 0.6), frozen=True)
    cost = time_fits(
        [recording], OrdersOptions(nb=(2,), nk=(2,)), FitOptions(linear_block=block)
    )
    assert cost.seconds > 0.0
    assert all(one > 0.0 for one in cost.rounds)
    assert "orders 2 2 1" in cost.source


def test_a_long_rest_before_the_motion_is_not_what_is_timed(monkeypatch):
    timed = []

    def fit(recordings, *_, **__):
        timed.append(recordings[0].input)
        return SimpleNamespace(model=None)

    monkeypatch.setattr("hwid_cli.stages.fit_seconds.fit", fit)
    # A fit to the rest alone would fail at once.
    u = np.concatenate([np.zeros(12_000), np.sin(np.arange(8000.0))])
    time_fits([Recording("r", u, u, 1e-3)], OrdersOptions(), FitOptions())

    assert {one.size for one in timed} == {10_000}
    assert all(np.count_nonzero(one) > 7000 for one in timed)


def test_the_first_stage_with_something_to_share_waits_for_its_processes():
    plans = [
        StagePlan("calibrate", "3 recordings", 3, None, 1.0, 0.0),
        StagePlan("identify", "8 fits", 8, 8, 0.0, 0.0, is_shared=True),
        StagePlan("order", "4 fits", 4, None, 2.0, 0.0, is_shared=True),
        StagePlan("group", "2 groups", 2, None, 3.0, 0.0, 5.0, is_shared=True),
    ]

    alone, shared = with_start(plans, 1), with_start(plans, 2)

    assert [one.seconds for one in alone] == [1.0, 0.0, 2.0 + 0.6, 3.0]
    assert [one.seconds for one in shared] == [1.0, 0.0, 2.0 + 0.6 + 1.6, 3.0]
    assert shared[3].longest_seconds == 5.0


def test_some_fits_of_maps_are_timed_each_on_a_recording_of_its_own(monkeypatch):
    clock, timed = [0.0], []

    def fit(recordings, orders, options):
        timed.append((recordings[0].name, options.input_units))
        # 1 to 5 s: long enough that no more than the least number is timed.
        clock[0] += len(timed)

    monkeypatch.setattr("hwid_cli.stages.fit_seconds.fit", fit)
    monkeypatch.setattr(
        "hwid_cli.stages.fit_seconds.time.process_time", lambda: clock[0]
    )
    u = np.sin(np.arange(2000.0))
    recordings = [Recording(name, u, u, 1e-3) for name in "ab"]
    maps = [FitOptions(input_units=2 + number) for number in range(10)]
    cost = replace(MEASURED, rounds=(1.0, 1.0, 1.0))

    least, most = map_seconds(cost, OrdersOptions(nb=(2,), nk=(2,)), recordings, maps)

    assert timed == [("a", 2), ("b", 4), ("a", 6), ("b", 8), ("a", 10)]
    # 3 s on the mean, known to two standard errors; two recordings, ten pairs of maps.
    error = 2.0 * (2.5 / 5) ** 0.5
    assert (least, most) == pytest.approx((20 * (3.0 - error), 20 * (3.0 + error)))
