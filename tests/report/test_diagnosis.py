import re
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.diagnosis import (
    BaseParameter,
    FittedEffect,
    FittedParameter,
    Gap,
    NextExperiment,
)
from hwid_cli.report.diagnosis import (
    base_table,
    closing_sentences,
    diagnosis_blocks,
    effects_table,
    gap_table,
    missing_force,
    moved_parameters,
    quantity_and_unit,
    ranking_table,
    recordings_table,
    used_sentence,
)
from hwid_cli.report.table import Text, as_text
from tests.report.diagnosis_examples import (
    DRAG,
    FRICTION,
    NAN,
    named,
    nothing_missing,
    unknown,
)


def diagnosis_text(diagnosis, width):
    return as_text(diagnosis_blocks(diagnosis), width=width)


def widest_line(text):
    return max(map(len, text.splitlines()))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("force_N", ("force", "N")),
        ("velocity_m_per_s", ("velocity", "m/s")),
        ("drag_N_s2_per_m2", ("drag", "N s^2/m^2")),
        ("stiffness_N_per_m3", ("stiffness", "N/m^3")),
        ("half_gap_m", ("half gap", "m")),
        ("slope_A_s_per_m", ("slope", "A s/m")),
        ("time_constant_s", ("time constant", "s")),
        ("frequency_Hz", ("frequency", "Hz")),
        ("loss_at_reference", ("loss at reference", "-")),
        ("damping_N_s_per_m", ("damping", "N s/m")),
        ("gain_per_s", ("gain", "1/s")),
        ("s", ("s", "-")),
        ("", ("", "-")),
    ],
)
def test_a_name_is_taken_apart(name, expected):
    assert quantity_and_unit(name) == expected


def test_the_effects_have_values_intervals_and_units():
    which = FittedParameter("which", NAN, text="stiffness")
    change = FittedEffect("parameter_change", "", "", (which,))
    ratio = FittedParameter("ratio", 1.00012, 1.0001, 1.00014)
    skew = FittedEffect("clock_skew", "", "", (ratio,))
    found = effects_table(replace(named(), effects=(FRICTION, DRAG, change, skew)))

    assert found.rows == (
        ("coulomb_friction", "force", "0.8123", "0.7902 to 0.8344", "N"),
        ("quadratic_drag", "drag", "2.5", "-", "N s^2/m^2"),
        ("parameter_change", "which", "stiffness", "-", "-"),
        ("clock_skew", "ratio", "1.000120", "1.000100 to 1.000140", "-"),
    )
    volts = replace(named(), effects=(DRAG,), units=MotionUnits("V", "mm", "V"))
    assert effects_table(volts).rows[0][-1] == "V s^2/mm^2"


def test_the_gap_closes_row_by_row():
    assert gap_table(named()).rows == (
        ("as given", "7.10e-04", "7.40e-04", "35.2"),
        ("base re-fitted", "4.40e-04", "4.70e-04", "22.4"),
        ("with the effects", "2.09e-05", "2.12e-05", "1.010"),
    )


def test_parameters_that_were_off_are_shown_with_the_gap_that_fitting_them_leaves():
    found = nothing_missing("parameters")

    assert gap_table(found).rows == (
        ("as given", "7.10e-04", "7.40e-04", "35.2"),
        ("base re-fitted", "2.09e-05", "2.10e-05", "1.000"),
    )


def test_test_recordings_that_the_diagnosis_was_trained_on_are_told():
    found = named()
    tests = (found.train[0], found.held_out[0], "not_diagnosed")

    (line,) = [
        one.text
        for one in diagnosis_blocks(found, tests)
        if isinstance(one, Text) and one.text.startswith("Trained on")
    ]
    assert f"Among those trained on: {found.train[0]} of test.recordings" in line
    assert "test.recordings" not in used_sentence(found, found.held_out)
    assert "test.recordings" not in used_sentence(found)


def test_without_effects_nothing_is_shown_with_them():
    found = unknown()

    assert [row[0] for row in gap_table(found).rows] == ["as given", "base re-fitted"]
    assert "with the effects" not in base_table(found).heads
    assert "with the effects" not in recordings_table(found).heads
    assert base_table(found).rows[0] == (
        "damping",
        "15",
        "17.2",
        "+14.7 %",
        "-",
        "N s/m",
    )


def test_the_shift_is_that_of_the_last_fit_and_needs_something_to_shift():
    rows = base_table(named()).rows

    assert rows[0] == ("damping", "15", "17.2", "15.1", "+0.7 %", "-", "N s/m")
    assert rows[2][4] == "-"


def test_the_interval_of_the_last_fit_is_shown():
    first, *others = named().base
    known = replace(first, low=14.9, high=15.3)
    rows = base_table(replace(named(), base=(known, *others))).rows
    assert rows[0][-2:] == ("14.9 to 15.3", "N s/m")
    assert rows[1][-2] == "-"


