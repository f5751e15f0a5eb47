"""The first sentences of the page: what they say of every verdict and model."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.answer import ChosenMaps
from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.diagnosis import BaseParameter, FittedParameter, Gap
from hwid_cli.records.report import ReportContents, StageRun, StoredResults
from hwid_cli.report.closing import UNDECIDED_MAPS
from hwid_cli.report.diagnosis import gap_table
from hwid_cli.report.html import report_page
from hwid_cli.report.sections.diagnosis_answer import (
    diagnosis_answer,
    value_with_interval,
    verdict_in_words,
)
from hwid_cli.report.sections.model_answer import model_answer
from hwid_cli.report.sections.summary import summary_section
from hwid_cli.stages.report import report_contents
from hwid_cli.stages.table import STAGES
from tests.report.diagnosis_examples import named, nothing_missing, unknown
from tests.report.report_examples import DIAGNOSIS, calibrated_only

NAN = float("nan")


def plain(text):
    return text.replace("\N{NO-BREAK SPACE}", " ")


def answer_to(record):
    stored = StoredResults("a", "{}", "poles", results={"diagnose": record})
    return diagnosis_answer(ReportContents(stored))


@pytest.mark.parametrize(
    ("value", "low", "high", "expected"),
    [
        (0.79894, 0.79737, 0.80052, "0.799 N [0.797, 0.801]"),
        (0.8012, 0.7911, 0.8113, "0.80 N [0.79, 0.81]"),
        (1234.6, 1190.0, 1280.0, "1230 N [1190, 1280]"),
        (1.2e-7, 1.1e-7, 1.3e-7, "1.2e-07 N [1.1e-07, 1.3e-07]"),
        (2.5, NAN, NAN, "2.5 N (not told)"),
        (2.5, 2.5, 2.5, "2.5 N"),
        (NAN, NAN, NAN, "unknown N"),
    ],
)
def test_a_value_has_the_digits_that_its_interval_allows(value, low, high, expected):
    found = value_with_interval(FittedParameter("force_N", value, low, high), "N")

    assert plain(found) == expected


def test_a_named_effect_is_said_with_its_size_and_interval():
    found = answer_to(named())

    # force_N of the example is 0.81 with 0.79 to 0.83.
    assert plain(found.verdict).startswith("The simulation lacks Coulomb friction: ")
    assert " N [" in plain(found.verdict)
    # Of a simulation that takes a voltage and gives millimetres.
    volts = answer_to(replace(named(), units=MotionUnits("V", "mm", "V")))
    assert " V [" in plain(volts.verdict)
    assert found.is_settled
    assert "were never trained on" in found.details[0]
    assert "times the noise" in found.details[0]

    held_out = named().held_out[:1]
    found = answer_to(replace(named(), held_out=held_out))
    assert "on 1 recording that was never trained on" in found.details[0]


def test_the_picture_before_and_after_stands_beside_the_noise():
    record = named()
    gaps = answer_to(record).blocks[0]

    assert [row.name for row in gaps.groups[0].rows] == [
        *("as given", "re-fitted", "with Coulomb friction"),
    ]
    told = [row.dots[0].value for row in gaps.groups[0].rows]
    steps = (record.given, record.before, record.after)
    assert told == [one.ratio_to_noise for one in steps]
    assert gaps.reference[0] == 1.0


def test_the_picture_of_parameters_that_were_off_ends_where_fitting_them_leads():
    record = nothing_missing("parameters")
    rows = answer_to(record).blocks[0].groups[0].rows

    assert [row.name for row in rows] == ["as given", "re-fitted"]
    assert [row.dots[0].value for row in rows] == [35.2, 1.0]


def test_what_leaves_much_is_a_part_and_no_fact():
    much = replace(named().after, ratio_to_noise=3.5)
    found = answer_to(
        replace(named(), complete=False, after=much, explained_share=0.9876)
    )

    assert "lacks" not in found.verdict
    assert "explains 98.8 % of the gap; what remains is not explained." in found.verdict
    assert not found.is_settled


def test_force_and_overlay_stand_beside_it():
    _, force, overlay = answer_to(named()).blocks

    assert [one.label for one in force.panels[0].curves][-1] == "with the effects"
    assert "held out" in overlay.sentence
    assert len(overlay.panels) == 1


@pytest.mark.parametrize(
    ("changes", "words", "is_settled"),
    [
        (
            {"complete": False, "after": Gap(2e-5, 3e-5, 1.5)},
            "A part of the gap stays unexplained.",
            False,
        ),
        (
            {"complete": False, "after": Gap(2e-5, 3e-5, 1.1)},
            "Little more than the noise remains.",
            False,
        ),
        (
            {"verdict": "ambiguous", "ambiguous_with": ("stribeck_friction",)},
            "or instead Stribeck friction: these recordings cannot tell them apart",
            False,
        ),
    ],
)
def test_what_stays_open_is_said(changes, words, is_settled):
    found = answer_to(replace(named(), **changes))

    assert words in found.verdict
    assert found.is_settled == is_settled


def test_verdicts_without_an_effect():
    assert verdict_in_words(nothing_missing()).startswith("Nothing is missing")
    assert answer_to(nothing_missing()).is_settled
    assert "no known effect explains" in verdict_in_words(unknown())
    assert not answer_to(unknown()).is_settled
    base = (
        BaseParameter("stiffness_N_per_m", 1000.0, 1200.0, 1200.0),
        BaseParameter("damping_N_s_per_m", 10.0, 10.1, 10.1),
    )
    moved = replace(nothing_missing(), verdict="parameters", base=base)
    assert "most of all the stiffness: 1000 given, 1200 N/m fitted (+20.0 %)" in plain(
        verdict_in_words(moved)
    )


@pytest.mark.parametrize(
    ("is_foreign", "confirmed", "detail", "note"),
    [
        (True, "surrogate", "A linear stand-in was run", "(confirmed: surrogate)"),
        (True, "simulation", "The simulation itself was", "(confirmed: simulation)"),
        # Of a drive it goes without saying.
        (False, "simulation", "", ""),
    ],
)
def test_what_was_run_with_the_effect_is_said(is_foreign, confirmed, detail, note):
    record = replace(named(), is_foreign=is_foreign, confirmed=confirmed)
    details, notes = answer_to(record).details, gap_table(record).notes
    assert detail in " ".join(details)
    assert note in " ".join(notes)
    if not is_foreign:
        assert "was run" not in " ".join(details)
        assert "confirmed" not in " ".join(notes)


def test_without_held_out_recordings_the_gap_is_that_of_the_fit():
    found = answer_to(replace(named(), held_out=()))

    assert "none was held out" in found.details[0]


def test_without_noise_the_gap_has_a_unit():
    record = named()
    found = answer_to(replace(record, noise=replace(record.noise, rms=0.0)))

    assert "times the noise" not in found.details[0]
    assert plain(found.details[0]).split(":")[1].count(" m") == 3
    assert found.blocks[0].reference is None


def test_results_that_left_a_file_only_have_an_answer_too():
    stored = StoredResults("a", "{}", "poles", diagnosis=DIAGNOSIS)

    assert diagnosis_answer(ReportContents(stored)).verdict == "Verdict: named."
    assert diagnosis_answer(ReportContents(StoredResults("a", "{}", "poles"))) is None


def test_the_model_is_named_with_its_fit_beside_the_linear_one(contents):
    better = {
        "rmsd": 0.5 * contents.answer.linear_rmsd,
        "fit_percent": np.array([95.0]),
    }
    record = replace(contents.answer, **better)
    found = model_answer(replace(contents, answer=record))

    assert found.verdict.startswith(f"Take {record.name}: fit ")
    assert f"{np.median(record.fit_percent):.1f} %" in plain(found.verdict)
    assert f"(linear: {np.median(record.linear_fit_percent):.1f} %)" in plain(
        found.verdict
    )
    assert "on 1 recording never used" in found.verdict
    assert any(record.name in command for _, command in found.next_steps)


def answered(contents, **changes):
    return model_answer(replace(contents, answer=replace(contents.answer, **changes)))


def test_a_page_that_linear_models_win_is_not_green(contents):
    wins = {
        "rmsd": np.array([1.36e-3]),
        "linear_rmsd": np.array([9.49e-4]),
        "linear_fit_percent": np.array([91.5]),
    }
    shown = replace(contents, answer=replace(contents.answer, **wins))
    page = report_page(shown, STAGES).html
    (answer,) = re.findall(
        r'<article class="answer((?:(?!<article).)*Which model describes(?:(?!<article).)*)',
        page,
        re.S,
    )

    assert "A linear model is better" in answer
    assert "settled" not in answer.split(">")[0]


def test_a_better_linear_model_is_the_answer(contents):
    found = answered(
        contents,
        rmsd=np.array([1.36e-3]),
        linear_rmsd=np.array([9.49e-4]),
        linear_name="linear:step_02/1/1",
        fit_percent=np.array([88.2]),
        linear_fit_percent=np.array([91.5]),
        threshold=0.01,
    )

    assert plain(found.verdict) == (
        "A linear model is better: RMSD 0.000949 m, with the maps of the "
        "configuration 0.00136 m, on 1 recording never used. Those are not worth it here."
    )
    assert not found.is_settled
    said, command = found.next_steps[1]
    assert (
        said == "For linear models put input_map: none, output_map: none into fit, then"
    )
    assert command == "hwid run CONFIG"
    exports = [one for _, one in found.next_steps if "hwid export" in one]
    (only,) = exports
    assert only == found.next_steps[0][1]
    assert "--model linear:step_02/1/1 " in only


def test_a_linear_model_that_wins_by_little_is_as_good(contents):
    wins = {"rmsd": np.array([1.02e-3]), "linear_rmsd": np.array([9.49e-4])}
    said = plain(answered(contents, threshold=0.01, **wins).verdict)
    assert said.startswith("A linear model is as good: RMSD 0.000949 m")


def test_where_the_evidence_on_maps_disagrees_more_recordings_are_asked(contents):
    maps = ChosenMaps(1, 1, "piecewise_linear", "none", 5)
    wins = {"rmsd": np.array([1.36e-3]), "linear_rmsd": np.array([9.49e-4])}
    found = answered(contents, maps=maps, has_these_maps=True, **wins)
    assert found.next_steps[1] == (f"{UNDECIDED_MAPS}, then", "hwid run CONFIG")
    other = answered(contents, maps=maps, has_these_maps=False, **wins)
    assert other.next_steps[1][0].startswith("To try other maps put input_map: piece")


def test_a_name_with_blanks_is_one_word_of_a_command(contents):
    found = answered(contents, linear_name="linear:Sine 3Hz/3/4")
    assert "--model 'linear:Sine 3Hz/3/4' " in found.next_steps[0][1]
    worse = 2.0 * contents.answer.rmsd
    fits = {
        "fit_percent": np.array([90.0]),
        "linear_fit_percent": np.array([80.0]),
        "linear_ratio": 0.5,
    }
    found = answered(contents, name="Sine 3Hz/3/4", linear_rmsd=worse, **fits)
    assert any("--model 'Sine 3Hz/3/4' " in one for _, one in found.next_steps)


def test_why_maps_are_taken_that_one_recording_speaks_against_is_said(contents):
    one = np.array([1.0e-3])
    found = answered(
        contents,
        rmsd=1.1 * one,
        linear_rmsd=one,
        linear_ratio=0.4,
        fit_percent=np.array([71.1]),
        linear_fit_percent=np.array([72.4]),
    )
    assert plain(found.verdict).endswith(
        "(linear: 72.4 %); over all recordings but its own it leaves 0.4 times as much as "
        "the linear model."
    )


@pytest.mark.parametrize(("linear", "rmsd"), [(-3.0, 1e-3), (-30.0, 3e-3)])
def test_a_model_that_is_worse_than_a_constant_is_not_taken(contents, linear, rmsd):
    found = answered(
        contents,
        rmsd=np.array([2e-3]),
        linear_rmsd=np.array([rmsd]),
        fit_percent=np.array([-20.2]),
        linear_fit_percent=np.array([linear]),
        threshold=0.01,
    )

    assert f"has a fit of -20.2 % (linear: {linear:.1f} %) on 1 rec" in plain(
        found.verdict
    )
    assert found.verdict.startswith("No model to take: ")
    assert not found.is_settled
    assert not any("hwid export" in one for _, one in found.next_steps)


def test_many_recordings_are_those_that_are_worst(contents):
    names = tuple(f"r{n}" for n in range(20))
    rmsd = np.random.default_rng(3).permutation(np.arange(1.0, 21.0))
    some = np.full(20, 50.0)
    found = answered(
        contents,
        recordings=names,
        rmsd=rmsd,
        linear_rmsd=rmsd,
        beyond=0 * some,
        fit_percent=some,
        linear_fit_percent=some,
        threshold=NAN,
    ).blocks[0]

    shown = [row.name for row in found.groups[0].rows]
    assert shown == [names[place] for place in np.argsort(-rmsd)[: len(shown)]]
    assert found.sentence.startswith(f"The {len(shown)} worst; {20 - len(shown)} more")
    assert found.reference is None


def test_where_to_trust_it_is_said(contents):
    inside = answered(contents, input_range=(-1.5, 2.0), beyond=np.array([0.0]))
    assert plain(inside.details[1]).endswith(
        "Its fit has visited inputs from -1.5 A to 2 A."
    )
    outside = answered(contents, beyond=np.array([0.25]))
    assert "leaves that range for 25 % of its samples" in plain(outside.details[1])


def test_a_model_above_its_threshold_is_not_one_to_take(contents):
    good = {name: np.array([90.0]) for name in ("fit_percent", "linear_fit_percent")}
    worse = {"linear_rmsd": 2.0 * contents.answer.rmsd, **good}
    limit = float(contents.answer.rmsd[0])
    above = answered(contents, threshold=limit, **worse)
    assert above.verdict.startswith("Not below the threshold of ")
    assert "hwid next CONFIG" in [command for _, command in above.next_steps]
    below = answered(contents, threshold=1.01 * limit, **worse)
    assert below.verdict.startswith(f"Take {contents.answer.name}: ")
    assert "hwid next CONFIG" not in [command for _, command in below.next_steps]


def test_a_band_that_holds_too_little_is_said(contents):
    found = answered(contents, held=(("step_09", 0.59),))
    assert "Do not rely on its band of 90 %: it holds 59 % of step_09." in plain(
        found.details[1]
    )
    found = answered(contents, held=(("step_09", 0.89),))
    assert "rely" not in found.details[1]


def test_recommended_orders_and_maps_are_said(contents):
    advice = contents.answer.advice
    maps = ChosenMaps(advice.nb, advice.nk, "saturation", "none")
    good = {name: np.array([90.0]) for name in ("fit_percent", "linear_fit_percent")}
    worse = {"linear_rmsd": 2.0 * contents.answer.rmsd, **good}
    told = plain(answered(contents, maps=maps, **worse).details[1])

    assert f"Recommended for new fits: nb = {advice.nb}, nk = {advice.nk}" in told
    assert "Recommended maps: saturation and none" in told
    none = ChosenMaps(advice.nb, advice.nk, "none", "none")
    said = plain(answered(contents, maps=none, **worse).details[1])
    assert "Recommended maps: none." in said
    # The model shown has others: the page says why.
    others = answered(contents, place=(advice.nb, advice.nk + 1), **worse).details[1]
    assert f"this model has {advice.nb}/{advice.nk + 1}, which other" in others
    own = answered(contents, place=(advice.nb, advice.nk), **worse).details[1]
    assert "which other" not in own
    chosen = answered(contents, maps=maps, own_maps=(("dead_zone", 0),), **worse)
    assert "those of this model came closest" in chosen.details[1]
    # A page that recommends other maps than it shows says how to get them.
    steps = answered(contents, maps=maps, has_these_maps=False, **worse).next_steps
    keys = "put input_map: saturation, output_map: none into fit"
    assert [one for said, one in steps if keys in said] == ["hwid run CONFIG"]
    steps = answered(contents, maps=maps, **worse).next_steps
    assert not any("recommended maps" in said for said, _ in steps)
    # Where a linear model is better than the maps it has, others are worth a try.
    better = {"linear_rmsd": 0.5 * contents.answer.rmsd, **good}
    other = answered(contents, maps=maps, has_these_maps=False, **better)
    assert "Those are not worth it here." in plain(other.verdict)
    assert other.next_steps[1][0] == f"To try other maps {keys}, then"
    assert (
        "maps: saturation and none (chosen on other recordings than those that judge"
        in plain(other.details[1])
    )
    given = answered(contents, maps=none, has_these_maps=False, **better)
    assert "input_map: none, output_map: none" in given.next_steps[1][0]


@pytest.mark.parametrize(("share", "is_said"), [(0.79, True), (0.81, False)])
def test_a_far_nearer_model_of_the_recommended_orders_is_pointed_to(
    contents, share, is_said
):
    own = contents.answer.mean_rmsd
    found = answered(contents, advised_rmsd=share * own, advised_name="step_06/2/4")
    told = plain(found.details[1])
    assert "At these orders, step_06/2/4, the RMSD is" in told
    assert ("Look at step_06/2/4 too" in told) is is_said


@pytest.mark.parametrize(("share", "is_said"), [(0.3, True), (1e-4, False)])
def test_noise_is_said_where_it_is_part_of_the_rmsd(contents, share, is_said):
    found = answered(contents, noise_rms=share * contents.answer.mean_rmsd)
    assert ("The noise of these recordings is about" in found.details[0]) is is_said
    assert "The noise" not in answered(contents, noise_rms=np.nan).details[0]


def test_a_model_above_the_threshold_is_not_settled(contents):
    fit = {"fit_percent": np.array([95.0]), "linear_rmsd": np.array([3e-2])}
    low = answered(contents, rmsd=np.array([1e-3]), threshold=0.01, **fit)
    high = answered(contents, rmsd=np.array([2e-2]), threshold=0.01, **fit)

    assert low.is_settled
    assert not high.is_settled
    assert "0 of 1 below the threshold" in high.details[0]


def test_a_model_of_all_recordings_says_that_nothing_validates_it(contents):
    none = np.zeros(0)
    found = answered(
        contents,
        recordings=(),
        rmsd=none,
        linear_rmsd=none,
        fit_percent=none,
        linear_fit_percent=none,
        beyond=none,
    )

    assert "nothing says yet how good it is elsewhere" in found.verdict
    assert not found.is_settled


def test_an_answer_of_other_settings_says_so_first(contents):
    runs = (
        StageRun("identify", "a"),
        StageRun("crossval", "a", changed=("crossval",)),
        StageRun("diagnose", "a", changed=("recordings", "simulation")),
    )
    shown = replace(contents, stored=replace(contents.stored, stages=runs))
    diagnosis, model = diagnosis_answer(shown), model_answer(shown)

    assert diagnosis.details[0] == (
        "Made with other settings of recordings and simulation: run hwid diagnose again."
    )
    assert model.details[0] == (
        "Made with other settings of crossval: run hwid crossval again."
    )
    assert diagnosis.next_steps[0][1] == "hwid diagnose CONFIG"
    assert not diagnosis.is_settled
    assert diagnosis_answer(contents).is_settled
    assert "other settings" not in " ".join(model_answer(contents).details)


def test_two_answers_share_the_first_screen(contents):
    answers = [diagnosis_answer(contents), model_answer(contents)]
    shown = summary_section(contents, answers).blocks

    assert [one.is_small for one in shown] == [True, True]
    assert [one.is_small for one in summary_section(contents, answers[:1]).blocks] == [
        False
    ]


def test_results_of_calibration_alone_say_what_to_run():
    (found,) = summary_section(report_contents(calibrated_only()), []).blocks

    assert found.verdict.startswith("No model yet")
    assert ("Fit models to them:", "hwid identify CONFIG") in found.next_steps


@pytest.mark.parametrize("verdict", ["none", "parameters"])
def test_what_measuring_added_stands_below_the_answer(verdict):
    plain = nothing_missing(verdict)
    late = answer_to(replace(plain, remains="late_input"))
    assert any("the input stands one sample later" in one for one in late.details)
    assert not any("What is left is" in one for one in answer_to(plain).details)
