"""The input that would separate two candidates."""

import re

import numpy as np
import pytest

from hwid_cli.diagnosis import next_experiment
from hwid_cli.diagnosis.candidate import rebuilt
from hwid_cli.diagnosis.next_experiment import (
    FittedCandidate,
    Separation,
    best_separation,
    least_separation,
    menu,
    played,
    propose,
    with_best_lead,
)
from hwid_cli.diagnosis.parameters import first_point, parameter_layout
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.recordings import Recording
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    STEP_S,
    fit,
    problem,
    replace,
    sizes,
    white,
)

NAMED = made_up(["periodic_force"], 200.0)
RIVAL = made_up(["sensor_hum"], 201.0)
LEAD = made_up(["thermal_gain_loss"], 110.0)
FRICTION = {"coulomb_friction": {"force_N": 0.8}}


@pytest.fixture(scope="module")
def rivals():
    """Coulomb friction and output backlash, fitted to one-way ramps."""
    time = STEP_S * np.arange(400)
    rng = np.random.default_rng(2)
    given = []
    for size in (1.0, 2.0, 3.0, 4.0):
        current = size * np.interp(time, [0.04, 0.1], [0, 1])
        motion = simulate_drive(
            current, replace(DRIVE, effects=FRICTION), sample_time_s=STEP_S
        )
        read = motion.output + NOISE * rng.standard_normal(400)
        given.append(Recording(f"step_{size}", current, read, STEP_S, kind="step"))
    of = problem(given)
    scales = sizes(of)
    models, fits = [], []
    for effect, start in (
        ("coulomb_friction", {"force_N": 0.4}),
        ("output_backlash", {"half_gap_m": 2e-4}),
    ):
        found = fit(of, {effect: start}, scales=scales)
        fits.append(found)
        models.append(FittedCandidate(*rebuilt(of, found, scales)))
    return of, models, scales, fits


def test_friction_and_backlash_are_separated_by_reversals(rivals):
    of, (coulomb, backlash), scales, _ = rivals
    found = best_separation(of, coulomb, backlash, scales)
    # Ramps to one side say little about either; anything that reverses does.
    assert "sine" in found.input or "triangle" in found.input
    assert found.rms > 5 * NOISE


def test_a_candidate_is_not_separated_from_itself(rivals):
    of, (coulomb, _), scales, _ = rivals
    # What is simulated is compared with itself.
    assert best_separation(of, coulomb, coulomb, scales).rms < 1e-12


def test_what_the_rival_can_absorb_does_not_count(rivals):
    of, (coulomb, _), scales, _ = rivals
    point = coulomb.point
    # Another force of friction: a new measurement would only correct it.
    moved = point.shared + np.array([0.0, 0.0, 0.0, 1e-3])
    other = FittedCandidate(coulomb.layout, type(point)(moved, point.own))
    found = best_separation(of, coulomb, other, scales)
    unabsorbed = 1e-3 * 0.8 / DRIVE.stiffness_N_per_m
    assert found.rms < 0.05 * unabsorbed


def candidate(of, effect, start):
    """An effect beside the given base, not fitted."""
    layout = parameter_layout(of, (effect,), {effect: start}, sizes(of))
    return FittedCandidate(layout, first_point(of, layout, of.drive, {effect: start}))


def test_on_a_free_axis_no_motion_is_proposed_that_runs_away(rivals):
    with_spring, _, scales, _ = rivals
    of = replace(with_spring, drive=replace(with_spring.drive, stiffness_N_per_m=0.0))
    coulomb = candidate(of, "coulomb_friction", {"force_N": 0.8})
    backlash = candidate(of, "output_backlash", {"half_gap_m": 2e-4})
    farthest = max(np.abs(one.position).max() for one in of.signals)
    inputs = menu(scales, "A")
    going = {
        name: np.abs(played(of, coulomb, one)[1].position).max() / farthest
        for name, one in inputs.items()
    }
    assert max(going.values()) > 3.0
    assert min(going.values()) < 1.0
    found = best_separation(of, coulomb, backlash, scales)
    assert going[found.input] < 1.3


@pytest.mark.parametrize(("sign", "word"), [(1.0, "negative"), (-1.0, "positive")])
def test_an_input_of_one_sign_keeps_it(rivals, sign, word):
    of, _, scales, _ = rivals
    signals = [replace(one, input=sign * np.abs(one.input)) for one in of.signals]
    one_sided = replace(of, signals=tuple(signals), input_unit="W")
    inputs = menu(scales, "W")
    kept = [
        name for name, one in inputs.items()
        if next_experiment._has_known_sign(one, one_sided)
    ]  # fmt: skip
    assert kept
    assert not any(word in name or "triangle" in name for name in kept)
    motor = replace(one_sided, input_unit="A")
    assert all(next_experiment._has_known_sign(one, motor) for one in inputs.values())


