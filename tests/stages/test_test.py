from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model.simulate import simulate
from hwid_cli.records.experiment import CrossvalOptions, FinalTestOptions, OrdersOptions
from hwid_cli.records.groups import Group, GroupSearch
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.coverage_matrix import ScoredModels
from hwid_cli.stages.crossval import cross_validate
from hwid_cli.stages.test import (
    chain_trend,
    final_models,
    final_test_key,
    score_final_models,
    score_table,
    spoilt_join,
    taken_model,
)
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers
from tests.stages.final_test_examples import KINDS, TESTED_ON, example_final_test

NONE = StaticMap("none", np.zeros(0))
GRID = OrdersOptions(nb=(1,), nk=(1, 2))
THRESHOLD = 0.5


def fit_of(names, gain, nf=1):
    model = HammersteinWiener(
        NONE, np.array([gain]), np.array([1.0, *[0.0] * nf]), 1, NONE, 1e-3
    )
    orders = Orders(1, nf, 1)
    return Fit(names, orders, FitOptions(), model, "converged", "", rmsd=0.1 * gain)


def failed(names, nf=1):
    return Fit(names, Orders(1, nf, 1), FitOptions(), None, "failed", "no start")


def recording_of(name, gain, seed):
    u = np.random.default_rng(seed).standard_normal(200)
    return Recording(name, u, simulate(fit_of((name,), gain).model, u), 1e-3)


# Plants of gain 1, 2, 3; t was never used.
RECORDINGS = tuple(
    recording_of(name, gain, seed)
    for seed, (name, gain) in enumerate(zip("abct", (1.0, 2.0, 3.0, 2.1), strict=True))
)
# For each recording a model that is off and one that is exact, but for c.
FITS = (
    fit_of(("a",), 5.0, 1), fit_of(("a",), 1.0, 2),
    fit_of(("b",), 2.0, 1), fit_of(("b",), 5.0, 2),
    failed(("c",), 1), failed(("c",), 2),
)  # fmt: skip


def settings_of(store=None, jobs=1, on_done=None):
    return RunSettings(store or MemoryStore(), Workers(jobs), on_done=on_done)


def crossval_of(fits=FITS):
    options = CrossvalOptions(threshold=THRESHOLD)
    return cross_validate(fits, RECORDINGS[:3], GRID, options, settings_of())


def search_of(*groups):
    """A search whose chain are the given groups: recordings, nb, nk, fit."""
    found = tuple(
        Group(names, 1, nb, nk, 0.1, 0.1, 2, 2, 2, is_kept=True)
        for names, nb, nk, _ in groups
    )
    return GroupSearch(
        groups=found,
        joins=(),
        fits=tuple(fit for *_, fit in groups),
        validated_on=("a",),
        rmsd=np.zeros((len(found), 1)),
        chain=tuple(group.name for group in found),
        reason="",
        join="experiments",
        unit="m",
        threshold=THRESHOLD,
    )


PAIR = (("a", "c"), 1, 2, fit_of(("a", "c"), 3.0, 2))


def test_the_recording_that_starts_the_chain_is_judged_with_the_chains_model_only():
    search = search_of((("a",), 1, 1, FITS[0]), PAIR)
    models = final_models(FITS, crossval_of(), search)

    # The chain begins with another model of a than its widest: two would count twice.
    assert models.names == ("b/1/1", "a/1/1", "a+c/1/2")
    assert models.chain == ("a/1/1", "a+c/1/2")
    assert models.fits == (FITS[2], FITS[0], PAIR[-1])


def test_a_model_that_is_also_in_the_chain_is_listed_once_there():
    search = search_of((("a",), 1, 2, FITS[1]), PAIR)
    models = final_models(FITS, crossval_of(), search)

    assert models.names == ("b/1/1", "a/1/2", "a+c/1/2")
    assert models.chain == ("a/1/2", "a+c/1/2")


def test_without_a_search_there_is_no_chain():
    models = final_models(FITS, crossval_of(), None)

    assert models.names == ("a/1/2", "b/1/1")
    assert models.chain == ()


def test_a_level_without_a_model_is_left_out():
    search = search_of((("a",), 1, 2, FITS[1]), (("a", "b"), 0, 0, None))

    assert final_models(FITS, crossval_of(), search).chain == ("a/1/2",)


def judged(store=None, jobs=1, on_done=None, search=None):
    models = final_models(FITS, crossval_of(), search or search_of(PAIR))
    settings = settings_of(store, jobs, on_done)
    return score_final_models(models, RECORDINGS, ["t"], THRESHOLD, settings)