def test_effects_that_the_simulation_has_are_shown_with_what_they_were_given_as():
    play = FittedParameter(
        "half_gap_m", 2e-4, 1.9e-4, 2.1e-4, before=1e-4, refitted=3e-4
    )
    word = FittedParameter("sensor", NAN, text="motor")
    present = FittedEffect("gear_backlash", "", "", (play, word))
    found = base_table(replace(unknown(), present=(present,))).rows
    rows = base_table(replace(named(), present=(present,), axis="rotary")).rows

    name, ends = "gear_backlash: half gap", "0.00019 to 0.00021"
    assert found[-1] == (name, "0.0001", "0.0003", "+200.0 %", ends, "m")
    shown = ("0.0001", "0.0003", "0.0002", "+100.0 %")
    assert rows[-1] == (name, *shown, ends, "rad")


def test_the_ranking_marks_the_chosen_candidate_only():
    rows = ranking_table(named()).rows

    assert [row[0] for row in rows if "*" in row[0]] == ["coulomb_friction*"]
    assert rows[0] == (
        "coulomb_friction*",
        "94.8 %",
        "1.010",
        "99.8 %",
        "100.0 %",
        "9980",
        "",
    )
    assert rows[-1] == ("cogging", "10.0 %", "-", "-", "-", "-", "not fitted")
    assert not [row for row in ranking_table(unknown()).rows if "*" in row[0]]


def test_the_star_stands_on_the_set_of_the_diagnosis_and_on_no_namesake():
    curved, plain = (
        replace(named().candidates[0], effects=effects, role=role)
        for effects, role in (
            (("one_sided_stop:contact",), "diagnosis"),
            (("one_sided_stop",), ""),
        )
    )
    stop = replace(FRICTION, id="one_sided_stop")
    found = replace(named(), effects=(stop,), candidates=(plain, curved))

    names = [row[0] for row in ranking_table(found).rows]
    assert names == ["one_sided_stop", "one_sided_stop:contact*"]
    # A set that ranks below those that are shown is shown nevertheless.
    few = [row[0] for row in ranking_table(found, count=1).rows]
    assert few == names


def test_the_ranking_without_noise_shows_the_rms_itself():
    found = named()
    table = ranking_table(replace(found, noise=replace(found.noise, rms=0.0)))

    assert table.heads[2] == "RMS [m]"
    assert table.rows[0][2] == f"{found.candidates[0].held_out_rms:.2e}"


def test_notes_are_a_column_that_a_page_has_room_for():
    table = ranking_table(named())

    assert table.heads[-1] == "note"
    assert table.rows[-1][-1] == "not fitted"
    assert "not fitted" not in as_text([table])


def test_what_was_not_fitted_to_the_end_is_explained_where_there_is_such_a_row():
    table = ranking_table(named())
    (why,) = table.notes
    assert why.startswith("-: left after its first iterations")
    fitted = [one for one in named().candidates if np.isfinite(one.held_out_rms)]
    assert ranking_table(replace(named(), candidates=tuple(fitted))).notes == ()


def test_every_recording_has_its_row():
    found = named(43)
    rows = recordings_table(found).rows

    assert len(rows) == 43
    first = found.gaps[0]
    values = (first.rms_given, first.rms_before, first.rms_after)
    assert rows[0] == (
        "step_00",
        "step",
        "validation",
        *(f"{one:.2e}" for one in values),
    )
    assert rows[1][2] == "training"


def test_what_differs_between_recordings_has_a_column():
    which = FittedParameter("which", NAN, text="mass")
    change = FittedEffect("parameter_change", "", "", (which,))
    gaps = tuple(replace(one, factor=1.25) for one in named().gaps)
    changed = replace(named(), effects=(change,), gaps=gaps)
    table = recordings_table(changed)
    assert table.columns[-1].head == "mass over its mean"
    assert table.rows[0][-1] == "1.250"
    assert "The mass over its mean: step_00 1.250" in diagnosis_text(changed, 200)
    assert len(recordings_table(named()).columns) == len(table.columns) - 1


def test_the_closing_sentences_end_once():
    assert closing_sentences(named()) == [
        "These data cannot tell it from: stribeck_friction, hysteresis + cogging.",
        "Next experiment: a slow triangle of 0.5 A - it shows sticking.",
        "Cannot be seen in these recordings: supply voltage: the input is the current; "
        "heating.",
    ]
    silent = replace(
        named(),
        ambiguous_with=(),
        not_observable=(),
        next_experiment=NextExperiment("", "no reason without an input"),
    )
    assert closing_sentences(silent) == []


def test_that_no_experiment_is_proposed_is_said_with_its_reason():
    hidden = replace(
        named(),
        verdict="ambiguous",
        next_experiment=NextExperiment("", "the noise hides it."),
    )
    assert "Next experiment: none; the noise hides it." in closing_sentences(hidden)


