from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from hwid_cli.records.best_model import BestModel
from hwid_cli.records.groups import SingleModels, SpoiltJoin
from hwid_cli.report.closing import (
    above_threshold_hint,
    best_model_sentences,
    closing_text,
    recordings_sentence,
    why_other_orders,
)

BEST = BestModel(
    *("a+b/2/3", "test", ("c", "d"), 0.012, "m", 0.01),
    linear_rmsd=0.03,
    singles=SingleModels("a/2/2", 0.011, "a/2/2", 0.011),
)


def test_a_command_to_copy_stays_on_one_line():
    command = "hwid export experiment.yaml --model " + "a+" * 60
    text = closing_text("t", [("best model", "word " * 40), ("next", command)], 80)

    assert f"  next        {command}" in text.splitlines()
    assert max(map(len, text.splitlines()[:-1])) <= 80


def test_a_threshold_that_looks_like_the_error_says_by_how_much():
    near = replace(BEST, rmsd=0.01002, threshold=0.01)
    said = "; ".join(best_model_sentences(near)).replace("\xa0", " ")
    assert "NOT below the 0.01 m of crossval.threshold, by 0.2 %" in said
    clear = "; ".join(best_model_sentences(replace(near, rmsd=0.012)))
    assert "crossval.threshold, by" not in clear


def test_a_failure_to_help_is_said():
    said = "; ".join(best_model_sentences(BEST)).replace("\xa0", " ")

    assert "mean RMSD 0.012 m on 2 recordings never used (c and d)" in said
    assert "NOT below the 0.01 m" in said
    assert "joining recordings does not help here: a/2/2, the single model" in said
    assert said.endswith("leaves 0.011 m")
    better = replace(BEST, rmsd=0.009)
    assert "joining recordings helps here" in "; ".join(best_model_sentences(better))


def test_a_single_model_that_only_the_test_would_choose_is_named_beside():
    # What a reader of the tables finds: one that is nearer there than both.
    singles = SingleModels("a/2/2", 0.015, "b/1/1", 0.010)
    said = "; ".join(best_model_sentences(replace(BEST, singles=singles)))
    said = said.replace("\xa0", " ")
    assert "joining recordings helps here: a/2/2, the single model chosen in" in said
    assert "leaves 0.015 m; b/1/1 happens to be nearer, 0.01 m, which only" in said
    farther = replace(singles, nearest_rmsd=0.013)
    assert "happens" not in "; ".join(
        best_model_sentences(replace(BEST, singles=farther))
    )


@pytest.mark.parametrize(
    ("held", "said"),
    [
        (
            (("c", 0.59), ("d", 0.80)),
            "holds 70 % of the recordings never used, 59 % of c",
        ),
        ((("c", 0.4),), "it holds 40 % of c"),
        ((("c", 0.59), ("d", 0.92)), ""),
        ((), ""),
    ],
)
def test_a_band_that_holds_too_little_is_no_band_to_rely_on(held, said):
    found = best_model_sentences(replace(BEST, held=held))
    warned = [one.replace("\xa0", " ") for one in found if "its band of" in one]
    assert bool(warned) is bool(said)
    assert all(one.endswith(said) for one in warned)


def test_a_recording_that_spoils_a_joined_model_is_one_to_look_at():
    spoilt = SpoiltJoin("a+b+c/1/2", 0.4, 0.1, "b")
    alone = replace(BEST, name="a/2/3", singles=None, spoilt=spoilt)
    said = "; ".join(best_model_sentences(alone)).replace("\xa0", " ")
    assert "3 recordings together is farther off its own ones (0.4 m)" in said
    assert "seen (0.1 m): b stands alone; look at it" in said
    unclear = replace(alone, spoilt=replace(spoilt, suspect=""))
    assert "some recordings contradict others" in "; ".join(
        best_model_sentences(unclear)
    )


def test_a_model_with_other_orders_than_the_recommended_ones_says_why():
    assert why_other_orders("it", (2, 3), (2, 3)) == ""
    assert why_other_orders("it", (2, 3), (1, 3)).startswith(
        "it has 2/3, which other recordings"
    )
    assert BEST.place == (2, 3)


def test_the_hint_of_a_model_that_is_too_far_off_leaves_out_what_was_done():
    text = above_threshold_hint("e.yaml", has_order=False, has_next=False)
    assert "hwid order" in text
    assert "with 'next: {limits: " in text
    assert "in e.yaml" in text
    text = above_threshold_hint("e.yaml", has_order=True, has_next=True)
    assert "hwid order" not in text
    assert "limits" not in text


def test_a_linear_model_without_a_name_is_the_one_of_the_same_orders():
    own = replace(BEST, judge="own", judged_on=("a",), chosen_on=())
    said = "; ".join(best_model_sentences(own)).replace("\xa0", " ")
    assert "; linear model of the same orders: 0.03 m;" in said
    named = replace(own, linear_name="linear:a/1/2")
    said = "; ".join(best_model_sentences(named)).replace("\xa0", " ")
    assert "; best linear model, linear:a/1/2: 0.03 m;" in said


