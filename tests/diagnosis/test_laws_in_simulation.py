"""When a law is put into a simulation of one's own."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import laws_in_simulation
from hwid_cli.diagnosis.simulator import CountedRuns, Runs
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up


@pytest.mark.parametrize(
    ("of_single", "terms", "of_law", "left_of_run", "is_told"),
    [
        # A law of one term that leaves less than half of what single effects do is run ...
        (700.0, 1, 110.0, 100.5, True),
        # ... and told if nothing is left then.
        (700.0, 1, 110.0, 130.0, False),
        (700.0, 2, 101.0, 100.5, False),
        (700.0, 1, 450.0, 100.5, False),
        # Or that leaves nothing beside the stand-in, where each of them leaves something.
        (180.0, 1, 119.0, 100.5, True),
        (180.0, 1, 145.0, 100.5, False),
        # An effect of the catalogue that may be all comes first.
        (101.0, 1, 100.5, 100.5, False),
    ],
)
def test_a_law_of_one_term_is_run_before_effects_that_leave_far_more(
    monkeypatch, of_single, terms, of_law, left_of_run, is_told
):
    def fit(sse):
        return made_up(("gravity",), sse, whiteness=0.5 if sse < 120.0 else 9.0)

    def findings(sse, law=None):
        verdict = SimpleNamespace(
            word="unknown", chosen=fit(sse), is_complete=sse < 120.0
        )
        return SimpleNamespace(
            criteria=CRITERIA, base=base(900.0), verdict=verdict, law=law,
            found=SimpleNamespace(fits={("gravity",): fit(sse)}),
        )  # fmt: skip

    law = SimpleNamespace(terms=[None] * terms)
    monkeypatch.setattr(laws_in_simulation, "find", lambda *_: findings(of_law, law))
    told = findings(left_of_run)
    monkeypatch.setattr(
        laws_in_simulation, "confirm", lambda *_: (told, {"c": 2.0}, True)
    )
    simulation = SimpleNamespace(run_tasks=CountedRuns(None)), {"c": 1.0}
    given = None, DiagnoseOptions(), simulation, findings(of_single), lambda *_: None
    expected = (told, {"c": 2.0}, True) if is_told else None
    assert laws_in_simulation.short_law(*given) == expected
    # Not where somebody has named the effects to look for.
    asked = replace(given[1], effects=("gravity",))
    assert laws_in_simulation.short_law(None, asked, *given[2:]) is None


@pytest.mark.parametrize(
    ("changes", "is_taken"),
    [
        ({}, True),
        # Longer than what is named, not borne out, hardly better, or nothing to look for.
        ({"n_terms": 2}, False),
        ({"is_confirmed": False}, False),
        ({"left": 120.0}, False),
        ({"is_complete": True}, False),
        ({"laws": "never"}, False),
        # Runs are left for it unless the configuration has limited them.
        ({"is_spent": True}, True),
        ({"is_spent": True, "max_runs": 500}, False),
    ],
)
def test_a_law_takes_the_place_of_a_name_that_leaves_far_more(
    monkeypatch, changes, is_taken
):
    case = {"n_terms": 1, "is_confirmed": True, "left": 104.0, "is_complete": False}
    case |= {"laws": "auto", "is_spent": False, "max_runs": None} | changes
    law = made_up(("law",), case["left"])
    found = SimpleNamespace(
        law=SimpleNamespace(terms=range(case["n_terms"])),
        verdict=DiagnosisVerdict("law", False, law, ()),
        criteria=CRITERIA,
    )
    monkeypatch.setattr(laws_in_simulation, "standing_beside", lambda *_: None)
    monkeypatch.setattr(laws_in_simulation, "find", lambda *_: found)
    monkeypatch.setattr(
        laws_in_simulation,
        "confirm",
        lambda one, *_: (one, {"kt": 2.0}, case["is_confirmed"]),
    )
    # 1.12 times the noise, and 1.02 with the law.
    named = made_up(("quadratic_drag",), 125.0)

    def run(_tasks, **_):
        return []

    told = laws_in_simulation.law_instead(
        Runs(
            SimpleNamespace(run=len),
            CountedRuns(run, 0 if case["is_spent"] else np.inf),
        ),
        SimpleNamespace(signals=()),
        DiagnosisVerdict("named", case["is_complete"], named, ()),
        {"kt": 1.0},
        DiagnoseOptions(laws=case["laws"], max_runs=case["max_runs"]),
        lambda *_: None,
    )
    assert told == ((found, {"kt": 2.0}) if is_taken else None)
