"""Which sets of effects a simulation of one's own is run with, and what its runs decide."""

from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import leads_in_simulation as module
from hwid_cli.diagnosis.leads_in_simulation import leads_in_simulation
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up

DELAY_AND_STOP = ("end_stop", "input_delay")
LAG_AND_STOP = ("actuator_lag", "end_stop")
FRICTION_AND_STOP = ("coulomb_friction", "end_stop")
THREE = ("coulomb_friction", "end_stop", "input_delay")
# What the stand-in leaves of each recording, whose noise is 100; and parameters.
BESIDE = {
    ("end_stop",): (500.0, 2),
    THREE: (101.0, 4),
    DELAY_AND_STOP: (130.0, 3),
    LAG_AND_STOP: (120.0, 3),
    FRICTION_AND_STOP: (950.0, 3),
}


@pytest.fixture
def findings():
    fits = {ids: made_up(ids, left, parameters=n) for ids, (left, n) in BESIDE.items()}
    found = SimpleNamespace(fits=fits)
    return SimpleNamespace(criteria=CRITERIA, base=base(2000.0), found=found)


def tried(monkeypatch, findings, runs_leave, *, spent_after=9):
    """Sets that the simulation is run with, and what is decided among."""
    asked, given = [], []

    class RunTasks:
        @property
        def are_spent(self):
            return len(asked) >= spent_after

    def settled(findings, one, runs, values, rival):
        asked.append((one.effects, rival))
        left = runs_leave.get(one.effects)
        return (
            None if left is None else made_up(one.effects, *left[:1], whiteness=left[1])
        )

    def decided(findings, turns, fits):
        given.append((set(turns), set(fits)))

    monkeypatch.setattr(module, "settled", settled)
    monkeypatch.setattr(module, "fit_of_run", lambda findings, turn: turn)
    monkeypatch.setattr(module, "decided_by_runs", decided)
    runs = SimpleNamespace(run_tasks=RunTasks())
    told = leads_in_simulation(findings, runs, {"gain": 1.0}, lambda *_: None)
    assert told.findings is None
    assert told.values == {"gain": 1.0}
    ((turns, fits),) = given
    assert fits == turns | {("end_stop",)}
    return asked, turns


def test_sets_of_few_parameters_that_leave_little_are_run_first(monkeypatch, findings):
    runs_leave = {LAG_AND_STOP: (300.0, 3.0), THREE: (110.0, 3.0)}
    asked, turns = tried(monkeypatch, findings, runs_leave)
    # One that leaves more than 3 times the noise beside the stand-in is no lead; what has
    # no run, or leaves more than without effects, is none to choose from.
    assert [ids for ids, _ in asked] == [LAG_AND_STOP, DELAY_AND_STOP, THREE]
    assert turns == {LAG_AND_STOP, THREE}
    # The best run before tells which ones are far behind.
    np.testing.assert_allclose([rival for _, rival in asked], [np.inf, 1800.0, 1800.0])


def test_a_run_that_leaves_noise_ends_the_search(monkeypatch, findings):
    asked, turns = tried(monkeypatch, findings, {LAG_AND_STOP: (100.0, 0.5)})
    assert [ids for ids, _ in asked] == [LAG_AND_STOP]
    assert turns == {LAG_AND_STOP}


def test_no_set_is_run_once_runs_are_spent(monkeypatch, findings):
    asked, _ = tried(monkeypatch, findings, {}, spent_after=1)
    assert len(asked) == 1


def test_what_runs_decide_is_told(monkeypatch, findings):
    best = made_up(LAG_AND_STOP, 100.0, whiteness=0.5)
    told = SimpleNamespace(verdict=SimpleNamespace(chosen=best))
    monkeypatch.setattr(module, "settled", lambda *_: best)
    monkeypatch.setattr(module, "fit_of_run", lambda findings, turn: turn)
    monkeypatch.setattr(module, "decided_by_runs", lambda *_: (told, {"gain": 2.0}))
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))
    found = leads_in_simulation(findings, runs, {"gain": 1.0}, lambda *_: None)
    assert (found.findings, found.values, found.is_all) == (told, {"gain": 2.0}, True)
