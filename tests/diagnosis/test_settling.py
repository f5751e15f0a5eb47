"""Which run of a simulation with an effect counts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import settling
from hwid_cli.diagnosis.settling import settled
from hwid_cli.diagnosis.turns import Turn
from tests.diagnosis.made_up_fits import base, made_up
from tests.diagnosis.small_drive import problem, recordings

FRICTION = "coulomb_friction"


def left(sse):
    """What a run leaves, as one sample."""
    return (np.array([np.sqrt(sse)]),)


@pytest.fixture
def settle(monkeypatch):
    """Best run where each way leaves a given sum of squares; the stand-in said 100."""

    def of(
        *, held, beside, free, beside_free, ran_away=False, rival=np.inf, spent=False
    ):
        asked = []

        def best_turn(_findings, turn, _runs):
            as_given = "held" if turn.problem.known else "free"
            way = turn.values.get("way", as_given)
            asked.append(way)
            sse = {"held": held, "beside held": beside, "free": free,
                   "beside free": beside_free}[way]  # fmt: skip
            run = (turn.fit, {"way": way})
            is_lost = ran_away and way == "held"
            return Turn(turn.problem, turn.fit, {"way": way}, 100.0, at_force=True,
                        rival=turn.rival, tried=run, left=left(sse), ran_away=is_lost)  # fmt: skip

        def beside_effect(_findings, turn, _runs):
            way = "beside free" if turn.values.get("way") == "free" else "beside held"
            return Turn(turn.problem, turn.fit, {"way": way}, 100.0, at_force=True)

        monkeypatch.setattr(settling, "best_turn", best_turn)
        monkeypatch.setattr(settling, "_beside_effect", beside_effect)
        able = SimpleNamespace(force=True)
        simulator = SimpleNamespace(free={"c": None}, capabilities=able)
        findings = SimpleNamespace(
            problem=problem(recordings()), base=base(1e5), own_base=None
        )
        fit = made_up((FRICTION,), 100.0 / 6)
        counted = SimpleNamespace(are_spent=spent)
        runs = SimpleNamespace(simulator=simulator, run_tasks=counted)
        best = settled(findings, fit, runs, {}, rival)
        return best.values_of_run["way"], asked

    return of


def test_a_run_as_good_as_the_stand_in_is_enough(settle):
    best, asked = settle(held=110.0, beside=1.0, free=1.0, beside_free=1.0)
    assert (best, asked) == ("held", ["held"])


def test_parameters_are_fitted_beside_the_effect_before_forces_take_their_place(settle):
    best, asked = settle(held=900.0, beside=110.0, free=1.0, beside_free=1.0)
    assert (best, asked) == ("beside held", ["held", "beside held"])


def test_no_other_way_is_tried_with_what_leaves_far_more_than_another_effect(settle):
    args = {"held": 900.0, "beside": 110.0, "free": 1.0, "beside_free": 1.0}
    assert settle(**args, rival=290.0) == ("held", ["held"])
    assert settle(**args, rival=310.0)[1] == ["held", "beside held"]


def test_nor_once_the_runs_are_spent(settle):
    args = {"held": 900.0, "beside": 110.0, "free": 1.0, "beside_free": 1.0}
    assert settle(**args, spent=True) == ("held", ["held"])


def test_and_again_where_forces_know_the_effect_better(settle):
    best, asked = settle(held=900.0, beside=800.0, free=100.0, beside_free=105.0)
    assert best == "beside free"
    assert asked == ["held", "beside held", "free", "beside free"]


def test_forces_take_the_place_of_parameters_that_nobody_can_find(settle):
    best, _ = settle(held=900.0, beside=800.0, free=100.0, beside_free=700.0)
    assert best == "free"


def test_no_forces_pass_for_an_effect_where_the_stand_in_has_run_away(settle):
    args = {"free": 1.0, "beside_free": 1.0, "ran_away": True}
    assert settle(held=900.0, beside=950.0, **args)[0] == "held"
    assert settle(held=900.0, beside=120.0, **args)[0] == "beside held"


@pytest.mark.parametrize(
    ("effect", "kt", "begins"),
    [
        # A delay counts by the force constant of the stand-in, which is left behind.
        ("input_delay", 4.0, True),
        ("gear_backlash", 4.0, True),
        ("input_delay", 3.3, False),
        # A force is one whatever the stand-in is.
        ("coulomb_friction", 4.0, False),
        ("sensor_lag", 4.0, False),
    ],
)
def test_where_parameters_have_moved_the_effect_is_fitted_beside_a_stand_in_of_these(
    monkeypatch, effect, kt, begins
):
    """A delay of 24 ms beside friction was told as 29 ms, with 1.08 times the noise left."""
    fit, given = made_up((effect,), 100.0 / 6), problem(recordings())
    asked = []

    def best_turn(_findings, turn, _runs):
        asked.append(turn.values["kt"])
        moved = {"kt": kt if len(asked) == 1 else 4.0}
        sse = 90.0 if len(asked) == 1 else 50.0
        return Turn(turn.problem, fit, moved, 100.0, at_force=True, tried=(fit, moved),
                    left=left(sse))  # fmt: skip

    def begun_with(turn, _runs, values, forces):
        assert forces == ["forces"]
        return Turn(turn.problem, turn.fit, values, turn.said, at_force=True)

    monkeypatch.setattr(settling, "best_turn", best_turn)
    monkeypatch.setattr(settling, "begun_with", begun_with)
    monkeypatch.setattr(settling, "rebuilt", lambda *_: ())
    monkeypatch.setattr(settling, "simulate_at", lambda _: ["motion"])
    monkeypatch.setattr(settling, "forces_along", lambda *_: ["forces"])
    able = SimpleNamespace(force=True)
    simulator = SimpleNamespace(free={"kt": None}, capabilities=able)
    findings = SimpleNamespace(
        problem=given, base=base(1e5), own_base=None, scales=None
    )
    runs = SimpleNamespace(
        simulator=simulator, run_tasks=SimpleNamespace(are_spent=False)
    )
    best = settled(findings, fit, runs, {"kt": 3.297})
    assert asked == ([3.297, 4.0] if begins else [3.297])
    assert best.sse.sum() == pytest.approx(50.0 if begins else 90.0)


def test_a_stand_in_of_other_parameters_has_the_effects_that_were_found_before(
    monkeypatch,
):
    """A delay beside friction was fitted again without it, and left 9 times the noise."""
    given = problem(recordings())
    present = {FRICTION: {"force_N": 2.0}}
    before = replace(given, drive=replace(given.drive, effects=present))
    fit = made_up(("input_delay",), 100.0 / 6)
    turn = Turn(before, fit, {"kt": 3.0}, 100.0, at_force=True)
    runs = SimpleNamespace(tried=lambda *_: ["run"] * len(given.signals))
    monkeypatch.setattr(settling, "as_sent", lambda *_, **__: [])
    monkeypatch.setattr(settling, "pushed", lambda *_: ["run"] * len(given.signals))
    monkeypatch.setattr(settling, "standing_beside", lambda *_: given)
    monkeypatch.setattr(settling, "_standing_with", lambda _drive, one, *_: one)
    forces = [0.0] * len(given.signals)

    there = settling.begun_with(turn, runs, {"kt": 4.0}, forces)

    assert there.problem.drive.effects == present
    assert there.values == {"kt": 4.0}
