"""Swapped columns, and inputs that a controller makes, are told; others are not."""

from dataclasses import replace

import pytest

from hwid_cli.stages.swapped_signals import swapped_sentence
from tests.diagnosis.small_drive import recordings


def swapped(one):
    return replace(one, input=one.output, output=one.input)


@pytest.fixture(scope="module")
def measured():
    return recordings({"coulomb_friction": {"force_N": 0.8}}, n=800)


def test_an_output_that_answers_to_its_input_is_no_matter(measured):
    assert swapped_sentence(measured, "a.yaml") == ""


def test_swapped_columns_are_told_with_their_number(measured):
    text = swapped_sentence([swapped(one) for one in measured], "a.yaml")
    assert text.startswith(
        "a.yaml: recordings.columns: the input answers to the output"
    )
    assert "of 9 recordings" in text


def test_few_swapped_ones_among_many_are_no_swapped_columns(measured):
    assert swapped_sentence([swapped(measured[0]), *measured[1:]], "a.yaml") == ""
