"""Stage ``crossval``: the RMSD of every model on every recording.

One task simulates all models of one recording on one recording, one after the other, and
keeps the RMSDs only: simulated signals are never held for more than one model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.experiment import CrossvalOptions, OrdersOptions
from hwid_cli.records.model import Fit, HammersteinWiener
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.tasks.cache import model_key, recording_key, task_key
from hwid_cli.tasks.runner import RunSettings, Task, run_tasks

STAGE = "crossval"
STAGE_VERSION = 2

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
        Those that judge.
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
    """List the tasks: for each recording's models, one for each judging recording.

    Parameters
    ----------
    fits : sequence of Fit
        Recording by recording, orders within.
    """
    n_grid = len(orders.nb) * len(orders.nk)
    contents = [recording_key(recording) for recording in recordings]
    tasks: list[Task] = []
    for first in range(0, len(fits), n_grid):
        models = tuple(fit.model for fit in fits[first : first + n_grid])
        tasks += deviation_tasks(models, recordings, contents, fits[first].name)
    return tuple(tasks)


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
        All judged in one task; None stands for a failed fit.
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
    model_keys = [None if model is None else model_key(model) for model in models]
    return tuple(
        Task(
            key=task_key(
                STAGE,
                STAGE_VERSION,
                {"models": model_keys, "recording": content},
                [],
            ),
            name=f"{name} on {recording.name}",
            function=_deviations,
            arguments=(tuple(models), recording),
            result_type=Deviations,
        )
        for recording, content in zip(recordings, contents, strict=True)
    )


def crossval_key(
    fits: Sequence[Fit],
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: CrossvalOptions,
) -> str:
    """Content key of the whole stage: its RMSDs and the names on their axes."""
    settings = {
        "rmsds": [task.key for task in crossval_tasks(fits, recordings, orders)],
        "identified_on": [fit.name for fit in fits],
        "validated_on": [recording.name for recording in recordings],
        "orders": orders,
        "threshold": options.threshold,
    }
    return task_key(STAGE, STAGE_VERSION, settings, [])


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
