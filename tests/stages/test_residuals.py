import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Recording
from hwid_cli.stages import residuals
from hwid_cli.stages.residuals import examined_residual, own_residuals
from hwid_cli.store.cache import Hdf5Store
from tests.store.record_examples import assert_same

NONE = StaticMap("none", np.zeros(0))
B, F = np.array([0.2, 0.15]), np.real(np.poly(0.8 * np.exp([0.5j, -0.5j])))
MODEL = HammersteinWiener(NONE, B, F, 1, NONE, 1.0, initial_state="estimated")
SEEDS = 30


def alarms(loss):
    """How often the residual of the true model is said to follow the input."""
    options = FitOptions("none", "none", loss=loss)
    fit = Fit(("another",), Orders(2, 2, 1), options, MODEL, "converged", "")
    count = 0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-1.0, 1.0, 120), 5)
        y = lfilter(np.r_[0.0, B], F, u)
        y += 0.01 * np.std(y) * rng.standard_normal(u.size)
        bad = rng.random(u.size) < 0.01
        y[bad] += rng.standard_normal(bad.sum())
        y[2] += 3.0
        tests = examined_residual(Recording("r", u, y, 1.0), fit)
        count += tests.follows_input or tests.follows_square or not tests.is_white
    return count


@pytest.mark.thorough
def test_outliers_of_a_true_model_are_no_missing_dynamics():
    # Three tests of 5 % each, of which some fail together.
    assert alarms("huber") <= 0.2 * SEEDS
    assert alarms("squared") > 0.4 * SEEDS


def test_what_was_tested_before_comes_from_the_store(tmp_path, monkeypatch):
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1.0, 1.0, 60), 5)
    y = lfilter(np.r_[0.0, B], F, u) + 0.01 * rng.standard_normal(u.size)
    recording = Recording("r", u, y, 1.0)
    options = FitOptions("none", "none")
    fit = Fit(("r",), Orders(2, 2, 1), options, MODEL, "converged", "", rmsd=0.01)
    store = Hdf5Store(tmp_path)
    (first,) = own_residuals((fit,), (recording,), "poles", store)

    def never(*_):
        raise AssertionError("tested again")

    monkeypatch.setattr(residuals, "examined_residual", never)
    (second,) = own_residuals((fit,), (recording,), "poles", store)
    assert_same(second.tests, first.tests)
    # Another sample is another recording.
    y = y.copy()
    y[7] += 1e-9
    with pytest.raises(AssertionError, match="tested again"):
        own_residuals((fit,), (Recording("r", u, y, 1.0),), "poles", store)
