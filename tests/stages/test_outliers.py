from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.records.experiment import CrossvalOptions, OrderOptions, OrdersOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.stages.identify import identify_all
from hwid_cli.stages.map_choice import candidate_maps, fit_maps, recommend_maps
from hwid_cli.stages.order import recommend_orders
from hwid_cli.stages.outliers import cross_validate_without_outliers, without_outliers
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings
from hwid_cli.tasks.workers import Workers

N_OUTLIERS = 25
ROBUST = FitOptions(
    input_map="none", output_map="none", initial_state="zero", loss="huber"
)
GRID = OrdersOptions(nb=(1, 2), nk=(1, 2, 3))
SETTINGS = RunSettings(MemoryStore(), Workers(1))


def recordings(*, outliers, gain=lambda u: u):
    """Two poles behind a gain; outliers of thirty times the output's deviation."""
    pair = 0.8 * np.exp(np.array([0.5j, -0.5j]))
    found = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-1, 1, 100), 6)
        y = lfilter([0.0, 0.2, 0.15], np.real(np.poly(pair)), gain(u))
        size = np.std(y)
        y += 0.02 * size * rng.standard_normal(u.size)
        places = rng.choice(u.size, outliers, replace=False)
        y[places] += 30.0 * size * rng.choice([-1.0, 1.0], outliers)
        found.append(Recording(f"r{seed}", u, y, 1.0))
    return tuple(found)


@pytest.fixture(scope="module")
def robust():
    chosen = recordings(outliers=N_OUTLIERS)
    fits = identify_all(chosen, GRID, ROBUST, SETTINGS)
    crossval = cross_validate(fits, chosen, GRID, CrossvalOptions(), SETTINGS)
    judging, n_outliers = cross_validate_without_outliers(
        fits, crossval, chosen, GRID, SETTINGS
    )
    plain = recommend_orders(fits, crossval, chosen, GRID, OrderOptions())
    advice = recommend_orders(fits, judging, chosen, GRID, OrderOptions(), n_outliers)
    return fits, judging, n_outliers, plain, advice


@pytest.mark.thorough
def test_all_outliers_of_the_judges_are_found_and_replaced(robust):
    fits, judging, n_outliers, *_ = robust
    clean = recordings(outliers=0)
    truth = cross_validate(fits, clean, GRID, CrossvalOptions(), SETTINGS)

    assert n_outliers == (N_OUTLIERS,) * 4
    # In 4 % of the samples the model's own word stands, which has no noise.
    assert judging.rmsd == pytest.approx(truth.rmsd, rel=0.05)


def test_judges_without_their_outliers_choose_the_true_poles(robust):
    *_, plain, advice = robust

    assert plain.overall.nk < 2
    assert plain.overall.evidence.n_outliers == 0
    assert advice.overall.nk == 2
    assert advice.overall.evidence.n_outliers == 4 * N_OUTLIERS
    # What judges the models of one recording are the three others.
    assert {one.evidence.n_outliers for one in advice.choices} == {3 * N_OUTLIERS}


@pytest.mark.thorough
def test_an_outlier_among_the_first_samples_does_not_hide_in_the_initial_state():
    estimated = replace(ROBUST, initial_state="estimated")
    clean = recordings(outliers=0)
    bad = []
    for one in clean:
        y = one.output.copy()
        y[3] += 10.0 * np.std(y)
        bad.append(replace(one, output=y))
    fits = identify_all(bad, GRID, estimated, SETTINGS)
    crossval = cross_validate(fits, bad, GRID, CrossvalOptions(), SETTINGS)
    judging, n_outliers = cross_validate_without_outliers(
        fits, crossval, bad, GRID, SETTINGS
    )
    truth = cross_validate(fits, clean, GRID, CrossvalOptions(), SETTINGS)

    assert n_outliers == (1,) * 4
    assert judging.rmsd == pytest.approx(truth.rmsd, rel=0.02)


@pytest.mark.thorough
def test_maps_are_judged_without_outliers_too():
    chosen = recordings(outliers=N_OUTLIERS, gain=lambda u: u - np.clip(u, -0.1, 0.1))
    options = replace(ROBUST, input_map="piecewise_linear", units=6)
    candidates = candidate_maps(options, OrderOptions(maps=("none",)))
    fits = fit_maps(chosen, Orders(2, 2, 1), candidates, SETTINGS)
    advice = recommend_maps(fits, chosen, chosen, 0.05, SETTINGS)

    assert advice.evidence.n_outliers == 4 * N_OUTLIERS
    assert advice.chosen.input_map == "piecewise_linear"
    linear = next(one for one in advice.candidates if one.input_map == "none")
    assert linear.factor > 1.5


def test_recordings_that_no_model_can_simulate_have_no_outliers():
    chosen = recordings(outliers=N_OUTLIERS)[:1]
    nothing = np.full((1, 1), np.nan)
    rmsd, n_outliers = without_outliers(
        [None], nothing, chosen, lambda some: nothing if some == [*chosen] else None
    )

    assert np.isnan(rmsd).all()
    assert n_outliers == (0,)
