"""Which model to take after a run, judged by the strictest recordings that there are.

The final test's recordings judge where it has run, else the validation recordings that no
group may hold, else all recordings but the model's own. The choice never looks at the
recordings of the final test.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.best_model import BestModel
from hwid_cli.records.experiment import CrossvalOptions, Experiment
from hwid_cli.records.groups import FinalTest, GroupSearch
from hwid_cli.records.model import Fit, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.ranking import best_fits, widest_model
from hwid_cli.stages.test import best_single

# From recordings and orders to their linear model.
FitLinear = Callable[[Sequence[Recording], Orders], Fit]


def best_model(experiment: Experiment, results: Mapping[str, Any]) -> BestModel | None:
    """Choose the model to take from what has run.

    Parameters
    ----------
    results : mapping of str to object
        Of the stages that have run, by their names.

    Returns
    -------
    BestModel or None
        None where no stage has given a usable model.
    """
    search: GroupSearch | None = results.get("group")
    final: FinalTest | None = results.get("test")
    winner = None if search is None or not search.chain else search.chain_groups[-1]
    if winner is not None and final is not None and winner.model_name in final.models:
        return _tested(winner.model_name, final)
    if final is not None and best_single(final) >= 0:
        return _tested(final.models[best_single(final)], final)
    if search is not None and winner is not None:
        return _of_group(search)
    if results.get("crossval") is not None:
        return _cross_validated(results["crossval"])
    if results.get("identify"):
        return _own(experiment, results["identify"], results["calibrate"].recordings)
    return None


def _tested(name: str, final: FinalTest) -> BestModel:
    """A model on the recordings of the final test, a single one beside a group."""
    is_tested = np.isin(final.recordings, final.tested_on)
    mean = np.mean(final.rmsd[:, is_tested], axis=1)
    found = BestModel(
        name,
        "test",
        final.tested_on,
        float(mean[final.models.index(name)]),
        final.unit,
        final.threshold,
    )
    single = best_single(final)
    if "+" not in name or single < 0:
        return found
    return replace(found, single=final.models[single], single_rmsd=float(mean[single]))


def _of_group(search: GroupSearch) -> BestModel:
    """The winner of a search on recordings that no group holds, else on all but its own."""
    winner = search.chain_groups[-1]
    row = search.rmsd[[one.name for one in search.groups].index(winner.name)]
    held = {name for one in search.groups for name in one.recordings}
    held |= {join.add_on for join in search.joins}
    unseen = [name not in held for name in search.validated_on]
    others = [name not in winner.recordings for name in search.validated_on]
    judge, is_judge = ("unseen", unseen) if any(unseen) else ("others", others)
    if not any(is_judge):
        judge, is_judge = "own", [True] * len(search.validated_on)
    names = np.array(search.validated_on)[is_judge]
    return BestModel(
        winner.model_name,
        judge,
        tuple(names.tolist()),
        float(np.mean(row[is_judge])),
        search.unit,
        search.threshold,
    )


def _cross_validated(crossval: CrossValidation) -> BestModel | None:
    """The widest model besides its own recording, on the recordings that say so."""
    place = widest_model(crossval, own_alone=True)
    if place is None:
        return None
    n, b, k = place
    own = crossval.identified_on[n]
    others = tuple(one for one in crossval.validated_on if one != own)
    judge, judges = ("others", others) if others else ("own", crossval.validated_on)
    rows = [crossval.validated_on.index(one) for one in judges]
    return BestModel(
        f"{own}/{crossval.nb[b]}/{crossval.nk[k]}",
        judge,
        judges,
        float(np.mean(crossval.rmsd[n, b, k, rows])),
        crossval.unit,
        crossval.threshold,
    )


def _own(
    experiment: Experiment, fits: Sequence[Fit], recordings: Sequence[Recording]
) -> BestModel | None:
    """The fit that comes closest to its own recording, in percent of what moves there."""
    best = [group[0] for group in best_fits(fits, 1) if group]
    if not best:
        return None
    chosen = max(best, key=lambda one: one.fit_percent)
    nb, nk = grid_place(chosen, experiment.orders.nk_role)
    return BestModel(
        f"{chosen.name}/{nb}/{nk}",
        "own",
        chosen.identified_on,
        chosen.rmsd,
        recordings[0].output_unit,
        (experiment.crossval or CrossvalOptions()).threshold,
        linear_rmsd=chosen.linear_rmsd,
    )


def beside_linear(
    best: BestModel,
    fits: Mapping[str, Fit],
    recordings: Sequence[Recording],
    fit_linear: FitLinear,
) -> BestModel:
    """Put the linear model of the same orders and recordings beside a model.

    Parameters
    ----------
    fits : mapping of str to Fit
        By the names of their models; that of ``best`` among them.
    recordings : sequence of Recording
        All of them.

    Returns
    -------
    BestModel
        Without a linear model where its own recording judges, or its fit fails.
    """
    if best.judge == "own" or best.name not in fits:
        return best
    own = fits[best.name]
    by_name = {one.name: one for one in recordings}
    found = fit_linear([by_name[name] for name in own.identified_on], own.orders)
    if found.model is None:
        return best
    deviations = [
        rmsd(by_name[name].output, validation_output(found.model, by_name[name]))
        for name in best.judged_on
    ]
    return replace(best, linear_rmsd=float(np.mean(deviations)))