@pytest.mark.parametrize("width", [80, 100])
def test_the_screen_shows_everything_that_was_found(width):
    found = named()
    text = diagnosis_text(found, width=width)

    for part in (
        "Verdict: named, coulomb_friction (complete)",
        "0.8123  0.7902 to 0.8344  N",
        "-Fc sgn v",
        "Explained: 99.8 % of the excess",
        "noise 2.10e-05 m",
        "- The missing force follows the velocity: 55 %.",
        "Trained on 6 recordings, validated on 3 recordings held out.",
        "stiffness        1184       1210              1185  +0.1 %              -  N/m",
        "Next experiment: a slow triangle",
    ):
        assert part in text
    assert found.summary in re.sub(r"\s+", " ", text)
    assert text.count("\n- ") == 5
    ranking = text[text.index("Candidates, the largest gain") :]
    assert [name in ranking for name in ("hysteresis", "output_backlash")] == [
        True,
        False,
    ]
    assert widest_line(text) <= width


def test_a_set_of_effects_that_is_too_wide_goes_on_in_the_next_row():
    found = named()
    long = replace(found, candidates=found.candidates[6:7])
    lines = diagnosis_text(long, width=80).splitlines()

    heads = next(n for n, line in enumerate(lines) if line.startswith("added to"))
    assert lines[heads + 2].startswith("force_constant_saturation +")
    assert lines[heads + 3 : heads + 5] == ["  asymmetric_friction +", "  second_mode"]
    assert "force_constant_saturation + asymmetric_friction" in diagnosis_text(
        long, width=140
    )


def test_an_incomplete_diagnosis_says_so():
    large = replace(named(), complete=False, after=Gap(2e-5, 3e-5, 1.5))
    small = replace(large, after=Gap(2e-5, 2e-5, 1.1))
    start = "Verdict: named, coulomb_friction"

    assert diagnosis_text(large, width=80).startswith(
        f"{start} (a part stays unexplained)"
    )
    assert diagnosis_text(small, width=80).startswith(
        f"{start} (little more than the noise remains)"
    )


@pytest.mark.parametrize(
    ("verdict", "has_base"), [("none", False), ("parameters", True)]
)
def test_nothing_missing_is_told_in_short(verdict, has_base):
    long = replace(nothing_missing(verdict), candidates=named().candidates)
    text = diagnosis_text(long, width=80)

    assert text.startswith(f"Verdict: {verdict}\nNothing is missing.")
    assert ("Parameters of the simulation" in text) == has_base
    assert "Candidates" not in text
    assert "Effects that" not in text
    # An unknown gap is a long story.
    assert len(text.splitlines()) < len(
        diagnosis_text(unknown(), width=80).splitlines()
    )


def test_numbers_that_are_not_there_are_dashes():
    found = named()
    gap = replace(found.after, train_rms=NAN, held_out_rms=NAN, ratio_to_noise=NAN)
    text = diagnosis_text(replace(found, after=gap, explained_share=NAN), width=80)

    assert re.search(r"^with the effects +- +- +-$", text, re.MULTILINE)
    assert "Explained: - of the excess" in text
    assert "nan" not in text


def test_hostile_words_stay_as_they_are():
    hostile = "$x_{ %s {0} <b>\\n"
    effect = replace(FRICTION, id=hostile, sentence=hostile)
    text = diagnosis_text(
        replace(named(), effects=(effect,), summary=hostile), width=80
    )

    assert text.count(hostile) == 4


def test_intervals_say_when_something_else_remains():
    words = "intervals hold as if nothing else were missing"
    assert words in effects_table(replace(named(), complete=False)).caption
    assert words not in effects_table(replace(named(), complete=True)).caption


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("flexure_N_m", ("flexure_N_m", "-")),
        ("flexure_N_per_m", ("flexure", "N/m")),
        ("coil_ohm", ("coil", "ohm")),
        ("mass_kg", ("mass", "kg")),
        ("gain", ("gain", "-")),
    ],
)
def test_a_name_of_the_users_says_its_unit_only_where_it_can_mean_one(name, told):
    found = replace(named(), base=(BaseParameter(name, 1.0, 2.0, 2.0),))
    one = moved_parameters(found)[0]
    assert (one.quantity, one.unit) == told


@pytest.mark.parametrize(
    ("axis", "force", "said"),
    [
        ("linear", "N", ("force F", "N")),
        ("rotary", "N", ("torque F", "N m")),
        # In a simulation of one's own, at its force input or through its input.
        ("linear", "N m", ("torque F", "N m")),
        ("linear", "V", ("force F", "V")),
    ],
)
def test_what_is_missing_on_an_angle_is_a_torque(axis, force, said):
    units = MotionUnits(force=force)
    assert missing_force(replace(named(), axis=axis, units=units)) == said
