"""``hwid crossval``: the RMSD of every model on every recording."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.identify import Identified, identify_stage, show_fits
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.results import CrossValidation


@click.command("crossval")
@stage_options
def command(choices: Choices) -> None:
    """Validate every model on every recording.

    Writes the tensor of RMSDs to results.h5:/crossval, crossval.csv and coverage.csv,
    and shows the models that cover the most recordings.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "crossval")
    identified, crossval = crossval_stage(session)
    show_fits(session, identified)
    show_coverage(session, identified, crossval)
    say(session, f"\nresults: {session.results_path}, crossval.csv, coverage.csv")


@once
def crossval_stage(session: "Session") -> "tuple[Identified, CrossValidation]":
    """Bring ``results.h5:/crossval`` and its CSV files up to date."""
    from hwid_cli.cli.session import (
        provenance,
        read_unchanged,
        say,
        stage_tasks,
        start_timer,
    )
    from hwid_cli.records.experiment import CrossvalOptions
    from hwid_cli.stages.crossval import cross_validate, crossval_key
    from hwid_cli.stages.selection import select_recordings
    from hwid_cli.store.results import read_crossval, write_crossval

    experiment, path = session.experiment, session.results_path
    identified = identify_stage(session)
    options = experiment.crossval or CrossvalOptions()
    judges = select_recordings(
        identified.recordings,
        options.recordings,
        key=f"{experiment.source}: crossval.recordings",
        held_out=() if experiment.test is None else experiment.test.recordings,
    )
    timer = start_timer()
    key = crossval_key(identified.fits, judges, experiment.orders, options)
    crossval = read_unchanged(session, "crossval", key, read_crossval)
    if crossval is not None:
        done = len(crossval.identified_on) * len(crossval.validated_on)
        say(
            session,
            f"crossval: {done} pairs from the cache, 0 computed, {timer()}",
        )
    else:
        n_grid = len(experiment.orders.nb) * len(experiment.orders.nk)
        total = len(identified.fits) // n_grid * len(judges)
        with stage_tasks(session, "crossval", total, "pairs") as settings:
            crossval = cross_validate(
                identified.fits, judges, experiment.orders, options, settings
            )
        origin = provenance(session, key, judges, seconds=timer.seconds)
        write_crossval(path, crossval, origin)
    write_tables(session, identified, crossval)
    return identified, crossval


def write_tables(
    session: "Session", identified: Identified, crossval: "CrossValidation"
) -> None:
    """Write ``crossval.csv`` and ``coverage.csv``."""
    from hwid_cli.files.csv_tables import write_coverage_csv, write_crossval_csv
    from hwid_cli.stages.ranking import score_models

    scores = score_models(identified.fits, crossval)
    write_crossval_csv(session.out / "crossval.csv", crossval)
    write_coverage_csv(session.out / "coverage.csv", scores, len(crossval.validated_on))


def show_coverage(
    session: "Session", identified: Identified, crossval: "CrossValidation"
) -> None:
    """Show the models that cover the most recordings."""
    from hwid_cli.cli.session import show
    from hwid_cli.report.crossval import coverage_table, cross_table
    from hwid_cli.stages.ranking import best_of_each, score_models
    from hwid_cli.stages.report import cross_matrix

    scores = score_models(identified.fits, crossval)
    best = best_of_each(scores, crossval.identified_on)
    show(session, coverage_table(scores, crossval))
    show(session, cross_table(cross_matrix(best, crossval)))
