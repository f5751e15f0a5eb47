"""Starts where related sets of effects ended: which are worth a fit."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis import related_sets, set_fits
from hwid_cli.diagnosis.candidate import Screened, start_from
from hwid_cli.diagnosis.related_sets import (
    from_related,
    near_the_best,
    parts_of,
    that_add,
)
from hwid_cli.diagnosis.set_fits import SetFits
from tests.diagnosis.made_up_fits import base, made_up
from tests.diagnosis.small_drive import fit, search_start
from tests.diagnosis.small_rounds import (
    FEW,
    STIFFNESS,
    Screenings,
    rounds_of,
    rounds_of_fits,
)
from tests.stages.diagnosed_drive import FRICTION

BREAKING = {"force_N": 0.5, "static_excess_N": 0.6, "velocity_m_per_s": 0.03}


@pytest.mark.parametrize(
    ("hidden", "is_kept"), [(FRICTION, False), ({"stribeck_friction": BREAKING}, True)]
)
def test_of_many_samples_what_includes_another_one_has_to_bring_more(
    hidden, is_kept, monkeypatch
):
    of = rounds_of(hidden, FEW)
    fits = SetFits(of)
    found = fit(of.problem, FRICTION, scales=of.baseline.scales)
    fits.found[found.effects] = found
    start = {**BREAKING, "velocity_m_per_s": 0.01}
    begun = [search_start(of.problem, {"stribeck_friction": start})]
    wide, other = {("stribeck_friction",): begun}, {("cubic_stiffness",): begun}

    # Of few samples all go on.
    assert that_add(fits, wide | other) == wide | other
    monkeypatch.setattr(set_fits, "MANY_SAMPLES", 1000)
    kept = that_add(fits, wide | other)
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
    fits = SetFits(rounds_of(FRICTION, FEW, run_tasks=turns.run))
    monkeypatch.setattr(set_fits, "MANY_SAMPLES", 1000)
    found = fit(fits.rounds.problem, FRICTION, scales=fits.rounds.baseline.scales)
    fits.found[found.effects] = found
    monkeypatch.setattr(fits, "few_sse", lambda fit: 10.0)
    monkeypatch.setattr(related_sets, "_widened", lambda fits, ids, narrow: [])
    begun = {("hysteresis",): ["a"], ("hysteresis:bouc_wen",): ["b"]}

    kept = that_add(fits, begun)
    screened = [one for turn in turns.turns for one in turn]
    adds = of_hysteresis == 0.5
    assert (("hysteresis",) in kept) == adds
    assert ("hysteresis:bouc_wen" in screened) == adds
    assert (("hysteresis:bouc_wen",) in kept) == adds


def test_sets_that_bring_nothing_from_where_a_smaller_one_ended_are_not_finished():
    fits = SetFits(rounds_of({**FRICTION, **STIFFNESS}, FEW))
    of = fits.rounds
    friction = fit(of.problem, FRICTION, scales=of.baseline.scales)
    fits.found[friction.effects] = friction
    here = start_from(of.problem.drive, friction)
    faint = {"cubic_stiffness": {"stiffness_N_per_m3": 100.0},
             "input_dead_zone": {"threshold_A": 1e-3}}  # fmt: skip
    sets = {
        ("coulomb_friction", name): [replace(here, effects={**here.effects, name: one})]
        for name, one in faint.items()
    }
    screened = fits.screen("sets", {**parts_of(fits, sets), **sets})
    assert {one.effects for one in screened} == {friction.effects, *sets}
    pair = ("coulomb_friction", "cubic_stiffness")
    best = fit(of.problem, {**FRICTION, **STIFFNESS}, scales=of.baseline.scales)
    assert set(near_the_best(fits, sets, screened, best)) == {pair}
    # It is what they bring that counts: beside what leaves as much both would be near.
    assert set(near_the_best(fits, sets, screened, friction)) == {pair}


def test_a_simpler_law_may_be_further_from_the_best_set_than_another_one(monkeypatch):
    # Few steps do not lead it where the wider one has been led by many.
    fits = SetFits(rounds_of(FRICTION, FEW))
    best = fit(
        fits.rounds.problem,
        {"stribeck_friction": BREAKING},
        scales=fits.rounds.baseline.scales,
    )
    left = {best.effects: 1.0, ("coulomb_friction",): 5.0, ("cubic_stiffness",): 5.0}
    monkeypatch.setattr(fits, "floor", lambda: 0.0)
    monkeypatch.setattr(fits, "few_sse", lambda found: left.get(found.effects, 100.0))
    monkeypatch.setattr(fits, "largest_part", lambda whole: None)
    sets = {ids: ["a"] for ids in left if ids != best.effects}
    screened = [Screened(ids, left[ids], ("a",)) for ids in sets]
    assert set(near_the_best(fits, sets, screened, best)) == {("coulomb_friction",)}


def test_beside_values_of_each_recording_relatives_of_shared_ones_are_tried(
    monkeypatch,
):
    # A magnet and iron that saturates: a gain of each recording makes up for the magnet.
    fits = SetFits(replace(rounds_of_fits(), base=base(900.0)))
    swallows = made_up(
        ("force_constant_saturation", "parameter_change:damping"), 150.0, own=np.ones(6)
    )
    shared = made_up(("cogging", "force_constant_saturation"), 200.0)
    fits.found = {one.effects: one for one in (swallows, shared)}
    asked = []
    monkeypatch.setattr(
        related_sets, "_from_best", lambda _, best: asked.append(best) or {}
    )
    from_related(fits, 2)
    assert asked == [swallows, shared]
    fits.found = {shared.effects: shared}
    asked.clear()
    from_related(fits, 2)
    assert asked == [shared]
