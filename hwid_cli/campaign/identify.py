"""Stage ``identify``: one model for every recording and every pair of orders."""

from collections.abc import Sequence
from dataclasses import replace

from hwid_cli.campaign.cache import task_key
from hwid_cli.campaign.order_grid import candidate_orders
from hwid_cli.campaign.runner import RunSettings, Task, run_tasks
from hwid_cli.maths.model.fit import fit
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import Recording

STAGE = "identify"
STAGE_VERSION = 2


def identify_all(
    recordings: Sequence[Recording],
    orders: OrdersOptions,
    options: FitOptions,
    settings: RunSettings,
) -> tuple[Fit, ...]:
    """Fit every recording with every pair of orders.

    Parameters
    ----------
    recordings : sequence of Recording
    orders : OrdersOptions
    options : FitOptions
    settings : RunSettings

    Returns
    -------
    tuple of Fit
        Recording by recording, each in the order of ``candidate_orders``.
    """
    tasks = identify_tasks(recordings, orders, options)
    done = run_tasks(tasks, settings)
    names = [
        recording.name for recording in recordings for _ in candidate_orders(orders)
    ]
    # A fit is cached by content: neither the name of its recording nor the rule for
    # joining several, which does nothing to one, is part of it.
    return tuple(
        replace(item.result, identified_on=(name,), options=options)
        for item, name in zip(done, names, strict=True)
    )


def identify_tasks(
    recordings: Sequence[Recording], orders: OrdersOptions, options: FitOptions
) -> tuple[Task, ...]:
    """List the fits of a campaign.

    Parameters
    ----------
    recordings : sequence of Recording
    orders : OrdersOptions
    options : FitOptions

    Returns
    -------
    tuple of Task
        Recording by recording, each in the order of ``candidate_orders``.
    """
    alone = replace(options, join=FitOptions().join)
    grid = candidate_orders(orders)
    return tuple(
        Task(
            key=_fit_key(content, candidate, alone),
            name=f"{recording.name}/{nb}/{nk}",
            function=_fit_one,
            arguments=(recording, candidate, alone),
            result_type=Fit,
        )
        for recording, content in (
            (recording, recording_key(recording)) for recording in recordings
        )
        for nb, nk, candidate in grid
    )


def identify_key(
    recordings: Sequence[Recording], orders: OrdersOptions, options: FitOptions
) -> str:
    """Content key of the whole stage: its fits and their names.

    Parameters
    ----------
    recordings : sequence of Recording
    orders : OrdersOptions
    options : FitOptions

    Returns
    -------
    str
    """
    settings = {
        "fits": [task.key for task in identify_tasks(recordings, orders, options)],
        "names": [recording.name for recording in recordings],
        "orders": orders,
        "options": options,
    }
    return task_key(STAGE, STAGE_VERSION, settings, [])


def recording_key(recording: Recording) -> str:
    """Content key of a recording: what a fit sees of it.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    str
    """
    settings = {
        "sample_time_s": recording.sample_time_s,
        "input_unit": recording.input_unit,
        "output_unit": recording.output_unit,
    }
    return task_key("recording", 1, settings, [recording.input, recording.output])


def _fit_key(content: str, orders: Orders, options: FitOptions) -> str:
    settings = {
        "recordings": [content],
        "orders": orders,
        "options": options,
    }
    return task_key(STAGE, STAGE_VERSION, settings, [])


def _fit_one(recording: Recording, orders: Orders, options: FitOptions) -> Fit:
    return fit([recording], orders, options)
