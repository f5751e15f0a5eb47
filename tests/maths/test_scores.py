import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hwid_cli.maths import scores

SIGNAL = arrays(float, 8, elements=st.floats(-1e6, 1e6))


def test_rmsd_is_the_norm_over_the_root_of_the_length():
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 50))
    expected = np.linalg.norm(a - b) / np.sqrt(50)
    # Both round a few times.
    assert scores.rmsd(a, b) == pytest.approx(expected, rel=1e-14)


@given(a=SIGNAL, b=SIGNAL)
def test_rmsd_is_symmetric_and_not_negative(a, b):
    assert scores.rmsd(a, b) == scores.rmsd(b, a) >= 0.0


def test_rmsd_of_a_diverging_model_stays_finite_while_its_output_does():
    assert scores.rmsd(np.zeros(4), np.full(4, 1e200)) == pytest.approx(1e200)


def test_rmsd_is_nan_where_the_simulation_is_not_finite():
    assert np.isnan(scores.rmsd(np.zeros(2), np.array([0.0, np.inf])))


def test_rmsd_refuses_shapes_that_differ():
    with pytest.raises(ValueError, match="shapes differ"):
        scores.rmsd(np.zeros(3), np.zeros(4))


def test_fit_percent_is_100_for_a_perfect_and_0_for_a_mean_model():
    y = np.array([1.0, 2.0, 4.0])
    assert scores.fit_percent(y, y) == 100.0
    assert scores.fit_percent(y, np.full(3, y.mean())) == pytest.approx(0.0)


def test_fit_percent_of_a_constant_output_does_not_exist():
    assert np.isnan(scores.fit_percent(np.ones(3), np.ones(3)))


def test_coverage_counts_strictly_below_the_threshold_and_skips_nan():
    deviations = np.array([[0.01, 0.0099, np.nan], [0.0, 0.001, 0.002]])
    np.testing.assert_array_equal(scores.coverage(deviations, 0.01), [1, 3])
