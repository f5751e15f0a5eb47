"""The model to take, from tables whose answer is seen at a glance."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from hwid_cli.model.fit import fit
from hwid_cli.records.groups import FinalTest, SingleModels
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.best_model import beside_linear
from hwid_cli.stages.best_model import best_model as choose
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, run_tasks


def best_model(results):
    return choose(results, nk_role="poles")


def crossval(rmsd, identified_on=("a", "b"), validated_on=("a", "b", "c")):
    values = np.array(rmsd)[:, None, :, :]
    return CrossValidation(
        *(identified_on, (1,), tuple(range(1, values.shape[2] + 1)), "poles"),
        *(validated_on, values, np.full(values.shape, "ok"), "m", 1.0),
    )


def final(models, rmsd, is_own, chain=()):
    n, m = len(models), 4
    return FinalTest(
        models=models,
        chain=chain,
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
        {"crossval": crossval([[[0, np.nan, 0.1]], [[0.9, 0.0, 0.9]]])},
    )
    assert found.name == "b/1/1"


def test_test_recordings_judge_and_do_not_choose():
    # b is better on the test recordings, and worse on the other it has not seen.
    models = ("a/1/1", "b/1/1")
    table = final(
        models, [[0, 0.5, 3, 5], [0.9, 0, 1, 1]], [[1, 0, 0, 0], [0, 1, 0, 0]]
    )
    found = best_model({"test": table})

    assert (found.name, found.judge) == ("a/1/1", "test")
    assert found.rmsd == pytest.approx(4.0)
    assert not found.is_accepted


def test_with_one_recording_for_the_fits_the_test_recordings_judge_its_best_model():
    # What the tests say of it stands first, however good it is on its own.
    table = final(
        ("a/1/1", "a/2/2"), [[0.5, 3, 5, 4], [0.1, 4, 6, 8]], [[1, 0, 0, 0]] * 2
    )
    table = replace(table, tested_on=("b", "c", "d"))
    found = best_model({"test": table})

    assert (found.name, found.judge) == ("a/2/2", "test")
    assert found.judged_on == ("b", "c", "d")
    assert found.rmsd == pytest.approx(6.0)
    assert not found.is_accepted


def test_a_group_stands_beside_the_best_single_model():
    models = ("a/1/1", "b/1/1", "a+b/1/1")
    table = final(
        models,
        # The second one covers less of what chooses and is nearer on the test.
        [[0, 0.5, 3, 5], [9, 0, 1, 1.5], [0.1, 0.1, 1, 2]],
        [[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0]],
        models[2:],
    )
    found = best_model({"test": table})

    assert (found.name, found.rmsd) == ("a+b/1/1", 1.5)
    assert found.singles == SingleModels("a/1/1", 4.0, "b/1/1", 1.25)


def test_nothing_is_recommended_where_nothing_has_run():
    assert best_model({"calibrate": None}) is None


def run_here(tasks):
    return run_tasks(tasks, RunSettings(MemoryStore()))


def saturated(name, largest):
    """A lag behind a saturation, by a loop of its own."""
    rng = np.random.default_rng(len(name) + int(10 * largest))
    current = np.repeat(largest * rng.uniform(-1, 1, 30), 12)
    state, output = 0.0, []
    for one in current:
        output.append(state)
        state = 0.8 * state + 0.2 * np.clip(one, -1.0, 1.0)
    return Recording(name, current, np.array(output), 1e-3)


def test_the_linear_model_is_of_the_same_recordings_and_judged_on_the_same():
    recordings = [saturated("a", 2.0), saturated("b", 3.0), saturated("c", 4.0)]
    options = FitOptions(
        input_map="saturation", output_map="none", initial_state="zero"
    )
    fits = {"a/1/1": fit(recordings[:1], Orders(1, 1, 1), options)}
    found = best_model({"crossval": crossval([[[0.0, 0.5, 0.5]]], ("a",))})
    after = beside_linear(found, fits, recordings, run_here, nk_role="poles")

    # y[k] = p y[k-1] + b u[k-1] by hand: the best p and b on a alone, judged on b and c.
    def simulated(p, b, u):
        y = np.zeros(u.size)
        for k in range(1, u.size):
            y[k] = p * y[k - 1] + b * u[k - 1]
        return y

    best = least_squares(
        lambda x: simulated(*x, recordings[0].input) - recordings[0].output, [0.5, 0.1]
    )
    by_hand = [
        np.sqrt(np.mean((simulated(*best.x, one.input) - one.output) ** 2))
        for one in recordings[1:]
    ]
    assert after.linear_rmsd == pytest.approx(np.mean(by_hand), rel=1e-3)
    # Beyond a the saturation goes on as a line, not as it is.
    assert after.fit_percent > 80.0
    # Of two recordings the median is the mean.
    shares = [
        100 * (1 - one / np.std(other.output))
        for one, other in zip(by_hand, recordings[1:], strict=True)
    ]
    assert after.linear_fit_percent == pytest.approx(np.mean(shares), rel=1e-2)
    assert after.is_usable


def test_a_linear_fit_that_fails_is_no_reason_to_say_nothing():
    recordings = [saturated("a", 2.0), saturated("b", 3.0), saturated("c", 4.0)]
    found = best_model({"crossval": crossval([[[0.0, 0.5, 0.5]]], ("a",))})
    linear = FitOptions(input_map="none", output_map="none")
    fits = {"a/1/1": fit(recordings[:1], Orders(1, 1, 1), linear)}
    gone = {"a/1/1": fit([saturated("z", 2.0)], Orders(1, 1, 1), FitOptions(units=3))}

    after = beside_linear(found, fits, recordings, run_here, nk_role="poles")
    assert after.has_estimated_starts
    same = {"fit_percent": np.nan, "has_estimated_starts": False}
    assert replace(after, **same) == replace(found, **same)
    assert 0.0 < after.fit_percent < 100.0
    assert beside_linear(found, gone, recordings, run_here, nk_role="poles") == found
    assert beside_linear(found, {}, recordings, run_here, nk_role="poles") == found
