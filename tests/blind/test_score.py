"""Scores and the document against cases worked out by hand."""

import math

import pytest

from tests.blind.document import document, read_outcomes
from tests.blind.score import score
from tests.blind.tables import wilson


def truth(*effects, acceptable=None, nuisance="", suite="full", **fields):
    ids = [one for one, _ in effects]
    return {
        "case": "a",
        "suite": suite,
        "plan": "full",
        "nuisance": nuisance,
        "noise_percent": 1.0,
        "noise_sigma_m": 2.0,
        "effects": [{"id": one, "parameters": p} for one, p in effects],
        "acceptable": [ids] if acceptable is None else acceptable,
        "reference_A": 5.0,
        "reference_m": 0.02,
        "gap": {"share_of_motion": 0.05, "to_noise": 1.5},
        "recordings": {
            "r1": {"largest_A": 4.0, "largest_m": 0.01, "factor": 0.9},
            "r2": {"largest_A": 5.0, "largest_m": 0.02, "factor": 1.1},
            "r3": {"largest_A": 1.0, "largest_m": 0.02, "factor": 3.0},
        },
    } | fields


def diagnosis(verdict, *effects, ambiguous_with=(), train=("r1", "r2")):
    return {
        "verdict": verdict,
        "complete": True,
        "effects": [{"id": one, "parameters": p} for one, p in effects],
        "ambiguous_with": list(ambiguous_with),
        "gap": {
            "noise_rms": 2.1,
            "before": {"held_out_rms": 6.0},
            "after": {"held_out_rms": 2.0},
        },
        "recordings": {"train": list(train), "held_out": []},
        "seconds": 1.0,
    }


COULOMB = ("coulomb_friction", {"force_N": 2.0})
FOUND = ("coulomb_friction", {"force_N": {"value": 2.2, "ci95": [1.9, 2.5]}})
SPRING = ("cubic_stiffness", {})


@pytest.mark.parametrize(
    ("found", "result", "family"),
    [
        (diagnosis("named", FOUND), "right", True),
        (diagnosis("named", SPRING), "wrong", False),
        (diagnosis("named", ("hysteresis", {})), "wrong", True),
        (diagnosis("named", FOUND, SPRING), "wrong", False),
        (
            diagnosis("ambiguous", SPRING, ambiguous_with=["coulomb_friction"]),
            "ambiguous",
            False,
        ),
        (diagnosis("ambiguous", FOUND, ambiguous_with=["cogging"]), "ambiguous", False),
        (diagnosis("ambiguous", SPRING), "refused", False),
        (diagnosis("unknown"), "refused", False),
        (diagnosis("parameters"), "refused", False),
        (None, "failed", False),
    ],
)
def test_a_hidden_effect_is_right_only_under_its_own_name(found, result, family):
    outcome = score(truth(COULOMB), found)

    assert (outcome["result"], outcome["family_right"]) == (result, family)


@pytest.mark.parametrize(
    ("hidden", "found", "result"),
    [
        (truth(acceptable=[]), diagnosis("parameters"), "right"),
        (truth(acceptable=[]), diagnosis("unknown"), "refused"),
        (truth(acceptable=[]), diagnosis("named", FOUND), "wrong"),
        (truth(acceptable=[], nuisance="drift"), diagnosis("unknown"), "right"),
        (truth(acceptable=[], nuisance="drift"), diagnosis("named", FOUND), "wrong"),
        (truth(("creep", {}), acceptable=[]), diagnosis("unknown"), "right"),
        (truth(("creep", {}), acceptable=[]), diagnosis("named", FOUND), "wrong"),
        (
            truth(("lugre_friction", {}), acceptable=[["coulomb_friction"]]),
            diagnosis("named", FOUND),
            "right",
        ),
    ],
)
def test_where_nothing_of_the_catalogue_is_hidden_a_name_is_wrong(
    hidden, found, result
):
    assert score(hidden, found)["result"] == result


