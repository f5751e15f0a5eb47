"""How wide a band is, by errors whose law is known here."""

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from hwid_cli.records.trust import Inside, ModelTrust
from hwid_cli.trust.band import ErrorTerms, band_of
from hwid_cli.trust.judged import (
    Judgement,
    calibrated,
    independent_errors,
    left_out_bands,
    trust_row,
)
from hwid_cli.trust.visited import visited_by

N = 400
OUTPUT = np.sin(np.arange(N) / 20.0)


def judgement(errors, output=OUTPUT):
    seen, none = np.ones(N, dtype=bool), np.zeros(N)
    terms = ErrorTerms(output, none, none, none)
    return Judgement("r", errors, terms, Inside(seen, seen, seen), 1e-3)


def trust():
    visited = visited_by([OUTPUT], [OUTPUT])
    return ModelTrust(visited, np.zeros((0, 1)), 1e-3, 1.0, ())


def covered(draw, count, *, trials=400):
    """Mean coverage of a new recording whose errors are drawn as those that judge."""
    found = []
    for _ in range(trials):
        known = calibrated(trust(), [judgement(draw()) for _ in range(count)])
        new = judgement(draw())
        band = band_of(known, new.terms, new.where)
        is_held = (new.measured >= band.lower) & (new.measured <= band.upper)
        found.append(is_held.mean())
    return float(np.mean(found))


@pytest.mark.thorough
@pytest.mark.parametrize("count", [2, 8])
def test_recordings_with_one_error_each_count_as_one_error_each(count):
    rng = np.random.default_rng([1, count])

    share = covered(lambda: 0.1 * rng.standard_normal() * np.ones(N), count)

    # A new draw is larger than both of two in a third of all cases: the largest error
    # seen would hold 0.67. Four hundred trials: a standard error of 0.015; the number of
    # errors itself is estimated, from two of them badly.
    assert 0.84 < share < 0.96


@pytest.mark.thorough
@pytest.mark.parametrize("count", [2, 8])
def test_a_machine_whose_gain_changes_has_a_band_that_grows_with_the_output(count):
    rng = np.random.default_rng([2, count])

    share = covered(lambda: 0.1 * rng.standard_normal() * OUTPUT, count)
    known = calibrated(
        trust(), [judgement(0.1 * sign * OUTPUT) for sign in (1, -1, 1, -1)]
    )
    bands = [
        band_of(known, one.terms, one.where)
        for one in (judgement(0.0 * OUTPUT), judgement(0.0 * OUTPUT, 5.0 * OUTPUT))
    ]
    most = [float(np.max(one.upper - one.output)) for one in bands]

    # At four of five of these samples the error is below its largest.
    assert 0.84 < share < 0.99
    assert known.gain == pytest.approx(0.1)
    assert most[1] > 3.0 * most[0]


def test_white_errors_have_a_band_of_their_quantile():
    rng = np.random.default_rng(3)

    share = covered(lambda: 0.1 * rng.standard_normal(N), 2, trials=100)

    # 40 000 samples; the scale rests on about 500 errors.
    assert 0.88 < share < 0.92


def test_the_number_of_independent_errors_is_bartletts():
    rng, phi = np.random.default_rng(4), 0.9
    white = rng.standard_normal((40, 4000))
    walks = lfilter([1.0], [1.0, -phi], white, axis=1)

    found = [
        np.mean([independent_errors(one) for one in part]) for part in (white, walks)
    ]

    # n of white noise and n (1 - phi^2) / (1 + phi^2) of a first-order filter; a third of
    # it is found, because the sum is made for errors that go together all the time.
    expected = 4000 * (1 - phi**2) / (1 + phi**2)
    assert found[0] == pytest.approx(4000 / 3, rel=0.1)
    assert found[1] == pytest.approx(expected / 3, rel=0.1)


def test_nothing_that_judges_leaves_twice_the_noise():
    known = calibrated(trust(), [])

    assert (known.scale, known.scatter, known.judged_on) == (2.0, 0.0, ())


@pytest.mark.parametrize(("count", "freedom"), [(1, 2.0), (3, 6.0)])
def test_few_recordings_say_little_of_a_wrong_structure(count, freedom):
    rng = np.random.default_rng(5)
    found = [judgement(0.1 * rng.standard_normal(N)) for _ in range(count)]

    of_noise, of_structure = (
        calibrated(trust(), found, is_off=is_off).scale for is_off in (False, True)
    )

    # Two quantiles of Student's: of many errors, and of two for each recording.
    ratio = stats.t.ppf(0.95, freedom) / stats.norm.ppf(0.95)
    assert of_structure / of_noise == pytest.approx(ratio, rel=0.03)


def test_a_recording_does_not_judge_its_own_band():
    good, bad = judgement(0.01 * np.ones(N)), judgement(0.5 * np.ones(N))

    (_, of_good), (_, of_bad) = left_out_bands(trust(), [good, bad])

    # Told by the bad one a band is wide; told by the good one it does not hold the bad.
    assert np.mean(of_good.upper - of_good.lower) > 1.0
    assert not ((bad.measured >= of_bad.lower) & (bad.measured <= of_bad.upper)).any()


def test_a_model_that_diverges_on_one_recording_stops_nothing():
    away = OUTPUT.copy()
    away[200:] = np.inf
    lost = judgement(np.full(N, 1e9), away)
    good = judgement(0.01 * np.ones(N))

    (_, of_good), (_, of_lost) = left_out_bands(trust(), [good, lost])
    rows = [
        trust_row(("m", "r", "m"), one.measured, band)
        for one, band in ((good, of_good), (lost, of_lost))
    ]

    assert [one.coverage for one in rows] == [1.0, 0.0]
    assert not np.isfinite(rows[1].rmsd)
    assert trust_row(("m", "r", "m"), good.measured, of_good).width > 1e9
