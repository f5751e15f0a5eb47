"""The tools of scikit-learn accept the estimator."""

import numpy as np
import pytest
from sklearn.base import clone, is_regressor
from sklearn.metrics import r2_score
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit, cross_val_score

from hwid_cli import HammersteinWienerRegressor


@pytest.fixture(scope="module")
def signals():
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(-1, 1, 40), 15)
    y = np.zeros(600)
    for k in range(1, 600):
        y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1]
    return u[:, np.newaxis], y + 1e-3 * rng.standard_normal(600)


LINEAR = {"input_map": "none", "output_map": "none"}


def test_it_is_cloned_with_its_parameters():
    one = HammersteinWienerRegressor(nb=3, units=4)
    other = clone(one)

    assert other is not one
    assert other.get_params() == one.get_params()
    assert is_regressor(one)
    assert other.set_params(nf=5).nf == 5
    with pytest.raises(ValueError, match="nn: unknown"):
        one.set_params(nn=1)


def test_its_score_is_that_of_scikit_learn(signals):
    found = HammersteinWienerRegressor(1, 1, 1, **LINEAR).fit(*signals)
    X, y = signals

    assert found.score(X, y) == pytest.approx(r2_score(y, found.predict(X)))
    # It starts in equilibrium; this plant does not.
    assert found.score(X, y) > 0.95


def test_it_is_cross_validated_and_searched(signals):
    splits = TimeSeriesSplit(3)
    one = HammersteinWienerRegressor(1, 1, 1, **LINEAR)
    assert np.all(cross_val_score(one, *signals, cv=splits) > 0.9)

    search = GridSearchCV(one, {"nk": [1, 9]}, cv=splits)
    assert search.fit(*signals).best_params_ == {"nk": 1}


def test_before_a_fit_nothing_is_predicted():
    with pytest.raises(ValueError, match="call fit first"):
        HammersteinWienerRegressor().predict(np.zeros(9))
    with pytest.raises(ValueError, match=r"one column, got an array of shape \(9, 2\)"):
        HammersteinWienerRegressor().fit(np.zeros((9, 2)), np.zeros(9))
