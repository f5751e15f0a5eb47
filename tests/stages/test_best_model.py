"""The model to take, from tables whose answer is seen at a glance."""

from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.records.experiment import Experiment
from hwid_cli.records.groups import FinalTest
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.best_model import beside_linear, best_model

EXPERIMENT = Experiment(name="e", source="e.yaml")


def crossval(rmsd, identified_on=("a", "b"), validated_on=("a", "b", "c")):
    values = np.array(rmsd)[:, None, :, :]
    return CrossValidation(
        *(identified_on, (1,), tuple(range(1, values.shape[2] + 1)), "poles"),
        *(validated_on, values, np.full(values.shape, "ok"), "m", 1.0),
    )


def final(models, rmsd, is_own):
    n, m = len(models), 4
    return FinalTest(
        models=models,
        chain=models[-1:],
        recordings=("a", "b", "c", "d"),
        tested_on=("c", "d"),
        rmsd=np.array(rmsd),
        is_own=np.array(is_own, dtype=bool),
        covers=np.zeros(n, int),
        covered_by=np.zeros(m, int),
        uncovered=(),
        hard_to_cover=(),
        assigned=("",) * m,
        smallest_set=(),
        assigned_in_set=("",) * m,
        predictions=(),
        unit="m",
        threshold=1.0,
    )


def test_its_own_recording_does_not_choose_a_model():
    # a/1/1 is perfect at home and bad elsewhere; b/1/2 is below the threshold on all.
    found = best_model(
        EXPERIMENT,
        {
            "crossval": crossval(
                [[[0.0, 3.0, 3.0], [0.1, 3.0, 3.0]], [[2.0, 0.1, 0.2], [0.9, 0.8, 0.7]]]
            )
        },
    )

    assert (found.name, found.judge, found.judged_on) == ("b/1/2", "others", ("a", "c"))
    assert found.rmsd == pytest.approx(0.8)
    assert found.is_accepted


def test_a_model_without_an_rmsd_is_not_taken():
    found = best_model(
        EXPERIMENT,
        {"crossval": crossval([[[0, np.nan, 0.1]], [[0.9, 0.0, 0.9]]])},
    )
    assert found.name == "b/1/1"


def test_test_recordings_judge_and_do_not_choose():
    # b is better on the test recordings, and worse on the other it has not seen.
    models = ("a/1/1", "b/1/1")
    table = final(
        models, [[0, 0.5, 3, 5], [0.9, 0, 1, 1]], [[1, 0, 0, 0], [0, 1, 0, 0]]
    )
    found = best_model(EXPERIMENT, {"test": table})

    assert (found.name, found.judge) == ("a/1/1", "test")
    assert found.rmsd == pytest.approx(4.0)
    assert not found.is_accepted


def test_a_group_stands_beside_the_best_single_model():
    models = ("a/1/1", "a+b/1/1")
    table = final(
        models, [[0, 0.5, 3, 5], [0.1, 0.1, 1, 2]], [[1, 0, 0, 0], [1, 1, 0, 0]]
    )
    group = SimpleNamespace(model_name="a+b/1/1")
    search = SimpleNamespace(chain=("a+b",), chain_groups=(group,))
    found = best_model(EXPERIMENT, {"test": table, "group": search})

    assert (found.name, found.single) == ("a+b/1/1", "a/1/1")
    assert (found.rmsd, found.single_rmsd) == (1.5, 4.0)


def test_nothing_is_recommended_where_nothing_has_run():
    assert best_model(EXPERIMENT, {"calibrate": None}) is None


def test_the_linear_model_is_of_the_same_recordings_and_judged_on_the_same():
    u = np.sin(np.arange(50.0))
    recordings = [Recording(name, u, k * u, 0.1) for k, name in enumerate("abc", 1)]
    asked = []

    def fit_linear(chosen, orders):
        asked.append(([one.name for one in chosen], orders))
        return Fit(("a",), orders, FitOptions(), None, "failed", "no")

    found = best_model(EXPERIMENT, {"crossval": crossval([[[0.0, 0.5, 0.5]]], ("a",))})
    fits = {"a/1/1": Fit(("a",), Orders(1, 1, 1), FitOptions(), None, "failed", "")}
    after = beside_linear(found, fits, recordings, fit_linear)

    assert asked == [(["a"], Orders(1, 1, 1))]
    # A linear fit that fails is no reason to say nothing.
    assert after == found
