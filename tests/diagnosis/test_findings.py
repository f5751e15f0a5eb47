"""What a diagnosis reports: gaps, parameters with intervals, curves, the candidates."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import findings
from hwid_cli.diagnosis.findings import MOST_OVERLAYS, _mean_factor
from hwid_cli.diagnosis.intervals import intervals
from hwid_cli.records.candidates import ParameterRef
from tests.diagnosis.made_up_fits import made_up
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    N,
    fit,
    problem,
    recordings,
    simulation,
    sizes,
)
from tests.stages.diagnosed_drive import FRICTION, breathing, diagnosed

WRONG = {"force_constant_N_per_A": 5.2}


@pytest.fixture(scope="module")
def given():
    return recordings(FRICTION)


@pytest.fixture(scope="module")
def found(given):
    return diagnosed(given, simulation(**WRONG))


def test_the_gap_falls_from_given_to_refitted_to_extended(found):
    for rms in ("train_rms", "held_out_rms", "ratio_to_noise"):
        given, before, after = (
            getattr(one, rms) for one in (found.given, found.before, found.after)
        )
        assert given > before > 5 * after > 0


def test_ratios_are_those_of_held_out_rms_to_noise(found):
    for gap in (found.given, found.before, found.after):
        assert gap.ratio_to_noise == pytest.approx(gap.held_out_rms / found.noise.rms)


def test_the_explained_share_is_of_the_excess_over_the_noise(found):
    floor = found.noise.rms**2
    before, after = found.before.held_out_rms**2, found.after.held_out_rms**2
    share = min((before - after) / (before - floor), 1.0)
    assert found.explained_share == pytest.approx(share)


def test_gaps_of_recordings_add_up_to_the_gap(found):
    for side, rms in ((True, "held_out_rms"), (False, "train_rms")):
        rows = [one for one in found.gaps if one.is_held_out is side]
        # All are as long.
        together = np.sqrt(np.mean([one.rms_after**2 for one in rows]))
        assert together == pytest.approx(getattr(found.after, rms))
        together = np.sqrt(np.mean([one.rms_given**2 for one in rows]))
        assert together == pytest.approx(getattr(found.given, rms))


def test_every_recording_is_on_one_side_and_in_the_table(given, found):
    names = [one.name for one in given]
    assert [one.name for one in found.gaps] == names
    assert sorted((*found.train, *found.held_out)) == sorted(names)
    assert [one.kind for one in found.gaps] == [one.kind for one in given]


def test_the_base_is_told_as_given_refitted_and_with_the_effect(found):
    constant = {one.name: one for one in found.base}["force_constant_N_per_A"]
    assert constant.before == 5.2
    # With friction in the model it is right; without, it makes up for it.
    assert constant.after == pytest.approx(5.0, rel=2e-3)
    assert abs(constant.refitted - 5.0) > 10 * abs(constant.after - 5.0)


def test_overlays_show_the_worst_held_out_recordings(found):
    assert 0 < len(found.overlays) <= MOST_OVERLAYS
    assert {one.name for one in found.overlays} <= set(found.held_out)
    before = {one.name: one.rms_before for one in found.gaps}
    sizes = [before[one.name] for one in found.overlays]
    assert sizes == sorted(sizes, reverse=True)
    for one in found.overlays:
        assert one.time_s[-1] == pytest.approx((N - 1) * 1e-3)
        rms = np.sqrt(np.mean((one.measured - one.before) ** 2))
        assert rms == pytest.approx(before[one.name])
        left = one.measured - one.after
        assert np.sqrt(np.mean(left**2)) < 1.2 * found.noise.rms


def test_the_table_has_the_winner_first(found):
    assert found.candidates[0].effects == ("coulomb_friction",)
    assert found.candidates[0].explained_share > 0.99
    assert found.candidates[0].whiteness <= 1


def test_the_missing_force_is_drawn_with_its_law(found):
    first = found.latent_force[0]
    assert first.variable == "velocity"
    assert first.law.size == first.at.size
    # Friction of 0.8 N against the motion. At rest any force below it may act, and
    # where it is fast the base's damping has made up for it.
    moves = np.abs(first.at) > 0.01
    slow = moves & (np.abs(first.at) < 0.3)
    assert slow.sum() > 4
    assert (np.sign(first.law[slow]) == -np.sign(first.at[slow])).all()
    apart = (first.law - first.mean)[moves]
    assert np.abs(apart).max() < 0.1 * np.abs(first.mean).max()


def test_where_begins_with_the_velocity(found):
    assert found.places[0].variable in {"velocity", "direction"}


def test_without_effects_the_gap_is_that_of_the_refit():
    found = diagnosed(recordings(), simulation(**WRONG))
    assert found.verdict == "parameters"
    assert found.before == found.given
    assert found.refitted == found.after
    assert found.explained_share > 0.99
    assert all(one.after == one.refitted for one in found.base)
    assert all(one.rms_before == one.rms_after for one in found.gaps)


@pytest.mark.thorough
def test_an_unknown_gap_stays_as_it_is():
    found = diagnosed(breathing())
    assert found.after == found.before
    assert found.explained_share == 0.0
    assert found.effects == ()
    assert all(one.law.size == 0 for one in found.latent_force)


def test_references_are_those_that_the_laws_count_from(found):
    assert found.reference_current_A == 4.0
    assert found.reference_displacement_m == 0.02


COULOMB = {"coulomb_friction": {"force_N": 0.8}}
TRUE = np.array([15.0, 1184.0, 5.0, 0.8])


def with_interval(of, start=None):
    start = {"coulomb_friction": {"force_N": 0.3}} if start is None else start
    found = fit(of, start)
    return found, *intervals(of, found, sizes(of))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("count", "fewest", "most"),
    # 95 % on average; fewer once in a hundred times even if the four parameters of a
    # fit went together in pairs. All of the many would be too wide.
    [(12, 39, 48), pytest.param(40, 140, 159, marks=pytest.mark.slow)],
)
def test_they_cover_the_truth_about_as_often_as_they_say(count, fewest, most):
    hits = 0
    for seed in range(count):
        of = problem(recordings(COULOMB, noise=5 * NOISE, seed=seed)[1:7:2])
        _, low, high = with_interval(of)
        hits += int(((low < TRUE) & (high > TRUE)).sum())
    assert fewest <= hits <= most


def test_four_times_the_data_halve_them():
    given = recordings(noise=NOISE)
    one = problem([given[5]])
    four = problem([replace(given[5], name=f"r{j}") for j in range(4)])
    widths = []
    for of in (one, four):
        found, low, high = with_interval(of, {})
        widths.append((high - low) / found.values)
    np.testing.assert_allclose(widths[1], widths[0] / 2, rtol=0.02)


def test_residuals_that_go_together_widen_them():
    of = problem(recordings(COULOMB))
    wrong, *ends = with_interval(of, {})
    assert wrong.neighbour > 0.9
    right, low, high = with_interval(of)
    assert abs(right.neighbour) < 0.1
    share = (ends[1] - ends[0])[:3] / (high - low)[:3]
    # 17 times the RMS alone would give 17.
    assert (share > 30).all()


def test_phases_of_recordings_are_allowed_for():
    force = {"amplitude_N": 0.4, "frequency_Hz": 31.0}
    given = recordings(
        own=lambda number, drive: replace(
            drive, effects={"periodic_force": {**force, "phase_rad": 0.9 * number}}
        )
    )
    of = problem(given)
    start = {"periodic_force": {"amplitude_N": 0.2, "frequency_Hz": 30.6}}
    found, low, high = with_interval(of, start)
    for name, true in force.items():
        row = found.names.index(ParameterRef("periodic_force", name))
        assert low[row] < true < high[row]
        # 60 periods in noise of a few percent of what the force moves.
        assert 1e-5 < (high[row] - low[row]) / true < 0.1


def test_what_ran_away_has_none():
    of = problem(recordings())
    start = {"cubic_stiffness": {"stiffness_N_per_m3": -1e9}}
    found, low, high = with_interval(of, start)
    assert not found.is_usable
    assert np.isnan([low, high]).all()


def test_they_grow_with_the_noise():
    widths = []
    for noise in (NOISE, 50 * NOISE):
        of = problem(recordings(noise=noise))
        found, low, high = with_interval(of, {})
        widths.append((high - low) / found.values)
    np.testing.assert_allclose(widths[1] / widths[0], 50, rtol=0.1)


def test_what_nothing_determines_has_a_wide_one_or_none():
    # One constant current: how strong the drive is cannot be told from its stiffness.
    held = recordings()[0]
    current = np.full_like(held.input, 2.0)
    noise = NOISE * np.random.default_rng(2).standard_normal(current.size)
    flat = replace(held, input=current, output=2.0 * 5.0 / 1184.0 + noise)
    found, low, high = with_interval(problem([flat]), {})
    assert (np.isnan(high) | ((high - low) > found.values)).all()


@pytest.mark.parametrize(
    ("which", "name", "factor"),
    [
        ("damping", "damping_N_s_per_m", 3.0),
        ("damping", "stiffness_N_per_m", 1.0),
        # All others are known in proportion to the mass.
        ("mass", "damping_N_s_per_m", 1 / 3.0),
        ("mass", "force_constant_N_per_A", 1 / 3.0),
    ],
)
def test_values_are_told_beside_the_mean_of_what_differs(which, name, factor):
    fit = made_up(("coulomb_friction",), 100.0, own=np.log([2.0, 4.0] * 3))
    ref = ParameterRef(f"parameter_change:{which}", f"log_{which}")
    assert _mean_factor(replace(fit, own_names=(ref,)), name) == pytest.approx(factor)


def test_intervals_of_the_base_are_told_beside_that_mean_too():
    fit = made_up(("coulomb_friction",), 100.0, own=np.log([2.0, 4.0] * 3))
    ref = ParameterRef("parameter_change:mass", "log_mass")
    fit = replace(fit, own_names=(ref,), names=(), values=np.zeros(0))
    ends = {"damping_N_s_per_m": (6.0, 9.0)}
    damping, *others = findings._base(DRIVE, fit, fit, ends)
    assert (damping.low, damping.high) == pytest.approx((2.0, 3.0))
    assert all(np.isnan(one.low) for one in others)


def test_intervals_of_the_base_are_not_those_of_an_effect_of_the_same_name(monkeypatch):
    name = "stiffness_N_per_m"
    refs = ParameterRef("base", name), ParameterRef("one_sided_stop", name)
    fit = replace(made_up(("one_sided_stop",), 1.0), names=refs, values=np.ones(2))
    low, high = np.array([1.0, 100.0]), np.array([2.0, 200.0])
    monkeypatch.setattr(findings, "intervals", lambda *_: (low, high))
    told = findings.Findings.intervals_of_base(
        SimpleNamespace(_judging=(None, fit), scales=None)
    )
    assert told == {name: (1.0, 2.0)}
