"""Each of the five words, from made-up evidence."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.selection import decide
from hwid_cli.records.diagnosis import VERDICTS
from tests.diagnosis.judged_fits import JUDGE, base, made_up

COULOMB = made_up(("coulomb_friction",), 110.0, whiteness=0.6)
PAIR = made_up(
    ("coulomb_friction", "input_dead_zone"), 101.0, parameters=2, whiteness=0.5
)
DEAD_ZONE = made_up(("input_dead_zone",), 110.0, whiteness=0.6)
GIVEN = np.full(6, 400.0)


def test_nothing_is_missing_where_the_base_leaves_noise():
    found = base(100.0, whiteness=0.5)
    verdict = decide(JUDGE, np.full(6, 100.5), found, [], [])
    assert (verdict.word, verdict.is_complete) == ("none", True)
    assert verdict.chosen is found


def test_parameters_were_off_where_the_refit_gained_much():
    verdict = decide(JUDGE, GIVEN, base(100.0, whiteness=0.5), [], [])
    assert (verdict.word, verdict.is_complete) == ("parameters", True)


def test_a_simulation_that_ran_away_as_given_had_wrong_parameters():
    given = np.full(6, np.inf)
    verdict = decide(JUDGE, given, base(100.0, whiteness=0.5), [], [])
    assert verdict.word == "parameters"


@pytest.mark.parametrize(("given", "word"), [(104.0, "none"), (106.5, "parameters")])
def test_the_refit_must_gain_more_than_its_parameters_cost(given, word):
    # 600 ln(104 / 100) = 24 < 10 + 3 ln 600 = 29 < 600 ln(106.5 / 100) = 38
    found = base(100.0, whiteness=0.5)
    assert decide(JUDGE, np.full(6, given), found, [], []).word == word


def test_rounding_is_no_parameter():
    judge = replace(JUDGE, n_samples=np.full(6, 10**6))
    found = base(1e-20, whiteness=0.5)
    # A thousandth less, in six million samples without noise.
    assert decide(judge, np.full(6, 1.0009e-20), found, [], []).word == "none"


def test_an_effect_with_clear_evidence_is_named():
    verdict = decide(JUDGE, GIVEN, base(), [COULOMB], [COULOMB])
    assert (verdict.word, verdict.is_complete) == ("named", True)
    assert verdict.chosen is COULOMB
    assert verdict.rivals == ()


def test_a_named_effect_is_incomplete_while_something_remains():
    left = replace(COULOMB, whiteness=1.5)
    verdict = decide(JUDGE, GIVEN, base(), [left], [left])
    assert (verdict.word, verdict.is_complete) == ("named", False)


def test_the_largest_set_that_may_be_named_is():
    verdict = decide(JUDGE, GIVEN, base(), [COULOMB, PAIR], [COULOMB, PAIR])
    assert verdict.chosen is PAIR


def test_without_evidence_for_the_set_its_part_is_named():
    weak = replace(PAIR, sse=np.full(6, 220.0), whiteness=2.0)
    verdict = decide(JUDGE, GIVEN, base(), [COULOMB, weak], [COULOMB, weak])
    assert verdict.chosen is COULOMB


def test_two_that_are_as_good_are_ambiguous():
    verdict = decide(JUDGE, GIVEN, base(), [COULOMB, DEAD_ZONE], [COULOMB])
    assert verdict.word == "ambiguous"
    assert verdict.rivals == (DEAD_ZONE,)


def test_a_rival_that_may_not_be_named_does_not_count():
    # As good on the whole, but worse in two of three held-out recordings.
    weak = replace(DEAD_ZONE, sse=np.array([80, 80, 80, 20, 200, 200.0]))
    found = base(np.array([400, 400, 400, 900, 150, 150.0]))
    assert JUDGE.gain(COULOMB, weak) < 6
    verdict = decide(JUDGE, GIVEN, found, [COULOMB, weak], [COULOMB])
    assert verdict.word == "named"


def test_rivals_are_of_the_same_size():
    verdict = decide(JUDGE, GIVEN, base(), [PAIR, COULOMB, DEAD_ZONE], [COULOMB, PAIR])
    assert (verdict.word, verdict.rivals) == ("named", ())


def test_a_gap_without_evidence_is_unknown():
    weak = made_up(("coulomb_friction",), 350.0)
    found = base()
    verdict = decide(JUDGE, GIVEN, found, [weak], [weak])
    assert (verdict.word, verdict.is_complete) == ("unknown", False)
    assert verdict.chosen is found


def test_a_small_remainder_that_is_nearly_white_is_noise():
    found = base(103.0, whiteness=1.5)
    assert decide(JUDGE, np.full(6, 103.0), found, [], []).word == "none"
    coloured = replace(found, whiteness=2.5)
    assert decide(JUDGE, np.full(6, 103.0), coloured, [], []).word == "unknown"
    larger = base(115.0, whiteness=1.5)
    assert decide(JUDGE, np.full(6, 115.0), larger, [], []).word == "unknown"


def test_there_is_a_word_for_every_case_and_no_other():
    assert set(VERDICTS) == {"named", "ambiguous", "parameters", "unknown", "none"}
