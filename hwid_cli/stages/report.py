"""What a report's figures need and no stage has stored: simulated outputs and views.

Which stretch of a recording is worth a closer look.

RMSDs arranged as the report's figures show them.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.data.signal_features import find_period
from hwid_cli.model.scores import coverage, fit_percent, rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.answer import ModelAnswer
from hwid_cli.records.groups import FinalTest
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.report import (
    ChainOnTests,
    ModelOutput,
    OrderGrid,
    PredictionCounts,
    ReportContents,
    RmsdMatrix,
    SimulatedRecording,
    StoredResults,
)
from hwid_cli.records.results import CrossValidation, ModelScore
from hwid_cli.sources import checksum_of_folder
from hwid_cli.stages.answer import model_answer
from hwid_cli.stages.crossval import cross_matrix
from hwid_cli.stages.identify import Run
from hwid_cli.stages.model_views import model_views, named_fits
from hwid_cli.stages.order_grid import grid_place
from hwid_cli.stages.ranking import (
    best_fits,
    best_of_each,
    count_statuses,
    score_models,
)
from hwid_cli.stages.residuals import examined_residual
from hwid_cli.stages.table import needed, stage_named
from hwid_cli.stages.test import chain_trend
from hwid_cli.tasks.cache import MemoryStore, task_key
from hwid_cli.tasks.runner import RunSettings, TaskDone, run_tasks
from hwid_cli.tasks.task import Task

# The output has begun to move, and has moved most of its way, at these shares of its
# largest distance from where it started, [-].
_BEGUN, _ARRIVED = 0.05, 0.9
# Shown before the beginning and after the arrival, in lengths of the way between, [-].
_BEFORE, _AFTER = 0.25, 1.0
_PERIODS = 3.0
# A detail is shorter than the whole, and long enough to be a curve, [-], [samples].
_MOST_SHARE, _LEAST_SAMPLES = 0.5, 40
# The start's level is the median of so many samples, [samples].
_START = 5


def detail_window(
    input: np.ndarray,  # noqa: A002 - the field's word
    output: np.ndarray,
    *,
    is_periodic: bool,
) -> tuple[int, int]:
    """Choose the stretch of a recording in which its transient lies.

    Parameters
    ----------
    input, output : ndarray, shape (n_samples,), [any]
    is_periodic : bool
        Show the first three periods of the input instead, where it has periods.

    Returns
    -------
    first, end : int, [samples]
        From shortly before the output begins to move until it has settled for as long as
        it moved; at most half of the recording.

    Examples
    --------
    >>> ramp = np.clip(np.arange(1000.0) - 100, 0, 100)
    >>> detail_window(ramp, ramp, is_periodic=False)
    (85, 276)
    """
    distance = np.abs(output - np.median(output[:_START]))
    largest = float(np.max(distance))
    begun = int(np.argmax(distance > _BEGUN * largest))
    arrived = int(np.argmax(distance > _ARRIVED * largest))
    way = arrived - begun
    period = find_period(input) if is_periodic else None
    if period is None:
        first, end = begun - round(_BEFORE * way), arrived + round(_AFTER * way)
    else:
        first, end = begun, begun + round(_PERIODS * period)
    first = max(0, first)
    most = max(int(_MOST_SHARE * output.size), min(_LEAST_SAMPLES, output.size))
    end = first + min(max(end - first, _LEAST_SAMPLES), most)
    # Close to the end of the recording the stretch moves forward, it does not shrink.
    over = max(0, end - output.size)
    return first - over, end - over


def own_grid(stored: StoredResults) -> OrderGrid | None:
    """Arrange the RMSD of every model on its own recording by its orders.

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


