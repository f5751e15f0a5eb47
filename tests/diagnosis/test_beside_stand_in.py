"""The order in which a search beside a stand-in asks, and what it keeps."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import pytest

from hwid_cli.diagnosis import beside_stand_in
from hwid_cli.diagnosis.beside_stand_in import Beside, FoundBeside, searched_beside
from hwid_cli.diagnosis.simulator import CountedRuns, Runs
from hwid_cli.diagnosis.told_by_runs import ToldByRuns
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.made_up_fits import made_up


def beside(runs, values, options=None):
    """What is asked of a simulation whose stand-in is a stub."""
    return Beside(
        None, options or DiagnoseOptions(), runs, values, None, lambda *_: None
    )


@dataclass(frozen=True)
class Some:
    """Findings, or what was found, as far as it is read here."""

    verdict: object = None
    found: object = None
    fits: object = None
    base: object = None
    problem: object = None
    scales: object = None
    criteria: object = field(
        default_factory=lambda: SimpleNamespace(leaves_next_to_nothing=lambda *_: False)
    )


@pytest.mark.parametrize("is_borne_out", [True, False])
def test_pieces_are_asked_where_no_run_bears_a_single_effect_out(
    monkeypatch, is_borne_out
):
    """What a stand-in leaves of an effect that runs bear out is its own error."""
    asked = []

    def find(_standing, options, *_, may_cut=True):
        asked.append((options.max_effects, may_cut))
        chosen = made_up((), 100.0, parameters=0)
        verdict = SimpleNamespace(word="unknown", chosen=chosen)
        return Some(verdict, Some(fits={}))

    one = find(None, DiagnoseOptions()) if is_borne_out else None
    asked.clear()
    alone = ToldByRuns(one, {"c": 1.0}, is_all=False)
    monkeypatch.setattr(beside_stand_in, "short_law", lambda *_: None)
    monkeypatch.setattr(beside_stand_in, "find", find)
    monkeypatch.setattr(beside_stand_in, "belongs_to", lambda *_: True)
    monkeypatch.setattr(beside_stand_in, "with_further_effect", lambda first, *_: first)
    monkeypatch.setattr(beside_stand_in, "single_in_simulation", lambda *_, **__: alone)
    monkeypatch.setattr(beside_stand_in, "with_own_base", lambda found, *_: found)
    monkeypatch.setattr(
        beside_stand_in, "confirm", lambda found, *_: (found, {"c": 1.0}, False)
    )
    monkeypatch.setattr(beside_stand_in, "leads_in_simulation", lambda *_: alone)
    simulator = SimpleNamespace(run=print)
    runs = Runs(simulator, CountedRuns(None))
    asked_of = beside(runs, {"c": 1.0}, DiagnoseOptions(max_effects=3))
    searched_beside(asked_of, is_first=False)
    assert asked == [(1, False), (3, not is_borne_out)]


@pytest.mark.parametrize(
    ("effect", "is_borne_out", "moved", "is_enough", "asks"),
    [
        # Parameters that have moved had imitated what is missing: the search begins again,
        # unless runs bear an effect out and they have moved by little.
        ("gear_backlash", False, 1.03, True, []),
        ("gear_backlash", True, 1.03, True, ["further"]),
        ("gear_backlash", True, 1.10, True, []),
        ("gear_backlash", False, 1.001, True, ["further", "sets"]),
        ("gear_backlash", True, 1.001, False, ["further", "sets"]),
        # An effect at a port was fitted from everywhere: a second one is looked for first.
        ("input_delay", True, 1.10, True, ["further"]),
        ("input_delay", True, 1.10, False, ["further"]),
    ],
)
def test_the_search_begins_again_where_parameters_have_moved(
    monkeypatch, effect, is_borne_out, moved, is_enough, asks
):
    chosen = made_up((effect,), 100.0)
    verdict = SimpleNamespace(word="unknown", chosen=chosen)
    found = SimpleNamespace(verdict=verdict)
    alone = ToldByRuns(found if is_borne_out else None, {"c": moved}, is_all=False)
    asked = []
    monkeypatch.setattr(beside_stand_in, "find", lambda *_, **__: found)
    monkeypatch.setattr(beside_stand_in, "with_own_base", lambda one, *_: one)
    monkeypatch.setattr(beside_stand_in, "single_in_simulation", lambda *_, **__: alone)
    monkeypatch.setattr(
        beside_stand_in,
        "with_further_effect",
        lambda *_: asked.append("further") or alone,
    )
    monkeypatch.setattr(beside_stand_in, "short_law", lambda *_: None)
    is_told = alone.findings is not None
    monkeypatch.setattr(beside_stand_in, "_is_enough", lambda _: is_told and is_enough)
    monkeypatch.setattr(
        beside_stand_in,
        "_of_sets",
        lambda *_: (
            asked.append("sets") or FoundBeside(found, {"c": moved}, is_borne_out)
        ),
    )
    monkeypatch.setattr(beside_stand_in, "_with_runs", lambda one, _: one)
    monkeypatch.setattr(beside_stand_in, "unconfirmed", lambda one: one)
    runs = Runs(SimpleNamespace(run=print), CountedRuns(None))
    told = searched_beside(beside(runs, {"c": 1.0}), is_first=True)
    assert asked == asks
    assert (told.findings, told.values) == (found, {"c": moved})
    assert told.is_confirmed is is_borne_out


@pytest.mark.parametrize(
    ("effects", "is_confirmed", "is_found", "told"),
    [
        # A set that the simulation's run bears out needs no other one ...
        (("end_stop", "gravity"), True, True, "set"),
        # ... and where it bears none out, or none was named, its runs choose another ...
        (("end_stop", "gravity"), False, True, "lead"),
        ((), True, True, "lead"),
        # ... if they can.
        ((), True, False, "set"),
    ],
)
def test_other_sets_are_run_where_none_is_confirmed(
    monkeypatch, effects, is_confirmed, is_found, told
):
    def findings(name, effects):
        verdict = SimpleNamespace(word=name, chosen=made_up(effects, 100.0))
        return SimpleNamespace(verdict=verdict)

    several, lead = findings("set", effects), findings("lead", ("end_stop", "hum"))
    leads = ToldByRuns(lead if is_found else None, {"c": 2.0}, is_all=False)
    monkeypatch.setattr(beside_stand_in, "find", lambda *_, **__: several)
    monkeypatch.setattr(beside_stand_in, "with_own_base", lambda found, *_: found)
    monkeypatch.setattr(
        beside_stand_in, "confirm", lambda *_: (several, {}, is_confirmed)
    )
    monkeypatch.setattr(beside_stand_in, "leads_in_simulation", lambda *_: leads)
    runs = SimpleNamespace(run_tasks=None, simulator=None)
    alone = ToldByRuns(None, {}, is_all=False)
    found = beside_stand_in._of_sets(beside(runs, {}), alone)
    assert found.findings.verdict.word == told
    assert found.values == ({"c": 2.0} if told == "lead" else {})
    assert found.is_confirmed is (told == "lead" or is_confirmed)


@pytest.mark.parametrize(("given", "most"), [(None, 1.5), (800, 1.0)])
def test_sets_have_runs_beyond_those_of_single_effects_where_these_are_open(
    monkeypatch, given, most
):
    seen = []
    verdict = SimpleNamespace(word="unknown", chosen=made_up((), 100.0))
    found = SimpleNamespace(verdict=verdict)
    alone = ToldByRuns(None, {}, is_all=False)
    monkeypatch.setattr(beside_stand_in, "short_law", lambda *_: None)
    monkeypatch.setattr(beside_stand_in, "find", lambda *_, **__: found)
    monkeypatch.setattr(beside_stand_in, "with_further_effect", lambda first, *_: first)
    monkeypatch.setattr(beside_stand_in, "single_in_simulation", lambda *_, **__: alone)
    monkeypatch.setattr(beside_stand_in, "with_own_base", lambda found, *_: found)
    monkeypatch.setattr(beside_stand_in, "_with_runs", lambda one, *_: one)
    monkeypatch.setattr(
        beside_stand_in, "_of_sets", lambda one, _: seen.append(one.runs)
    )
    # All that may be left out are spent.
    counted = CountedRuns(lambda *_, **__: [], 800)
    counted.count = 900
    runs = Runs(SimpleNamespace(run=print), counted)
    asked_of = beside(runs, {}, DiagnoseOptions(max_runs=given))
    searched_beside(asked_of, is_first=False)
    assert len(seen) == (most > 1.0)
    assert all(not one.run_tasks.are_spent for one in seen)


@pytest.mark.parametrize(
    ("word", "starts_alike", "is_of_runs"),
    [
        ("unknown", True, True),
        ("named", True, False),
        # A run whose starts were found where others are known cannot be played again.
        ("unknown", False, False),
    ],
)
def test_leads_are_those_of_the_simulations_own_runs(
    monkeypatch, word, starts_alike, is_of_runs
):
    monkeypatch.setattr(beside_stand_in, "where_it_starts", lambda problem, fit: fit)
    monkeypatch.setattr(beside_stand_in, "belongs_to", lambda *_: starts_alike)
    said = made_up(("cogging",), 10.0)
    other = made_up(("coulomb_friction",), 50.0)
    run = replace(said, sse=90.0 * said.sse)
    found = replaced_findings(word, {said.effects: said, other.effects: other})
    told = beside_stand_in._with_runs(
        found, ToldByRuns(None, {}, is_all=False, fits={said.effects: run})
    )
    assert told.found.fits[said.effects] is (run if is_of_runs else said)
    assert told.found.fits[other.effects] is other


def replaced_findings(word, fits):
    return Some(
        DiagnosisVerdict(word, is_complete=False, chosen=None, rivals=()),
        Some(fits=fits),
    )


@pytest.mark.parametrize(
    ("effects", "sse", "is_confirmed", "is_less"),
    [
        (("cogging", "coulomb_friction"), 90.0, True, True),
        (("cogging", "coulomb_friction"), 110.0, True, False),
        (("cogging", "coulomb_friction"), 90.0, False, False),
        ((), 90.0, True, False),
    ],
)
def test_a_set_has_to_leave_less_than_one_effect(effects, sse, is_confirmed, is_less):
    def told(fit):
        return SimpleNamespace(verdict=SimpleNamespace(chosen=fit))

    one = told(made_up(("coulomb_friction",), 100.0))
    several = FoundBeside(told(made_up(effects, sse)), {}, is_confirmed)
    assert several.leaves_less_than(one) is is_less
