"""What runs of a simulation with effects in it tell."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from hwid_cli.diagnosis import told_by_runs
from hwid_cli.diagnosis.port_screening import AtPorts
from hwid_cli.diagnosis.told_by_runs import TriedEffects, decided_by_runs
from tests.diagnosis.made_up_fits import CRITERIA, PROBLEM, base, made_up


@pytest.mark.parametrize(
    ("present", "is_exact"),
    [
        ({}, True),
        ({"input_delay": {"delay_s": 0.02}}, True),
        ({"coulomb_friction": {"force_N": 1.0}}, False),
    ],
)
def test_beside_a_force_no_run_shows_an_effect_at_a_port_as_it_is(present, is_exact):
    drive = replace(PROBLEM.drive, effects=present)
    tried = TriedEffects(SimpleNamespace(problem=SimpleNamespace(drive=drive)))
    assert tried.ports_are_exact is is_exact


def test_an_effect_that_leaves_far_more_than_another_at_a_port_is_not_tried_beside_it():
    findings = SimpleNamespace(criteria=CRITERIA, base=base(900.0), own_base=None)
    tried = TriedEffects(findings)
    tried.at_ports = AtPorts({"output_backlash": 0.15, "input_delay": 0.9})
    delay = made_up(("input_delay",), 100.0)
    assert not tried.is_known(delay)
    play = made_up(("output_backlash",), 100.0, whiteness=0.5)
    tried.fits = {play.effects: play}
    assert tried.is_known(delay)
    assert not tried.is_known(made_up(("gravity",), 100.0))
    tried.at_ports = AtPorts({"output_backlash": 0.3, "input_delay": 0.9})
    assert not tried.is_known(delay)
    # Nor what runs have told before.
    tried.given_up = {delay.effects}
    assert tried.is_known(delay)
    assert not tried.is_known(play)
    tried.through_runs = {play.effects}
    assert tried.is_known(play)


def test_what_the_simulation_was_not_run_with_is_not_told(monkeypatch):
    # A part of a set stands among what is weighed as the stand-in leaves it.
    run, part = made_up(("end_stop", "gravity"), 300.0), made_up(("end_stop",), 500.0)
    verdict = SimpleNamespace(chosen=part)
    monkeypatch.setattr(told_by_runs, "decide", lambda *_: verdict)
    findings = SimpleNamespace(
        criteria=CRITERIA, base=base(900.0), given_sse=None, own_base=None
    )
    fits = {one.effects: one for one in (part, run)}
    turns = {run.effects: SimpleNamespace()}
    assert decided_by_runs(findings, turns, fits) is None
