"""``hwid export``: a model as a file that runs elsewhere."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from hwid_cli.cli.closing import BEST, BEST_LINEAR, recommended
from hwid_cli.cli.driver import result_of
from hwid_cli.cli.linear_models import linear_model
from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import Session, open_session
from hwid_cli.data.recording_files import recordings_options
from hwid_cli.data.signal_units import as_files_are
from hwid_cli.errors import ConfigError, SimulationError
from hwid_cli.export.contents import (
    SIMULATION,
    TITLE,
    card_of_program,
    export_model,
    export_simulation,
    find_fit,
)
from hwid_cli.export.effects_alone import write_effects
from hwid_cli.export.extended_fmu import write_extended_fmu
from hwid_cli.export.formats import write_exported
from hwid_cli.export.python_module import write_module
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.best_model import LINEAR
from hwid_cli.records.experiment import RecordingsOptions
from hwid_cli.records.exported import Exported
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import CalibrationLog, Recording
from hwid_cli.records.report import StoredResults
from hwid_cli.report.thesis_names import thesis_name_of
from hwid_cli.simulations.kinds import KINDS, kind_named
from hwid_cli.stages.diagnose import extended_options
from hwid_cli.stages.extended_program import (
    exactness_of,
    extended_program,
    told_difference,
)
from hwid_cli.stages.model_views import named_fits
from hwid_cli.stages.table import to_run
from hwid_cli.stages.trust import kept_for_test, trust_of
from hwid_cli.store.result_files import has_left_results, read_provenance, results_file

_FOLDER = "models"


def export(
    choices: Choices, model: str | None, diagnosis: bool, file_format: str
) -> None:
    """Write a model as a file that runs elsewhere."""
    if diagnosis == (model is not None):
        raise click.UsageError("expected one of --model NAME and --diagnosis")
    session = open_session(choices, "export")
    asked = SIMULATION if model is None else model
    foreign = session.experiment.foreign_simulation if asked == SIMULATION else None
    if foreign is not None:
        written = _export_program(session, foreign.kind, file_format)
    elif file_format in ("python", "simulink", "modelica"):
        raise ConfigError(
            f"--format {file_format}: {asked} is no program of your own; expected one of "
            "json, mat, c, fmu; choose one of them"
        )
    else:
        exported = chosen_model(session, asked, with_trust=file_format == "json")
        written = write_exported(session.out / _FOLDER, exported, file_format)
    session.show_notes()
    for path in written:
        click.echo(path)


def _export_program(session: Session, kind: str, file_format: str) -> list[Path]:
    """The user's own simulation with what a diagnosis added, or the effects alone."""
    formats = kind_named(kind).exports
    if not formats:
        others = [one for one in KINDS if kind_named(one).exports]
        raise ConfigError(
            f"--diagnosis: simulation.kind is {kind}; expected one of "
            f"{', '.join(others)}, which an effect can act on step by step; use "
            "extended_simulation.yaml"
        )
    if file_format not in formats:
        raise ConfigError(
            f"--format {file_format}: simulation.kind is {kind}; expected one of "
            f"{', '.join(formats)}; a whole simulation needs --format {formats[0]}"
        )
    diagnosis = result_of(session, "diagnose")
    given = session.given["diagnose"]
    program = extended_program(diagnosis, given, given.simulation)
    folder = session.out / _FOLDER
    if file_format == "python":
        name = session.experiment.name
        title = f"The simulation of {name!r} as 'hwid diagnose' extended it."
        exactness = exactness_of(program, diagnosis)
        return write_module(folder, program.extended, title=title, exactness=exactness)
    origin = _origin(session, "diagnose")
    card = card_of_program(
        given.recordings,
        _options(session, given.logs),
        origin=origin,
    )
    sample_time_s = given.recordings[0].sample_time_s
    if file_format == "fmu":
        path = folder / "simulation.fmu"
        write_extended_fmu(path, program.extended, card, sample_time_s)
        try:
            session.note(told_difference(program, path))
        except SimulationError:
            path.unlink()
            raise
        return [path]
    return write_effects(folder, file_format, program.extended, card, sample_time_s)


def chosen_model(session: Session, asked: str, *, with_trust: bool = False) -> Exported:
    """The model of a name; stages that it needs run first.

    Parameters
    ----------
    with_trust : bool
        Whether it carries what is known of its errors.

    Raises
    ------
    ConfigError
        If there is no such model.
    """
    if asked in (BEST, BEST_LINEAR):
        asked = _best_name(session, is_linear=asked == BEST_LINEAR)
    if asked == SIMULATION:
        return _simulation(session)
    if asked.startswith(LINEAR):
        fit = linear_model(session, asked, "export")
        title = f"{LINEAR}{thesis_name_of(fit.name, fit.orders)}"
        return _exported(session, fit, (asked, title), "calibrate", with_trust)
    _refuse_other_recordings(session, asked)
    named, stage = _named_fits(session, asked)
    titles = {
        thesis_name_of(name.rsplit("/", 2)[0], fit.orders): name
        for name, fit in named.items()
    }
    name, fit = find_fit(asked, named, titles)
    title = next(title for title, known in titles.items() if known == name)
    made_by = stage if "+" in name else "identify"
    return _exported(session, fit, (name, title), made_by, with_trust)


