"""``hwid init``: a commented starter configuration from a folder of measurements."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from hwid_cli.records.starter import Layout, Proposal


@click.command("init")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("experiment.yaml"),
    show_default=True,
    metavar="FILE",
    help="Configuration to write.",
)
@click.option("--force", is_flag=True, help="Replace a configuration that is there.")
@click.option("-q", "--quiet", is_flag=True, help="Say errors only.")
def command(folder: Path, out: Path, force: bool, quiet: bool) -> None:
    """Write a commented starter configuration for a folder of measurements.

    Guesses columns, units, sample time, kinds, recipes and orders from names and content,
    says why, and asks nothing: the file runs at once, and every line of it is yours to
    correct.
    """
    from hwid_cli.config.load import load_experiment
    from hwid_cli.config.starter import (
        draft_experiment,
        refuse_existing,
        starter_text,
        write_starter,
    )
    from hwid_cli.data.folder import list_measurements
    from hwid_cli.data.layout import guess_layout
    from hwid_cli.data.survey import survey_recordings
    from hwid_cli.errors import MeasurementError
    from hwid_cli.stages.proposal import propose

    refuse_existing(out, force=force)
    layout = guess_layout(list_measurements(folder))
    survey = survey_recordings(draft_experiment(layout, folder), folder)
    if not survey.recordings:
        raise MeasurementError(survey.problems[0])
    proposal = propose(survey.recordings, survey.unusable)
    write_starter(out, starter_text(layout, proposal, folder, out), force=force)
    load_experiment(out)
    if not quiet:
        _show(out, layout, proposal, survey.problems)


def _show(
    out: Path, layout: "Layout", proposal: "Proposal", problems: tuple[str, ...]
) -> None:
    from hwid_cli.report.starter import starter_summary
    from hwid_cli.report.table import as_text

    click.echo(as_text([starter_summary(str(out), layout, proposal, problems)]))