def test_both_of_a_pair_must_be_named():
    pair = truth(COULOMB, ("cubic_stiffness", {}))

    assert score(pair, diagnosis("named", FOUND))["result"] == "wrong"
    assert score(pair, diagnosis("named", SPRING, FOUND))["result"] == "right"
    told = diagnosis(
        "ambiguous", FOUND, ambiguous_with=[["coulomb_friction", "cubic_stiffness"]]
    )
    assert score(pair, told)["result"] == "ambiguous"


def test_errors_and_gaps_are_relative_to_the_truth():
    outcome = score(truth(COULOMB), diagnosis("named", FOUND))

    assert outcome["errors"] == {"coulomb_friction.force_N": pytest.approx(0.1)}
    assert outcome["covered"] == {"coulomb_friction.force_N": True}
    assert (outcome["before_to_noise"], outcome["after_to_noise"]) == (3.0, 1.0)
    assert outcome["closed"] == 1.0


def test_a_parameter_that_is_not_reported_is_infinitely_wrong():
    found = diagnosis("named", ("coulomb_friction", {}))
    errors = score(truth(COULOMB), found)["errors"]

    assert errors == {"coulomb_friction.force_N": math.inf}


@pytest.mark.parametrize(
    ("effect", "name", "value"),
    [
        ("supply_sag", "loss_at_reference", 0.2 * 0.8),
        ("force_constant_saturation", "loss_at_reference", 0.2 * 0.64),
        ("sensor_cubic", "coefficient", 0.2 * 0.25),
        ("sensor_quadratic", "coefficient", 0.2 * 0.5),
    ],
)
def test_sizes_count_at_the_largest_reading_of_the_training(effect, name, value):
    hidden = truth((effect, {name: 0.2}))
    told = diagnosis("named", (effect, {name: {"value": value}}), train=["r1"])

    assert score(hidden, told)["errors"][f"{effect}.{name}"] == pytest.approx(0.0)


def test_the_spread_of_a_parameter_is_that_of_the_training():
    hidden = truth(("parameter_change", {"spread": 0.5, "which": "stiffness"}))
    parameters = {"spread": {"value": 0.1}, "which": {"value": "stiffness_N_per_m"}}
    told = diagnosis("named", ("parameter_change", parameters))

    errors = score(hidden, told)["errors"]

    assert errors["parameter_change.spread"] == pytest.approx(0.0)
    assert errors["parameter_change.which"] == 0.0
    parameters["which"]["value"] = "damping_N_s_per_m"
    assert score(hidden, told)["errors"]["parameter_change.which"] == math.inf


def test_the_interval_is_wilsons():
    # Worked example: 7 of 10.
    assert wilson(7, 10) == pytest.approx((0.3968, 0.8922), abs=1e-4)
    assert wilson(0, 10)[0] == 0.0
    assert wilson(10, 10)[1] == 1.0


def outcome(found, hidden=None, **fields):
    extra = {"seeds": "development", "program": "abc", "wall_seconds": 2.0}
    return score(hidden or truth(COULOMB), found) | extra | fields


def test_the_document_shows_what_went_wrong_and_how_often():
    text = document(
        [
            outcome(diagnosis("named", FOUND), case="a"),
            outcome(diagnosis("named", SPRING), case="b"),
            outcome(None, case="c"),
        ]
    )

    assert "33% (6%-79%, n=3)" in text
    assert "| full | coulomb_friction | 1 | cubic_stiffness | 1 |" in text
    assert "| full | coulomb_friction | 1 | failed | 1 |" in text
    assert "flatter" in text
    assert "frozen" not in text


def test_development_and_reporting_outcomes_never_mix():
    mixed = [outcome(None), outcome(None, seeds="reporting")]

    with pytest.raises(ValueError, match="expected one kind"):
        document(mixed)
    assert "frozen" in document(mixed[1:])


def test_of_a_case_that_was_run_again_the_last_line_counts(tmp_path):
    file = tmp_path / "outcomes.jsonl"
    file.write_text(
        '{"case": "a", "result": "failed"}\n{"case": "a", "result": "right"}\n'
    )

    assert [one["result"] for one in read_outcomes(file)] == ["right"]
