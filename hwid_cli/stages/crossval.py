"""Stage ``crossval``: the RMSD of every model on every recording.

One task simulates all models of one recording on one recording, one after the other, and
keeps the RMSDs only: simulated signals are never held for more than one model.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hwid_cli.files.csv_tables import write_coverage_csv, write_crossval_csv
from hwid_cli.model.extrapolation import outlined_model
from hwid_cli.model.scores import coverage, rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import CrossvalOptions, Experiment, OrdersOptions
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.report import RmsdMatrix
from hwid_cli.records.results import CrossValidation, ModelScore
from hwid_cli.records.trust import TrustOnTests
from hwid_cli.records.units import behind
from hwid_cli.report.crossval import coverage_table, cross_table
from hwid_cli.report.table import Block
from hwid_cli.stages.fit_seconds import (
    PAIR_BYTES,
    SECONDS_PER_SIMULATED_SAMPLE,
    TASK_SECONDS,
    counted,
)
from hwid_cli.stages.identify import recordings_with_models, stored_fits
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.stages.ranking import best_of_each, score_models
from hwid_cli.stages.selection import select_recordings
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.stages.trust import TRUST_VERSION, validation_bands_task
from hwid_cli.store.final_test_results import write_trust_csv
from hwid_cli.store.result_files import Provenance
from hwid_cli.store.results import read_crossval, write_crossval
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.runner import RunSettings, Task, run_tasks

NAME = "crossval"
STAGE_VERSION = 4

# Widest models whose bands are told.
_BANDS = 3
# Why an RMSD is there or missing.
OK, NO_MODEL, NOT_FINITE = "ok", "no model", "not finite"


@dataclass(frozen=True, eq=False)
class Deviations:
    """RMSD of several models on one recording.

    Parameters
    ----------
    rmsd : ndarray, shape (n_models,), [output unit]
        NaN where there is none.
    status : ndarray of str, shape (n_models,)
        ``OK``, ``NO_MODEL`` or ``NOT_FINITE``.
    """

    rmsd: np.ndarray
    status: np.ndarray


def cross_validate(
    fits: Sequence[Fit],
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: CrossvalOptions,
    settings: RunSettings,
) -> CrossValidation:
    """Validate every model on every recording.

    Parameters
    ----------
    fits : sequence of Fit
        As ``identify_all`` gives them: recording by recording, orders within.
    recordings : sequence of Recording
        Those that validate.
    """
    tasks = crossval_tasks(fits, recordings, orders)
    done = run_tasks(tasks, settings)
    n_grid = len(orders.nb) * len(orders.nk)
    names = tuple(fit.name for fit in fits[::n_grid])
    # Tasks run over (identified_on, validated_on), each with all of the grid.
    shape = (len(names), len(recordings), len(orders.nb), len(orders.nk))
    deviations = np.array([item.result.rmsd for item in done]).reshape(shape)
    status = np.array([item.result.status for item in done]).reshape(shape)
    return CrossValidation(
        identified_on=names,
        nb=orders.nb,
        nk=orders.nk,
        nk_role=orders.nk_role,
        validated_on=tuple(recording.name for recording in recordings),
        rmsd=np.moveaxis(deviations, 1, -1).copy(),
        status=np.moveaxis(status, 1, -1).copy(),
        unit=recordings[0].output_unit,
        threshold=options.threshold,
    )


def crossval_tasks(
    fits: Sequence[Fit], recordings: Sequence[Recording], orders: OrdersOptions
) -> tuple[Task, ...]:
    """List the tasks: for each recording's models, one for each validation recording.

    Parameters
    ----------
    fits : sequence of Fit
        Recording by recording, orders within.
    """
    contents = [recording_key(recording) for recording in recordings]
    tasks: list[Task] = []
    for name, models in _models_of_each(fits, orders):
        tasks += deviation_tasks(models, recordings, contents, name)
    return tuple(tasks)


def _models_of_each(
    fits: Sequence[Fit], orders: OrdersOptions
) -> Iterator[tuple[str, list[HammersteinWiener | None]]]:
    """Name of each recording with the models of all of its orders."""
    n_grid = len(orders.nb) * len(orders.nk)
    for first in range(0, len(fits), n_grid):
        yield fits[first].name, [fit.model for fit in fits[first : first + n_grid]]


def deviation_tasks(
    models: Sequence[HammersteinWiener | None],
    recordings: Sequence[Recording],
    contents: Sequence[str],
    name: str,
) -> tuple[Task, ...]:
    """List the tasks that give the RMSD of several models on each recording.

    Parameters
    ----------
    models : sequence of HammersteinWiener or None
        All scored in one task; None stands for a failed fit.
    recordings : sequence of Recording
        One task for each.
    contents : sequence of str
        ``recording_key`` of each recording.
    name : str
        Of the models, for people.

    Returns
    -------
    tuple of Task
        Each gives ``Deviations``.
    """
    keys = deviation_keys(models, contents)
    # Once for all recordings: the outputs are the same to the last bit.
    models = tuple(None if one is None else outlined_model(one) for one in models)
    return tuple(
        Task(
            key=key,
            name=f"{name} on {recording.name}",
            function=_deviations,
            arguments=(models, recording),
            result_type=Deviations,
        )
        for recording, key in zip(recordings, keys, strict=True)
    )


def deviation_keys(
    models: Sequence[HammersteinWiener | None], contents: Sequence[str]
) -> list[str]:
    """Keys of the tasks that ``deviation_tasks`` lists, without the tasks.

    Parameters
    ----------
    contents : sequence of str
        ``recording_key`` of each recording.
    """
    model_keys = [None if model is None else model_key(model) for model in models]
    return [
        task_key(NAME, STAGE_VERSION, {"models": model_keys, "recording": content}, [])
        for content in contents
    ]


def crossval_key(
    fits: Sequence[Fit],
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: CrossvalOptions,
) -> str:
    """Content key of the whole stage: its RMSDs and the names on their axes."""
    contents = [recording_key(recording) for recording in recordings]
    settings = {
        "rmsds": [
            key
            for _, models in _models_of_each(fits, orders)
            for key in deviation_keys(models, contents)
        ],
        "identified_on": [fit.name for fit in fits],
        "validated_on": [recording.name for recording in recordings],
        "orders": orders,
        "options": options,
    }
    return task_key(NAME, STAGE_VERSION, settings, [])


def _deviations(
    models: Sequence[HammersteinWiener | None], recording: Recording
) -> Deviations:
    """RMSD of each model; a simulated signal lives only until it is scored."""
    values = np.full(len(models), np.nan)
    for number, model in enumerate(models):
        if model is not None:
            values[number] = rmsd(recording.output, validation_output(model, recording))
    status = [
        NO_MODEL if model is None else OK if np.isfinite(value) else NOT_FINITE
        for model, value in zip(models, values, strict=True)
    ]
    return Deviations(values, np.array(status))


def cross_matrix(best: Sequence[ModelScore], crossval: CrossValidation) -> RmsdMatrix:
    """Put the widest models' RMSDs on all judging recordings together.

    Parameters
    ----------
    best : sequence of ModelScore
        As ``ranking.best_of_each`` gives them.

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


