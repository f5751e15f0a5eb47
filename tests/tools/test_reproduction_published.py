"""What the thesis's own tables say about its claims, under our definitions."""

import pytest

from tools.reproduction_claims import CLAIMS, definition, judge
from tools.reproduction_evidence import Evidence
from tools.reproduction_published import (
    TESTED_ON,
    group_name,
    published_assignment,
    published_evidence,
    published_iterations,
)
from tools.reproduction_verdicts import FAILS, HOLDS, IN_PART, NOT_JUDGED


@pytest.fixture(scope="module")
def published():
    return published_evidence()


def verdict(text, evidence):
    (claim,) = [claim for claim in CLAIMS if claim.text == text]
    return judge(claim, evidence)


def test_the_published_tables_do_not_support_every_claim(published):
    answers = {claim.text: judge(claim, published).answer for claim in CLAIMS}
    assert {text for text, answer in answers.items() if answer != HOLDS} == {
        "One step is like no other",
        "RMSD on the test steps falls along the chain",
        "Grouping widens coverage on the test steps",
        "Model 2: and saturates",
        "Model 2: uncovered recordings gain accuracy",
        "Hard recordings give narrow models",
        "Several models together describe the machine",
        "More recordings, more accuracy (Model 2)",
    }
    assert NOT_JUDGED not in answers.values()


def test_the_published_test_rmsd_falls_on_the_mean_but_not_on_every_step(published):
    found = verdict("RMSD on the test steps falls along the chain", published)
    assert found.answer == IN_PART
    assert found.numbers["monotone"] == 0
    assert "step 11 from 0.0054 to 0.0068" in found.why


def test_the_published_chain_covers_as_many_test_steps_at_its_end_as_at_its_start(
    published,
):
    found = verdict("Grouping widens coverage on the test steps", published)
    assert (found.answer, found.figure) == (FAILS, "1 0 1 1 of 3")


def test_the_published_levels_are_seven_and_three_times_eight(published):
    assert published.levels.values == (7, 8, 8, 8)
    assert published.levels.of == 12


def test_the_published_coverage_of_model_1_counts_otherwise_than_printed(published):
    assert published.growth_1.values == (6, 7, 8, 8)
    assert published.growth_1.recount == (6, 7, 7, 8)
    assert "6 7 7 8" in verdict("Model 1: and saturates", published).why


def test_rounded_cells_are_resolved_by_the_printed_coverage(published):
    # Row 4 prints 0.01 on step 3 and counts it; row 6 prints 0.01 on step 9 and does not.
    assert published.widest.covered[3, 2]
    assert not published.widest.covered[5, 8]
    assert published.widest.counts.values[3] == 2


def test_a_blank_own_cell_counts_as_covered_when_singles_and_groups_are_compared(
    published,
):
    # The widest single recordings cover 14 others.
    found = verdict("Groups cover more than single recordings", published)
    assert found.figure == "15 -> 22 of 38"


def test_the_shifted_part_of_the_sine_table_is_not_used(published):
    row = published.chain_1.models.index(group_name("6-9-1"))
    first = published.chain_1.recordings.index("sine_13")
    unknown = published.chain_1.rmsd != published.chain_1.rmsd
    assert unknown[row, first:].all()
    assert unknown.sum() == 11


def test_the_published_iterations_went_on_with_34_and_31_groups():
    found = published_iterations()
    assert [iteration.n_kept for iteration in found] == [34, 31, 0]
    assert [iteration.n_groups for iteration in found] == [77, 340, 279]
    assert found[0].cells["step_07", "step_09"] == 8
    used = {name for one in found for cell in one.cells for name in cell}
    assert not {part for name in used for part in name.split("+")} & set(TESTED_ON)


def test_every_recording_of_the_thesis_is_served_by_one_model():
    found = published_assignment()
    assert len(found) == 38
    assert len(set(found.values())) == 6


def test_every_claim_prints_a_definition_that_says_when_it_holds():
    assert [claim.text for claim in CLAIMS if "Holds:" not in definition(claim)] == []


def test_no_claim_is_judged_without_results():
    answers = {judge(claim, Evidence()).answer for claim in CLAIMS}
    assert answers == {NOT_JUDGED}
