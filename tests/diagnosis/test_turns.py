"""How long stand-in and simulation take turns."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import turns
from hwid_cli.diagnosis.turns import Turn, best_turn
from hwid_cli.records.programs import FreeParameter, SimulatorRun
from tests.diagnosis.made_up_fits import base, made_up
from tests.diagnosis.small_drive import problem, recordings

FIT = made_up(("coulomb_friction",), 100.0)


@pytest.fixture
def taken(monkeypatch):
    """Turns that are taken, of those that would leave given sums of squares."""

    def of(sums, *, agrees, without=1e9, rival=np.inf, are_spent=False):
        left = iter(sums)
        seen = []

        def following(_findings, turn, _runs):
            sse = next(left)
            seen.append(sse)
            return Turn(turn.problem, FIT, {}, 100.0, at_force=True, rival=rival,
                        tried=(FIT, {}), left=(np.array([np.sqrt(sse)]),))  # fmt: skip

        monkeypatch.setattr(turns, "_next_turn", following)
        monkeypatch.setattr(turns, "_agrees", lambda *_: agrees)
        monkeypatch.setattr(turns, "fit_of_run", lambda *_: FIT)
        criteria = SimpleNamespace(is_complete=lambda _: False)
        first = Turn(None, FIT, {}, 100.0, at_force=True, rival=rival)
        findings = SimpleNamespace(criteria=criteria, base=base(without / 6))
        runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=are_spent))
        best = best_turn(findings, first, runs)
        return len(seen), float(best.sse.sum())

    return of


def falling(first, factor, n=40):
    return [first * factor**k for k in range(n)]


def test_turns_go_on_while_each_leaves_clearly_less(taken):
    # A rough simulation settles by a tenth in a turn.
    count, left = taken(falling(80.0, 0.9), agrees=False)
    assert count == 16
    assert left == pytest.approx(80.0 * 0.9**15)


@pytest.mark.parametrize(
    ("first", "factor"),
    [
        # Hardly anything is gained.
        (80.0, 0.97),
        # The stand-in had said 100.
        (1e4, 0.8),
    ],
)
def test_other_turns_are_eight_at_most(taken, first, factor):
    count, _ = taken(falling(first, factor), agrees=False)
    assert count <= 8


def test_two_turns_that_agree_are_enough_once_nothing_is_gained(taken):
    assert taken([50.0, 49.9, 1.0], agrees=True) == (2, 49.9)
    count, left = taken([50.0, 49.0, 48.0, 47.9, 1.0], agrees=True)
    assert (count, left) == (4, 47.9)


@pytest.mark.parametrize(
    ("present", "effect", "is_force"),
    [
        ("constant_load", "output_backlash", True),
        ("input_delay", "output_backlash", False),
        ("", "output_backlash", False),
        ("", "coulomb_friction", True),
    ],
)
def test_a_force_that_the_drive_has_already_acts_at_the_force_input(
    present, effect, is_force
):
    """Through the input of a loop inside the simulation it would be another force."""
    values = {"constant_load": {"force_N": 1.0}, "input_delay": {"delay_s": 1e-3}}
    of = problem(recordings({}))
    drive = replace(of.drive, effects={one: values[one] for one in (present,) if one})
    able = SimpleNamespace(capabilities=SimpleNamespace(force=True))
    runs = SimpleNamespace(simulator=able)
    fit = made_up((effect,), 1.0)
    assert turns.acts_at_force(replace(of, drive=drive), fit, runs) is is_force


def test_no_turn_follows_one_that_leaves_far_more_than_no_effect(taken):
    # Ten times as much as without it; just less goes on until nothing is gained.
    assert taken([1100.0, 50.0], agrees=False, without=100.0)[0] == 1
    count, _ = taken([900.0, 50.0, *[49.0] * 20], agrees=False, without=100.0)
    assert count > 2


def test_three_turns_are_enough_where_another_effect_leaves_far_less(taken):
    falls = falling(100.0, 0.9)
    assert taken(falls, agrees=False, rival=20.0)[0] == 3
    # Within its reach it goes on.
    assert taken(falls, agrees=False, rival=30.0)[0] == 16


def test_once_runs_are_spent_only_turns_follow_that_still_gain(taken):
    slow = falling(80.0, 0.97)
    assert taken(slow, agrees=False, are_spent=True)[0] == 2
    assert taken(slow, agrees=False)[0] > 2
    assert taken(falling(80.0, 0.9), agrees=False, are_spent=True)[0] == 16


def test_derivatives_by_a_parameter_are_seen_beside_the_rounding_of_a_run():
    way = np.linspace(0.0, 1.0, 100)

    def push(values):
        return [SimulatorRun(np.round(values["a"] * way, 3), np.zeros(0))]

    found = push({"a": 1.0})
    parameter = ("a", FreeParameter(1.0, (0.1, 5.0)))
    (rough,) = turns._slope(push, {"a": 1.0}, parameter, found, 0.0)
    (seen,) = turns._slope(push, {"a": 1.0}, parameter, found, 0.5)
    assert np.corrcoef(seen, way)[0, 1] > 0.99
    assert np.corrcoef(rough, way)[0, 1] < 0.95


def test_a_stand_in_that_runs_away_ends_the_turns(monkeypatch):
    """A gain without dynamics is no drive: what stands for it may explode."""
    of = problem(recordings({}))
    signals = of.signals
    calm = [np.zeros(one.input.size) for one in signals]
    wild = [np.full(one.input.size, np.inf) for one in signals]
    read = [SimulatorRun(one, np.zeros(0)) for one in calm]
    monkeypatch.setattr(turns, "rebuilt", lambda *_: (None, None))
    monkeypatch.setattr(turns, "forces_along", lambda *_: calm)
    monkeypatch.setattr(turns, "as_sent", lambda *_, **__: calm)
    monkeypatch.setattr(turns, "pushed", lambda *_: read)
    monkeypatch.setattr(
        turns,
        "simulate_at",
        lambda *_: [SimpleNamespace(output=one, position=one) for one in wild],
    )
    first = Turn(of, FIT, {}, 100.0, at_force=True)
    findings = SimpleNamespace(scales=None)
    assert turns.answered(findings, first, runs=None) is None
