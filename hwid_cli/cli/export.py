"""``hwid export``: a model as a file that runs elsewhere."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.calibrate import calibrate_stage
from hwid_cli.cli.identify import identify_stage
from hwid_cli.cli.options import Choices, stage_options

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.exported import Exported
    from hwid_cli.records.model import Fit

FORMATS = ("json", "mat", "c", "fmu")
_FOLDER = "models"


@click.command("export")
@click.option(
    "--model",
    required=True,
    metavar="NAME",
    help="The model: step_06/3/7, a group step_06+step_09/3/7, a published name "
    "NLHW-Step-6-3-7-1, or 'simulation' for the physics simulation that 'hwid "
    "diagnose' extended.",
)
@click.option(
    "--format",
    "file_format",
    type=click.Choice(FORMATS),
    default="json",
    show_default=True,
    help="json for 'hwid predict', mat with a script for MATLAB, C source, or an FMU.",
)
@stage_options
def command(choices: Choices, model: str, file_format: str) -> None:
    """Write a model as a file that runs elsewhere.

    Writes models/NAME.json, .mat (and .m), .c or .fmu below the folder of the results,
    and prints the path; docs/export.md describes the formats.
    """
    from hwid_cli.cli.session import open_session
    from hwid_cli.export.formats import write_exported

    session = open_session(choices, "export")
    exported = chosen_model(session, model)
    for path in write_exported(session.out / _FOLDER, exported, file_format):
        click.echo(path)


def chosen_model(session: "Session", asked: str) -> "Exported":
    """The model of a name; stages that it needs run first.

    Raises
    ------
    ConfigError
        If there is no such model.
    """
    from hwid_cli.data.paths import recordings_options
    from hwid_cli.export.contents import SIMULATION, export_model, find_fit
    from hwid_cli.report.thesis_names import thesis_name_of

    if asked == SIMULATION:
        return _simulation(session)
    named, stage = _named_fits(session, asked)
    titles = {
        thesis_name_of(name.rsplit("/", 2)[0], fit.orders): name
        for name, fit in named.items()
    }
    name, fit = find_fit(asked, named, titles)
    return export_model(
        fit,
        calibrate_stage(session).recordings,
        recordings_options(session.experiment),
        name=name,
        title=next(title for title, known in titles.items() if known == name),
        origin=_origin(session, stage if "+" in name else "identify"),
    )


def _named_fits(session: "Session", asked: str) -> "tuple[dict[str, Fit], str]":
    """All models by name, those of groups only where the name may be one of them."""
    from hwid_cli.cli.group import group_stage
    from hwid_cli.records.report import StoredResults
    from hwid_cli.stages.model_views import named_fits
    from hwid_cli.store.result_files import has_left_results

    experiment = session.experiment
    identified = identify_stage(session)
    has_groups = experiment.group is not None or has_left_results(
        session.results_path, "group"
    )
    # The search takes long: a name of a single recording does not start it.
    is_single = asked.rsplit("/", 2)[0] in {
        recording.name for recording in identified.recordings
    }
    search = group_stage(session) if has_groups and not is_single else None
    stored = StoredResults(
        experiment.name,
        config="",
        nk_role=experiment.orders.nk_role,
        fits=identified.fits,
        search=search,
    )
    return named_fits(stored), "identify" if search is None else "group"


def _simulation(session: "Session") -> "Exported":
    """The physics simulation with what a diagnosis added."""
    from hwid_cli.cli.diagnose import diagnose_stage, what_to_diagnose
    from hwid_cli.data.paths import recordings_options
    from hwid_cli.export.contents import export_simulation
    from hwid_cli.stages.diagnose import extended_options

    given = what_to_diagnose(session)
    diagnosis = diagnose_stage(session)
    return export_simulation(
        extended_options(diagnosis, given.simulation),
        given.recordings,
        recordings_options(session.experiment),
        given.options,
        origin=_origin(session, "diagnose"),
    )


def _origin(session: "Session", stage: str) -> dict[str, object]:
    """Where the results of a stage came from, as plain data."""
    from hwid_cli.store.result_files import read_provenance

    found = read_provenance(session.results_path, stage)
    return {
        "stage": stage,
        "config": dict(found.config),
        "versions": dict(found.versions),
    }