def _refuse_other_recordings(session: Session, asked: str) -> None:
    """Refuse a model of recordings that there are none of, before fits take their time."""
    joined, *orders = asked.rsplit("/", 2)
    if len(orders) < 2:
        return
    known = [one.name for one in result_of(session, "calibrate").recordings]
    if other := [one for one in joined.split("+") if one not in known]:
        raise ConfigError(
            f"--model {asked}: no recording {other[0]!r}; {did_you_mean(other[0], known)}"
        )


def _best_name(session: Session, *, is_linear: bool) -> str:
    """Name of the model that ``hwid run`` ends with, or of the linear one beside it.

    Stages that the configuration names run where they have not: without one of them
    another model is the best.
    """
    asked = ("identify", *to_run(session.experiment))
    for stage in ("identify", "crossval", "group", "test"):
        path = session.out / results_file(stage)
        if stage in asked or has_left_results(path, stage):
            result_of(session, stage)
    best = recommended(session)
    if best is None or not best.is_usable:
        raise ConfigError(
            f"--model {BEST}: no model can be taken; expected one that holds on other "
            "recordings; 'hwid run' says what may help, or give the name of a model"
        )
    name = best.linear_name if is_linear else best.taken_name
    if not name:
        raise ConfigError(
            f"--model {BEST_LINEAR}: no linear model was compared; expected one; run "
            f"'hwid crossval', or give its name as {LINEAR}RECORDING/NB/NK"
        )
    session.note(f"best {'linear ' * is_linear}model: {name}")
    return name


def _exported(
    session: Session,
    fit: Fit,
    names: tuple[str, str],
    stage: str,
    with_trust: bool,
) -> Exported:
    """A fit as a file holds it.

    Parameters
    ----------
    names : tuple of str
        Of the model, and its title.
    stage : str
        Whose settings and versions made it.
    """
    recordings = result_of(session, "calibrate").recordings
    name, title = names
    exported = export_model(
        fit,
        recordings,
        _options(session, result_of(session, "calibrate").logs),
        name=name,
        title=title,
        origin=_origin(session, stage),
    )
    if not with_trust:
        return exported
    kept = kept_for_test(session.experiment)
    return replace(exported, trust=trust_of(fit, recordings, kept))


def _named_fits(session: Session, asked: str) -> tuple[dict[str, Fit], str]:
    """All models by name, those of groups only where the name may be one of them."""
    experiment = session.experiment
    fits = result_of(session, "identify")
    has_groups = experiment.group is not None or has_left_results(
        session.out / results_file("group"), "group"
    )
    # The search takes long: what cannot be a name of several recordings does not start it.
    is_other = "+" not in asked and not asked.startswith(TITLE)
    names = {one.name for one in result_of(session, "calibrate").recordings}
    is_single = is_other or asked.rsplit("/", 2)[0] in names
    search = result_of(session, "group") if has_groups and not is_single else None
    stored = StoredResults(
        experiment.name,
        config="",
        nk_role=experiment.orders.nk_role,
        results={"identify": fits, "group": search},
    )
    return named_fits(stored), "identify" if search is None else "group"


def _simulation(session: Session) -> Exported:
    """The physics simulation with what a diagnosis added."""
    diagnosis = result_of(session, "diagnose")
    given = session.given["diagnose"]
    exported = export_simulation(
        extended_options(diagnosis, given.simulation),
        given.recordings,
        _in_units_of(given.recordings[0], _options(session, given.logs)),
        given.options,
        origin=_origin(session, "diagnose"),
    )
    return replace(exported, trust=diagnosis.trust)


def _options(session: Session, logs: Sequence[CalibrationLog]) -> RecordingsOptions:
    """How files are read, with the units that they were found to have."""
    return as_files_are(recordings_options(session.experiment), logs)


def _in_units_of(recording: Recording, options: RecordingsOptions) -> RecordingsOptions:
    """The same with the units of a recording, where the experiment has others."""
    return replace(
        options, input_unit=recording.input_unit, output_unit=recording.output_unit
    )


def _origin(session: Session, stage: str) -> dict[str, object]:
    """Where the results of a stage came from, as plain data."""
    found = read_provenance(session.out / results_file(stage), stage)
    return {
        "stage": stage,
        "config": dict(found.config),
        "versions": dict(found.versions),
    }
