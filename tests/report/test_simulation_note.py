"""Every printed fit says that it was simulated in free run, and from which state."""

from dataclasses import replace

import pytest

from hwid_cli.report.crossval import coverage_table, cross_table
from hwid_cli.report.final_test import (
    chain_coverage_table,
    chain_on_tests_table,
    chain_tables,
    coverage_matrix_table,
    prediction_table,
    smallest_set_table,
)
from hwid_cli.report.fits import best_models_table
from hwid_cli.report.groups import chain_table, join_table, levels_table
from hwid_cli.report.page import section_notes
from hwid_cli.report.simulation_note import HUBER_NOTE, simulation_note
from hwid_cli.report.table import as_text
from tests.report.report_examples import fit, group_search, with_results
from tests.report.test_assignment import FINAL as ASSIGNED
from tests.report.test_crossval import CROSS, CROSSVAL, SCORES
from tests.report.test_final_test import FINAL, KINDS, TREND

RULES = ("zero", "steady", "estimated")
SEARCH = group_search(levels=2)


def started(rule):
    one = fit(("step_01",))
    return replace(one, options=replace(one.options, initial_state=rule))


VALIDATED = {
    "coverage": coverage_table(SCORES, CROSSVAL),
    "cross": cross_table(CROSS),
    "levels": levels_table(SEARCH),
    "joins": join_table(SEARCH, 2),
    "chain": chain_table(SEARCH),
    "on tests": chain_on_tests_table(FINAL, TREND),
    "kinds": chain_coverage_table(FINAL, TREND, {}),
    "on all": chain_tables(FINAL, TREND, KINDS)[0],
    "matrix": coverage_matrix_table(FINAL),
    "set": smallest_set_table(ASSIGNED),
    "told": prediction_table(ASSIGNED),
}


@pytest.mark.parametrize("rule", RULES)
def test_every_table_of_validations_says_how_models_start(rule):
    words = simulation_note(rule, is_validation=True)
    assert len(words) <= 80
    for name, table in VALIDATED.items():
        text = as_text([table], initial_state=rule)
        assert words in text.splitlines(), name
        for other in set(RULES) - {rule}:
            assert simulation_note(other, is_validation=True) not in text, name


def test_every_section_of_the_report_says_how_models_start(page, contents):
    _, *rest = page.html.split('<section id="')
    sections = {text.partition('"')[0]: text for text in rest}
    fitted, validated = (
        simulation_note("estimated", is_validation=one) for one in (False, True)
    )

    assert [name for name, text in sections.items() if validated in text] == [
        "test",
        "coverage",
        "assignment",
        "groups",
        "models",
        "crossval",
        "recordings",
        "residuals",
    ]
    assert [name for name, text in sections.items() if fitted in text] == ["orders"]
    # The answer's model starts by its own rule.
    rule = contents.answer.model.initial_state
    assert simulation_note(rule, is_validation=True) in sections["summary"]


@pytest.mark.parametrize("rule", RULES)
def test_the_table_of_the_best_models_says_how_their_fits_start(rule):
    text = as_text([best_models_table([(started(rule),)], "m", nk_is_delay=False)])

    assert simulation_note(rule, is_validation=False) in text.splitlines()


@pytest.mark.parametrize(
    ("join", "words"),
    [("concatenate", "start once"), ("experiments", "starts by itself")],
)
def test_the_chain_of_groups_says_how_joined_recordings_start(join, words):
    search = replace(SEARCH, join=join)

    assert words in chain_table(search).how[0]


def test_a_section_of_fits_that_bear_outliers_says_so(contents):
    robust = tuple(
        replace(one, options=replace(one.options, loss="huber"))
        for one in contents.stored.fits
    )
    stored = with_results(contents.stored, identify=robust)

    for found, is_said in ((contents, False), (replace(contents, stored=stored), True)):
        notes = [one.text for one in section_notes(found, is_validation=True)]
        assert (HUBER_NOTE in notes) == is_said
