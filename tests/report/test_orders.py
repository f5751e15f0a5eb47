from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.best_model import BestModel
from hwid_cli.records.order import (
    OrderAdvice,
    OrderChoice,
    ResponseEstimate,
    SelectionEvidence,
)
from hwid_cli.report.closing import orders_sentence
from hwid_cli.report.orders import order_reasons, order_table
from hwid_cli.report.simulation_note import simulation_note
from hwid_cli.report.table import as_text

NAN = float("nan")
JUDGEMENT = SelectionEvidence(1.2e-3, 1.15e-3, 1.04, 0.02, 4)
OVERALL = OrderChoice("", 2, 3, 3, 4, JUDGEMENT, 4, 4, 2, 3)
ADVICE = OrderAdvice(
    overall=OVERALL,
    choices=tuple(replace(OVERALL, recording=f"step_0{n}") for n in range(3)),
    responses=tuple(
        ResponseEstimate(f"step_0{n}", 1, np.array([1.0, 0.4, 0.01]), 2)
        for n in range(3)
    ),
    delay=1,
    n_poles=2,
    tolerance=0.05,
    nb=(1, 2, 3, 4),
    nk=(1, 2, 3, 4, 5),
    nk_role="poles",
    nf=None,
    unit="m",
)


def said(**changes):
    return " ".join(as_text(order_reasons(replace(ADVICE, **changes))).split())


@pytest.mark.parametrize("rule", ["zero", "steady", "estimated"])
def test_the_table_has_a_row_for_each_and_says_how_models_start(rule):
    lines = as_text([order_table(ADVICE)], initial_state=rule).splitlines()

    assert lines[-1].split()[:3] == ["all", "together", "2/3"]
    assert lines[-2].split() == [
        "step_02", "2/3", "1.20e-03", "1.04", "3/4", "4/4", "2/3", "1", "2",
    ]  # fmt: skip
    assert simulation_note(rule, is_validation=True) in lines
    assert max(map(len, lines)) <= 80


def test_the_recommendation_says_why():
    text = said()

    assert text.startswith("Take nb = 2, nk = 3 (orders [2 3 1]): on recordings that")
    assert (
        "on average 4 % further off than the best orders of the grid, [3 4 1]" in text
    )
    assert "within the tolerance of 5 %" in text
    assert "BIC of the fits chooses 2/3, AIC 4/4." in text
    assert "Delay: at most 1 sample; a quarter" in text
    assert "Poles: 2 singular values of the impulse response's Hankel matrix" in text
    assert "so in 3 of 3 recordings" in text
    assert max(map(len, as_text(order_reasons(ADVICE)).splitlines())) <= 80


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"best_nb": 2, "best_nk": 3}, "they have the lowest RMSD on recordings"),
        (
            {"n_validation": 0, "standard_error": NAN},
            "There is no validation recording",
        ),
        (
            {"nb": 4, "nk": 5},
            "widen orders.nb (beyond 4) and orders.nk (beyond 5)",
        ),
    ],
)
def test_each_case_has_its_reason(changes, words):
    names = {"nb", "nk", "best_nb", "best_nk"}
    places = {key: value for key, value in changes.items() if key in names}
    others = {key: value for key, value in changes.items() if key not in places}
    evidence = replace(JUDGEMENT, **others)

    assert words in said(overall=replace(OVERALL, evidence=evidence, **places))


def test_a_grid_is_wide_enough_where_smaller_orders_are_taken():
    assert "widen" not in said(overall=replace(OVERALL, best_nb=4, best_nk=5))


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (1, "1 pair of model and recording does not count"),
        (48, "48 pairs of model and recording do not count"),
    ],
)
def test_pairs_that_are_extrapolated_are_told(count, words):
    evidence = replace(JUDGEMENT, n_unexcited=count)

    assert words in said(overall=replace(OVERALL, evidence=evidence))
    assert "not count" not in said()


def test_a_delay_that_the_grid_does_not_have_is_told():
    late = tuple(replace(one, delay=n) for n, one in enumerate(ADVICE.responses, 5))
    text = said(responses=late, delay=5)

    assert "at most 5 samples" in text
    assert "allow 5 to 7 samples" in text
    assert "The grid takes 1; leading coefficients of B" in text
    assert "set orders.nk_role: delay to try 0" in said(delay=0)


def test_in_the_delay_reading_the_orders_are_those_of_the_toolboxes():
    text = said(nk_role="delay", nf=2)

    assert "(orders [2 2 3])" in text
    assert "The recommended delay is 3." in text


def test_what_the_data_do_not_show_is_said():
    blind = tuple(replace(one, delay=-1, n_poles=0) for one in ADVICE.responses)
    text = said(responses=blind, n_poles=0, overall=replace(OVERALL, bic_nb=0))

    assert "no output responds to its input" in text
    assert "no hint of their number" in text
    assert "BIC" not in text


def test_delays_that_every_fit_tries_are_not_asked_for_again():
    tried = said(tried_delays=(1, 2, 3), delay=2)
    assert "orders [2 3 nk], nk of fit.delays" in tried
    assert "Every fit tries 1, 2, 3 (fit.delays)." in tried
    assert "The grid takes" not in tried
    assert "allow longer ones than 3" in said(tried_delays=(1, 3), delay=5)
    assert "allow longer" not in tried


@pytest.mark.parametrize(
    ("count", "words"),
    [
        (
            1,
            "1 sample of the validation recordings is an outlier and does not count here",
        ),
        (
            25,
            "25 samples of the validation recordings are outliers and do not count here",
        ),
    ],
)
def test_outliers_that_do_not_count_are_told(count, words):
    evidence = replace(JUDGEMENT, n_outliers=count)

    assert words in said(overall=replace(OVERALL, evidence=evidence))
    assert "outlier" not in said()


@pytest.mark.parametrize("delays", [(1, 2, 3, 4, 5, 6), ()])
def test_a_delay_that_the_grid_does_not_reach_is_said_with_its_key(delays):
    changes = {"further_delays": delays}
    advice = replace(ADVICE, **changes)
    key = f"put delays: [{', '.join(map(str, delays))}] into fit"
    assert (key in orders_sentence(advice, None)) == bool(delays)
    assert (key.capitalize() in said(**changes)) == bool(delays)


def test_where_no_model_predicts_the_others_no_orders_are_recommended():
    lost = replace(JUDGEMENT, best_rmsd=4.6, output_spread=0.2)
    advice = replace(ADVICE, overall=replace(OVERALL, evidence=lost))
    text = " ".join(as_text(order_reasons(advice)).split())
    assert text.startswith("These orders are no choice: no model of one recording")
    assert "off by 4.6 m, where outputs vary by 0.2 m" in text
    assert orders_sentence(advice, None).startswith("none recommended: no model of one")
    near = replace(JUDGEMENT, best_rmsd=0.19, output_spread=0.2)
    assert "no choice" not in said(overall=replace(OVERALL, evidence=near))


def test_one_answer_is_given_where_the_named_model_has_other_orders():
    # The advice alone asks for a wider grid; a model that is named needs none.
    edge = replace(ADVICE, overall=replace(OVERALL, nb=4, nk=5))
    best = BestModel("a+b/2/3", "test", ("c",), 0.012, "m", 0.01, linear_rmsd=0.03)
    beside = orders_sentence(edge, None, best)

    assert "widen orders.nb" in orders_sentence(edge, None)
    assert "the model above has 2/3, which other recordings chose for it" in beside
    assert beside.endswith("take the model")
    assert "widen" not in beside
