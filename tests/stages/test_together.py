"""One model of all recordings, on plants whose laws are written here."""

from dataclasses import dataclass, replace
from itertools import chain
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import GroupOptions, OrdersOptions
from hwid_cli.records.groups import Group, Join
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages import together
from hwid_cli.stages.group_levels import GroupPlan, search_all
from hwid_cli.stages.group_search import Found, with_whole
from hwid_cli.stages.together import (
    Candidate,
    fit_together,
    folds_of,
    kinds_tried,
    with_units,
)
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, run_tasks

GRID = OrdersOptions(nb=(1,), nk=(1, 2))
OPTIONS = FitOptions(
    units=6, initial_state="steady", join="experiments", starts=1, max_iterations=20
)
N = 300


def tank(u):
    """Level of a tank behind a pump: the outflow goes with the root of the level."""
    y, level = np.zeros(u.size), u[0] ** 2
    for k, pumped in enumerate(u):
        y[k] = level
        level += 0.05 * (pumped - np.sqrt(max(level, 0.0)))
    return y


def step(name, before, after, seed=0):
    u = np.where(np.arange(N) < 20, before, after)
    noise = 0.01 * np.random.default_rng(seed).standard_normal(N)
    return Recording(name, u, tank(u) + noise, 1.0)


STEPS = (
    step("a", 1.0, 2.0, 1),
    step("b", 2.0, 1.2, 2),
    step("c", 1.5, 2.6, 3),
    step("d", 2.2, 1.6, 4),
)


class Count:
    def __init__(self):
        self.tasks = []

    def __call__(self, total, work):
        def execute(tasks):
            assert len(tasks) == total
            self.tasks += tasks
            return run_tasks(tasks, RunSettings(MemoryStore()))

        return work(execute)


@pytest.fixture(scope="module")
def found():
    count = Count()
    return fit_together(STEPS, GRID, OPTIONS, count), count.tasks


@pytest.mark.thorough
def test_it_is_closer_to_new_inputs_than_any_model_of_one_recording(found):
    new = 1.8 + 0.6 * np.sin(2 * np.pi * np.arange(600) / 150)
    true = tank(new)

    def off(found):
        return np.std(simulate(found.model, new, initial_state="steady") - true)

    model, _ = found
    assert model.fit.identified_on == ("a", "b", "c", "d")
    single = [fit([one], Orders(1, 2, 1), OPTIONS) for one in STEPS]
    assert off(model.fit) < 0.5 * min(off(one) for one in single)
    assert model.fit.uncertainty is not None


@pytest.mark.thorough
def test_what_chooses_was_in_no_fit(found):
    """Each fold is a fit of the others; only the last fit is one of all."""
    model, tasks = found
    names = [tuple(one.name for one in task.arguments[0]) for task in tasks]
    assert names[-1] == ("a", "b", "c", "d")
    left_out = [set("abcd") - set(one) for one in names[:-1]]
    assert all(len(one) == 1 for one in left_out)
    per_candidate = [
        sorted(map(min, left_out[n : n + 4])) for n in range(0, len(left_out), 4)
    ]
    assert per_candidate == [list("abcd")] * len(per_candidate)
    assert len({task.key for task in tasks}) == len(tasks) == model.n_models


@pytest.mark.thorough
def test_maps_are_chosen_that_go_on_between_the_levels(found):
    """Of six units on either side, steps between few levels tell three on one side."""
    model, _ = found
    own = model.fit.options
    assert (own.input_map, own.output_map).count("none") == 1
    used = own.of_output if own.input_map == "none" else own.of_input
    assert used.units <= 5


def test_folds_hold_each_recording_once():
    for n in (2, 5, 6, 23):
        folds = folds_of(n)
        assert len(folds) == min(n, 5)
        assert sorted(chain.from_iterable(folds)) == list(range(n))


def test_units_are_of_maps_that_have_them():
    options = FitOptions(units=10, input_map="saturation", output_map="cubic_spline")
    assert with_units(options, 3).of_output.units == 3
    assert with_units(options, 99).of_output.units == 10
    assert (
        with_units(options, 3).of_input.units == with_units(options, 5).of_input.units
    )
    maps = [(one.input_map, one.output_map) for one in kinds_tried(options)]
    assert maps == [
        ("saturation", "cubic_spline"), ("saturation", "none"), ("none", "cubic_spline"),
    ]  # fmt: skip
    assert kinds_tried(replace(options, input_map="none")) == (
        replace(options, input_map="none"),
    )


def test_smaller_orders_come_before_smaller_maps():
    small, large = Orders(1, 2, 1), Orders(2, 3, 1)
    few = with_units(OPTIONS, 3)
    sizes = [
        Candidate(few, 1, 2, small).size,
        Candidate(OPTIONS, 1, 2, small).size,
        Candidate(few, 2, 3, large).size,
    ]
    assert sizes == sorted(sizes)
    assert len(set(sizes)) == 3


