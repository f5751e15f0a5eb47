"""The results of the three runs: read, and brought into the form of the published tables."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hwid_cli.model.scores import coverage
from hwid_cli.records.groups import FinalTest, GroupSearch
from hwid_cli.records.model import Fit
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.ranking import best_fits, best_of_each, score_models
from hwid_cli.store.final_test_results import read_final_test
from hwid_cli.store.group_results import read_group
from hwid_cli.store.result_files import Provenance, has_left_results, read_provenance
from hwid_cli.store.results import read_crossval, read_fits
from tools.reproduction_evidence import (
    N_BEST,
    Counts,
    Evidence,
    Matrix,
    SelfRmsd,
    own_cells,
)

STAGES = ("identify", "crossval", "group", "test")


@dataclass(frozen=True, eq=False)
class Results:
    """Records of the three runs; None or empty where a stage has not run.

    Parameters
    ----------
    fits : tuple of Fit
        Of the models of single recordings.
    crossval : CrossValidation or None
    search_1, search_2 : GroupSearch or None
        For Combination Models 1 and 2.
    final_1, final_2 : FinalTest or None
    """

    fits: tuple[Fit, ...] = ()
    crossval: CrossValidation | None = None
    search_1: GroupSearch | None = None
    search_2: GroupSearch | None = None
    final_1: FinalTest | None = None
    final_2: FinalTest | None = None


@dataclass(frozen=True)
class Run:
    """Where one of the three results files came from.

    Parameters
    ----------
    stages : dict of str to Provenance
        By stage, those that have run.
    """

    stages: dict[str, Provenance]


def read_runs(paths: Sequence[Path]) -> tuple[Run, ...]:
    """Read where results came from.

    Parameters
    ----------
    paths : sequence of Path
        Results files; may be missing.

    Returns
    -------
    tuple of Run

    Raises
    ------
    CacheError
        If a file cannot be read.
    """
    return tuple(
        Run(
            {
                stage: read_provenance(path, stage)
                for stage in STAGES
                if has(path, stage)
            }
        )
        for path in paths
    )


def read_results(paths: Sequence[Path]) -> Results:
    """Read the records of the three runs.

    Parameters
    ----------
    paths : sequence of Path, length 3
        Results files of single steps, Combination Model 1 and Combination Model 2.

    Returns
    -------
    Results

    Raises
    ------
    CacheError
        If a file cannot be read.
    """
    steps, one, two = paths
    return Results(
        fits=read_fits(steps) if has(steps, "identify") else (),
        crossval=read_crossval(steps) if has(steps, "crossval") else None,
        search_1=_group(one),
        search_2=_group(two),
        final_1=_final(one),
        final_2=_final(two),
    )


def has(path: Path, stage: str) -> bool:
    """Whether a results file holds a stage.

    Parameters
    ----------
    path : Path
    stage : str

    Returns
    -------
    bool
    """
    return has_left_results(path, stage)


def _group(path: Path) -> GroupSearch | None:
    return read_group(path) if has(path, "group") else None


def _final(path: Path) -> FinalTest | None:
    return read_final_test(path) if has(path, "test") else None


def evidence_of(results: Results) -> Evidence:
    """Bring the results of the three runs into the form of the published tables.

    Parameters
    ----------
    results : Results

    Returns
    -------
    Evidence
    """
    fits, crossval = results.fits, results.crossval
    one, two = results.final_1, results.final_2
    machine = None if two is None else matrix_of(two)
    return Evidence(
        self_rmsd=_self_rmsd(fits, crossval),
        singles=_singles(crossval),
        widest=_widest(fits, crossval),
        levels=_best_of_levels(results.search_1),
        chain_tests=None if one is None else _chain(one, one.tested_on),
        growth_1=growth_of(results.search_1),
        growth_2=None if two is None else _growth_on_all(two),
        chain_1=None if one is None else _chain(one, one.recordings),
        chain_2=None if two is None else _chain(two, two.recordings),
        machine=machine,
        chosen=None if machine is None or two is None else _chosen(two, machine),
    )


def matrix_of(final: FinalTest) -> Matrix:
    """All models of a final test on all its recordings.

    Parameters
    ----------
    final : FinalTest

    Returns
    -------
    Matrix
    """
    return Matrix(
        models=tuple(identified_on(model) for model in final.models),
        recordings=final.recordings,
        rmsd=np.where(np.isfinite(final.rmsd), final.rmsd, np.inf),
        covered=final.rmsd < final.threshold,
        is_own=final.is_own,
    )


def identified_on(model: str) -> str:
    """Recordings of a model, from its name.

    Parameters
    ----------
    model : str

    Returns
    -------
    str

    Examples
    --------
    >>> identified_on("step_06+step_09/3/7")
    'step_06+step_09'
    """
    return model.rsplit("/", 2)[0]


def growth_of(search: GroupSearch | None) -> Counts | None:
    """Coverage of the validation recordings along the chain of a search.

    Parameters
    ----------
    search : GroupSearch or None

    Returns
    -------
    Counts or None
    """
    if search is None or len(search.chain) < 2:
        return None
    values = tuple(group.coverage for group in search.chain_groups)
    return Counts(values, len(search.validated_on))


def _growth_on_all(final: FinalTest) -> Counts | None:
    chain = _chain(final, final.recordings)
    return None if chain is None else chain.counts


def _self_rmsd(
    fits: tuple[Fit, ...], crossval: CrossValidation | None
) -> SelfRmsd | None:
    if not fits or crossval is None:
        return None
    lowest = {}
    for name, best in zip(
        dict.fromkeys(fit.name for fit in fits), best_fits(fits, N_BEST), strict=True
    ):
        found = [fit.rmsd for fit in best]
        lowest[name] = [*found, *[np.inf] * (N_BEST - len(found))]
    return SelfRmsd(tuple(lowest), np.array(list(lowest.values())), crossval.threshold)


def _singles(crossval: CrossValidation | None) -> Counts | None:
    if crossval is None:
        return None
    counts = coverage(crossval.rmsd, crossval.threshold).reshape(-1)
    return Counts(tuple(int(count) for count in counts), len(crossval.validated_on))


def _widest(fits: tuple[Fit, ...], crossval: CrossValidation | None) -> Matrix | None:
    if not fits or crossval is None:
        return None
    best = best_of_each(score_models(fits, crossval), crossval.identified_on)
    rows = [
        crossval.rmsd[
            crossval.identified_on.index(score.identified_on),
            crossval.nb.index(score.nb),
            crossval.nk.index(score.nk),
        ]
        for score in best
    ]
    rmsd = np.array(rows).reshape(len(best), len(crossval.validated_on))
    names = tuple(score.identified_on for score in best)
    return Matrix(
        models=names,
        recordings=crossval.validated_on,
        rmsd=np.where(np.isfinite(rmsd), rmsd, np.inf),
        covered=rmsd < crossval.threshold,
        is_own=own_cells(names, crossval.validated_on),
    )


def _best_of_levels(search: GroupSearch | None) -> Counts | None:
    if search is None or not search.groups:
        return None
    best = tuple(
        max(group.coverage for group in search.groups if group.level == level)
        for level in search.levels
    )
    return Counts(best, len(search.validated_on))


def _chain(final: FinalTest, recordings: tuple[str, ...]) -> Matrix | None:
    """The chain's models; None where it has fewer than two or nothing judges them."""
    if len(final.chain) < 2 or not recordings:
        return None
    first = len(final.models) - len(final.chain)
    return matrix_of(final).part(tuple(range(first, len(final.models))), recordings)


def _chosen(final: FinalTest, machine: Matrix) -> Matrix | None:
    rows = tuple(final.models.index(model) for model in final.smallest_set)
    return machine.part(rows, machine.recordings) if rows else None
