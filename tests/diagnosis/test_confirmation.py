"""What is found beside a stand-in, put into the simulation itself."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import confirmation
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.drive import StandIn
from hwid_cli.records.programs import FreeParameter
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up

PAIR = ("cubic_stiffness", "one_sided_stop:contact")
FRICTION = ("coulomb_friction",)


@pytest.mark.parametrize(
    ("pair", "left", "whiteness", "is_named"),
    [
        (PAIR, 100.0, 0.9, True),
        # Two that look alike are no fact where the run leaves something.
        (PAIR, 124.0, 30.0, False),
        (FRICTION, [*[9e4] * 3, *[2e5] * 3], 30.0, True),
        # Nor is what leaves more of the recordings held out than the base does.
        (FRICTION, [*[9e4] * 3, *[9e5] * 3], 30.0, False),
    ],
)
def test_what_was_found_is_a_fact_where_its_own_run_bears_it_out(
    monkeypatch, pair, left, whiteness, is_named
):
    run = made_up(pair, left, whiteness=whiteness)
    whole = base(600_000.0)
    findings = Findings(
        problem=None, criteria=CRITERIA, scales=None, given_sse=whole.sse, base=whole,
        before=[], force=[], where=(), found=None,
        verdict=DiagnosisVerdict("named", True, made_up(pair, 100.0), ()),
    )  # fmt: skip
    drive = SimpleNamespace(drive=None)
    turn = SimpleNamespace(values_of_run={}, problem=drive)
    monkeypatch.setattr(confirmation, "settled", lambda *_: turn)
    monkeypatch.setattr(confirmation, "is_as_good", lambda _: True)
    for without in ("_without_idle", "_without_imitations"):
        monkeypatch.setattr(confirmation, without, lambda _, best, __: best)
    monkeypatch.setattr(confirmation, "followed", lambda _, best, __: best)
    monkeypatch.setattr(confirmation, "fit_of_run", lambda *_: run)
    monkeypatch.setattr(
        confirmation,
        "_with_run",
        lambda *_: SimpleNamespace(
            verdict=SimpleNamespace(chosen=run, rivals=()), criteria=CRITERIA
        ),
    )
    runs = SimpleNamespace(simulator=SimpleNamespace(run=print))
    found, _, is_confirmed = confirmation.confirm(findings, runs, {})
    assert is_confirmed is is_named
    if not is_named:
        assert found.verdict.word == "unknown"


@pytest.mark.parametrize(
    ("effects", "is_as_good", "cause"),
    [
        ((), True, "input_noise"),
        # More than was told, or told of an effect: the run itself has to show it.
        ((), False, ""),
        (("coulomb_friction",), True, ""),
    ],
)
def test_what_was_told_to_be_noise_is_noise_where_the_run_leaves_no_more(
    monkeypatch, effects, is_as_good, cause
):
    whole = base(600_000.0)
    chosen = replace(made_up(effects, 100.0, whiteness=0.8), cause="input_noise")
    findings = Findings(
        problem=None, criteria=CRITERIA, scales=None, given_sse=whole.sse, base=whole,
        before=[], force=[], where=(), found=None,
        verdict=DiagnosisVerdict("parameters", True, chosen, ()),
    )  # fmt: skip
    run = made_up(effects, 100.0, whiteness=7.0)
    monkeypatch.setattr(confirmation, "fit_of_run", lambda *_: run)
    monkeypatch.setattr(confirmation, "is_as_good", lambda _: is_as_good)
    turn = SimpleNamespace(problem=DiagnosisProblem((), StandIn(1.0, 1.0, 1.0, 1.0)))
    verdict = confirmation._with_run(findings, turn).verdict
    assert verdict.chosen.cause == cause
    assert verdict.is_complete is bool(cause)


@pytest.mark.parametrize(
    ("acts_by", "left_without", "remain"),
    [
        # A run leaves as much without it.
        (10.0, 101.0, ("coulomb_friction",)),
        # The simulation's own run misses it, or it acts.
        (10.0, 3000.0, ("coulomb_friction", "periodic_force")),
        (9000.0, 101.0, ("coulomb_friction", "periodic_force")),
    ],
)
def test_what_hardly_acts_in_the_run_is_no_effect(
    monkeypatch, acts_by, left_without, remain
):
    pair, whole = ("coulomb_friction", "periodic_force"), base(600_000.0)
    findings = Findings(
        problem=None, criteria=CRITERIA, scales=None, given_sse=whole.sse, base=whole,
        before=[], force=[], where=(), found=None,
        verdict=DiagnosisVerdict("named", True, made_up(pair, 100.0), ()),
    )  # fmt: skip
    runs = SimpleNamespace(run_tasks=SimpleNamespace(are_spent=False))
    problem = DiagnosisProblem((), StandIn(1.0, 1.0, 1.0, 1.0))

    def turn_of(fit):
        return SimpleNamespace(fit=fit, problem=problem, values_of_run={})

    def settled(_findings, fit, _runs, _values):
        return turn_of(replace(fit, sse=made_up(fit.effects, left_without).sse))

    def acts(_findings, _turn, effect):
        return acts_by if effect == "periodic_force" else 1e5

    monkeypatch.setattr(confirmation, "settled", settled)
    monkeypatch.setattr(confirmation, "fit_of_run", lambda _, turn: turn.fit)
    monkeypatch.setattr(confirmation, "_acts_by", acts)
    found = confirmation._without_idle(findings, turn_of(made_up(pair, 100.0)), runs)
    assert found.fit.effects == remain


@pytest.mark.parametrize(
    ("left", "word"), [(140.0, "ambiguous"), (900.0, "named"), (None, "named")]
)
def test_rivals_are_those_that_leave_as_little_in_the_simulation(
    monkeypatch, left, word
):
    """A stand-in that errs takes both for as good; runs say which one is."""
    chosen, rival = made_up(FRICTION, 135.0), made_up(("hysteresis",), 135.0)
    whole = base(600_000.0)
    findings = Findings(
        problem=None, criteria=CRITERIA, scales=None, given_sse=whole.sse, base=whole,
        before=[], force=[], where=(), found=None,
        verdict=DiagnosisVerdict("ambiguous", False, chosen, (rival,)),
    )  # fmt: skip
    turn = None if left is None else SimpleNamespace(fit=made_up(("hysteresis",), left))
    monkeypatch.setattr(confirmation, "settled", lambda *_: turn)
    monkeypatch.setattr(confirmation, "fit_of_run", lambda _, turn: turn.fit)
    best = SimpleNamespace(values_of_run={}, sse=chosen.sse)
    found = confirmation._beside_rivals(findings, findings, best, None)

    assert found.verdict.word == word
    assert bool(found.verdict.rivals) is (word == "ambiguous")


@pytest.mark.parametrize(
    ("effects", "lag_s", "left", "kept"),
    [
        # The pump's own lag does as well once it is back where it was stated ...
        (("actuator_lag", "end_stop"), 0.02, 100.0, ("end_stop",)),
        # ... unless more is left, or it has stayed there, or nothing else would be left.
        (("actuator_lag", "end_stop"), 0.02, 300.0, ("actuator_lag", "end_stop")),
        (("actuator_lag", "end_stop"), 0.15, 100.0, ("actuator_lag", "end_stop")),
        (("actuator_lag",), 0.02, 100.0, ("actuator_lag",)),
        # What acts on the motion is no parameter's imitation.
        (("cogging", "end_stop"), 0.02, 100.0, ("cogging", "end_stop")),
    ],
)
def test_an_effect_that_makes_up_for_a_parameter_led_away_goes(
    monkeypatch, effects, lag_s, left, kept
):
    run = made_up(effects, 100.0)
    best = SimpleNamespace(
        fit=run, values_of_run={"lag": lag_s, "gain": 2.0}, problem=base
    )
    asked = []

    def settled(_findings, fit, _runs, values):
        asked.append(values)
        fit = replace(fit, sse=np.full(6, left))
        return SimpleNamespace(fit=fit, values_of_run=values, problem=base)

    def smaller(fit, owner):
        return replace(fit, effects=tuple(one for one in fit.effects if one != owner))

    monkeypatch.setattr(confirmation, "settled", settled)
    monkeypatch.setattr(confirmation, "fit_of_run", lambda _, turn: turn.fit)
    monkeypatch.setattr(confirmation, "replace", lambda one, **_: one)
    monkeypatch.setattr(confirmation, "without_owner", smaller)
    free = {"lag": FreeParameter(0.17, (0.02, 0.6)), "gain": FreeParameter(2.1)}
    runs = SimpleNamespace(
        simulator=SimpleNamespace(free=free), run_tasks=SimpleNamespace(are_spent=False)
    )
    findings = SimpleNamespace(criteria=CRITERIA, base=base(900.0))
    found = confirmation._without_imitations(findings, best, runs)
    assert found.fit.effects == kept
    assert all(one == {"lag": 0.17, "gain": 2.0} for one in asked)
