"""``hwid identify``: one model for every recording and every pair of orders."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from hwid_cli.cli.calibrate import calibrate_stage
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.model import Fit
    from hwid_cli.records.recordings import Recording


@dataclass(frozen=True, eq=False)
class Identified:
    """What identification used and gave.

    Parameters
    ----------
    recordings : tuple of Recording
        All calibrated ones.
    fits : tuple of Fit
        Recording by recording, orders within.
    """

    recordings: "tuple[Recording, ...]"
    fits: "tuple[Fit, ...]"


@click.command("identify")
@stage_options
def command(choices: Choices) -> None:
    """Fit a model to every recording for every pair of orders.

    Writes the models to results.h5:/identify and shows the three best of each
    recording.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "identify")
    show_fits(session, identify_stage(session))
    say(session, f"results: {session.results_path}")


@once
def identify_stage(session: "Session") -> Identified:
    """Bring ``results.h5:/identify`` up to date."""
    from hwid_cli.cli.session import (
        provenance,
        read_unchanged,
        say,
        stage_tasks,
        start_timer,
    )
    from hwid_cli.stages.identify import identify_all, identify_key
    from hwid_cli.stages.order_grid import candidate_orders
    from hwid_cli.stages.selection import select_recordings
    from hwid_cli.store.results import read_fits, write_fits

    experiment, path = session.experiment, session.results_path
    recordings = calibrate_stage(session).recordings
    chosen = select_recordings(
        recordings,
        None if experiment.identify is None else experiment.identify.recordings,
        key=f"{experiment.source}: identify.recordings",
        held_out=() if experiment.test is None else experiment.test.recordings,
    )
    timer = start_timer()
    key = identify_key(chosen, experiment.orders, experiment.fit)
    fits = read_unchanged(session, "identify", key, read_fits)
    if fits is not None:
        say(
            session,
            f"identify: {len(fits)} fits from the cache, 0 computed, {timer()}",
        )
        return Identified(recordings, fits)
    total = len(chosen) * len(candidate_orders(experiment.orders))
    with stage_tasks(session, "identify", total, "fits") as settings:
        fits = identify_all(chosen, experiment.orders, experiment.fit, settings)
    origin = provenance(session, key, chosen, seconds=timer.seconds)
    write_fits(path, fits, experiment.orders, origin)
    return Identified(recordings, fits)


def show_fits(session: "Session", identified: Identified) -> None:
    """Show the best models of each recording, what they leave, and how the fits ended."""
    from hwid_cli.cli.session import show
    from hwid_cli.report.fits import best_models_table, fits_ended
    from hwid_cli.report.residuals import residual_table
    from hwid_cli.stages.ranking import best_fits, count_statuses
    from hwid_cli.stages.residuals import own_residuals

    if session.is_quiet:
        return
    nk_role = session.experiment.orders.nk_role
    table = best_models_table(
        best_fits(identified.fits),
        identified.recordings[0].output_unit,
        nk_is_delay=nk_role == "delay",
    )
    show(session, table)
    left = own_residuals(identified.fits, identified.recordings, nk_role)
    if left:
        show(session, residual_table(left))
    show(session, *fits_ended(count_statuses(identified.fits), identified.fits))
