import numpy as np
import pytest
from scipy import signal

from hwid_cli.records.experiment import CrossvalOptions, OrderOptions, OrdersOptions
from hwid_cli.records.model import Fit, FitOptions, Information, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.stages.identify import identify_all
from hwid_cli.stages.order import recommend_orders
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings
from hwid_cli.tasks.workers import Workers

LINEAR = FitOptions(input_map="none", output_map="none", initial_state="zero")


def recordings(count, numerator, poles):
    f = np.real(np.poly(poles))
    found = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-1, 1, 80), 10)
        y = signal.lfilter(numerator, f, u)
        y = y + 0.02 * np.std(y) * rng.standard_normal(u.size)
        found.append(Recording(f"r{seed}", u, y, 1e-3))
    return tuple(found)


def advice_on(chosen, grid, judges=None):
    settings = RunSettings(MemoryStore(), Workers(1))
    fits = identify_all(chosen, grid, LINEAR, settings)
    crossval = cross_validate(fits, judges or chosen, grid, CrossvalOptions(), settings)
    return recommend_orders(fits, crossval, chosen, grid, OrderOptions())


def test_true_orders_of_a_plant_are_recommended():
    pair = 0.85 * np.exp(np.array([0.3j, -0.3j]))
    chosen = recordings(4, [0.0, 0.2, 0.15], pair)
    advice = advice_on(chosen, OrdersOptions(nb=(1, 2, 3), nk=(1, 2, 3, 4)))

    one = advice.overall
    # Numerators of a smooth response are hardly told apart: one coefficient less may do.
    assert one.nk == 2
    assert one.nb <= 2
    assert (one.bic_nb, one.bic_nk) == (2, 2)
    # A hint: one recording of four shows more, of its noise.
    assert np.median([found.n_poles for found in advice.responses]) == 2
    assert {found.delay for found in advice.responses} == {1}
    assert one.evidence.n_validation == 4
    assert all(choice.evidence.n_validation == 3 for choice in advice.choices)
    assert one.evidence.factor <= 1.0 + advice.tolerance


def test_true_delay_is_recommended_where_the_grid_has_delays():
    chosen = recordings(3, [0.0, 0.0, 0.0, 0.3], [0.8])
    grid = OrdersOptions(nb=(1, 2), nk=(1, 2, 3, 4), nk_role="delay", nf=1)
    one = advice_on(chosen, grid).overall

    assert (one.nb, one.nk) == (1, 3)


def test_a_single_recording_judges_itself_and_says_so():
    chosen = recordings(1, [0.0, 0.3], [0.8])
    one = advice_on(chosen, OrdersOptions(nb=(1, 2), nk=(1, 2))).overall

    assert one.evidence.n_validation == 0
    assert (one.nb, one.nk) == (1, 1)
    assert np.isnan(one.evidence.standard_error)


def made_up(rmsd, bic=None):
    """Advice on a made-up tensor of shape (n, nb, nk, m)."""
    n, n_b, n_k, m = rmsd.shape
    nb, nk = tuple(range(1, n_b + 1)), tuple(range(1, n_k + 1))
    names = tuple(f"r{i}" for i in range(max(n, m)))
    status = np.where(np.isfinite(rmsd), "ok", "no model")
    crossval = CrossValidation(
        names[:n], nb, nk, "poles", names[:m], rmsd, status, "m", 0.01
    )
    fits = [
        Fit(
            (name,),
            Orders(b, k, 1),
            LINEAR,
            None,
            "failed",
            "",
            information=Information(bic=np.nan if bic is None else bic[b - 1, k - 1]),
        )
        for name in names[:n]
        for b in nb
        for k in nk
    ]
    same = np.array([0.0, 1.0])
    chosen = [Recording(name, same, same, 1.0) for name in names]
    grid = OrdersOptions(nb, nk)
    return recommend_orders(fits, crossval, chosen, grid, OrderOptions())


def test_smaller_orders_within_the_tolerance_are_taken():
    rmsd = np.full((2, 2, 2, 2), 1.0)
    rmsd[:, 0, 0], rmsd[:, 1, 1] = 1.015, 0.999
    one = made_up(rmsd).overall

    assert (one.nb, one.nk) == (1, 1)
    assert (one.best_nb, one.best_nk) == (2, 2)
    assert one.evidence.factor == pytest.approx(1.015 / 0.999)


def test_smaller_orders_beyond_the_tolerance_are_not():
    rmsd = np.full((2, 2, 2, 2), 1.0)
    rmsd[:, 0, 0] = 1.03

    assert sum([(one := made_up(rmsd).overall).nb, one.nk]) == 3


def test_where_validation_recordings_disagree_their_mean_decides():
    rmsd = np.full((4, 1, 2, 4), 1.0)
    # On average 1.5 % worse, but 20 % worse and 14 % better by turns.
    rmsd[:, 0, 0] = np.array([1.2, 0.859, 1.2, 0.859])
    one = made_up(rmsd).overall

    assert one.nk == 1
    assert one.evidence.standard_error > 5.0 * np.log(one.evidence.factor)
    # On average 7 % worse, within a standard error of 11 %.
    rmsd[:, 0, 0] = np.array([1.3, 0.88, 1.3, 0.88])
    assert made_up(rmsd).overall.nk == 2


def test_a_model_that_goes_astray_does_not_decide_alone():
    rmsd = np.full((5, 1, 2, 5), 1.0)
    rmsd[:, 0, 0] = 1.2
    rmsd[0, 0, 1, 1] = 1e9
    mean = made_up(rmsd).overall

    # Once ten times in twenty costs 12 %; 1e9 itself would cost a factor of 2.8.
    assert mean.best_nk == 2


def test_missing_models_count_as_bad_and_missing_criteria_are_left_out():
    rmsd = np.full((2, 1, 2, 2), 1.0)
    rmsd[:, 0, 0] = np.nan
    one = made_up(rmsd).overall

    assert (one.nb, one.nk) == (1, 2)
    assert (one.bic_nb, one.aic_nk) == (0, 0)


def test_bic_of_all_recordings_is_the_sum():
    one = made_up(np.ones((3, 2, 2, 3)), bic=np.array([[3.0, 1.0], [2.0, 5.0]])).overall

    assert (one.bic_nb, one.bic_nk) == (1, 2)


def test_without_any_model_there_is_no_advice():
    assert made_up(np.full((2, 1, 2, 2), np.nan)) is None