@pytest.mark.thorough
@pytest.mark.parametrize("threshold", [1e-6, 0.5])
def test_the_group_of_all_wins_whatever_its_threshold_says(threshold):
    names = tuple(one.name for one in STEPS)
    plan = GroupPlan(
        STEPS, None, names, names, GRID, OPTIONS,
        GroupOptions(max_level=1, together=True), threshold,
    )  # fmt: skip
    done = []

    def run(_level, _unit, _total, work):
        def execute(tasks):
            done.extend(tasks)
            return run_tasks(tasks, RunSettings(MemoryStore()))

        return work(execute)

    search = search_all(plan, run)
    winner = search.chain_groups[-1]
    assert winner.recordings == names
    assert winner.coverage == (0 if threshold < 1e-3 else 4)
    fit = search.fits[[one.name for one in search.groups].index(winner.name)]
    assert (winner.nb, winner.nk) == (fit.orders.nb, fit.orders.nf)
    row = search.rmsd[[one.name for one in search.groups].index(winner.name)]
    assert winner.validation_rmsd == pytest.approx(np.sqrt(np.mean(row**2)))
    # A recording alone that is below no threshold is no model that it grew from.
    assert len(search.chain) == (1 if threshold < 1e-3 else 2)
    search.check_stored()
    without = replace(plan, options=GroupOptions(max_level=1))
    assert search_all(without, run).chain != search.chain


def group(names, rmsd, nb=1):
    return Group(tuple(names), 1, nb, 1, 0.0, rmsd, 1, 1, 1, False)


def test_a_group_of_all_that_had_grown_gives_way():
    singles = [group("a", 3.0), group("b", 2.0)]
    joins = [Join(1, "a", "", "a"), Join(1, "b", "", "b"), Join(2, "a", "b", "a+b")]
    grown = Found((*singles, group("ab", 9.0)), tuple(joins), ("a",), "")
    whole = with_whole(grown, group("ab", 1.0))
    assert [one.validation_rmsd for one in whole.groups] == [3.0, 2.0, 1.0]
    assert [one.group for one in whole.joins] == ["a", "b", "a+b"]
    assert whole.joins[-1] == Join(2, "b", "a", "a+b")
    assert whole.chain == ("b", "a+b")
    # Whatever it covers.
    assert with_whole(grown, replace(group("ab", 1.0), coverage=0)).chain[-1] == "a+b"
    # One that is farther off is not taken.
    assert with_whole(grown, group("ab", 2.5)).chain == ("b",)
    assert with_whole(grown, group("ab", float("nan"), nb=0)).chain == ("b",)


@pytest.mark.parametrize(
    ("off", "is_taken"),
    [
        # A pole that outlasts the recordings has to come half as near again.
        (1.4, False),
        (1.6, True),
    ],
)
def test_a_model_that_never_forgets_its_start_has_to_be_worth_it(
    monkeypatch, off, is_taken
):
    settles, lasts = (Candidate(OPTIONS, 1, n, Orders(1, n, 1)) for n in (1, 2))
    poles = {1: 0.9, 2: 1.0 - 0.4 / N}

    def fits(_self, tasks):
        return [
            SimpleNamespace(
                model=SimpleNamespace(
                    denominator=np.array([1.0, -poles[task.arguments[1].nf]])
                )
            )
            for task in tasks
        ]

    def share_off(found, _recording, *, is_of_motion):
        return 0.1 * off if found.model.denominator[1] == -0.9 else 0.1

    monkeypatch.setattr(together._Folds, "_fits", fits)
    monkeypatch.setattr(together, "_share_off", share_off)
    best = together._Folds(STEPS, None).best_of([settles, lasts])
    assert best == (lasts if is_taken else settles)


