"""Which model of the results to take, and how it does beside a linear one.

The choice never looks at the recordings of the final test: those say how good it is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.differences import differences_rms
from hwid_cli.model.input_range import SAME_LEVEL, outside_share
from hwid_cli.model.scores import fit_percent, rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.answer import ChosenMaps, ModelAnswer
from hwid_cli.records.experiment import OrderOptions
from hwid_cli.records.groups import FinalTest
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.order import OrderChoice
from hwid_cli.records.recordings import Recording
from hwid_cli.records.report import StoredResults
from hwid_cli.records.results import CrossValidation
from hwid_cli.stages.best_model import best_model, held_by
from hwid_cli.stages.identify import Run
from hwid_cli.stages.linear_reference import Roles, linear_reference
from hwid_cli.stages.model_views import named_fits
from hwid_cli.stages.order import recommend_overall
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.test import spoilt_join
from hwid_cli.stages.together import own_maps


def model_answer(
    stored: StoredResults, crossval: CrossValidation | None, run: Run
) -> ModelAnswer | None:
    """Choose a model, and simulate it and a linear one where it was not fitted.

    Parameters
    ----------
    crossval : CrossValidation or None
        Of the stored models; None where there is none.
    run : callable
        Runs the fits of linear models.

    Returns
    -------
    ModelAnswer or None
        None without any model.
    """
    fits = named_fits(stored)
    named = {name: one for name, one in fits.items() if one.model is not None}
    advice = _advice(stored, crossval)
    name, chosen_on = _chosen(stored, crossval, named)
    if not name or not stored.recordings:
        return None
    found = named[name]
    if found.model is None:
        return None
    final = stored.final_test
    unseen = _unseen(stored.recordings, found.identified_on, final)
    names = tuple(one.name for one in unseen)
    roles = Roles(chosen_on, names)
    beside = linear_reference(
        found, fits.values(), stored.recordings, roles, run, nk_role=stored.nk_role
    )
    deviation, percent = _scores(found.model, unseen)
    linear = beside.fit.model if beside else None
    linear_deviation, linear_percent = _scores(linear, unseen)
    visited = _visited(found, stored.recordings)
    answer = ModelAnswer(
        name=name,
        model=found.model,
        linear=linear,
        linear_name=beside.name if beside else "",
        linear_ratio=beside.ratio if beside else np.nan,
        own=found.identified_on,
        chosen_on=chosen_on,
        recordings=names,
        is_unused=final is not None and bool(final.tested_on),
        rmsd=deviation,
        linear_rmsd=linear_deviation,
        fit_percent=percent,
        linear_fit_percent=linear_percent,
        input_range=visited,
        beyond=np.array([_beyond(visited, one) for one in unseen]),
        unit=stored.recordings[0].output_unit,
        threshold=_threshold(crossval or final),
        advice=advice,
        place=grid_place(found, stored.nk_role),
        noise_rms=differences_rms([one.output for one in unseen], 0.0) or np.nan,
    )
    answer = _with_maps(answer, found, fits, _maps(stored, advice))
    at = _at(advice, found, named, stored.nk_role)
    return _with_test(_with_advised(answer, at, named.get(at), unseen), stored)


def _with_maps(
    answer: ModelAnswer, found: Fit, fits: Mapping[str, Fit], maps: ChosenMaps | None
) -> ModelAnswer:
    """The answer with the recommended maps beside those of its model."""
    own = own_maps(found, fits.values())
    has_them = bool(own) or _has_maps(found, maps)
    return replace(answer, maps=maps, has_these_maps=has_them, own_maps=own)


def _with_test(answer: ModelAnswer, stored: StoredResults) -> ModelAnswer:
    """The answer with what the final test says of its band, and of a joined model."""
    final = stored.final_test
    if final is None:
        return answer
    spoilt = spoilt_join(final, stored.recordings)
    return replace(answer, held=held_by(answer.name, final), spoilt=spoilt)


def _threshold(judged: CrossValidation | FinalTest | None) -> float:
    return np.nan if judged is None else judged.threshold


def _unseen(
    recordings: Sequence[Recording], own: Sequence[str], final: FinalTest | None
) -> list[Recording]:
    """Recordings that the fit has not used; those of the final test, where there are some."""
    tested = () if final is None else final.tested_on
    return [
        one
        for one in recordings
        if one.name not in own and (not tested or one.name in tested)
    ]


def _maps(stored: StoredResults, advice: OrderChoice | None) -> ChosenMaps | None:
    """What ``hwid order`` recommended, if it did so for the orders of today."""
    maps = stored.chosen_maps
    if advice is None or maps is None or (maps.nb, maps.nk) != _place(advice):
        return None
    return maps


def _has_maps(found: Fit, maps: ChosenMaps | None) -> bool:
    """Whether a fit has maps of these kinds and sizes, if any are recommended."""
    if maps is None:
        return True
    own = found.options.of_input, found.options.of_output
    wanted = (
        (maps.input_map, maps.input_units),
        (maps.output_map, maps.output_units),
    )
    return all(
        one.kind == kind and (one.units == units or not units)
        for one, (kind, units) in zip(own, wanted, strict=True)
    )


def _at(
    advice: OrderChoice | None,
    found: Fit,
    named: Mapping[str, Fit],
    nk_role: str,
) -> str:
    """Name of the model of the same recordings at the recommended orders, if there is one."""
    if advice is None:
        return ""
    for name, one in named.items():
        is_same = one.identified_on == found.identified_on
        if is_same and grid_place(one, nk_role) == _place(advice):
            return name
    return ""


def _with_advised(
    answer: ModelAnswer, name: str, fit: Fit | None, unseen: Sequence[Recording]
) -> ModelAnswer:
    """The answer with what the model of the recommended orders leaves there."""
    if fit is None or not unseen:
        return answer
    mean = float(np.mean(_scores(fit.model, unseen)[0]))
    return replace(answer, advised_name=name, advised_rmsd=mean)


def _place(advice: OrderChoice) -> tuple[int, int]:
    return advice.nb, advice.nk


def _advice(
    stored: StoredResults, crossval: CrossValidation | None
) -> OrderChoice | None:
    """Recommended orders; None where outliers count, which ``hwid order`` leaves out first."""
    if crossval is None:
        return None
    if any(one.options.loss != "squared" for one in stored.fits):
        return None
    options = stored.order or OrderOptions()
    return recommend_overall(stored.fits, crossval, stored.recordings, options)


def _chosen(
    stored: StoredResults,
    crossval: CrossValidation | None,
    named: Mapping[str, Fit],
) -> tuple[str, tuple[str, ...]]:
    """Name of the model to take, and the recordings that chose it."""
    results = {**stored.results, "crossval": crossval}
    for stage in ("test", "group", "crossval", "identify"):
        found = best_model(results, nk_role=stored.nk_role)
        if found is not None and found.name in named:
            return found.name, found.chosen_on
        # Its model is gone, as after other orders: the results before it choose.
        results.pop(stage, None)
    return "", ()


def _scores(
    model: HammersteinWiener | None, recordings: Sequence[Recording]
) -> tuple[np.ndarray, np.ndarray]:
    """RMSD and fit percent on each recording; NaN without a model."""
    if model is None:
        missing = np.full(len(recordings), np.nan)
        return missing, missing
    outputs = [validation_output(model, one) for one in recordings]
    both = [
        (rmsd(one.output, simulated), fit_percent(one.output, simulated))
        for one, simulated in zip(recordings, outputs, strict=True)
    ]
    values = np.array(both).reshape(-1, 2)
    return values[:, 0], values[:, 1]


def _visited(found: Fit, recordings: Sequence[Recording]) -> tuple[float, float]:
    """Lowest and highest input of the fit."""
    own = [one.input for one in recordings if one.name in found.identified_on]
    if not own and found.model is not None:
        return found.model.input_map.domain
    return min(float(one.min()) for one in own), max(float(one.max()) for one in own)


def _beyond(visited: tuple[float, float], recording: Recording) -> float:
    share, *_ = outside_share(recording.input, visited, same=SAME_LEVEL)
    return share
