"""Evidence for a candidate, against calculations by hand."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED,
    LEAST_EXPLAINED_SET,
    LEAST_GAIN,
    LEAST_IMPROVED,
    Judge,
    count,
    has_size,
    ranked,
)
from tests.diagnosis.judged_fits import HELD_OUT, JUDGE, base, made_up
from tests.diagnosis.small_drive import problem, recordings, white

GOOD = ("coulomb_friction",)
PAIR = ("coulomb_friction", "input_dead_zone")


def test_the_gain_is_that_of_the_information_criterion():
    found = made_up(GOOD, 150.0, parameters=2)
    # 600 ln(400 / 150) - 2 ln 600
    assert JUDGE.gain(found, base()) == pytest.approx(575.704, abs=1e-3)
    assert JUDGE.gain(base(), found) == pytest.approx(-575.704, abs=1e-3)


def test_own_parameters_count_once_for_each_recording():
    found = made_up(GOOD, 400.0, parameters=0, own=np.arange(6))
    assert count(found) == 9
    # 0 - 6 ln 600
    assert JUDGE.gain(found, base()) == pytest.approx(-38.382, abs=1e-3)


def test_residuals_that_go_together_count_as_fewer_samples():
    found = made_up(GOOD, 150.0, neighbour=0.5)
    # 600 / 3 samples: 200 ln(400 / 150) - ln 200
    assert JUDGE.gain(found, base(neighbour=0.8)) == pytest.approx(190.868, abs=1e-3)


def test_only_what_goes_together_in_both_counts():
    found = made_up(GOOD, 150.0)
    assert JUDGE.gain(found, base(neighbour=0.99)) == JUDGE.gain(found, base())


def test_residuals_that_all_go_together_still_count_as_some():
    found = made_up(GOOD, 150.0, neighbour=1.0)
    # Ten pieces of each recording: 60 ln(400 / 150) - ln 60
    assert JUDGE.gain(found, base(neighbour=1.0)) == pytest.approx(54.756, abs=1e-3)


def test_what_could_not_be_simulated_loses_against_everything():
    lost = made_up(GOOD, np.inf)
    assert JUDGE.gain(lost, base()) == -float("inf")
    assert JUDGE.gain(base(), lost) == float("inf")
    assert not JUDGE.may_be_named(lost, base())


def test_a_perfect_fit_has_a_finite_gain():
    assert np.isfinite(JUDGE.gain(made_up(GOOD, 0.0), base()))


def test_held_out_recordings_alone_are_the_evidence():
    found = made_up(GOOD, [1, 1, 1, 100, 250, 500])
    against = JUDGE.evidence(found, base())
    # 1200 before, 850 after, 300 of noise.
    assert against.explained == pytest.approx(350 / 900)
    assert against.improved == pytest.approx(2 / 3)


def test_nothing_is_explained_where_there_is_no_excess():
    assert JUDGE.evidence(made_up(GOOD, 80.0), base(90.0)).explained == 0.0


def test_rms_of_both_sides_and_ratio_to_the_noise():
    found = made_up(GOOD, [100, 200, 300, 400, 900, 1400])
    assert JUDGE.rms(found, held_out=False) == pytest.approx(np.sqrt(2.0))
    assert JUDGE.rms(found, held_out=True) == pytest.approx(3.0)
    assert JUDGE.ratio(found) == pytest.approx(3.0)


def test_without_noise_the_ratio_is_infinite():
    silent = replace(JUDGE, noise=white(0.0))
    assert silent.ratio(base()) == float("inf")


def test_a_single_recording_judges_itself():
    judge = Judge.of(problem(recordings()[:1]), white())
    np.testing.assert_array_equal(judge.is_held_out, [True])
    found = replace(base(), sse=np.array([4.0]))
    assert judge.rms(found, held_out=False) == judge.rms(found, held_out=True) == 0.1


def test_skipped_samples_do_not_count():
    of = problem(recordings()[:2])
    short = replace(of, signals=tuple(replace(one, skip=100) for one in of.signals))
    np.testing.assert_array_equal(Judge.of(short, white()).n_samples, [300, 300])


# Each of the next cases fails one rule and only that one.
def rules(found, against):
    evidence = JUDGE.evidence(found, against)
    least = LEAST_EXPLAINED if len(found.effects) == 1 else LEAST_EXPLAINED_SET
    return {
        "gain": evidence.gain >= LEAST_GAIN,
        "explained": evidence.explained >= least or JUDGE.is_complete(found),
        "improved": evidence.improved >= LEAST_IMPROVED,
        "size": has_size(found),
    }


def test_clear_evidence_suffices():
    found = made_up(GOOD, 110.0)
    assert all(rules(found, base()).values())
    assert JUDGE.may_be_named(found, base())


@pytest.mark.parametrize(
    ("rule", "found", "against"),
    [
        # 600 ln(102 / 100.5) - ln 600 = 2.5
        ("gain", made_up(GOOD, 100.5), base(102.0)),
        # 100 of 300 beyond the noise.
        ("explained", made_up(GOOD, 300.0), base()),
        # 180 of 300: enough for one effect, too little for two.
        ("explained", made_up(PAIR, 220.0), base()),
        # One of three held-out recordings, though most of the error goes.
        (
            "improved",
            made_up(GOOD, [100] * 4 + [500] * 2),
            base([400] * 3 + [1400, 400, 400]),
        ),
        # Factors that scatter by half a percent.
        (
            "size",
            made_up(GOOD, 110.0, own=[0.005, -0.005] * 3),
            base(),
        ),
    ],
)
def test_evidence_that_fails_one_rule_does_not_suffice(rule, found, against):
    assert [name for name, holds in rules(found, against).items() if not holds] == [
        rule
    ]
    assert not JUDGE.may_be_named(found, against)


def test_one_effect_may_explain_less_than_two_must():
    assert JUDGE.may_be_named(made_up(GOOD, 220.0), base())


def test_what_leaves_white_noise_need_not_explain_half():
    assert JUDGE.may_be_named(made_up(GOOD, 300.0, whiteness=0.9), base())


def test_factors_beyond_scatter_have_a_size():
    assert has_size(made_up(GOOD, 1.0, own=[0.05, -0.05] * 3))
    assert has_size(made_up(GOOD, 1.0))


def test_complete_is_what_leaves_white_noise():
    assert JUDGE.is_complete(made_up(GOOD, 100.0, whiteness=1.0))
    assert not JUDGE.is_complete(made_up(GOOD, 100.0, whiteness=1.001))
    assert not JUDGE.is_complete(made_up(GOOD, np.inf, whiteness=0.5))


def test_the_table_is_ordered_by_gain_with_the_lost_and_the_waiting_last():
    fits = [
        made_up(("a",), 300.0),
        made_up(("b",), np.inf),
        made_up(("c",), 150.0),
        replace(made_up(("d",), 350.0), has_converged=False),
    ]
    shares = {("a",): 0.2, ("b",): 0.1, ("e",): 0.01, ("f",): 0.02}
    rows = ranked(JUDGE, fits, base(), shares)

    assert [row.effects[0] for row in rows] == ["c", "a", "d", "b", "f", "e"]
    assert [row.is_fitted for row in rows] == [True] * 4 + [False] * 2
    assert rows[1].forecast_share == 0.2
    assert np.isnan(rows[0].forecast_share)
    assert rows[2].note == "stopped at the iteration limit"
    assert rows[3].note == "could not be simulated"
    assert np.isnan(rows[3].held_out_rms)
    assert "not fitted" in rows[4].note
    assert rows[0].held_out_rms == pytest.approx(np.sqrt(1.5))
    assert rows[0].improved_share == 1.0


def test_the_made_up_recordings_are_as_said():
    assert HELD_OUT.sum() == 3
