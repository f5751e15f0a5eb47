"""Rounds of candidate fits: which sets are tried, which are kept."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis import diagnose, rounds
from hwid_cli.diagnosis.candidate import Screened
from hwid_cli.diagnosis.few_samples import first_parts
from hwid_cli.diagnosis.forecast import Forecast
from hwid_cli.diagnosis.proposals import SCREENED_ON_TOP, first_starts
from hwid_cli.diagnosis.rounds import FEWEST_FINISHED, MOST_FINISHED, run_rounds
from hwid_cli.diagnosis.set_fits import SetFits
from hwid_cli.drive.catalogue import CATALOGUE
from tests.diagnosis.made_up_fits import base as made_up_base
from tests.diagnosis.made_up_fits import made_up
from tests.diagnosis.small_drive import fit, in_turn
from tests.diagnosis.small_rounds import (
    FEW,
    STIFFNESS,
    Screenings,
    rounds_of,
    rounds_of_fits,
)
from tests.stages.diagnosed_drive import FRICTION


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
            tuple(one.arguments[1])
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
    # What includes a wider law, or starts otherwise, comes only where that has brought
    # something.
    third = {
        one
        for one in alone
        if CATALOGUE[one[0]].is_of_start
        or any(CATALOGUE[other].contains for other in CATALOGUE[one[0]].contains)
    }
    screened = set(friction.effects_of("screen")) - {()}
    assert screened <= alone - wider
    assert alone - wider - third <= screened
    assert ("sensor_lag:second_order",) in third - screened


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
    search.fits.found = {fit.effects: fit for fit in (one, best, pair)}
    assert search.parents(2) == [best, pair][:parents]


def test_screened_again_is_what_gets_further_and_is_not_far_behind(monkeypatch):
    turns = Screenings({"moves": 0.8, "stands": 0.99, "far": 0.5})
    search = rounds._Search(rounds_of(FRICTION, FEW, run_tasks=turns.run))
    monkeypatch.setattr(search.fits, "floor", lambda: 0.0)
    monkeypatch.setattr(search.fits, "few_sse", lambda found: 0.9)
    first = [Screened((one,), 1.0, ()) for one in ("moves", "stands")]
    first.append(Screened(("far",), 10.0, ()))

    found = search._screened_on("sets", first, search.rounds.base)
    assert turns.turns == [["moves", "stands"], ["moves"]]
    assert [one.sse for one in found] == pytest.approx([0.64, 0.99, 10.0])


def test_nothing_is_screened_again_once_a_set_explains_half(monkeypatch):
    turns = Screenings({})
    search = rounds._Search(rounds_of(FRICTION, FEW, run_tasks=turns.run))
    monkeypatch.setattr(search.fits, "floor", lambda: 0.0)
    monkeypatch.setattr(search.fits, "few_sse", lambda found: 0.9)
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
    search.fits.found = {friction.effects: friction}
    plain, richer = ("quadratic_drag",), ("stribeck_friction",)
    tried = []

    def tried_again(name, size, sets):
        tried.append((name, size, *sets))
        search.fits.found[drag.effects] = drag
        return True

    monkeypatch.setattr(
        rounds, "from_related", lambda fits, size: {richer: [], plain: []}
    )
    monkeypatch.setattr(search, "_tried_again", tried_again)
    search.use_again(1)
    name = "single effects, from related ones"
    wide = () if completes else ((f"{name} that include others", 1, richer),)
    assert tried == [(name, 1, plain), *wide] * 2


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
    counts = {what.partition(" (so far")[0]: n for what, n in pair.announced}
    assert 0 < counts["sets of 2 effects, screening"] <= 2 * SCREENED_ON_TOP
    assert 0 < counts["sets of 2 effects"] <= MOST_FINISHED


@pytest.mark.thorough
def test_what_begins_is_told_with_what_leads_until_then(pair):
    """A search that is stopped has said so much."""
    begun = [what for what, _ in pair.announced]
    assert begun[1] == "single effects, screening"
    (larger,) = [one for one in begun if one.startswith("sets of 2 effects, screening")]
    title, _, left = larger.partition(" (so far ")[2].rpartition(", ")
    assert title in {ids[0] for ids in pair.found.fits if len(ids) == 1}
    number, words = left.split(" ", maxsplit=1)
    assert words == "times the noise)"
    assert float(number) > 1.5


@pytest.mark.thorough
def test_nested_effects_are_never_put_together(pair):
    screened = {ids for ids in pair.effects_of("screen") if len(ids) == 2}
    assert screened
    nested = {"coulomb_friction", "stribeck_friction", "hysteresis"}
    for ids in screened | set(pair.found.fits):
        assert len(nested & set(ids)) <= 1


@pytest.mark.thorough
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


def test_before_a_search_ends_all_samples_say_what_to_fit(monkeypatch):
    # The few samples of the screening promise nothing; all of them promise the stiffness.
    of = rounds_of(FRICTION | STIFFNESS, ("coulomb_friction", "cubic_stiffness"))
    search = rounds._Search(of)
    monkeypatch.setattr(rounds.SetFits, "has_many", True)
    promised = search.proposals.of_size(1, [of.base], search.fits.train)
    search.fits.few = first_parts(search.fits.train, 50)
    asked = []

    def of_size(size, parents, problem):
        asked.append(problem)
        return promised

    monkeypatch.setattr(search.proposals, "of_size", of_size)
    best = search.look_closer(1, [of.base])
    assert asked == [search.fits.train]
    assert best is not None
    assert set(search.fits.found) == set(promised)


def test_a_search_of_few_samples_looks_no_closer():
    of = rounds_of(FRICTION, ("coulomb_friction",))
    search = rounds._Search(of)
    assert search.look_closer(1, [of.base]) is None
    assert not search.fits.found


@pytest.mark.parametrize("are_pieces", [False, True])
def test_what_leads_in_pieces_is_not_told(monkeypatch, are_pieces):
    """They have starts of their own: what is left there is no share of the recordings."""
    said = []
    fits = SetFits(rounds_of(FRICTION, FEW))
    rounds = replace(fits.rounds, on_round=lambda what, _: said.append(what))
    fits = SetFits(rounds)
    found = fit(rounds.problem, FRICTION, scales=rounds.baseline.scales)
    fits.found[found.effects] = found
    monkeypatch.setattr(SetFits, "are_pieces", are_pieces)
    fits._begin("sets of 2 effects", 3)
    (what,) = said
    assert what.startswith("sets of 2 effects")
    assert ("so far" in what) is not are_pieces


@pytest.mark.parametrize(
    ("of_training", "is_built_on"), [(150.0, True), (1500.0, False)]
)
def test_what_takes_most_of_all_recordings_is_built_on_whatever_held_out_ones_show(
    of_training, is_built_on
):
    # Where a second effect is missing, the first one alone may be worse there.
    left = [*[2000.0] * 3, *[130.0] * 3]
    search = rounds._Search(replace(rounds_of_fits(), base=made_up_base(left)))
    one = made_up(("input_saturation",), [*[of_training] * 3, *[220.0] * 3])
    search.fits.found = {one.effects: one}
    assert search.parents(1) == ([one] if is_built_on else [])


def test_nothing_is_built_on_what_ran_to_its_bound(monkeypatch):
    search = rounds._Search(replace(rounds_of_fits(), base=made_up_base(900.0)))
    one, best = made_up(("end_stop",), 300.0), made_up(("torque_ripple",), 150.0)
    search.fits.found = {fit.effects: fit for fit in (one, best)}
    assert search.parents(1) == [best, one]
    monkeypatch.setattr(rounds, "runs_to_bound", lambda _, found, scales: found is best)
    assert search.parents(1) == [one]


@pytest.mark.parametrize(
    ("effect", "count", "kept"),
    [
        ("coulomb_friction", 1, 1),
        ("coulomb_friction", 0, 0),
        ("input_saturation", 1, 4),
        ("input_saturation", 0, 0),
    ],
)
def test_beside_what_is_stated_a_limit_has_all_its_starts(effect, count, kept):
    """A limit of 20 V in a loop was found from the fourth of its starts alone."""
    found = Forecast(
        effect, 0.5, tuple({"value": float(n)} for n in range(4)), np.ones(3)
    )
    assert list(first_starts(found, count)) == list(found.starts[:kept])


def test_friction_along_the_way_may_stand_for_friction_and_waves():
    """While the drive goes one way under one current, all three are the same force."""
    values = {
        "force_N": 2.0,
        "variation_share": 0.3,
        "period_m": 0.05,
        "phase_rad": 0.4,
    }
    x = np.linspace(0.0, 0.2, 400)
    wave = -np.sin(2 * np.pi * x / 0.05 + 0.4)
    sets = CATALOGUE["position_friction"].imitated(values)
    of_force = [one["cogging"] for one in sets if "cogging" in one]
    of_drive = [one["torque_ripple"] for one in sets if "torque_ripple" in one]
    assert all(one["coulomb_friction"] == {"force_N": 2.0} for one in sets)

    cogging = [
        one["amplitude_N"] * np.sin(2 * np.pi * x / one["period_m"] + one["phase_rad"])
        for one in of_force
    ]
    assert min(np.abs(one - 2.0 * 0.3 * wave).max() for one in cogging) < 1e-12
    # How large a ripple is hangs on the current.
    ripples = [np.sin(one["per_turn"] * x + one["phase_rad"]) for one in of_drive]
    assert min(np.abs(one - wave).max() for one in ripples) < 1e-12
    assert all(0.0 < one["share"] < 0.3 for one in of_drive)


def test_sets_that_one_effect_may_stand_for_are_screened_beside_it():
    allowed = ("coulomb_friction", "position_friction", "torque_ripple", "cogging")
    search = rounds.Proposals(rounds_of(FRICTION, allowed))
    friction = {
        "force_N": 0.6,
        "variation_share": 0.2,
        "period_m": 5e-3,
        "phase_rad": 0.1,
    }
    of = search.rounds.problem
    scales = search.rounds.baseline.scales
    parent = fit(of, {"position_friction": friction}, scales=scales)
    sets = search.of_size(2, [parent], first_parts(of, 4000))

    assert {
        ("coulomb_friction", "torque_ripple"),
        ("cogging", "coulomb_friction"),
    } <= set(sets)
    start = sets["coulomb_friction", "torque_ripple"][0]
    found = dict(zip([n.parameter for n in parent.names], parent.values, strict=True))
    per_turn = start.effects["torque_ripple"]["per_turn"]
    assert per_turn == pytest.approx(2 * np.pi / found["period_m"])
    assert "position_friction" not in start.effects


def test_what_a_filter_has_shown_is_fitted_to_whole_recordings():
    """No way has led there from single effects: the search on them has found nothing."""
    of = rounds_of({**FRICTION, **STIFFNESS}, FEW)
    behind = diagnose._Searched(of, of.base.sse, [], [], run_rounds(of, 2), (), [])
    searched = replace(behind, found=rounds.RoundsResult())
    assert not diagnose._is_settled(searched)
    led = diagnose._led_by(searched, behind)
    assert led.found.best[-1].effects == ("coulomb_friction", "cubic_stiffness")
    assert diagnose._is_settled(led)

    held = replace(
        of, problem=replace(of.problem, drive=replace(of.problem.drive, hold="zero"))
    )
    assert diagnose._led_by(searched, replace(behind, rounds=held)) is searched
