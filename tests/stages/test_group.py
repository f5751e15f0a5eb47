import re
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.model.uncertainty import parameter_covariance
from hwid_cli.records.experiment import GroupOptions, OrdersOptions
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.group import group_key, stored_tasks
from hwid_cli.stages.group_levels import GroupPlan, search_all
from hwid_cli.stages.identify import identify_all
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers, run_tasks

QUICK = FitOptions(
    units=4, max_iterations=20, starts=1, initial_state="zero", join="experiments"
)
GRID = OrdersOptions(nb=(1, 2), nk=(1,))


def recording_of(name, low, high, seed):
    """A first-order lag behind a map whose slope falls from 1 to 0.3 at an input of 1."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(low, high, 15), 10)
    w = np.minimum(u, 0.7 + 0.3 * u)
    y = np.zeros(u.size)
    for k in range(1, u.size):
        y[k] = 0.8 * y[k - 1] + 0.2 * w[k - 1]
    return Recording(name, u, y + 0.001 * rng.standard_normal(u.size), 1e-3)


# Two below the bend, one above it, and one of another sign: nothing joins with that.
MIRRORED = recording_of("d", -0.8, 0.8, 4)
RECORDINGS = (
    recording_of("a", -0.8, 0.8, 1),
    recording_of("b", -0.8, 0.8, 2),
    recording_of("c", 1.2, 4.0, 3),
    replace(MIRRORED, output=-MIRRORED.output),
)
NAMES = ("a", "b", "c", "d")


def plan(**changes):
    values = {
        "recordings": RECORDINGS,
        "start": None,
        "candidates": NAMES,
        "validate": NAMES,
        "orders": GRID,
        "fit_options": QUICK,
        "options": GroupOptions(keep={"best": True}, max_level=3),
        "threshold": 0.05,
    }
    return GroupPlan(**(values | changes))


class Bench:
    """Runs levels in this process and writes down what was asked."""

    def __init__(self, store=None, stop_after=None):
        self.store = store or MemoryStore()
        self.computed = []
        self.stop_after = stop_after

    def on_done(self, item):
        if not item.from_cache:
            self.computed.append(item.task.name)
            if len(self.computed) == self.stop_after:
                raise KeyboardInterrupt

    def __call__(self, _level, _unit, _total, work):
        settings = RunSettings(self.store, Workers(1), on_done=self.on_done)
        return work(lambda tasks: run_tasks(tasks, settings))


@pytest.fixture(scope="module")
def bench():
    return Bench()


@pytest.fixture(scope="module")
def search(bench):
    return search_all(plan(), bench)


def same(one, other):
    # As text, because a missing RMSD is NaN, which is not equal to itself.
    return (
        str(one.groups) == str(other.groups)
        and one.joins == other.joins
        and one.chain == other.chain
        and np.array_equal(one.rmsd, other.rmsd, equal_nan=True)
    )


def test_grouping_covers_what_no_single_recording_covers(search):
    singles = [one for one in search.groups if one.level == 1]

    assert max(one.coverage for one in singles) == 2
    assert search.chain_groups[-1].coverage == 3
    assert set(search.chain[-1].split("+")) >= {"c"}
    assert "d" not in search.chain[-1]


def test_a_group_is_scored_by_simulating_its_best_model(search):
    for group, fit, values in zip(search.groups, search.fits, search.rmsd, strict=True):
        if fit is None:
            continue
        expected = [
            rmsd(one.output, validation_output(fit.model, one)) for one in RECORDINGS
        ]
        np.testing.assert_array_equal(values, expected)
        assert group.coverage == sum(value < 0.05 for value in expected)
        assert group.validation_rmsd == pytest.approx(
            np.sqrt(np.mean(np.square(expected))), rel=1e-12
        )
        assert (fit.orders.nb, fit.orders.nf) == (group.nb, group.nk)
        assert fit.name == group.name


@pytest.mark.thorough
def test_what_no_group_may_hold_is_scored_apart(search):
    validated = replace(plan(), candidates=("a", "b", "c"))
    place = validated.validate.index("d")
    scored = search_all(validated, Bench())

    assert validated.is_unseen.tolist() == [name == "d" for name in validated.validate]
    assert not plan().is_unseen.any()
    assert all(np.isnan(one.unseen_rmsd) for one in search.groups)
    for group, values in zip(scored.groups, scored.rmsd, strict=True):
        if group.coverage:
            assert group.unseen_rmsd == pytest.approx(values[place], rel=1e-12)
            assert group.unseen_coverage == int(values[place] < 0.05)


def test_the_best_model_of_every_group_has_standard_errors(search):
    by_name = {one.name: one for one in RECORDINGS}
    groups = [one for one in search.fits if one is not None and "+" in one.name]

    assert groups
    for one in groups:
        whole = [by_name[name] for name in one.identified_on]
        expected = parameter_covariance(one, whole)
        np.testing.assert_allclose(
            one.uncertainty.standard_errors,
            np.sqrt(np.diag(expected.matrix)),
            rtol=1e-12,
        )
        assert np.isfinite(one.information.bic)


def test_models_that_fail_on_their_own_recordings_are_not_simulated(search, bench):
    failed = [one for one in search.groups if one.n_self_passed == 0]

    assert failed
    assert all("d" in one.recordings for one in failed)
    assert all(one.coverage == 0 and not one.model_name for one in failed)
    simulated = {name.split(" on ")[0] for name in bench.computed if " on " in name}
    assert not simulated & {one.name for one in failed}


def test_single_recordings_are_the_tasks_of_identify():
    bench = Bench()
    identify_all(RECORDINGS, GRID, QUICK, RunSettings(bench.store, Workers(1)))
    search_all(plan(options=GroupOptions(max_level=1)), bench)

    assert not [name for name in bench.computed if " on " not in name]


@pytest.mark.thorough
def test_a_search_is_resumed_in_the_middle_of_a_level(search, bench):
    total = len(bench.computed)
    stopped = Bench(stop_after=total - 4)
    with pytest.raises(KeyboardInterrupt):
        search_all(plan(), stopped)
    again = Bench(store=stopped.store)

    assert same(search_all(plan(), again), search)
    assert len(again.computed) == 4


def test_a_second_search_computes_nothing(search, bench):
    again = Bench(store=bench.store)

    assert same(search_all(plan(), again), search)
    assert again.computed == []


def test_a_search_is_forecast_from_the_cache_only_where_all_of_it_is_there(
    search, bench
):
    assert stored_tasks(plan(), bench.store) >= len(bench.computed)
    assert stored_tasks(plan(threshold=0.05), MemoryStore()) is None
    further = plan(fit_options=replace(QUICK, max_iterations=21))
    assert stored_tasks(further, bench.store) is None


@pytest.mark.thorough
def test_the_order_in_which_starts_are_named_changes_nothing_without_order(search):
    one, other = (
        search_all(plan(start=start), Bench()) for start in (("a", "c"), ("c", "a"))
    )

    assert same(one, other)


def test_concatenated_groups_keep_their_order():
    ordered = plan(
        fit_options=replace(QUICK, join="concatenate"),
        start=("c", "a"),
        options=GroupOptions(keep={"top": 2}, max_level=2),
        candidates=("a", "c"),
    )
    bench = Bench()
    search = search_all(ordered, bench)

    assert [one.name for one in search.groups] == ["c", "a", "c+a", "a+c"]
    # Each order is a fit of its own: the second record starts where the first one ends.
    assert {"c+a/1/1", "a+c/1/1"} <= set(bench.computed)
    assert search.groups[2].rmsd != search.groups[3].rmsd


def _fitted(bench):
    """Names of the fits among what was computed."""
    return [name for name in bench.computed if re.fullmatch(r"[a-d+]+/\d+/\d+", name)]


def test_a_recording_that_only_joins_is_fitted_alone_for_its_warm_start():
    bench = Bench()
    options = GroupOptions(keep={"best": True}, max_level=2)
    search_all(plan(start=("a",), candidates=("a", "b"), options=options), bench)

    assert _fitted(bench) == ["a/1/1", "a/2/1", "b/1/1", "b/2/1", "a+b/1/1", "a+b/2/1"]


@pytest.mark.thorough
def test_cold_fits_are_other_tasks_than_warm_ones():
    warm, cold = (
        GroupOptions(keep={"best": True}, max_level=2, warm_start=flag)
        for flag in (True, False)
    )
    bench = Bench()
    search_all(plan(options=warm), bench)
    before = len(bench.computed)
    search_all(plan(options=cold), bench)

    assert any("+" in name for name in bench.computed[before:])


def test_cold_fits_need_no_models_of_recordings_that_only_join():
    bench = Bench()
    options = GroupOptions(keep={"best": True}, max_level=2, warm_start=False)
    search_all(plan(start=("a",), candidates=("a", "b"), options=options), bench)

    assert _fitted(bench) == ["a/1/1", "a/2/1", "a+b/1/1", "a+b/2/1"]


@pytest.mark.parametrize(
    "change",
    [
        {"start": ("a",)},
        {"candidates": ("a", "b", "c")},
        {"validate": ("a", "b")},
        {"orders": OrdersOptions(nb=(1,), nk=(1,))},
        {"fit_options": replace(QUICK, units=5)},
        {"options": GroupOptions(keep={"best": True}, max_level=4)},
        {"options": GroupOptions(keep={"top": 1}, max_level=3)},
        {"options": GroupOptions(keep={"best": True}, max_level=3, warm_start=False)},
        {"threshold": 0.06},
        {"recordings": RECORDINGS[:3]},
    ],
    ids=lambda change: next(iter(change)),
)
def test_everything_that_matters_alters_the_key(change):
    assert group_key(plan(**change)) != group_key(plan())
