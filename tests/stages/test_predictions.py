import numpy as np
import pytest

from hwid_cli.stages.coverage_matrix import ScoredModels
from hwid_cli.stages.predictions import predict_all

RECORDINGS = ("a", "b", "c", "t")
MODELS = ("a/1/1", "b/1/1", "c/1/1")
# Inputs in a row: t lies between a and b, nearer to b; c is far away.
PLACES = np.array([0.0, 0.4, 2.0, 0.3])
DISTANCES = np.abs(PLACES[:, np.newaxis] - PLACES)
IS_KNOWN = np.array([True, True, True, False])
RMSD = np.array(
    [
        [0.001, 0.006, 0.05, 0.004],
        [0.02, 0.001, 0.03, 0.005],
        [0.009, 0.04, 0.001, 0.06],
    ]
)
IS_OWN = np.eye(3, 4, dtype=bool)


def predict(rmsd=RMSD, is_own=IS_OWN, distances=DISTANCES, is_known=IS_KNOWN):
    judged = ScoredModels(MODELS[: len(rmsd)], RECORDINGS, rmsd, is_own, 0.01)
    told = predict_all(judged, distances, is_known)
    return {prediction.recording: prediction for prediction in told}


def test_a_new_recording_gets_the_model_that_serves_its_nearest_best():
    told = predict()["t"]

    assert (told.nearest, told.model) == ("b", "b/1/1")
    # Between the places 0.3 and 0.4; rounding only.
    assert told.distance == pytest.approx(0.1)
    assert (told.rmsd, told.is_right) == (0.005, True)
    assert (told.best_model, told.best_rmsd, told.is_possible) == (
        "a/1/1",
        0.004,
        True,
    )


def test_models_fitted_to_the_recording_itself_are_left_out():
    told = predict()["a"]

    # The nearest of a is b. The model of b serves b; the model of a would serve a.
    assert (told.nearest, told.model, told.is_right) == ("b", "b/1/1", False)
    # It would have been better to take the model of c, not that of a itself.
    assert (told.best_model, told.is_possible) == ("c/1/1", True)


def test_the_own_model_is_left_out_where_it_serves_the_nearest_best():
    rmsd = RMSD.copy()
    rmsd[0, 1] = 1e-5
    told = predict(rmsd)["a"]

    assert (told.nearest, told.model) == ("b", "b/1/1")


def test_a_test_recording_is_nobodys_nearest():
    # t is nearer to b than a is, and nearer to a than b is.
    told = predict()

    assert [told[name].nearest for name in RECORDINGS] == ["b", "a", "b", "b"]
    as_known = predict(is_known=np.ones(4, dtype=bool))
    assert [as_known[name].nearest for name in RECORDINGS] == ["t", "t", "b", "b"]


def test_a_wrong_choice_is_told_apart_from_an_impossible_one():
    told = predict(np.where(IS_OWN, RMSD, 0.02))

    assert not any(told[name].is_right for name in RECORDINGS)
    assert not any(told[name].is_possible for name in RECORDINGS)


def test_a_missing_rmsd_is_never_right():
    rmsd = RMSD.copy()
    rmsd[1, 3] = np.nan
    told = predict(rmsd)["t"]

    assert told.model == "b/1/1"
    assert np.isnan(told.rmsd)
    assert not told.is_right


def test_without_a_model_to_choose_from_the_names_are_empty():
    told = predict(RMSD[:1], IS_OWN[:1])["a"]

    assert (told.nearest, told.model, told.best_model) == ("b", "", "")
    assert np.isnan([told.rmsd, told.best_rmsd]).all()
    assert not told.is_right
    assert not told.is_possible


def test_without_another_recording_there_is_no_nearest():
    only_a = np.array([True, False, False, False])
    told = predict(is_known=only_a)["a"]

    assert (told.nearest, told.model) == ("", "")
    assert np.isnan(told.distance)