def final_matrix(final: FinalTest, models: Sequence[str]) -> RmsdMatrix:
    """Put some of the final test's models and all recordings together.

    Parameters
    ----------
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
    """Follow the chain of groups on the recordings that nothing else has used."""
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


def report_key(stored: StoredResults) -> str:
    """Content key of a page: all that it shows comes from these."""
    # Seconds may be NaN, which no key can hold; as text they can.
    settings = {
        # A page is derived and no result: any change of any source may write it again. A
        # version that somebody has to raise would be forgotten.
        "program": checksum_of_folder(),
        "config": stored.config,
        "stages": [str(run) for run in stored.stages],
        "diagnosis": json.dumps(stored.diagnosis, sort_keys=True),
        "maps": str(stored.chosen_maps),
        "source": stored.source,
    }
    return task_key("report", 1, settings, ())


def changed_sections(
    stage: str, now: Mapping[str, Any], stored: Mapping[str, Any]
) -> tuple[str, ...]:
    """Name the sections of a configuration that a stage's results do not belong to.

    Parameters
    ----------
    now, stored : mapping
        Resolved configurations as plain data.

    Returns
    -------
    tuple of str
        Empty where the results are those of today's configuration.
    """
    # A configuration that names no groups now may have had some.
    before = (*needed(stage), stage)
    matter = [section for name in before for section in stage_named(name).sections]
    # Only what is in JSON can be compared with what was stored as JSON.
    today = json.loads(json.dumps(now))
    return tuple(
        name for name in matter if not _agrees(today.get(name), stored.get(name))
    )


def _agrees(now: Any, stored: Any) -> bool:
    """Whether settings are the same; keys that an older program did not know count so."""
    if isinstance(now, dict) and isinstance(stored, dict):
        return all(
            key in now and _agrees(now[key], value) for key, value in stored.items()
        )
    return bool(now == stored)


def report_contents(stored: StoredResults, run: Run | None = None) -> ReportContents:
    """Work out everything that a report shows.

    Parameters
    ----------
    run : callable or None
        Runs the fits of linear models; None runs them here and keeps none.
    """
    crossval, final = stored.crossval, stored.final_test
    is_fresh = crossval is None or _belongs(stored.fits, crossval)
    scores: tuple[ModelScore, ...] = ()
    widest: tuple[ModelScore, ...] = ()
    if crossval is not None and is_fresh:
        scores = tuple(score_models(stored.fits, crossval))
        widest = best_of_each(scores, crossval.identified_on)
    fresh = crossval if is_fresh else None
    answer = model_answer(stored, fresh, run or _run_here)
    simulated = _simulated(stored, fresh, answer)
    covered = {one.recording.name for one in simulated}
    kinds = {recording.name: recording.kind for recording in stored.recordings}
    return ReportContents(
        stored=stored,
        statuses=count_statuses(stored.fits),
        simulated=simulated,
        without_model=tuple(name for name in kinds if name not in covered),
        best=best_fits(stored.fits),
        grid=own_grid(stored),
        scores=scores,
        cross=cross_matrix(widest, crossval) if crossval and widest else None,
        models=model_views(stored, widest),
        trend=None if final is None else chain_on_tests(final),
        chain=None if final is None else chain_trend(final, kinds),
        chain_matrix=None if final is None else final_matrix(final, final.chain),
        full_matrix=None if final is None else final_matrix(final, final.models),
        predictions=None if final is None else _count_predictions(final),
        answer=answer,
        outdated=() if is_fresh else ("crossval",),
    )


def _run_here(tasks: Sequence[Task]) -> Sequence[TaskDone]:
    return run_tasks(tasks, RunSettings(MemoryStore()))


def _belongs(fits: Sequence[Fit], crossval: CrossValidation) -> bool:
    """Whether a tensor was made of these fits."""
    n_grid = len(crossval.nb) * len(crossval.nk)
    expected = [name for name in crossval.identified_on for _ in range(n_grid)]
    return [fit.name for fit in fits] == expected


def _simulated(
    stored: StoredResults,
    crossval: CrossValidation | None,
    answer: ModelAnswer | None,
) -> tuple[SimulatedRecording, ...]:
    named = named_fits(stored)
    own = {group[0].name: group[0] for group in best_fits(stored.fits, 1) if group}
    found = []
    for recording in stored.recordings:
        chosen = _choose(recording.name, own, stored, crossval)
        if chosen is None or chosen[0] not in named:
            continue
        name, choice = chosen
        if named[name].model is not None:
            one = _simulate(recording, named[name], name, choice)
            found.append(replace(one, others=_others(recording, name, answer)))
    return tuple(found)


def _choose(
    name: str,
    own: Mapping[str, Fit],
    stored: StoredResults,
    crossval: CrossValidation | None,
) -> tuple[str, str] | None:
    """Name of the model to show a recording with, and why."""
    if name in own:
        nb, nk = grid_place(own[name], stored.nk_role)
        return f"{name}/{nb}/{nk}", "own"
    final = stored.final_test
    if final is not None and name in final.recordings:
        return final.assigned[final.recordings.index(name)], "assigned"
    if crossval is not None and name in crossval.validated_on:
        values = crossval.rmsd[..., crossval.validated_on.index(name)]
        if np.isfinite(values).any():
            n, b, k = np.unravel_index(np.nanargmin(values), values.shape)
            who = crossval.identified_on[n]
            return f"{who}/{crossval.nb[b]}/{crossval.nk[k]}", "crossval"
    return None


def _simulate(
    recording: Recording, fit: Fit, name: str, choice: str
) -> SimulatedRecording:
    output = recording.output
    if fit.model is not None:
        output = validation_output(fit.model, recording)
    return SimulatedRecording(
        recording=recording,
        model=name,
        choice=choice,
        output=output,
        residual=recording.output - output,
        rmsd=rmsd(recording.output, output),
        fit_percent=fit_percent(recording.output, output),
        detail=detail_window(
            recording.input, recording.output, is_periodic=recording.kind == "sine"
        ),
        tests=examined_residual(recording, fit),
    )


def _others(
    recording: Recording, name: str, answer: ModelAnswer | None
) -> tuple[ModelOutput, ...]:
    """Outputs of the model to take and of the linear one beside it."""
    if answer is None:
        return ()
    found: list[tuple[str, bool, HammersteinWiener]] = []
    if answer.name != name:
        found.append((answer.name, False, answer.model))
    if answer.linear is not None:
        found.append((answer.linear_name, True, answer.linear))
    outputs = []
    for model, is_linear, one in found:
        output = validation_output(one, recording)
        scores = (rmsd(recording.output, output), fit_percent(recording.output, output))
        outputs.append(ModelOutput(model, is_linear, output, *scores))
    return tuple(outputs)


def _count_predictions(final: FinalTest) -> PredictionCounts:
    return PredictionCounts(
        right=sum(one.is_right for one in final.predictions),
        possible=sum(one.is_possible for one in final.predictions),
        total=len(final.predictions),
    )
