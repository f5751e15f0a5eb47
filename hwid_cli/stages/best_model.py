"""Which model to take after a run, judged by the strictest recordings that there are.

The final test's recordings judge where it has run, else the validation recordings that no
group may hold, else all recordings but the model's own. The choice never looks at the
recordings of the final test.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.model.scores import fit_percent, rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.best_model import BestModel
from hwid_cli.records.groups import FinalTest, GroupSearch
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.identify import Run
from hwid_cli.stages.linear_reference import Roles, linear_reference
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.ranking import best_fits, widest_model
from hwid_cli.stages.test import single_models, spoilt_join, taken_model
from hwid_cli.stages.together import own_maps


def best_model(
    results: Mapping[str, Any], *, nk_role: str, threshold: float = np.nan
) -> BestModel | None:
    """Choose the model to take from what has run.

    Parameters
    ----------
    results : mapping of str to object
        Of the stages that have run, by their names.
    nk_role : str
        What the second axis of the order grid means.
    threshold : float, [output unit]
        Of a model that nothing but its own recording judges; the other results have theirs.

    Returns
    -------
    BestModel or None
        None where no stage has given a usable model.
    """
    search: GroupSearch | None = results.get("group")
    final: FinalTest | None = results.get("test")
    crossval: CrossValidation | None = results.get("crossval")
    if final is not None:
        place = taken_model(final)
        if place >= 0:
            known = results.get("calibrate")
            return _tested(place, final, () if known is None else known.recordings)
    if search is not None and search.chain:
        return _of_group(search)
    if crossval is not None:
        return _cross_validated(crossval)
    if results.get("identify"):
        unit = results["calibrate"].recordings[0].output_unit
        return _own(results["identify"], nk_role, unit, threshold)
    return None


def _tested(place: int, final: FinalTest, recordings: Sequence[Recording]) -> BestModel:
    """A model on the recordings of the final test, a single one beside a group."""
    is_tested = np.isin(final.recordings, final.tested_on)
    mean = np.mean(final.rmsd[:, is_tested], axis=1)
    choosers = np.array(final.recordings)[~is_tested & ~final.is_own[place]]
    found = BestModel(
        final.models[place],
        "test",
        final.tested_on,
        float(mean[place]),
        final.unit,
        final.threshold,
        tuple(choosers.tolist()),
        held=held_by(final.models[place], final),
    )
    if "+" not in found.name:
        spoilt = spoilt_join(final, recordings) if recordings else None
        return replace(found, spoilt=spoilt)
    return replace(found, singles=single_models(final))


def held_by(model: str, final: FinalTest) -> tuple[tuple[str, float], ...]:
    """Test recordings, and the share of each that a model's band of 90 % holds, [-]."""
    return tuple(
        (one.recording, one.coverage) for one in final.trust.rows if one.model == model
    )


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
        search.validated_on,
    )


def _cross_validated(crossval: CrossValidation) -> BestModel | None:
    """The widest model besides its own recording, on the recordings that say so."""
    place = widest_model(crossval)
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
        others,
    )


def _own(
    fits: Sequence[Fit], nk_role: str, unit: str, threshold: float
) -> BestModel | None:
    """The fit that comes closest to its own recording, in percent of what moves there."""
    best = [group[0] for group in best_fits(fits, 1) if group]
    if not best:
        return None
    chosen = max(best, key=lambda one: one.fit_percent)
    nb, nk = grid_place(chosen, nk_role)
    return BestModel(
        f"{chosen.name}/{nb}/{nk}",
        "own",
        chosen.identified_on,
        chosen.rmsd,
        unit,
        threshold,
        linear_rmsd=chosen.linear_rmsd,
    )


def beside_linear(
    best: BestModel,
    fits: Mapping[str, Fit],
    recordings: Sequence[Recording],
    run: Run,
    *,
    nk_role: str,
) -> BestModel:
    """Put the fit on new recordings, and that of the best linear model, beside a model.

    Parameters
    ----------
    fits : mapping of str to Fit
        By the names of their models.
    recordings : sequence of Recording
        All of them.
    run : callable
        Runs the fits of linear models.
    nk_role : str
        What the second axis of the order grid means.

    Returns
    -------
    BestModel
        As it was where its own recording judges; without a linear model where there is
        none.
    """
    if best.judge == "own" or best.name not in fits:
        return best
    found = fits[best.name]
    by_name = {one.name: one for one in recordings}
    if not set(found.identified_on) <= set(by_name):
        return best
    judges = [by_name[name] for name in best.judged_on]
    _, percent = _scores(found.model, judges)
    is_estimated = found.options.initial_state == "estimated"
    beside = replace(
        best,
        fit_percent=percent,
        has_estimated_starts=is_estimated,
        own_maps=own_maps(found, fits.values()),
    )
    linear = linear_reference(
        found,
        fits.values(),
        recordings,
        Roles(best.chosen_on, best.judged_on),
        run,
        nk_role=nk_role,
    )
    if linear is None:
        return beside
    deviation, percent = _scores(linear.fit.model, judges)
    return replace(
        beside,
        linear_rmsd=deviation,
        linear_fit_percent=percent,
        linear_name=linear.name,
        linear_ratio=linear.ratio,
    )


def _scores(
    model: HammersteinWiener | None, judges: Sequence[Recording]
) -> tuple[float, float]:
    """Mean RMSD and median fit percent."""
    if model is None:
        return np.nan, np.nan
    outputs = [(one.output, validation_output(model, one)) for one in judges]
    percents = np.array([fit_percent(*one) for one in outputs])
    known = percents[np.isfinite(percents)]
    median = float(np.median(known)) if known.size else np.nan
    return float(np.mean([rmsd(*one) for one in outputs])), median