@dataclass(frozen=True, eq=False)
class _Given:
    """Models, and the recordings that validate them."""

    fits: tuple[Fit, ...]
    recordings: tuple[Recording, ...]
    orders: OrdersOptions
    options: CrossvalOptions
    identified: tuple[Recording, ...]

    @property
    def key(self) -> str:
        """Content key of the RMSDs and of the bands."""
        rmsds = crossval_key(self.fits, self.recordings, self.orders, self.options)
        own = [recording_key(one) for one in self.identified]
        settings = {"rmsds": rmsds, "own": own, "bands": TRUST_VERSION}
        return task_key(NAME, STAGE_VERSION, settings, [])


def _choose(context: Context) -> _Given:
    experiment, recordings = context.experiment, context.results["calibrate"].recordings
    fits = context.results["identify"]
    names = {fit.name for fit in fits}
    return _Given(
        fits,
        _validation(recordings, experiment),
        experiment.orders,
        experiment.crossval or CrossvalOptions(),
        tuple(one for one in recordings if one.name in names),
    )


def _validation(
    recordings: Sequence[Recording], experiment: Experiment
) -> tuple[Recording, ...]:
    options = experiment.crossval or CrossvalOptions()
    return select_recordings(
        recordings,
        options.recordings,
        key=f"{experiment.source}: crossval.recordings",
        held_out=() if experiment.test is None else experiment.test.recordings,
    )


