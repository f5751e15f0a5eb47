from dataclasses import replace

import pytest

from hwid_cli.records.order import MapAdvice, MapCandidate, SelectionEvidence
from hwid_cli.report.orders import map_reasons, map_table
from hwid_cli.report.simulation_note import simulation_note
from hwid_cli.report.table import as_text

PIECEWISE = "piecewise_linear"
BEST = MapCandidate(PIECEWISE, 5, "none", 0, 13, 1.1e-3, 1.0, -120.0)
SMALL = MapCandidate(PIECEWISE, 3, "none", 0, 9, 1.13e-3, 1.03, -100.0)
GIVEN = MapCandidate(PIECEWISE, 10, PIECEWISE, 10, 43, 1.8e-3, 1.62, float("inf"))
OTHERS = tuple(
    MapCandidate("cubic_spline", 3 + n, "sigmoid_network", 3, 20, 1.5e-3, 1.4, -90.0)
    for n in range(20)
)
ADVICE = MapAdvice(
    orders=(1, 2, 1),
    candidates=(BEST, SMALL, *OTHERS, GIVEN),
    chosen=SMALL,
    given=GIVEN,
    evidence=SelectionEvidence(1.13e-3, 1.1e-3, 1.03, 0.02, 4, 6),
    tolerance=0.05,
    unit="rad/s",
)


def said(**changes):
    return " ".join(as_text(map_reasons(replace(ADVICE, **changes))).split())


@pytest.mark.parametrize("rule", ["zero", "steady", "estimated"])
def test_the_best_come_first_and_those_of_the_configuration_are_there(rule):
    lines = as_text([map_table(ADVICE)], initial_state=rule).splitlines()
    heads = next(n for n, line in enumerate(lines) if "input map" in line)
    rows = lines[heads + 2 :]

    assert "[1 2 1]" in lines[0]
    assert simulation_note(rule, is_validation=True) in lines
    assert rows[0].split() == [
        "piecewise", "linear,", "5", "none", "13", "1.10e-03", "1.00", "-",
    ]  # fmt: skip
    assert rows[1].split()[0] == "take"
    assert rows[1].split()[-1] == "20"
    assert rows[-1].split()[0] == "yours"
    assert (len(rows), rows[-1].split()[-1]) == (13, "-")
    assert "13 of 23 pairs" in lines[2]
    assert max(map(len, lines)) <= 80


def test_the_recommendation_can_be_pasted_and_says_why():
    text = said()

    assert text.startswith(
        "Put input_map: piecewise_linear, input_units: 3, output_map: none into fit: on "
    )
    assert "3 % further off than the best maps, piecewise linear, 5 and none" in text
    assert "Those of the configuration are 1.62 times as far off as the best." in text
    assert "6 pairs of model and recording do not count" in text
    assert max(map(len, as_text(map_reasons(ADVICE)).splitlines())) <= 80


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"chosen": BEST}, "they have the lowest RMSD on recordings that"),
        ({"given": SMALL}, "They are those of the configuration."),
        ({"given": BEST}, "Those of the configuration are the best."),
        (
            {"evidence": replace(ADVICE.evidence, n_validation=0)},
            "they have the lowest BIC. There is no validation recording",
        ),
    ],
)
def test_each_case_has_its_reason(changes, words):
    assert words in said(**changes)


def test_where_no_model_predicts_the_others_no_maps_are_to_be_taken():
    lost = replace(ADVICE.evidence, best_rmsd=0.3, output_spread=0.2)
    text = said(evidence=lost)
    assert text.startswith("These maps are no choice: no model of one recording")
    assert "off by 0.3 rad/s" in text
    assert "Put " not in text
    table = as_text([map_table(replace(ADVICE, evidence=lost))], initial_state="zero")
    assert "take" not in table.split()
