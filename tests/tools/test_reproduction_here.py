"""From the records of our stages to what the claims are judged on."""

from dataclasses import replace

import numpy as np

from tests.store.record_examples import example_fit, failed_fit
from tests.tools.reproduction_examples import crossval_of, final_of, search_of
from tools.reproduction_here import Results, evidence_of, matrix_of
from tools.reproduction_tables import iterations_of

GOOD, BAD = 0.001, 0.05
NAMES = ("a", "b", "c")


def test_nothing_run_is_no_evidence():
    evidence = evidence_of(Results())
    assert set(vars(evidence).values()) == {None}
    assert evidence.machine_counts is None


def test_a_recording_without_usable_models_has_an_infinite_lowest_rmsd():
    fits = (example_fit("a"), failed_fit("b", nb=2, nf=2))
    crossval = crossval_of([[GOOD, BAD], [np.nan, np.nan]], ("a", "b"))
    found = evidence_of(Results(fits=fits, crossval=crossval)).self_rmsd
    assert found.recordings == ("a", "b")
    assert found.lowest[0, 0] == fits[0].rmsd
    assert np.isinf(found.lowest[1]).all()


def test_the_widest_models_keep_their_own_cells_and_lose_their_nans():
    rmsd = [[GOOD, BAD, np.nan], [BAD, GOOD, GOOD], [BAD, BAD, GOOD]]
    fits = tuple(example_fit(name) for name in NAMES)
    evidence = evidence_of(Results(fits=fits, crossval=crossval_of(rmsd, NAMES)))
    assert evidence.singles.values == (1, 2, 1)
    assert np.array_equal(evidence.widest.is_own, np.eye(3, dtype=bool))
    assert np.isinf(evidence.widest.rmsd[0, 2])
    assert not evidence.widest.covered[0, 2]


def test_levels_take_the_best_group_of_each_level():
    search = search_of((3, 5, 5), tuple("abcdef"))
    evidence = evidence_of(Results(search_1=search))
    assert (evidence.levels.values, evidence.levels.of) == ((3, 5, 5), 6)
    assert evidence.growth_1.values == (3, 5, 5)


def small_final(**settings):
    models = ("a/1/1", "c/1/1", "b/2/2", "b+a/2/2")
    rmsd = [[GOOD, BAD, BAD], [BAD, BAD, GOOD], [BAD, GOOD, BAD], [GOOD, GOOD, np.nan]]
    return final_of(rmsd, models, NAMES, n_chain=2, tested_on=("c",), **settings)


def test_the_chain_is_the_last_models_and_the_tests_are_columns_of_it():
    evidence = evidence_of(Results(final_1=small_final()))
    assert evidence.chain_1.models == ("b", "b+a")
    assert evidence.chain_1.recordings == NAMES
    assert evidence.chain_tests.recordings == ("c",)
    assert np.isinf(evidence.chain_tests.rmsd[1, 0])
    assert evidence.machine is None


def test_the_machine_is_judged_with_all_models_of_the_second_run():
    evidence = evidence_of(Results(final_2=small_final(chosen=("c/1/1", "b+a/2/2"))))
    assert evidence.machine.models == ("a", "c", "b", "b+a")
    assert evidence.machine.singles == (0, 1, 2)
    assert evidence.chosen.models == ("c", "b+a")
    assert evidence.chosen.covered.any(axis=0).all()
    assert evidence.growth_2.values == (1, 2)


def test_a_chain_of_one_model_is_no_chain():
    final = final_of([[GOOD, BAD]], ("a/1/1",), ("a", "b"), n_chain=1, tested_on=("b",))
    evidence = evidence_of(Results(final_1=final, final_2=final))
    assert evidence.chain_1 is None
    assert evidence.growth_2 is None
    assert evidence.machine is not None


def test_own_cells_come_from_the_record():
    final = small_final()
    assert np.array_equal(matrix_of(final).is_own, final.is_own)


def test_iterations_count_groups_once_and_joins_all():
    search = search_of((3, 5, 4), tuple("abcdef"))
    kept = tuple(replace(group, is_kept=group.level == 2) for group in search.groups)
    search = replace(search, groups=kept)
    first, second = iterations_of(search)
    assert first.level == 2
    assert first.cells == {("a", "b"): 5, ("a", "c"): 4}
    assert first.by_coverage == {4: 1, 5: 1}
    assert (first.n_groups, first.n_kept, first.of) == (2, 2, 6)
    assert (second.level, second.n_kept) == (3, 0)
