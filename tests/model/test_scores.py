import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hwid_cli.model import scores

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


def published_cross_rmsd():
    """T3.2.2.2-3: RMSD of each step's best model on all steps, and printed coverage."""
    path = Path(__file__).parents[1] / "reference" / "cross_rmsd.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    values = [[float(row[str(n)]) for n in range(1, 16)] for row in rows]
    return np.array(values), np.array([int(row["printed_coverage"]) for row in rows])


def test_the_published_coverage_is_counted_from_the_published_rmsd():
    values, printed = published_cross_rmsd()

    # Printed to three decimals: a cell of 0.010 may lie on either side of the threshold.
    least = scores.coverage(values, 0.01)
    most = scores.coverage(values, np.nextafter(0.01, 1.0))
    assert (least <= printed).all()
    assert (printed <= most).all()
    # In these rows nothing is rounded to the threshold, so the count is exact.
    exact = least == most
    assert exact.sum() >= 8
    np.testing.assert_array_equal(least[exact], printed[exact])