def test_where_every_input_goes_too_far_that_is_said(rivals, monkeypatch):
    of, _, scales, fits = rivals
    monkeypatch.setattr(next_experiment, "_BEYOND_TRAVEL", 1e-6)
    criteria = SelectionCriteria.of(of, white())
    verdict = DiagnosisVerdict("ambiguous", True, fits[0], (fits[1],))
    found = propose(of, criteria, scales, verdict, fits)
    assert found.input == ""
    assert found.reason.startswith("every input of the menu goes farther")


@pytest.mark.parametrize(
    ("is_complete", "said"), [(True, "no further one is needed"), (False, "the rest")]
)
def test_nothing_is_needed_only_where_nothing_is_left(rivals, is_complete, said):
    of, _, scales, fits = rivals
    verdict = DiagnosisVerdict("named", is_complete, fits[0], ())
    found = propose(of, SelectionCriteria.of(of, white()), scales, verdict, fits)
    assert not found.input
    assert found.reason.endswith(said)


def test_a_rival_that_runs_away_separates_nothing(rivals):
    of, (coulomb, _), scales, _ = rivals
    start = {"cubic_stiffness": {"stiffness_N_per_m3": -1e9}}
    lost = parameter_layout(of, ("cubic_stiffness",), start, scales)
    model = FittedCandidate(lost, first_point(of, lost, of.drive, start))
    assert best_separation(of, coulomb, model, scales) == Separation(
        *(next(iter(menu(scales, "A"))), 0.0),
        n_samples=next(iter(menu(scales, "A").values())).size,
    )


def test_the_menu_stays_within_the_current_that_was_used(rivals):
    _, _, scales, _ = rivals
    inputs = menu(scales, "A")
    assert len(inputs) == len(set(inputs)) >= 10
    for name, command in inputs.items():
        assert np.abs(command).max() <= scales.current_A * (1 + 1e-12), name
        assert np.isfinite(command).all(), name
        assert np.ptp(command) > 0, name
        # A drive starts at rest.
        assert command[0] == pytest.approx(0.0, abs=1e-12), name


def test_the_menu_has_no_frequency_that_the_samples_cannot_follow(rivals):
    _, _, scales, _ = rivals
    slow = replace(scales, sample_time_s=0.02)
    fast = [name for name in menu(slow, "A") if "at 60.7 Hz" in name]
    assert fast == []
    assert len(menu(slow, "A")) < len(menu(scales, "A"))


@pytest.mark.parametrize("step_s", [1e-4, 1e-3, 5e-3, 0.02, 0.1])
def test_no_sine_of_the_menu_is_above_a_tenth_of_the_sample_rate(rivals, step_s):
    _, _, scales, _ = rivals
    found = menu(replace(scales, sample_time_s=step_s), "A")
    frequencies = [
        float(one) for name in found for one in re.findall(r"at ([\d.e+]+) Hz", name)
    ]
    # Names have three digits.
    assert all(one <= 0.1 / step_s * 1.005 for one in frequencies)
    # Steps and a triangle are left wherever the drive's own frequency lies.
    assert len(found) - len(frequencies) >= 5


def proposed(rivals, rms):
    of, _, scales, (coulomb, backlash) = rivals
    verdict = DiagnosisVerdict("ambiguous", True, coulomb, (backlash,))
    criteria = SelectionCriteria.of(of, white(rms))
    return propose(of, criteria, scales, verdict, (coulomb, backlash))


def test_what_the_noise_hides_is_not_proposed_and_said(rivals):
    seen = proposed(rivals, NOISE)
    assert seen.input
    assert "times the noise) after the parameters" in seen.reason
    hidden = proposed(rivals, 1.0)
    assert not hidden.input
    assert "no input of the size of these recordings tells" in hidden.reason
    assert "through the noise (the best, " in hidden.reason


def test_a_difference_below_the_noise_of_a_sample_says_why_it_is_seen(rivals):
    of, (coulomb, backlash), scales, _ = rivals
    best = best_separation(of, coulomb, backlash, scales)
    least = least_separation(best.n_samples)
    assert least < 1.0
    assert proposed(rivals, best.rms / (1.01 * least)).input == best.input
    assert proposed(rivals, best.rms / (0.99 * least)).input == ""
    said = proposed(rivals, 2 * best.rms).reason
    assert f"0.5 times the noise of one sample; {best.n_samples} samples" in said


def effects(found):
    return [one.effects for one in found]


def test_the_set_that_fits_best_stands_first_though_it_is_not_named():
    found = with_best_lead(CRITERIA, [NAMED, RIVAL], [base(), NAMED, RIVAL, LEAD])

    assert effects(found) == effects([LEAD, NAMED, RIVAL])


def test_candidates_stay_where_the_best_is_one_of_them():
    found = with_best_lead(CRITERIA, [NAMED, RIVAL], [base(), RIVAL, NAMED])

    assert effects(found) == effects([NAMED, RIVAL])


def test_a_set_that_could_not_be_simulated_is_no_lead():
    lost = replace(LEAD, sse=LEAD.sse * float("inf"))

    assert with_best_lead(CRITERIA, [NAMED], [lost, NAMED]) == [NAMED]
    assert with_best_lead(CRITERIA, [], [LEAD]) == []
