from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.model import (
    Fit,
    FitOptions,
    HammersteinWiener,
    Information,
    Orders,
    StaticMap,
)
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.ranking import (
    best_fits,
    best_of_each,
    count_statuses,
    score_models,
)

NONE = StaticMap("none", np.zeros(0))
MODEL = HammersteinWiener(NONE, np.ones(1), np.array([1.0, -0.5]), 1, NONE, 1e-3)


def fit_of(name, nb, nk, rmsd, status="converged"):
    model = None if status == "failed" else MODEL
    return Fit((name,), Orders(nb, nk, 1), FitOptions(), model, status, "", rmsd=rmsd)


# Two recordings, nb 1 and 2, nk 1.
FITS = (
    fit_of("a", 1, 1, 0.3),
    fit_of("a", 2, 1, 0.2),
    fit_of("b", 1, 1, float("nan"), "failed"),
    fit_of("b", 2, 1, 0.1, "iteration_limit"),
)
RMSD = np.array([[[[0.3, 0.05]], [[0.2, 0.9]]], [[[np.nan, np.nan]], [[0.09, 0.099]]]])
CROSSVAL = CrossValidation(
    identified_on=("a", "b"),
    nb=(1, 2),
    nk=(1,),
    nk_role="poles",
    validated_on=("a", "b"),
    rmsd=RMSD,
    status=np.where(np.isnan(RMSD), "no model", "ok"),
    unit="m",
    threshold=0.1,
)


def test_the_best_fits_of_each_recording_come_first_and_failed_ones_never():
    best = best_fits(FITS, count=3)

    assert [[fit.rmsd for fit in group] for group in best] == [[0.2, 0.3], [0.1]]


@pytest.mark.parametrize(("loss", "first"), [("squared", 0.2), ("huber", 0.3)])
def test_fits_that_bear_outliers_are_ranked_without_them(loss, first):
    known = [
        replace(
            fit,
            options=FitOptions(loss=loss),
            information=Information(fpe=0.01 / fit.rmsd),
        )
        for fit in FITS[:2]
    ]

    assert best_fits(known, count=1)[0][0].rmsd == first


def test_statuses_are_counted():
    assert count_statuses(FITS) == {"converged": 2, "iteration_limit": 1, "failed": 1}


def test_models_are_ranked_by_coverage_then_by_their_own_rmsd():
    scores = score_models(FITS, CROSSVAL)

    assert [(s.identified_on, s.nb, s.nk, s.coverage) for s in scores] == [
        ("b", 2, 1, 2),
        ("a", 1, 1, 1),
        ("a", 2, 1, 0),
        ("b", 1, 1, 0),
    ]
    assert scores[1].rmsd == 0.3


def test_covered_means_strictly_below_the_threshold():
    at_threshold = np.where(np.isnan(RMSD), np.nan, 0.1)
    crossval = CrossValidation(
        **{**CROSSVAL.__dict__, "rmsd": at_threshold},
    )

    assert {score.coverage for score in score_models(FITS, crossval)} == {0}


def test_the_best_of_each_recording_is_its_widest_model():
    best = best_of_each(score_models(FITS, CROSSVAL), CROSSVAL.identified_on)

    assert [(score.identified_on, score.nb) for score in best] == [("a", 1), ("b", 2)]
