from dataclasses import replace

import numpy as np

from hwid_cli.records.model import Orders
from hwid_cli.records.results import CrossValidation, ModelScore
from hwid_cli.report.crossval import coverage_table, cross_table
from hwid_cli.report.table import as_text
from hwid_cli.stages.report import cross_matrix

NAMES = tuple(f"step_{n:02d}" for n in range(1, 16))
GENERATOR = np.random.default_rng(1)
CROSSVAL = CrossValidation(
    identified_on=NAMES,
    nb=(3, 10),
    nk=(7, 10),
    nk_role="poles",
    validated_on=NAMES,
    rmsd=GENERATOR.uniform(0.001, 0.1, (15, 2, 2, 15)),
    status=np.full((15, 2, 2, 15), "ok"),
    unit="m",
    threshold=0.01,
)
SCORES = tuple(
    ModelScore(name, 10, 10, 1.234e-4, 7, Orders(10, 10, 1)) for name in NAMES
)
CROSS = cross_matrix(SCORES, CROSSVAL)


def assert_fits_the_screen(text):
    assert max(map(len, text.splitlines())) <= 80


def coverage_text(scores, crossval, **how):
    return as_text([coverage_table(scores, crossval)], **how)


def cross_text(scores, crossval):
    table = cross_table(cross_matrix(scores, crossval))
    return as_text([table])


def test_the_thesis_is_named_on_request_only():
    text = coverage_text(SCORES, CROSSVAL)
    asked = coverage_text(SCORES, CROSSVAL, thesis_names=True)

    for word in ("(form of T3.2.2.2-2)", "thesis's name", "NLHW-Step-4-10-10-1"):
        assert word in asked
        assert word not in text


def test_no_dash_of_a_dimensionless_output_stands_behind_a_number():
    text = coverage_text(SCORES, replace(CROSSVAL, unit="-"))

    assert "RMSD below 0.01\n" in text


def test_the_delay_that_was_found_stands_in_the_name():
    found = [replace(SCORES[0], orders=Orders(10, 10, 3))]
    text = coverage_text(found, CROSSVAL, thesis_names=True)

    assert text.splitlines()[-1].endswith("-10-10-3")


def test_the_coverage_table_shows_the_first_models_only():
    text = coverage_text(2 * SCORES, CROSSVAL, thesis_names=True)

    rows = text.splitlines()[3:]
    assert len(rows) == 15
    assert rows[3].split() == [
        "step_04", "10", "10", "7", "of", "15", "1.23e-04", "NLHW-Step-4-10-10-1",
    ]  # fmt: skip
    assert_fits_the_screen(text)


def test_the_cross_table_holds_every_value_once_and_marks_what_is_covered():
    text = cross_text(SCORES, CROSSVAL)

    for row in CROSSVAL.rmsd[:, 1, 1]:
        for value in row:
            mark = "*" if value < 0.01 else " "
            assert f"{value:.2e}{mark}" in text + " "
    blocks = text.split("\n\n")
    assert len(blocks) == 3
    assert all(block.count("step_15/10/10") == 1 for block in blocks)
    assert_fits_the_screen(text)


def test_a_missing_rmsd_is_a_dash():
    crossval = CrossValidation(
        **{**CROSSVAL.__dict__, "rmsd": np.full((15, 2, 2, 15), np.nan)}
    )
    row = cross_text(SCORES[:1], crossval).splitlines()[-1].split()

    assert set(row[1:-1]) == {"-"}


def test_long_names_take_more_blocks_and_are_never_cut():
    names = tuple(f"idf_neg_0.045_{n}" for n in range(12))
    crossval = CrossValidation(
        identified_on=names,
        nb=(1,),
        nk=(1,),
        nk_role="poles",
        validated_on=names,
        rmsd=np.ones((12, 1, 1, 12)),
        status=np.full((12, 1, 1, 12), "ok"),
        unit="rad",
        threshold=0.1,
    )
    scores = [ModelScore(name, 1, 1, 1.0, 0, Orders(1, 1, 1)) for name in names]
    text = cross_text(scores, crossval)

    assert all(f" {name}" in text for name in names)
    assert_fits_the_screen(text)
