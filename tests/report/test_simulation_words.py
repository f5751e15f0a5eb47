"""Every printed fit says that it was simulated in free run, and from which state."""

from dataclasses import replace

import pytest

from hwid_cli.report.final_test_tables import (
    chain_coverage_table,
    chain_on_tests_table,
    chain_tables,
    coverage_matrix_table,
    prediction_table,
    smallest_set_table,
)
from hwid_cli.report.fit_tables import best_models_table
from hwid_cli.report.group_tables import chain_table, join_table, levels_table
from hwid_cli.report.page import Text
from hwid_cli.report.sections.final_test import (
    assignment_section,
    coverage_section,
    final_test_section,
)
from hwid_cli.report.sections.groups import groups_section
from hwid_cli.report.sections.models import models_section
from hwid_cli.report.sections.recordings import (
    crossval_section,
    orders_section,
    recordings_section,
)
from hwid_cli.report.sections.residuals import residuals_section
from hwid_cli.report.sections.summary import summary_section
from hwid_cli.report.simulation_words import HUBER_WORDS, simulation_words
from hwid_cli.report.tables import coverage_table, cross_table
from tests.report.report_examples import fit, group_search, with_results
from tests.report.test_assignment_tables import FINAL as ASSIGNED
from tests.report.test_final_test_tables import FINAL, KINDS, TREND
from tests.report.test_tables import CROSSVAL, SCORES

RULES = ("zero", "steady", "estimated")
SEARCH = group_search(levels=2)


def started(rule):
    one = fit(("step_01",))
    return replace(one, options=replace(one.options, initial_state=rule))


VALIDATED = {
    "coverage": lambda rule: coverage_table(SCORES, CROSSVAL, initial_state=rule),
    "cross": lambda rule: cross_table(SCORES, CROSSVAL, initial_state=rule),
    "levels": lambda rule: levels_table(SEARCH, initial_state=rule),
    "joins": lambda rule: join_table(SEARCH, 2, initial_state=rule),
    "chain": lambda rule: chain_table(SEARCH, initial_state=rule),
    "on tests": lambda rule: chain_on_tests_table(FINAL, TREND, initial_state=rule),
    "kinds": lambda rule: chain_coverage_table(FINAL, TREND, initial_state=rule),
    "on all": lambda rule: chain_tables(FINAL, TREND, KINDS, initial_state=rule),
    "matrix": lambda rule: coverage_matrix_table(FINAL, initial_state=rule),
    "set": lambda rule: smallest_set_table(ASSIGNED, initial_state=rule),
    "told": lambda rule: prediction_table(ASSIGNED, initial_state=rule),
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("table", VALIDATED)
def test_every_table_of_validations_says_how_models_start(table, rule):
    text = VALIDATED[table](rule)
    words = simulation_words(rule, is_validation=True)

    assert words in text.splitlines()
    assert len(words) <= 80
    for other in set(RULES) - {rule}:
        assert simulation_words(other, is_validation=True) not in text


@pytest.mark.parametrize(
    ("section", "is_validation"),
    [
        (summary_section, True),
        (recordings_section, True),
        (residuals_section, True),
        (orders_section, False),
        (crossval_section, True),
        (models_section, True),
        (groups_section, True),
        (final_test_section, True),
        (coverage_section, True),
        (assignment_section, True),
    ],
)
def test_every_section_of_the_report_says_how_models_start(
    contents, section, is_validation
):
    notes = [one.text for one in section(contents).blocks if isinstance(one, Text)]

    assert simulation_words("estimated", is_validation=is_validation) in notes


@pytest.mark.parametrize("rule", RULES)
def test_the_table_of_the_best_models_says_how_their_fits_start(rule):
    text = best_models_table([(started(rule),)], "m")

    assert simulation_words(rule, is_validation=False) in text.splitlines()


@pytest.mark.parametrize(
    ("join", "words"),
    [("concatenate", "start once"), ("experiments", "starts by itself")],
)
def test_the_chain_of_groups_says_how_joined_recordings_start(join, words):
    search = replace(SEARCH, join=join)

    assert words in chain_table(search, initial_state="estimated")


def test_a_section_of_fits_that_bear_outliers_says_so(contents):
    robust = tuple(
        replace(one, options=replace(one.options, loss="huber"))
        for one in contents.stored.fits
    )
    stored = with_results(contents.stored, identify=robust)

    for found, is_said in ((contents, False), (replace(contents, stored=stored), True)):
        notes = [
            one.text for one in crossval_section(found).blocks if isinstance(one, Text)
        ]
        assert (HUBER_WORDS in notes) == is_said
