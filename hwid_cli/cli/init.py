"""``hwid init``: a commented starter configuration from a folder of measurements."""

from dataclasses import replace
from pathlib import Path

import click

from hwid_cli.config.load import load_experiment
from hwid_cli.config.starter import (
    draft_experiment,
    refuse_existing,
    starter_text,
    write_starter,
)
from hwid_cli.data.folder import (
    STAR,
    guess_layout,
    list_measurements,
    with_slower_grid,
)
from hwid_cli.data.recordings import survey_recordings
from hwid_cli.errors import MeasurementError
from hwid_cli.records.starter import FolderLayout, Proposal
from hwid_cli.report.starter import starter_summary
from hwid_cli.report.table import as_text
from hwid_cli.stages.proposal import propose


def write_starter_configuration(
    folder: Path, out: Path, units: str, force: bool, quiet: bool
) -> None:
    """Write a commented starter configuration for a folder of measurements."""
    refuse_existing(out, force=force)
    layout = guess_layout(list_measurements(folder))
    layout = replace(layout, keeps_units=units == "file")
    survey = survey_recordings(draft_experiment(layout, folder), folder)
    slower = with_slower_grid(layout, survey.sample_times_s.values())
    if slower is not layout:
        layout = slower
        survey = survey_recordings(draft_experiment(layout, folder), folder)
    if not survey.recordings:
        raise MeasurementError(survey.problems[0])
    may_cut = not layout.parts and layout.variable != STAR
    proposal = propose(
        survey.recordings, survey.unusable, survey.problems, may_cut=may_cut
    )
    write_starter(out, starter_text(layout, proposal, folder, out), force=force)
    load_experiment(out)
    if not quiet:
        _show(out, layout, proposal)


def _show(out: Path, layout: FolderLayout, proposal: Proposal) -> None:
    click.echo(as_text([starter_summary(str(out), layout, proposal)]))