def test_a_linear_model_of_many_recordings_is_told_by_its_orders():
    many = replace(BEST, linear_name="linear:a+b+c+d/4/5", linear_rmsd=0.03)
    said = [one.replace("\xa0", " ") for one in best_model_sentences(many)]
    assert said[1] == "best linear model, of 4 recordings, orders 4/5: 0.03 m"
    # The one to take has its name: people copy it.
    many = replace(many, linear_rmsd=0.008)
    assert "linear:a+b+c+d/4/5: mean RMSD 0.008 m" in best_model_sentences(many)[
        0
    ].replace("\xa0", " ")


def test_a_judge_that_nobody_knows_is_refused():
    with pytest.raises(ValueError, match="judge 'me' is none of"):
        replace(BEST, judge="me")


def test_a_linear_model_that_is_better_stands_first():
    linear = replace(BEST, linear_rmsd=0.008, linear_name="linear:a+b/1/3")
    first, second = (one.replace("\xa0", " ") for one in best_model_sentences(linear))

    assert first == (
        "a linear model is better, linear:a+b/1/3: mean RMSD 0.008 m on 2 recordings "
        # The limit stands behind the model that it is about.
        "never used (c and d); below the 0.01 m of crossval.threshold"
    )
    assert second == "a+b/2/3: 0.012 m; these maps are not worth it here"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        # The linear one is worse still, or better and no good either, or not there.
        (
            {"fit_percent": -1.5, "linear_fit_percent": -40.0},
            "a+b/2/3 has a fit of -1.5 %, the linear one -40.0 % on 2 recordings",
        ),
        (
            {"fit_percent": -70.0, "linear_fit_percent": -3.0, "linear_rmsd": 0.001},
            "a+b/2/3 has a fit of -70.0 %, the linear one -3.0 % on 2 recordings",
        ),
        (
            {"fit_percent": -5.0, "linear_rmsd": float("nan")},
            "a+b/2/3 has a fit of -5.0 % on 2 recordings never used (c and d); a constant",
        ),
    ],
)
def test_where_a_constant_would_be_closer_no_model_is_the_best(changes, said):
    nothing = replace(BEST, **changes)
    (sentence,) = best_model_sentences(nothing)
    assert not nothing.is_usable
    assert sentence.startswith("no model predicts these recordings: ")
    assert said in sentence.replace("\xa0", " ")


@pytest.mark.parametrize(
    "changes",
    [
        {"fit_percent": 1.0, "linear_fit_percent": -40.0},
        {"fit_percent": -1.0, "linear_fit_percent": 2.0, "linear_rmsd": 0.001},
        {},
    ],
)
def test_a_model_that_is_closer_than_a_constant_is_one_to_take(changes):
    assert replace(BEST, **changes).is_usable


@pytest.mark.parametrize(
    ("changes", "is_better"),
    [
        ({"linear_rmsd": 0.0119}, True),
        ({"linear_rmsd": 0.012}, False),
        ({"linear_rmsd": float("nan")}, False),
        ({"linear_rmsd": 0.0119, "rmsd": float("inf")}, True),
        # A fit that only its own recording judges says nothing of others.
        ({"linear_rmsd": 0.0119, "judge": "own"}, False),
        # Two recordings say so, all others beside them do not; three would do.
        ({"linear_rmsd": 0.0119, "linear_ratio": 0.9}, False),
        ({"linear_rmsd": 0.0119, "linear_ratio": 1.1}, True),
        (
            {"linear_rmsd": 0.0119, "linear_ratio": 0.9, "judged_on": ("c", "d", "e")},
            True,
        ),
    ],
)
def test_only_recordings_beyond_the_fit_say_that_the_linear_model_is_better(
    changes, is_better
):
    assert replace(BEST, **changes).is_linear_better is is_better


def test_a_linear_model_that_is_closer_on_few_recordings_only_is_said_beside():
    said = best_model_sentences(replace(BEST, linear_rmsd=0.0119, linear_ratio=0.4))
    assert said[0].startswith("a+b/2/3: ")
    assert "over all recordings but its own a+b/2/3 leaves 0.4 times" in said[1]


@pytest.mark.parametrize(
    ("names", "is_enough", "said"),
    [
        (("levels_8", "sweep"), False, "levels_8 and 1 more; files to play: out/next"),
        (("levels_8",), False, "levels_8; files to play: out/next"),
        ((), False, "enough is known"),
        (("levels_8",), True, "enough is known"),
    ],
)
def test_recordings_to_take_are_named_with_the_place_of_their_files(
    names, is_enough, said
):
    found = SimpleNamespace(
        is_enough=is_enough, proposals=[SimpleNamespace(name=one) for one in names]
    )
    assert recordings_sentence(found, Path("out/next")).startswith(said)


def test_starts_that_a_prediction_does_not_have_are_told():
    (first, *_) = best_model_sentences(replace(BEST, has_estimated_starts=True))
    assert "(c and d), starts estimated from the measured output; NOT below" in first


def test_maps_that_folds_chose_are_said():
    found = BestModel("a+b/1/2", "test", ("c",), 0.002, "m", 0.01)
    maps = (("piecewise_linear", 3), ("none", 0))
    said = best_model_sentences(replace(found, own_maps=maps))
    assert (
        "its maps, piecewise linear, 3 and none, come closest to recordings left out in turn"
        in said
    )
    assert not any("maps" in one for one in best_model_sentences(found))
