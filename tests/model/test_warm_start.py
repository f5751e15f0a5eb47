from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Recording

ORDERS = Orders(2, 2, 1)
OPTIONS = FitOptions(units=4, join="experiments", initial_state="zero")


def plant():
    return HammersteinWiener(
        StaticMap("piecewise_linear", np.array([-4.0, -1, 1, 4, -2, -1, 1, 2])),
        np.array([0.05, 0.03]),
        np.array([1.0, -1.6, 0.68]),
        1,
        StaticMap("piecewise_linear", np.array([-3.0, -1, 1, 3, -1.6, -1, 1, 1.6])),
        1e-3,
    )


def recording_of(name, size, seed):
    rng = np.random.default_rng(seed)
    u = size * np.repeat(rng.uniform(-1, 1, 40), 15)
    y = simulate(plant(), u)
    return Recording(name, u, y + 1e-3 * rng.standard_normal(y.size), 1e-3)


SMALL, LARGE = recording_of("small", 0.8, 1), recording_of("large", 4.0, 2)


@pytest.fixture(scope="module")
def members():
    return [fit([one], ORDERS, OPTIONS).model for one in (SMALL, LARGE)]


def test_a_warm_fit_reaches_the_noise_that_a_search_from_nothing_reaches(members):
    cold = fit([SMALL, LARGE], ORDERS, OPTIONS)
    warm = fit([SMALL, LARGE], ORDERS, OPTIONS, starts=members)

    # The noise is 1e-3; both are within a tenth of it, 1200 samples give 2 %.
    assert cold.rmsd < 1.1e-3
    assert warm.rmsd < 1.1e-3


def test_the_model_of_a_small_recording_grows_to_the_range_of_a_large_one(members):
    warm = fit([SMALL, LARGE], ORDERS, OPTIONS, starts=members[:1])

    # Alone, the small one's maps say nothing about the bends at 1.
    low, high = warm.model.input_map.domain
    assert high - low > 6.0
    assert warm.rmsd < 2e-3


def test_the_best_of_several_starts_is_taken_whatever_their_order(members):
    one = fit([SMALL, LARGE], ORDERS, OPTIONS, starts=members)
    other = fit([SMALL, LARGE], ORDERS, OPTIONS, starts=members[::-1])

    assert one.rmsd == other.rmsd


def test_a_warm_fit_has_no_linear_rmsd(members):
    assert np.isnan(fit([SMALL, LARGE], ORDERS, OPTIONS, starts=members).linear_rmsd)


def test_an_unstable_start_leads_to_a_search_from_nothing(members):
    wild = replace(members[0], denominator=np.array([1.0, -5.0, 6.0]))
    warm = fit([SMALL, LARGE], ORDERS, OPTIONS, starts=[wild])
    cold = fit([SMALL, LARGE], ORDERS, OPTIONS)

    assert warm.rmsd == cold.rmsd


def test_estimated_initial_states_of_all_recordings_are_fitted(members):
    options = replace(OPTIONS, initial_state="estimated")
    shifted = replace(LARGE, input=LARGE.input[50:], output=LARGE.output[50:])
    warm = fit([SMALL, shifted], ORDERS, options, starts=members)

    assert warm.rmsd < 1.2e-3


def test_concatenated_recordings_start_warm_too(members):
    options = replace(OPTIONS, join="concatenate")
    warm = fit([SMALL, LARGE], ORDERS, options, starts=members)
    cold = fit([SMALL, LARGE], ORDERS, options)

    # Where the records meet, the data jump as no model does; that RMSD is of both fits.
    assert warm.rmsd < 1.02 * cold.rmsd


@pytest.mark.parametrize(
    ("orders", "options"),
    [
        (Orders(1, 2, 1), OPTIONS),
        (Orders(2, 2, 2), OPTIONS),
        (ORDERS, replace(OPTIONS, output_map="none")),
    ],
)
def test_a_start_of_another_kind_is_refused(members, orders, options):
    with pytest.raises(ValueError, match="a start must have the orders"):
        fit([SMALL, LARGE], orders, options, starts=members)
