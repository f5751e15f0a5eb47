"""RMSDs arranged as the report's figures show them."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.campaign.order_grid import grid_place
from hwid_cli.maths.scores import coverage
from hwid_cli.records.groups import FinalTest
from hwid_cli.records.report import ChainOnTests, OrderGrid, RmsdMatrix, StoredResults
from hwid_cli.records.results import CrossValidation, ModelScore


def own_grid(stored: StoredResults) -> OrderGrid | None:
    """Arrange the RMSD of every model on its own recording by its orders.

    Parameters
    ----------
    stored : StoredResults

    Returns
    -------
    OrderGrid or None
        None without fits.
    """
    if not stored.fits:
        return None
    unit = stored.recordings[0].output_unit if stored.recordings else ""
    places = [grid_place(fit, stored.nk_role) for fit in stored.fits]
    names = tuple(dict.fromkeys(fit.name for fit in stored.fits))
    nb = tuple(sorted({place[0] for place in places}))
    nk = tuple(sorted({place[1] for place in places}))
    values = np.full((len(names), len(nb), len(nk)), np.nan)
    for fit, (one_nb, one_nk) in zip(stored.fits, places, strict=True):
        at = names.index(fit.name), nb.index(one_nb), nk.index(one_nk)
        values[at] = fit.rmsd
    return OrderGrid(names, nb, nk, stored.nk_role, values, unit)


def cross_matrix(best: Sequence[ModelScore], crossval: CrossValidation) -> RmsdMatrix:
    """Put the widest models' RMSDs on all judging recordings together.

    Parameters
    ----------
    best : sequence of ModelScore
        As ``ranking.best_of_each`` gives them.
    crossval : CrossValidation

    Returns
    -------
    RmsdMatrix
        Counts a model's own recording, as the tables of ``hwid crossval`` do.
    """
    rows = [
        crossval.rmsd[
            crossval.identified_on.index(score.identified_on),
            crossval.nb.index(score.nb),
            crossval.nk.index(score.nk),
        ]
        for score in best
    ]
    values = np.array(rows)
    return RmsdMatrix(
        models=tuple(f"{s.identified_on}/{s.nb}/{s.nk}" for s in best),
        recordings=crossval.validated_on,
        rmsd=values,
        is_own=np.array(
            [[s.identified_on == name for name in crossval.validated_on] for s in best]
        ),
        covers=np.array([score.coverage for score in best]),
        covered_by=coverage(values.T, crossval.threshold),
        unit=crossval.unit,
        threshold=crossval.threshold,
    )


def final_matrix(final: FinalTest, models: Sequence[str]) -> RmsdMatrix:
    """Put some of the final test's models and all recordings together.

    Parameters
    ----------
    final : FinalTest
    models : sequence of str
        Some of ``final.models``.

    Returns
    -------
    RmsdMatrix
        Leaves a model's own recordings out of the counts, as ``hwid test`` does.
    """
    rows = [final.models.index(name) for name in models]
    foreign = np.where(final.is_own[rows], np.nan, final.rmsd[rows])
    return RmsdMatrix(
        models=tuple(models),
        recordings=final.recordings,
        rmsd=final.rmsd[rows],
        is_own=final.is_own[rows],
        covers=final.covers[rows],
        covered_by=coverage(foreign.T, final.threshold),
        unit=final.unit,
        threshold=final.threshold,
    )


def chain_on_tests(final: FinalTest) -> ChainOnTests:
    """Follow the chain of groups on the recordings that nothing else has used.

    Parameters
    ----------
    final : FinalTest

    Returns
    -------
    ChainOnTests
    """
    rows = [final.models.index(name) for name in final.chain]
    columns = [final.recordings.index(name) for name in final.tested_on]
    values = final.rmsd[np.ix_(rows, columns)]
    return ChainOnTests(
        models=final.chain,
        recordings=final.tested_on,
        rmsd=values,
        mean=values.mean(axis=1),
        covers=coverage(values, final.threshold),
        unit=final.unit,
        threshold=final.threshold,
    )