def _compute(given: _Given, runner: Runner) -> CrossValidation:
    n_grid = len(given.orders.nb) * len(given.orders.nk)
    total = len(given.fits) // n_grid * len(given.recordings)
    with runner.tasks(total, "pairs") as settings:
        found = cross_validate(
            given.fits, given.recordings, given.orders, given.options, settings
        )
    tasks = _band_tasks(given, found)
    with runner.tasks(len(tasks), "bands") as settings:
        done = run_tasks(tasks, settings)
    rows = [row for item in done for row in item.result.rows]
    return replace(found, bands=TrustOnTests(tuple(rows)))


def _band_tasks(given: _Given, found: CrossValidation) -> list[Task]:
    """List the tasks: bands of the widest models, each of another recording."""
    own = {one.name: one for one in given.identified}
    best: dict[str, ModelScore] = {}
    for score in score_models(given.fits, found):
        best.setdefault(score.identified_on, score)
    fits = {(fit.name, fit.orders): fit for fit in given.fits}
    return [
        validation_bands_task(
            f"{one.identified_on}/{one.nb}/{one.nk}",
            fits[one.identified_on, one.orders],
            own[one.identified_on],
            given.recordings,
        )
        for one in list(best.values())[:_BANDS]
        if one.identified_on in own
    ]


def _summary(_: _Given, result: CrossValidation, is_stored: bool) -> str:
    pairs = len(result.identified_on) * len(result.validated_on)
    return f"{pairs} pairs from the cache, 0 computed" if is_stored else ""


def _write_csv(
    out: Path, given: _Given, result: CrossValidation, _: Provenance | None, __: bool
) -> None:
    scores = score_models(given.fits, result)
    write_crossval_csv(out / "crossval.csv", result)
    write_coverage_csv(out / "coverage.csv", scores, len(result.validated_on))
    write_trust_csv(out / "crossval_trust.csv", result.bands.rows)


def _tables(context: Context, result: CrossValidation) -> list[Block]:
    """The models that cover the most recordings."""
    scores = score_models(context.results["identify"], result)
    best = best_of_each(scores, result.identified_on)
    return [coverage_table(scores, result), cross_table(cross_matrix(best, result))]


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    experiment = planning.experiment
    chosen = recordings_with_models(planning.recordings, experiment)
    validation = _validation(planning.recordings, experiment)
    fits, n_stored = stored_fits(experiment, chosen, planning.store)
    n_models = len(chosen) * len(candidate_orders(experiment.orders))
    pairs, done = len(chosen) * len(validation), 0
    if n_stored == n_models:
        tasks = crossval_tasks(fits, validation, experiment.orders)
        done = sum(planning.store.get(one.key, Deviations) is not None for one in tasks)
    samples = n_models * sum(one.n_samples for one in validation) * (1 - done / pairs)
    what = (
        f"{counted(n_models, 'model')} on {counted(len(validation), 'recording')} = "
        f"{counted(n_models * len(validation), 'validation')} in {counted(pairs, 'task')}"
    )
    seconds = SECONDS_PER_SIMULATED_SAMPLE * samples + TASK_SECONDS * (pairs - done)
    seconds /= min(planning.workers, pairs)
    size = PAIR_BYTES * pairs
    return (StagePlan(NAME, what, pairs, done, seconds, size, is_shared=True),)


def loose_threshold(
    options: CrossvalOptions, recordings: Sequence[Recording], source: str
) -> list[str]:
    """Say that every model is below a threshold, as one of another unit is."""
    swing = float(np.median([np.ptp(one.output) for one in recordings]))
    if not options.threshold > swing > 0.0:
        return []
    unit = behind(recordings[0].output_unit)
    return [
        f"{source}: crossval.threshold: found {options.threshold:g}{unit}; expected a "
        f"part of what the output moves by, {swing:.3g}{unit}: any model is below it"
    ]


STAGE = Stage(
    name=NAME,
    needs=("calibrate", "identify"),
    sections=("crossval",),
    choose=_choose,
    key=lambda given: given.key,
    compute=_compute,
    storage=in_results(
        NAME,
        read_crossval,
        lambda path, given, result, origin: write_crossval(path, result, origin),
    ),
    summary=_summary,
    write_files=_write_csv,
    tables=_tables,
    warnings=lambda context, given: loose_threshold(
        given.options, given.recordings, str(context.experiment.source)
    ),
    shows_before=("identify",),
    files=("results.h5", "crossval.csv", "coverage.csv", "crossval_trust.csv"),
    plan=_plan,
)