def test_every_model_is_judged_on_every_recording():
    final = judged()

    assert final.models == ("a/1/2", "b/1/1", "a+c/1/2")
    assert final.recordings == ("a", "b", "c", "t")
    gains = np.array([1.0, 2.0, 3.0])[:, np.newaxis]
    # The delay of one sample leaves the first output at zero.
    rms = [np.sqrt(np.sum(item.input[:-1] ** 2) / 200) for item in RECORDINGS]
    # Rounding of 200 samples of size 1.
    np.testing.assert_allclose(
        final.rmsd, np.abs(gains - [1.0, 2.0, 3.0, 2.1]) * rms, atol=1e-13
    )
    assert final.is_own.tolist() == [
        [True, False, False, False],
        [False, True, False, False],
        [True, False, True, False],
    ]


def test_counts_gaps_set_and_assignment_are_read_off():
    final = judged()

    assert final.covers.tolist() == [0, 1, 0]
    assert final.covered_by.tolist() == [0, 0, 0, 1]
    assert final.uncovered == ()
    assert final.hard_to_cover == ("a", "b", "c")
    assert final.assigned == ("a/1/2", "b/1/1", "a+c/1/2", "b/1/1")
    assert final.smallest_set == final.models
    assert final.assigned_in_set == final.assigned
    assert final.tested_on == ("t",)
    assert (final.unit, final.threshold) == ("m", THRESHOLD)
    assert [told.recording for told in final.predictions] == ["a", "b", "c", "t"]
    assert "t" not in {told.nearest for told in final.predictions}


# Starting two workers takes seconds, and cross-validation tests the same tasks.
@pytest.mark.slow
def test_the_number_of_workers_changes_no_number():
    np.testing.assert_array_equal(judged(jobs=1).rmsd, judged(jobs=2).rmsd)


def test_a_second_judgement_computes_nothing():
    store, items = MemoryStore(), []
    first = judged(store)
    second = judged(store, on_done=items.append)

    assert [item.from_cache for item in items] == [True] * 4
    np.testing.assert_array_equal(first.rmsd, second.rmsd)


def key_of(models=None, recordings=RECORDINGS, tested_on=("t",), threshold=THRESHOLD):
    models = models or final_models(FITS, crossval_of(), search_of(PAIR))
    options = FinalTestOptions(tested_on)
    return final_test_key(models, recordings, tested_on, threshold, options)


MODELS = final_models(FITS, crossval_of(), search_of(PAIR))


@pytest.mark.parametrize(
    "changes",
    [
        {"models": replace(MODELS, names=("x", *MODELS.names[1:]))},
        {"models": replace(MODELS, n_chain=2)},
        {"models": replace(MODELS, fits=(FITS[0], *MODELS.fits[1:]))},
        {
            "models": replace(
                MODELS,
                fits=(replace(FITS[1], identified_on=("b",)), *MODELS.fits[1:]),
            )
        },
        {"recordings": RECORDINGS[::-1]},
        {"recordings": (replace(RECORDINGS[0], name="x"), *RECORDINGS[1:])},
        {"recordings": (replace(RECORDINGS[0], input=np.ones(200)), *RECORDINGS[1:])},
        {"tested_on": ("c",)},
        {"threshold": 0.4},
    ],
)
def test_all_that_the_result_depends_on_alters_the_key(changes):
    assert key_of() == key_of(MODELS)
    assert key_of(**changes) != key_of()


def test_a_table_where_nothing_is_covered_gives_an_empty_set():
    rmsd = np.ones((2, 3))
    rmsd[:, 2] = np.nan
    final = score_table(
        ScoredModels(("a/1/1", "b/1/1"), ("a", "b", "c"), rmsd, rmsd < 0, 0.01),
        chain=(),
        tested_on=(),
        distances=np.zeros((3, 3)),
        unit="m",
    )

    assert final.smallest_set == ()
    assert final.assigned == ("a/1/1", "a/1/1", "")
    assert final.assigned_in_set == ("", "", "")
    assert final.uncovered == ("a", "b", "c")
    assert not any(told.is_right for told in final.predictions)


def test_the_trend_follows_the_chain_on_tests_and_kinds():
    final = example_final_test()
    trend = chain_trend(final, KINDS)

    assert trend.models == final.chain
    assert trend.kinds == ("step", "sine")
    columns = [final.recordings.index(name) for name in TESTED_ON]
    # Rounding of a mean of three.
    np.testing.assert_allclose(
        trend.tested_rmsd, final.rmsd[-4:, columns].mean(axis=1), rtol=1e-12
    )
    below = final.rmsd[-4:] < final.threshold
    assert trend.coverage[:, 0].tolist() == below[:, :15].sum(axis=1).tolist()
    assert trend.coverage[:, 1].tolist() == below[:, 15:].sum(axis=1).tolist()
    assert trend.total == tuple(below.sum(axis=1).tolist())


