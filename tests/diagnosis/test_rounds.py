"""Rounds of candidate fits: which sets are tried, which are kept."""

import pytest

from hwid_cli.diagnosis.candidate import Baseline, fit_candidate, fitted_drive
from hwid_cli.diagnosis.rounds import (
    FEWEST_SINGLES,
    FITTED_ON_TOP,
    FITTED_PAIRS,
    Rounds,
    run_rounds,
)
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.drive.catalogue import CATALOGUE
from tests.diagnosis.small_drive import in_turn, problem, recordings, sizes, white
from tests.stages.diagnosed_drive import FRICTION

STIFFNESS = {"cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
HELD_OUT = ("step_1", "sine_1", "sine_3")


def rounds_of(effects, allowed, **options):
    of = problem(recordings(effects), held_out=HELD_OUT)
    baseline = Baseline(of.drive, sizes(of, (31.0,)), white())
    base = fit_candidate(of, (), ({},), baseline)
    return Rounds(
        **{
            "problem": of,
            "baseline": Baseline(
                fitted_drive(of.drive, base), baseline.scales, baseline.noise
            ),
            "criteria": SelectionCriteria.of(of, white()),
            "base": base,
            "allowed": allowed,
            "run_tasks": in_turn,
            "on_round": lambda what, count: None,
            **options,
        }
    )


@pytest.fixture(scope="module")
def of_all():
    """Coulomb friction, with the whole catalogue to choose from."""
    return run_rounds(rounds_of(FRICTION, tuple(CATALOGUE)), 1)


def test_the_hidden_effect_wins_against_the_whole_catalogue(of_all):
    assert of_all.best[-1].effects == ("coulomb_friction",)
    assert len(of_all.best) == 1


def test_every_effect_gets_a_forecast_and_the_first_ones_a_fit(of_all):
    assert set(of_all.shares) == {(name,) for name in CATALOGUE}
    assert FEWEST_SINGLES <= len(of_all.fits) < len(CATALOGUE)
    first = sorted(of_all.shares, key=of_all.shares.get)[-FEWEST_SINGLES:]
    assert set(first) <= {one.effects for one in of_all.fits}


def test_what_includes_the_first_one_is_fitted_as_well(of_all):
    fitted = {one.effects for one in of_all.fits}
    for name, entry in CATALOGUE.items():
        if "coulomb_friction" in entry.contains:
            assert (name,) in fitted


def test_pruned_candidates_are_not_finished(of_all):
    by_name = {one.effects: one for one in of_all.fits}
    best = by_name["coulomb_friction",]
    poor = [one for one in of_all.fits if one.sse.sum() > 100 * best.sse.sum()]
    assert best.has_converged
    assert poor
    assert any(one.iterations <= 1 and not one.has_converged for one in poor)


def test_no_larger_set_is_tried_once_nothing_remains(of_all):
    announced = []
    found = run_rounds(
        rounds_of(
            FRICTION,
            ("coulomb_friction", "input_dead_zone"),
            on_round=lambda what, count: announced.append((what, count)),
        ),
        3,
    )
    assert announced == [("forecasts", 2), ("single effects", 2)]
    assert len(found.best) == 1


@pytest.mark.parametrize(
    "more",
    [
        ("input_dead_zone",),
        pytest.param(
            ("input_dead_zone", "quadratic_drag", "stribeck_friction"),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["few", "many"],
)
def test_a_pair_is_found_although_neither_effect_explains_much_alone(more):
    allowed = ("coulomb_friction", "cubic_stiffness", *more)
    announced = []
    found = run_rounds(
        rounds_of(
            {**FRICTION, **STIFFNESS},
            allowed,
            on_round=lambda what, count: announced.append((what, count)),
        ),
        3,
    )
    assert [len(one.effects) for one in found.best] == [1, 2]
    assert found.best[-1].effects == ("coulomb_friction", "cubic_stiffness")
    sets = [count for what, count in announced if what == "sets of 2 effects"]
    assert 0 < sets[0] <= FITTED_ON_TOP + FITTED_PAIRS
    # Nothing remains, so no set of three.
    assert not any(what == "sets of 3 effects" for what, _ in announced)


@pytest.mark.parametrize(
    "frictions",
    [
        ("coulomb_friction", "asymmetric_friction"),
        pytest.param(
            ("coulomb_friction", "stribeck_friction", "hysteresis"),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["two", "three"],
)
def test_nested_effects_are_never_put_together(frictions):
    nested = (*frictions, "cubic_stiffness")
    found = run_rounds(rounds_of({**FRICTION, **STIFFNESS}, nested), 2)
    pairs = {one.effects for one in found.fits if len(one.effects) == 2}
    assert pairs
    for pair in pairs:
        assert sum(name != "cubic_stiffness" for name in pair) <= 1


def test_a_second_effect_that_adds_nothing_is_not_taken():
    # Something remains, and drag looks like friction, but does not explain most of it.
    found = run_rounds(
        rounds_of({**FRICTION, **STIFFNESS}, ("cubic_stiffness", "quadratic_drag")),
        2,
    )
    assert [one.effects for one in found.best] == [("cubic_stiffness",)]
    assert {len(one.effects) for one in found.fits} == {1, 2}


@pytest.mark.parametrize(("allowed", "most"), [((), 3), (("coulomb_friction",), 0)])
def test_without_candidates_nothing_is_fitted(allowed, most):
    found = run_rounds(rounds_of(FRICTION, allowed), most)
    assert (found.fits, found.best) == ((), ())
    assert set(found.shares) == {(name,) for name in allowed}
