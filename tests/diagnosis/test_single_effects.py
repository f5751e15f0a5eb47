"""Which single effects a simulation of one's own is run with."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import port_search, single_effects, told_by_runs
from hwid_cli.diagnosis.port_effects import PortStart
from hwid_cli.diagnosis.single_effects import (
    _is_settled_by,
    _likely,
    _twins_in_simulation,
)
from hwid_cli.diagnosis.told_by_runs import TriedEffects
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.candidates import ParameterRef
from tests.diagnosis.made_up_fits import CRITERIA, PROBLEM, base, made_up

# In the order in which they leave least beside the stand-in.
LIKELY = {
    "actuator_lag:second_order": 101.0,
    "sensor_lag:second_order": 101.5,
    "actuator_lag": 102.0,
    "sensor_lag": 102.5,
    "input_delay": 103.0,
}


@pytest.fixture(autouse=True)
def are_clear(monkeypatch):
    """Made-up fits have no intervals: none reaches where its effect is not there."""
    monkeypatch.setattr(single_effects, "unclear_effects", lambda *_: ())


def test_variants_of_one_effect_take_no_place_of_another():
    fits = {
        (one,): made_up((one,), sse, parameters=1 + one.count(":"))
        for one, sse in LIKELY.items()
    }
    findings = SimpleNamespace(
        criteria=CRITERIA,
        base=base(),
        found=SimpleNamespace(fits=fits),
        problem=None,
        scales=None,
    )
    found = [one.effects[0] for one in _likely(findings)]
    assert sorted(found) == sorted(LIKELY)


@pytest.mark.parametrize(
    ("of_lag", "whiteness", "settled"),
    [
        # Runs through the port leave nothing but noise: no turn of the stand-in follows ...
        (100.0, 0.5, []),
        # ... unless something remains.
        (250.0, 3.0, ["actuator_lag"]),
    ],
)
def test_an_effect_at_a_port_is_fitted_through_runs_first(
    monkeypatch, of_lag, whiteness, settled
):
    lag = made_up(("actuator_lag",), 150.0)
    run = made_up(("actuator_lag",), of_lag, whiteness=whiteness)
    turns = []

    def by_turns(findings, one, runs, values, rival):
        turns.append(one.effects[0])

    start = PortStart(lag, {}, 1.1, 0.1)
    monkeypatch.setattr(single_effects, "begin_at_port", lambda *_: start)
    monkeypatch.setattr(port_search, "with_port_effects", lambda *_: run)
    for room in (single_effects, told_by_runs):
        monkeypatch.setattr(room, "fit_of_run", lambda findings, turn: turn)
    monkeypatch.setattr(single_effects, "settled", by_turns)
    findings = SimpleNamespace(
        criteria=CRITERIA, problem=PROBLEM, base=base(900.0), own_base=None
    )
    runs = SimpleNamespace(
        simulator=SimpleNamespace(free={"gain": None}),
        run_tasks=SimpleNamespace(are_spent=False),
    )
    tried = TriedEffects(findings)
    tried.keep(single_effects._in_simulation(tried, lag, runs, {}))
    assert turns == settled
    assert tried.fits[("actuator_lag",)] is run
    # Not twice.
    single_effects._in_simulation(tried, lag, runs, {})
    assert turns == [*settled, "actuator_lag"]


def test_kinds_of_friction_do_not_keep_a_dead_zone_from_the_simulation():
    frictions = [
        "stribeck_friction",
        "position_friction",
        "hysteresis",
        "asymmetric_friction",
        "load_friction:drive",
        "coulomb_friction",
    ]
    names = [*frictions, "input_dead_zone"]
    fits = {
        (one,): made_up((one,), 101.0 + row, parameters=2 - (one == "coulomb_friction"))
        for row, one in enumerate(names)
    }
    findings = SimpleNamespace(
        criteria=CRITERIA,
        base=base(),
        found=SimpleNamespace(fits=fits),
        problem=None,
        scales=None,
    )
    found = {one.effects[0] for one in _likely(findings)}
    # Four different ones and the limit case of most.
    assert {"stribeck_friction", "input_dead_zone", "coulomb_friction"} <= found
    assert len(found) == 5


@pytest.mark.parametrize(
    ("sse", "is_allowed", "tried"),
    [
        # A lag of the sensor leaves nothing: that of the actuator is the same ...
        (100.0, True, ["actuator_lag"]),
        # ... unless something remains, or nobody has asked for it.
        (400.0, True, []),
        (100.0, False, []),
    ],
)
def test_what_leaves_nothing_is_tried_as_the_limit_case_with_its_values(
    monkeypatch, sse, is_allowed, tried
):
    lag = replace(
        made_up(("sensor_lag",), sse, whiteness=0.5 if sse == 100.0 else 9.0),
        names=(ParameterRef("base", "damping_N_s_per_m"),
               ParameterRef("sensor_lag", "time_constant_s")),
        values=np.array([4.7, 0.065]),
    )  # fmt: skip
    asked = []

    def settled(_findings, fit, _runs, values):
        asked.append((fit, values))

    monkeypatch.setattr(single_effects, "settled", settled)
    shares = {("sensor_lag",): 0.8} | ({("actuator_lag",): 0.2} if is_allowed else {})
    findings = SimpleNamespace(
        criteria=CRITERIA, base=base(), found=SimpleNamespace(shares=shares)
    )
    turn = SimpleNamespace(values_of_run={"c": 0.45})
    fits = {lag.effects: lag}
    found = _twins_in_simulation(findings, None, {lag.effects: turn}, fits)
    # None of them could be run here.
    assert found == []
    assert [fit.effects[0] for fit, _ in asked] == tried
    for fit, values in asked:
        assert fit.names[1] == ParameterRef("actuator_lag", "time_constant_s")
        assert fit.values.tolist() == [4.7, 0.065]
        assert values == {"c": 0.45}


def findings_of(sses, criteria=CRITERIA):
    fits = {
        (one,): made_up((one,), sse, parameters=len(CATALOGUE[one].parameters))
        for one, sse in sses.items()
    }
    return SimpleNamespace(
        criteria=criteria,
        base=base(),
        found=SimpleNamespace(fits=fits),
        problem=None,
        scales=None,
    )


def test_a_delay_is_run_although_the_stand_in_takes_others_for_far_better():
    # Excesses of 2, 30, 140 and 290 beside the 300 of the base.
    given = {
        "coulomb_friction": 102.0,
        "input_delay": 130.0,
        "input_saturation": 240.0,
        "input_dead_zone": 390.0,
    }
    found = {one.effects[0] for one in _likely(findings_of(given))}
    # Saturation leaves less than half of what the base leaves, the dead zone does not.
    assert found == {"coulomb_friction", "input_delay", "input_saturation"}


class Replacing:
    """Criteria of a stand-in that has become another drive beside every effect."""

    def __getattr__(self, name):
        return getattr(CRITERIA, name)

    def replaces(self, _found):
        return True


def test_what_changes_the_input_is_run_whatever_it_has_made_of_the_stand_in():
    given = {"coulomb_friction": 101.0, "input_dead_zone": 102.0}
    found = [one.effects for one in _likely(findings_of(given, Replacing()))]
    assert found == [("input_dead_zone",)]


@pytest.mark.parametrize(
    ("run", "other", "is_tried"),
    [
        # The lag has left nothing in the simulation: a delay may, too ...
        ("actuator_lag", "input_delay", True),
        # ... as the stand-in is no judge between the two; of friction it is.
        ("actuator_lag", "coulomb_friction", False),
        ("coulomb_friction", "input_delay", False),
    ],
)
def test_changes_of_the_input_are_rivals_until_they_were_run(run, other, is_tried):
    findings = findings_of({run: 100.5, other: 120.0})
    (one,) = (fit for fit in findings.found.fits.values() if fit.effects == (other,))
    done = [made_up((run,), 100.0, whiteness=0.5)]
    assert _is_settled_by(findings, one, done) is not is_tried
    assert not _is_settled_by(findings, one, [])


@pytest.mark.parametrize(
    ("said", "whiteness", "is_tried"),
    [
        (100.2, 0.5, False),
        # The stand-in says clearly less; or the run has left more than noise.
        (60.0, 0.5, True),
        (100.2, 1.05, True),
    ],
)
def test_a_wider_effect_that_says_no_more_than_a_run_with_a_simpler_one_is_not_run(
    said, whiteness, is_tried
):
    """A coupling beside a delay took 1259 runs, and had nothing left to explain."""
    findings = findings_of({"input_delay": 104.0, "elastic_coupling:load": said})
    wide = findings.found.fits["elastic_coupling:load",]
    done = [made_up(("input_delay",), 100.0, whiteness=whiteness)]
    assert _is_settled_by(findings, wide, done) is not is_tried


def test_of_likely_effects_the_simple_ones_are_run_first():
    findings = findings_of({"elastic_coupling:load": 101.0, "input_delay": 102.0})
    found = [one.effects[0] for one in _likely(findings)]
    assert found == ["input_delay", "elastic_coupling:load"]


def test_what_leaves_nothing_beside_the_stand_in_is_run_before_its_limit_case():
    fits = {
        (one,): made_up((one,), sse, parameters=count)
        for one, sse, count in (
            ("coulomb_friction", 130.0, 1),
            ("stribeck_friction", 100.05, 3),
            ("asymmetric_friction", 120.0, 2),
        )
    }
    findings = SimpleNamespace(
        criteria=CRITERIA,
        base=base(1100.0),
        found=SimpleNamespace(fits=fits),
        problem=None,
        scales=None,
    )
    found = [one.effects[0] for one in _likely(findings)]
    assert found[:2] == ["stribeck_friction", "coulomb_friction"]


@pytest.mark.parametrize(
    ("sse", "whiteness", "turns_on"),
    [(130.0, 3.0, True), (100.0, 0.5, False), (1000.0, 3.0, False)],
)
def test_a_run_near_the_noise_turns_on(monkeypatch, sse, whiteness, turns_on):
    """Not one that leaves noise alone, nor one that is far from it."""
    near = made_up(("stribeck_friction",), sse, whiteness=whiteness)
    asked = []

    def best_turn(_findings, turn, _runs):
        asked.append(turn)
        return SimpleNamespace(fit=near, sse=turn.sse - 1.0)

    monkeypatch.setattr(single_effects, "best_turn", best_turn)
    monkeypatch.setattr(single_effects, "followed", lambda _, turn, *__, **___: turn)
    for room in (single_effects, told_by_runs):
        monkeypatch.setattr(room, "fit_of_run", lambda _, turn: turn.fit)
    findings = SimpleNamespace(criteria=CRITERIA, base=base(900.0))
    tried = TriedEffects(findings)
    tried.keep([SimpleNamespace(fit=near, sse=near.sse)])
    runs = SimpleNamespace(up_to=lambda _: None)
    for _ in range(2):
        # Once is enough.
        single_effects._follow(tried, runs, at_most=10.0)
    assert len(asked) == turns_on


def test_play_without_a_gap_is_run_after_all_others(monkeypatch):
    """It leaves least, and is as well another effect: its runs may be the last ones."""
    findings = findings_of({"gear_backlash": 104.0, "input_delay": 130.0})
    first = [one.effects[0] for one in _likely(findings)]

    def unclear(_problem, one, _scales):
        return one.effects if "gear_backlash" in one.effects else ()

    monkeypatch.setattr(single_effects, "unclear_effects", unclear)
    last = [one.effects[0] for one in _likely(findings)]
    assert set(first) == {"gear_backlash", "input_delay"}
    assert last == ["input_delay", "gear_backlash"]


@pytest.mark.parametrize(
    ("effect", "of_run", "said", "is_behind"),
    [
        # 300 over the noise without an effect. The run with friction leaves 48, which is
        # more than noise; the stand-in leaves 100 with friction, and 90 with play.
        ("output_backlash", 148.0, 190.0, True),
        # Clearly less beside the stand-in: it may be what the machine has.
        ("output_backlash", 148.0, 170.0, False),
        # The run explains too little to say so, or leaves hardly anything.
        ("output_backlash", 220.0, 190.0, False),
        ("output_backlash", 130.0, 190.0, False),
        # No stand-in ranks what changes the input.
        ("input_dead_zone", 148.0, 190.0, False),
    ],
)
def test_runs_are_kept_for_a_second_effect(effect, of_run, said, is_behind):
    findings = findings_of({"coulomb_friction": 200.0, effect: said})
    run = made_up(("coulomb_friction",), of_run)
    one = findings.found.fits[effect,]
    assert single_effects._is_behind_most(findings, one, [run]) is is_behind
    assert not single_effects._is_behind_most(findings, one, [])