def test_the_best_single_model_is_chosen_without_the_test_and_its_own_recording():
    final = example_final_test()
    trend = chain_trend(final, KINDS)

    found = {}
    for model, row in zip(final.models, final.rmsd, strict=True):
        own = model.split("/")[0].split("+")
        others = [
            value
            for name, value in zip(final.recordings, row, strict=True)
            if name not in (*own, *final.tested_on)
        ]
        if len(own) == 1 and np.isfinite(others).all():
            covered = sum(value < 0.01 for value in others) / len(others)
            found[model] = (-covered, np.mean(np.log(others)))
    best = min(found, key=found.get)
    row = final.rmsd[final.models.index(best)]
    tested = [row[final.recordings.index(name)] for name in final.tested_on]
    assert trend.singles.chosen == best
    assert trend.singles.chosen_rmsd == pytest.approx(np.mean(tested), rel=1e-12)


def test_without_a_chain_the_trend_is_empty():
    trend = chain_trend(example_final_test(n_chain=0), KINDS)

    assert (trend.models, trend.tested_rmsd, trend.total) == ((), (), ())


def joined_and_singles(own_of_joined, unseen_of_single):
    """Four recordings, a single model of each, and a model of the first three."""
    singles = np.full((4, 5), 2.0)
    singles[0] = [0.1, *([unseen_of_single] * 3), 1.0]
    singles[1:, 0] = 2.0
    joined = [own_of_joined] * 4 + [1.5]
    names = ("a", "b", "c", "d", "e")
    is_own = np.zeros((5, 5), dtype=bool)
    is_own[:4, :4] = np.eye(4, dtype=bool)
    is_own[4, :4] = True
    models = ("a/1/1", "b/1/1", "c/1/1", "d/1/1", "a+b+c+d/1/1")
    return score_table(
        ScoredModels(models, names, np.vstack([singles, joined]), is_own, 0.5),
        chain=models[4:],
        tested_on=("e",),
        distances=np.ones((5, 5)),
        unit="m",
    )


def test_a_joined_model_that_its_own_recordings_refuse_is_not_taken():
    spoilt = joined_and_singles(own_of_joined=0.9, unseen_of_single=0.3)
    assert spoilt.models[taken_model(spoilt)] == "a/1/1"
    sound = joined_and_singles(own_of_joined=0.2, unseen_of_single=0.3)
    assert sound.models[taken_model(sound)] == "a+b+c+d/1/1"
    assert spoilt_join(sound, ()) is None


def test_only_its_own_recordings_refuse_a_joined_model():
    # d is none of its own: that a single model is nearer there says nothing of the join.
    table = joined_and_singles(own_of_joined=0.2, unseen_of_single=0.3)
    is_own, rmsd = table.is_own.copy(), table.rmsd.copy()
    is_own[4, 3] = False
    rmsd[4, 3] = 50.0
    found = replace(table, is_own=is_own, rmsd=rmsd)
    assert found.models[taken_model(found)] == "a+b+c+d/1/1"


def test_the_recording_that_nothing_predicts_and_that_predicts_nothing_is_named():
    rng = np.random.default_rng(3)
    recordings = [
        Recording(name, rng.normal(size=50), rng.normal(size=50), 1e-3)
        for name in ("a", "b", "c", "d", "e")
    ]
    table = joined_and_singles(own_of_joined=0.9, unseen_of_single=0.3)
    rmsd = table.rmsd.copy()
    # Nothing predicts c well, and its model nothing else; b and d know one another.
    rmsd[:4, 2] = [2.5, 2.5, 0.1, 2.5]
    rmsd[1, 3] = rmsd[3, 1] = 0.3
    found = spoilt_join(replace(table, rmsd=rmsd), recordings)
    assert (found.model, found.suspect) == ("a+b+c+d/1/1", "c")
    assert found.rmsd == pytest.approx(0.9)
    assert found.single_rmsd == pytest.approx((0.3 * 2.5 * 0.3) ** (1 / 3))
    # Where all are alike far from the others, none stands alone.
    alike = np.where(table.is_own, 0.1, 0.4)
    alike[4] = 0.9
    found = spoilt_join(replace(table, rmsd=alike), recordings)
    assert found is not None
    assert found.suspect == ""
