"""What a diagnosis says of its verdict in a few words."""

from dataclasses import replace

import pytest

from hwid_cli.records.diagnosis import FittedEffect
from hwid_cli.report.diagnosis import effect_sentences, verdict_sentence
from tests.report.diagnosis_examples import named


@pytest.mark.parametrize(
    ("verdict", "identifier", "says", "of"),
    [
        ("named", "coulomb_friction", "Verdict: named, coulomb_friction (complete)", 1),
        ("law", "law", "Verdict: law (complete)", 0),
    ],
)
def test_a_law_is_said_once(verdict, identifier, says, of):
    only = FittedEffect(identifier, "a formula", "F = c v^3", ())
    found = replace(named(), verdict=verdict, effects=(only,), complete=True)
    assert verdict_sentence(found) == says
    assert effect_sentences(found)[-1] == f"Law{f' of {identifier}' * of}: F = c v^3"