def test_the_first_samples_tell_a_start_and_the_others_count():
    """A drift that no input makes: a start fitted to all of it would follow the drift."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(-1, 1, 30), 10)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u)
    options = replace(OPTIONS, input_map="none", output_map="none")
    options = replace(options, initial_state="estimated")
    own = Recording("a", u, y + 1e-4 * rng.standard_normal(N), 1.0)
    found = fit([own], Orders(1, 1, 1), options)
    later = replace(own, output=y + np.maximum(np.arange(N) - 60, 0.0) / N)
    left = later.output[60:] - y[60:]
    expected = np.sqrt(np.mean(left**2)) / np.std(later.output)
    assert together._share_off(found, later, is_of_motion=False) == pytest.approx(
        expected, rel=0.01
    )


def test_what_only_lasts_in_the_fit_of_all_gives_way_to_the_next_best(monkeypatch):
    near, next_best = (Candidate(OPTIONS, 1, n, Orders(1, n, 1)) for n in (1, 2))

    def fits(_self, tasks):
        found = []
        for task in tasks:
            is_whole = len(task.arguments[0]) == len(STEPS)
            pole = 1.0 if is_whole and task.arguments[1].nf == 1 else 0.9
            model = SimpleNamespace(denominator=np.array([1.0, -pole]))
            found.append(Named(model, task.arguments[1]))
        return found

    def share_off(found, _recording, *, is_of_motion):
        return 0.08 + 0.02 * found.orders.nf

    monkeypatch.setattr(together._Folds, "_fits", fits)
    monkeypatch.setattr(together, "_share_off", share_off)
    best, whole = together._Folds(STEPS, None).fitted([near, next_best])
    assert best == next_best
    assert whole.orders == next_best.orders


@dataclass
class Named:
    model: SimpleNamespace
    orders: Orders
    identified_on: tuple = ()


@pytest.mark.parametrize("is_of_motion", [False, True])
def test_orders_are_told_by_how_an_output_moves_whatever_its_size(is_of_motion):
    """A map that ends too early halves a step: no order can mend that."""
    u = np.repeat(np.random.default_rng(6).uniform(-1, 1, 30), 10)
    u[:10] = 0.0
    y = lfilter([0.0, 0.1], [1.0, -0.9], u)
    options = replace(OPTIONS, input_map="none", output_map="none")
    found = fit([Recording("a", u, y, 1.0)], Orders(1, 1, 1), options)
    larger = Recording("b", u, 2.0 * y + 3.0, 1.0)
    off = together._share_off(found, larger, is_of_motion=is_of_motion)
    assert (off < 1e-3) == is_of_motion


@pytest.mark.parametrize(("off", "is_small"), [(1.01, True), (1.05, False)])
def test_of_what_is_nearly_as_close_the_smallest_is_taken(monkeypatch, off, is_small):
    small, large = (Candidate(OPTIONS, 1, n, Orders(1, n, 1)) for n in (1, 2))

    def fits(_self, tasks):
        model = SimpleNamespace(denominator=np.array([1.0, -0.9]))
        return [Named(model, task.arguments[1]) for task in tasks]

    def share_off(found, _recording, *, is_of_motion):
        return 0.1 * off if found.orders.nf == 1 else 0.1

    monkeypatch.setattr(together._Folds, "_fits", fits)
    monkeypatch.setattr(together, "_share_off", share_off)
    best = together._Folds(STEPS, None).best_of([large, small])
    assert best == (small if is_small else large)


def late_probe(u, delay):
    """A warm body behind a transport, read by a probe that bends."""
    late = np.r_[np.full(delay, u[0]), u[: u.size - delay]]
    block = lfilter([0.1], [1, -0.9], late - u[0]) + u[0]
    body = lfilter([0.04], [1, -0.96], block - u[0]) + u[0]
    return body + 0.3 * body**2


def levels(name, seed, delay):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.2, 2.0, 6), 50)
    noise = 0.01 * rng.standard_normal(u.size)
    return Recording(name, u, late_probe(u, delay) + noise, 1.0)


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0, 9])
def test_a_longer_delay_is_taken_where_recordings_ask_for_it(delay):
    recordings = [levels("a", 1, delay), levels("b", 2, delay), levels("c", 3, delay)]
    grid = OrdersOptions(nb=(1, 2), nk=(1, 2))
    whole = fit_together(recordings, grid, OPTIONS, Count()).fit
    assert bool(whole.options.delays) == bool(delay)
    # The first coefficients of the numerator may be small.
    assert abs(whole.orders.nk - (delay or 1)) <= 1
    new = levels("new", 9, delay)
    left = new.output - simulate(whole.model, new.input)
    assert np.sqrt(np.mean(left[50:] ** 2)) < 0.03


@pytest.mark.parametrize(
    ("bics", "off", "expected"),
    [
        ((0.0, -5.0, -90.0, -40.0), (0.1, 0.2), (1, 2)),
        # Hardly a better fit; what is left out speaks against it; none is longer.
        ((0.0, -5.0, -15.0, -10.0), (0.1, 0.2), ()),
        ((0.0, -5.0, -90.0, -40.0), (0.3, 0.2), ()),
        ((0.0, -90.0, -80.0, -40.0), (0.1, 0.2), ()),
    ],
)
def test_fit_and_left_out_recordings_have_to_ask_for_a_delay(bics, off, expected):
    """Criteria without a delay and with 1, 2 and 3; how far off late and plain ones are."""
    delays = (1, 2, 3)
    plain = Candidate(OPTIONS, 1, 2, Orders(1, 2, 1))
    best = delays[int(np.argmin(bics[1:]))]
    late = replace(plain, options=replace(OPTIONS, delays=(best,)))
    folds = object.__new__(together._Folds)
    folds._task = lambda *_: None
    folds._fits = lambda _: [
        SimpleNamespace(information=SimpleNamespace(bic=bic)) for bic in bics
    ]
    folds.best_of = lambda _: None
    folds._fits_of = {late: "late", plain: "plain"}
    folds._off = lambda fits, **_: off[fits == "plain"]
    assert folds.delays_needed(plain, delays) == expected
