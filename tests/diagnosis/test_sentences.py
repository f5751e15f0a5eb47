"""What a diagnosis says in words."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.sentences import doubtful_values, hidden_from_view
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.diagnosis import BaseParameter
from hwid_cli.records.drive import Controller
from tests.diagnosis.small_drive import (
    DRIVE,
    STEP_S,
    N,
    problem,
    recordings,
    simulation,
)
from tests.stages.diagnosed_drive import FRICTION, breathing, diagnosed


def said(of):
    return " | ".join(hidden_from_view(of))


@pytest.mark.thorough
def test_the_five_words_are_said_differently():
    right, wrong = simulation(), simulation(force_constant_N_per_A=5.3)
    summaries = [
        diagnosed(recordings(), right).summary,
        diagnosed(recordings(), wrong).summary,
        diagnosed(recordings(FRICTION), right).summary,
        diagnosed(breathing(), right).summary,
    ]
    starts = ("Nothing is missing", "No effect is missing", "The simulation lacks")
    for summary, start in zip(summaries, starts, strict=False):
        assert summary.startswith(start)
    assert "no effect of the catalogue explains" in summaries[3]


def shifted(names):
    """Recordings of the right drive; some begin within their excitation."""
    return [
        replace(one, input=one.input[44:], output=one.output[44:])
        if one.name in names
        else one
        for one in recordings()
    ]


SINES = ("sine_0", "sine_1", "sine_2", "sine_3")


@pytest.mark.thorough
@pytest.mark.parametrize("names", [SINES, ("sine_1",)])
def test_an_unknown_gap_in_some_recordings_names_them(names):
    found = diagnosed(shifted(names), effects=("quadratic_drag",))
    assert found.verdict == "unknown", found.summary
    assert f"gap sits in {', '.join(names)}: check how they start" in found.summary


@pytest.mark.thorough
def test_an_unknown_gap_in_all_recordings_names_none():
    found = diagnosed(breathing(), effects=("coulomb_friction",))
    assert found.verdict == "unknown"
    assert "gap sits in" not in found.summary


@pytest.mark.thorough
def test_a_named_effect_is_explained_with_its_numbers():
    found = diagnosed(recordings(FRICTION))
    assert "coulomb_friction (dry friction" in found.summary
    assert f"{found.before.ratio_to_noise:.3g}" in found.summary
    assert f"{found.after.ratio_to_noise:.3g}" in found.summary
    assert "remains" not in found.summary
    assert found.next_experiment.input == ""


@pytest.mark.thorough
def test_an_unknown_gap_comes_with_the_input_that_separates_the_nearest():
    found = diagnosed(breathing())
    first, second = (one.effects[0] for one in found.candidates[:2])
    assert first in found.next_experiment.reason
    assert second in found.next_experiment.reason
    assert "A" in found.next_experiment.input


@pytest.mark.thorough
def test_with_a_single_candidate_there_is_nothing_to_separate():
    found = diagnosed(breathing(), effects=("coulomb_friction",))
    assert found.verdict == "unknown"
    assert found.next_experiment.input == ""


def test_a_measured_current_hides_what_comes_before_it():
    of = problem(recordings()[:2])
    assert "before the current (resistance" in said(of)
    volts = problem(recordings()[:2], resistance_ohm=2.0)
    assert "before the current" not in said(volts)


def test_the_mass_is_always_hidden():
    assert "mass" in said(problem(recordings()))


@pytest.mark.parametrize(
    ("rows", "side"), [((0, 1, 3), "negative"), ((2, 4), "positive")]
)
def test_a_side_where_the_drive_never_is_stays_hidden(rows, side):
    # Steps to one side; without the millimetre that comes from swinging back.
    given = [recordings()[row] for row in rows]
    sign = 1 if side == "negative" else -1
    clipped = [
        replace(one, output=sign * np.maximum(sign * one.output, 0.0)) for one in given
    ]
    text = said(problem(clipped))
    assert f"on the {side} side" in text
    other = "positive" if side == "negative" else "negative"
    assert f"on the {other} side" not in text


def test_motion_to_both_sides_hides_neither():
    assert " side" not in said(problem(recordings()))


def test_a_free_axis_hides_an_offset_unless_a_controller_holds_it():
    free = problem(recordings()[:2], stiffness_N_per_m=0.0)
    assert "offset" in said(free)
    held = problem(
        recordings()[:2], stiffness_N_per_m=0.0, controller=Controller(20.0, 30.0)
    )
    assert "offset" not in said(held)
    assert "offset" not in said(problem(recordings()[:2]))


def test_without_held_out_recordings_it_says_so():
    assert "only one" in said(problem(recordings()[:1]))
    assert "only one" not in said(problem(recordings(), held_out=("step_0",)))


@pytest.mark.parametrize(
    ("before", "after", "is_doubtful"),
    [
        (3.34, 0.41, True),
        (1.0, 3.01, True),
        (-1.0, -3.01, True),
        (1.0, 2.99, False),
        (1.0, 0.34, False),
        # From none there is no factor.
        (0.0, 5.0, False),
        (1.0, float("nan"), False),
    ],
)
def test_a_parameter_that_moved_by_more_than_a_factor_of_three_is_questioned(
    before, after, is_doubtful
):
    one = BaseParameter("force_constant_N_per_A", before, 1.0, after)
    assert bool(doubtful_values([one], DRIVE)) == is_doubtful


def test_the_question_says_the_values_and_what_holds_the_parameter():
    one = BaseParameter("force_constant_N_per_A", 3.34, 1.0, 0.4104)
    assert doubtful_values([one], DRIVE) == (
        "force_constant_N_per_A was 3.34 and is fitted as 0.41: check its value, or the "
        "units of the recordings; simulation.known: [force_constant_N_per_A] holds it; "
        "it rests on the given mass_kg: force constant, damping and stiffness are known "
        "only in proportion to it",
    )


KNOWN = (
    "known is only force constant / (resistance x mass), (damping + force constant^2 / "
    "resistance) / mass and stiffness / mass"
)


def test_under_a_voltage_the_resistance_may_be_what_is_wrong():
    driven = replace(DRIVE, resistance_ohm=1.8)
    one = BaseParameter("damping_N_s_per_m", 28.7, 5.0, 5.03)
    (text,) = doubtful_values([one], driven)
    assert text.endswith(f"rests on the given mass_kg and resistance_ohm: {KNOWN}")
    shown = said(problem(recordings()[:2], resistance_ohm=1.8))
    assert f"the mass and the resistance themselves: {KNOWN}" in shown
    assert "in proportion to it" not in shown

    turning = replace(driven, axis="rotary")
    (text,) = doubtful_values([one], turning)
    assert "the given inertia_kg_m2 and resistance_ohm" in text
    assert "torque constant / (resistance x inertia)" in text


@pytest.mark.parametrize("mass", [0.15, 0.45])
@pytest.mark.parametrize("resistance", [1.2, 2.2])
def test_drives_with_the_same_quotients_move_alike(mass, resistance):
    """What is said to be all that is known is: other values of it move otherwise."""
    one = replace(DRIVE, resistance_ohm=1.8)
    constant = (
        one.force_constant_N_per_A
        * mass
        / one.mass_kg
        * resistance
        / one.resistance_ohm
    )
    braking = one.damping_N_s_per_m + one.force_constant_N_per_A**2 / one.resistance_ohm
    other = replace(
        one,
        mass_kg=mass,
        resistance_ohm=resistance,
        force_constant_N_per_A=constant,
        damping_N_s_per_m=braking * mass / one.mass_kg - constant**2 / resistance,
        stiffness_N_per_m=one.stiffness_N_per_m * mass / one.mass_kg,
    )
    volts = 6.0 * np.sin(2 * np.pi * 7.0 * STEP_S * np.arange(N))
    here, there, damped = (
        simulate_drive(volts, drive, sample_time_s=STEP_S).position
        for drive in (
            one,
            other,
            replace(other, damping_N_s_per_m=one.damping_N_s_per_m),
        )
    )
    assert np.max(np.abs(here - there)) < 1e-9 * np.max(np.abs(here))
    assert np.max(np.abs(here - damped)) > 1e-3 * np.max(np.abs(here))


ONE_WAY = "all recordings move in one direction only"


def ways(*outputs):
    """Recordings of a free axis with these outputs."""
    (first, *_) = recordings()
    found = [
        replace(first, name=f"r{number}", input=output, output=output)
        for number, output in enumerate(outputs)
    ]
    return problem(found, stiffness_N_per_m=0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_motion_in_one_direction_hides_friction_behind_a_load(sign):
    way = np.linspace(0.0, 1.0, 200)
    noise = 1e-3 * np.random.default_rng(2).standard_normal(200)
    assert ONE_WAY in said(ways(sign * way + noise, sign * way**2))


def test_motion_to_both_sides_shows_friction():
    way = np.linspace(0.0, 1.0, 200)
    assert ONE_WAY not in said(ways(way, -way))
    assert ONE_WAY not in said(ways(np.sin(3 * way)))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("friction_N", "stiffness_N_per_m", "leads"),
    [
        (1.0, 1e3, "coulomb_friction"),
        (1.5, 5e3, "coulomb_friction and cubic_stiffness"),
    ],
)
def test_what_remains_comes_with_a_lead(friction_N, stiffness_N_per_m, leads):
    # A cubic spring imitates a stop only in part, so that no set comes near the noise.
    stop = {"position_m": 0.008, "stiffness_N_per_m": stiffness_N_per_m}
    given = {"coulomb_friction": {"force_N": friction_N}, "end_stop": stop}
    allowed = ("coulomb_friction", "cubic_stiffness")
    found = diagnosed(recordings(given), effects=allowed, max_effects=2)

    assert not found.complete
    assert f"Best lead: {leads} would explain" in found.summary
    assert len(found.effects) + leads.count("and") + 1 == len(allowed)


def test_nothing_is_added_to_a_complete_verdict():
    assert "lead" not in diagnosed(recordings(FRICTION)).summary
