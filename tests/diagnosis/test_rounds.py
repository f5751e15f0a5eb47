"""Rounds of candidate fits: which sets are tried, which are kept."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis import rounds
from hwid_cli.diagnosis.candidate import (
    Baseline,
    Screened,
    fitted_drive,
    start_from,
)
from hwid_cli.diagnosis.rounds import (
    FEWEST_FINISHED,
    MOST_FINISHED,
    SCREENED_ON_TOP,
    Rounds,
    run_rounds,
)
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.drive.catalogue import CATALOGUE
from tests.diagnosis.made_up_fits import CRITERIA, made_up
from tests.diagnosis.made_up_fits import base as made_up_base
from tests.diagnosis.small_drive import (
    fit,
    in_turn,
    problem,
    recordings,
    search_start,
    sizes,
    white,
)
from tests.stages.diagnosed_drive import FRICTION

STIFFNESS = {"cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
HELD_OUT = ("step_1", "sine_1", "sine_3")
FEW = (
    "coulomb_friction",
    "cubic_stiffness",
    "hysteresis",
    "input_dead_zone",
    "quadratic_drag",
    "stribeck_friction",
)


def rounds_of(effects, allowed, **options):
    of = problem(recordings(effects), held_out=HELD_OUT)
    scales = sizes(of, (31.0,))
    base = fit(of, scales=scales)
    return Rounds(
        **{
            "problem": of,
            "baseline": Baseline(fitted_drive(of.drive, base), scales, white()),
            "criteria": SelectionCriteria.of(of, white()),
            "base": base,
            "allowed": allowed,
            "run_tasks": in_turn,
            "on_round": lambda what, count: None,
            **options,
        }
    )


def rounds_of_fits():
    """Rounds that weigh made-up fits."""
    six = recordings()[:6]
    of = problem(six, held_out=[one.name for one in six[3:]])
    return rounds_of(FRICTION, FEW, problem=of, criteria=CRITERIA)


class Watched:
    """Rounds whose tasks and announcements are kept."""

    def __init__(self, effects, allowed, most):
        self.tasks, self.announced = [], []
        self.rounds = rounds_of(
            effects,
            allowed,
            run_tasks=self.run,
            on_round=lambda what, count: self.announced.append((what, count)),
        )
        self.found = run_rounds(self.rounds, most)

    def run(self, tasks, *, keep):
        results = in_turn(tasks, keep=keep)
        self.tasks.extend(zip(tasks, results, strict=True))
        return results

    def effects_of(self, function):
        """Sets of effects of the tasks with a function, in their order."""
        return [
            tuple(one.content["effects"])
            for one, _ in self.tasks
            if one.function.__name__ == function
        ]

    def train_sse(self, one):
        rows = [not signals.is_held_out for signals in self.rounds.problem.signals]
        return float(one.sse[rows].sum())


@pytest.fixture(scope="module")
def friction():
    """Coulomb friction, with the whole catalogue to choose from."""
    return Watched(FRICTION, tuple(CATALOGUE), 1)


@pytest.fixture(scope="module")
def pair():
    """Two effects, a few to choose from."""
    return Watched({**FRICTION, **STIFFNESS}, FEW, 3)


@pytest.mark.thorough
def test_the_hidden_effect_wins_against_the_whole_catalogue(friction):
    assert friction.found.best[-1].effects == ("coulomb_friction",)
    assert len(friction.found.best) == 1


@pytest.mark.thorough
def test_every_effect_gets_a_forecast_and_a_screening(friction):
    # A second one of a kind is tried beside its first only.
    alone = {(name,) for name, one in CATALOGUE.items() if not one.beside}
    assert set(friction.found.shares) == alone
    # What includes friction cannot be better than friction, which leaves nothing.
    wider = {one for one in alone if "coulomb_friction" in CATALOGUE[one[0]].contains}
    assert set(friction.effects_of("screen")) - {()} == alone - wider


@pytest.mark.thorough
def test_where_something_is_left_what_includes_others_is_screened_too(pair):
    screened = pair.effects_of("screen")
    wide = screened.index(("stribeck_friction",))
    assert screened.index(("coulomb_friction",)) < wide
    assert ("hysteresis",) in screened


@pytest.mark.thorough
def test_the_first_ones_of_the_screening_are_finished(pair):
    sse = {}
    for task, result in pair.tasks:
        if task.function.__name__ == "fit_candidate":
            break
        if task.function.__name__ == "screen":
            sse[result.effects] = result.sse
    first = sorted(sse, key=sse.get)[:FEWEST_FINISHED]
    assert len(first) == FEWEST_FINISHED
    assert set(first) <= set(pair.effects_of("fit_candidate"))


@pytest.mark.thorough
def test_what_includes_another_one_is_not_finished_where_that_leaves_noise(friction):
    assert friction.found.best[0].whiteness <= 1
    for name, entry in CATALOGUE.items():
        if "coulomb_friction" in entry.contains:
            assert (name,) not in friction.found.fits


@pytest.mark.thorough
def test_what_includes_another_one_is_finished_after_it(pair):
    finished = pair.effects_of("fit_candidate")
    first = finished.index(("coulomb_friction",))
    assert first < finished.index(("stribeck_friction",))


BREAKING = {"force_N": 0.5, "static_excess_N": 0.6, "velocity_m_per_s": 0.03}


@pytest.mark.parametrize(
    ("hidden", "is_kept"), [(FRICTION, False), ({"stribeck_friction": BREAKING}, True)]
)
def test_of_many_samples_what_includes_another_one_has_to_bring_more(
    hidden, is_kept, monkeypatch
):
    of = rounds_of(hidden, FEW)
    search = rounds._Search(of)
    found = fit(of.problem, FRICTION, scales=of.baseline.scales)
    search.fits[found.effects] = found
    start = {**BREAKING, "velocity_m_per_s": 0.01}
    begun = [search_start(of.problem, {"stribeck_friction": start})]
    wide, other = {("stribeck_friction",): begun}, {("cubic_stiffness",): begun}

    # Of few samples all go on.
    assert search._that_add(wide | other) == wide | other
    monkeypatch.setattr(rounds, "MANY_SAMPLES", 1000)
    kept = search._that_add(wide | other)
    assert (("stribeck_friction",) in kept) == is_kept
    assert kept[("cubic_stiffness",)] == begun


@pytest.mark.parametrize("of_hysteresis", [0.99, 0.5])
def test_a_shape_of_a_law_is_screened_only_where_the_law_has_brought_something(
    of_hysteresis, monkeypatch
):
    # Bouc-Wen friction includes hysteresis, which includes Coulomb friction.
    turns = Screenings(
        {
            "coulomb_friction": 1.0,
            "hysteresis": of_hysteresis,
            "hysteresis:bouc_wen": 0.1,
        }
    )
    search = rounds._Search(rounds_of(FRICTION, FEW, run_tasks=turns.run))
    monkeypatch.setattr(rounds, "MANY_SAMPLES", 1000)
    found = fit(search.rounds.problem, FRICTION, scales=search.rounds.baseline.scales)
    search.fits[found.effects] = found
    monkeypatch.setattr(search, "_few_sse", lambda fit: 10.0)
    monkeypatch.setattr(search, "_widened", lambda ids, narrow: [])
    begun = {("hysteresis",): ["a"], ("hysteresis:bouc_wen",): ["b"]}

    kept = search._that_add(begun)
    screened = [one for turn in turns.turns for one in turn]
    adds = of_hysteresis == 0.5
    assert (("hysteresis",) in kept) == adds
    assert ("hysteresis:bouc_wen" in screened) == adds
    assert (("hysteresis:bouc_wen",) in kept) == adds


def test_a_further_effect_is_measured_by_its_own_part_beside_values_of_recordings():
    # A change between recordings leaves little of what its values are fitted to; friction
    # and a stop leave less of all, and much less than the stop alone.
    search = rounds._Search(rounds_of_fits())
    changing = made_up(("parameter_change:damping",), 400.0, own=np.ones(6))
    stop, both = made_up(("end_stop",), 900.0), made_up(("a", "end_stop"), 350.0)
    search.fits = {one.effects: one for one in (changing, stop, both)}

    assert search.is_better(both, changing)
    assert not search.is_better(both, made_up(("x",), 400.0))


@pytest.mark.parametrize(("of_base", "goes_on"), [(400.0, True), (1e6, False)])
def test_of_little_that_only_a_complete_set_could_name_one_effect_takes_half(
    of_base, goes_on
):
    # Two fifths of what a single effect leaves: much, or next to nothing, of all.
    search = rounds._Search(replace(rounds_of_fits(), base=made_up_base(of_base)))
    one = made_up(("end_stop",), 300.0)
    assert search.is_better(made_up(("a", "end_stop"), 220.0), one) == goes_on
    assert search.is_better(made_up(("a", "end_stop"), 180.0), one)
    assert search.is_better(made_up(("a", "end_stop"), 220.0, whiteness=0.5), one)


@pytest.mark.parametrize(("of_pair", "parents"), [(299.0, 1), (200.0, 2)])
def test_a_set_that_is_hardly_more_than_a_smaller_one_is_built_on_by_none(
    of_pair, parents
):
    search = rounds._Search(replace(rounds_of_fits(), base=made_up_base(900.0)))
    one, best = (
        made_up(("end_stop",), 300.0),
        made_up(("gravity", "sensor_drift"), 150.0),
    )
    pair = made_up(("cogging", "end_stop"), of_pair)
    search.fits = {fit.effects: fit for fit in (one, best, pair)}
    assert search.parents(2) == [best, pair][:parents]


class Screenings:
    """Screenings that leave made-up multiples of what they left before."""

    def __init__(self, factors):
        self.factors, self.turns = factors, []

    def run(self, tasks, *, keep):
        assert not keep
        self.turns.append([one.content["effects"][0] for one in tasks])
        return [self._screened(*one.content["effects"]) for one in tasks]

    def _screened(self, effect):
        turns = sum(effect in turn for turn in self.turns)
        return Screened((effect,), 1.0 * self.factors[effect] ** turns, ())


def test_screened_again_is_what_gets_further_and_is_not_far_behind(monkeypatch):
    turns = Screenings({"moves": 0.8, "stands": 0.99, "far": 0.5})
    search = rounds._Search(rounds_of(FRICTION, FEW, run_tasks=turns.run))
    monkeypatch.setattr(search, "_floor", lambda: 0.0)
    monkeypatch.setattr(search, "_few_sse", lambda found: 0.9)
    first = [Screened((one,), 1.0, ()) for one in ("moves", "stands")]
    first.append(Screened(("far",), 10.0, ()))

    found = search._screened_on("sets", first, search.rounds.base)
    assert turns.turns == [["moves", "stands"], ["moves"]]
    assert [one.sse for one in found] == pytest.approx([0.64, 0.99, 10.0])


def test_nothing_is_screened_again_once_a_set_explains_half(monkeypatch):
    turns = Screenings({})
    search = rounds._Search(rounds_of(FRICTION, FEW, run_tasks=turns.run))
    monkeypatch.setattr(search, "_floor", lambda: 0.0)
    monkeypatch.setattr(search, "_few_sse", lambda found: 0.9)
    first = [Screened((name,), sse, ()) for name, sse in (("a", 0.4), ("b", 0.8))]
    assert search._screened_on("sets", first, search.rounds.base) == first
    assert turns.turns == []


@pytest.mark.parametrize("completes", [True, False])
def test_richer_relatives_are_not_tried_once_a_plain_one_leaves_nothing(
    completes, monkeypatch
):
    search = rounds._Search(rounds_of_fits())
    friction = made_up(("coulomb_friction",), 300.0)
    drag = made_up(("quadratic_drag",), 100.0, whiteness=0.5 if completes else 2.0)
    search.fits = {friction.effects: friction}
    plain, richer = ("quadratic_drag",), ("stribeck_friction",)
    tried = []

    def tried_again(name, size, sets):
        tried.append((name, size, *sets))
        search.fits[drag.effects] = drag
        return True

    monkeypatch.setattr(search, "_again", lambda size: {richer: [], plain: []})
    monkeypatch.setattr(search, "_tried_again", tried_again)
    search._use_again(1)
    name = "single effects, from related ones"
    wide = () if completes else ((f"{name} that include others", 1, richer),)
    assert tried == [(name, 1, plain), *wide] * 2


def test_sets_that_bring_nothing_from_where_a_smaller_one_ended_are_not_finished():
    search = rounds._Search(rounds_of({**FRICTION, **STIFFNESS}, FEW))
    of = search.rounds
    friction = fit(of.problem, FRICTION, scales=of.baseline.scales)
    search.fits[friction.effects] = friction
    here = start_from(of.problem.drive, friction)
    faint = {"cubic_stiffness": {"stiffness_N_per_m3": 100.0},
             "input_dead_zone": {"threshold_A": 1e-3}}  # fmt: skip
    sets = {
        ("coulomb_friction", name): [replace(here, effects={**here.effects, name: one})]
        for name, one in faint.items()
    }
    screened = search._screen("sets", {**search._parts(sets), **sets})
    assert {one.effects for one in screened} == {friction.effects, *sets}
    pair = ("coulomb_friction", "cubic_stiffness")
    best = fit(of.problem, {**FRICTION, **STIFFNESS}, scales=of.baseline.scales)
    assert set(search._near(sets, screened, best)) == {pair}
    # It is what they bring that counts: beside what leaves as much both would be near.
    assert set(search._near(sets, screened, friction)) == {pair}


def test_no_larger_set_is_tried_once_nothing_remains():
    watched = Watched(FRICTION, ("coulomb_friction", "input_dead_zone"), 3)
    assert watched.announced[:2] == [
        ("forecasts", 2),
        ("single effects, screening", 2),
    ]
    assert not any(what.startswith("sets") for what, _ in watched.announced)
    assert len(watched.found.best) == 1


@pytest.mark.thorough
def test_a_pair_is_found_although_neither_effect_explains_much_alone(pair):
    assert [len(one.effects) for one in pair.found.best] == [1, 2]
    assert pair.found.best[-1].effects == ("coulomb_friction", "cubic_stiffness")
    # Nothing remains, so no set of three.
    assert not any("sets of 3 effects" in what for what, _ in pair.announced)


@pytest.mark.thorough
def test_the_larger_sets_that_are_finished_are_few(pair):
    counts = dict(pair.announced)
    assert 0 < counts["sets of 2 effects, screening"] <= 2 * SCREENED_ON_TOP
    assert 0 < counts["sets of 2 effects"] <= MOST_FINISHED


@pytest.mark.thorough
def test_nested_effects_are_never_put_together(pair):
    screened = {ids for ids in pair.effects_of("screen") if len(ids) == 2}
    assert screened
    nested = {"coulomb_friction", "stribeck_friction", "hysteresis"}
    for ids in screened | set(pair.found.fits):
        assert len(nested & set(ids)) <= 1


def test_a_second_effect_that_adds_nothing_is_not_taken():
    # Something remains, and drag looks like friction, but does not explain most of it.
    watched = Watched(
        {**FRICTION, **STIFFNESS}, ("cubic_stiffness", "quadratic_drag"), 2
    )
    assert [one.effects for one in watched.found.best] == [("cubic_stiffness",)]
    assert {len(ids) for ids in watched.found.fits} == {1, 2}


@pytest.mark.parametrize(("allowed", "most"), [((), 3), (("coulomb_friction",), 0)])
def test_without_candidates_nothing_is_fitted(allowed, most):
    watched = Watched(FRICTION, allowed, most)
    assert (watched.found.fits, watched.found.best) == ({}, ())
    assert watched.found.shares == {}
    assert watched.tasks == []
