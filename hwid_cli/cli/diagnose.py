"""``hwid diagnose``: what a physics simulation lacks, and by how much that mends it."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hwid_cli.cli.calibrate import calibrate_stage
from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session
    from hwid_cli.records.diagnosis import Diagnosis
    from hwid_cli.records.experiment import (
        DiagnoseOptions,
        Experiment,
        SimulationOptions,
    )
    from hwid_cli.records.recordings import Recording
    from hwid_cli.store.result_files import Provenance

_FIGURES = "figures"
_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class ToDiagnose:
    """What a diagnosis works on."""

    recordings: "tuple[Recording, ...]"
    simulation: "SimulationOptions"
    options: "DiagnoseOptions"


@click.command("diagnose")
@stage_options
def command(choices: Choices) -> None:
    """Find what a physics simulation of the drive lacks.

    Compares the simulation with the recordings, names the missing effect, adds it, and
    shows what is left on recordings that were held out; or says that nothing is missing,
    or that nothing known explains the gap. Writes diagnosis.json, ranking.csv, where.csv,
    gaps.csv, extended_simulation.yaml, results.h5:/diagnose and figures.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "diagnose")
    show_diagnosis(session, diagnose_stage(session))
    say(
        session,
        f"\nresults: {session.out / 'diagnosis.json'}, ranking.csv, where.csv, "
        f"gaps.csv, extended_simulation.yaml, {session.out / _FIGURES}",
    )


@once
def diagnose_stage(session: "Session") -> "Diagnosis":
    """Bring ``results.h5:/diagnose`` and the files of the diagnosis up to date.

    Raises
    ------
    ConfigError
        If the configuration has no simulation to diagnose, or names unknown recordings.
    """
    from hwid_cli.cli.session import (
        provenance,
        read_unchanged,
        say,
        stage_rounds,
        start_timer,
    )
    from hwid_cli.stages.diagnose import diagnose_all, diagnosis_key
    from hwid_cli.store.diagnosis_results import read_diagnosis_record, write_diagnosis
    from hwid_cli.store.result_files import read_provenance

    given, path = what_to_diagnose(session), session.results_path
    warning = start_warning(session.experiment, given)
    if warning:
        _log.warning("%s", warning)
    timer = start_timer()
    key = diagnosis_key(given.recordings, given.simulation, given.options)
    diagnosis = read_unchanged(session, "diagnose", key, read_diagnosis_record)
    if diagnosis is not None:
        done = len(given.recordings)
        say(session, f"diagnose: {done} recordings from the cache, {timer()}")
        origin = read_provenance(path, "diagnose")
    else:
        with stage_rounds(session, "diagnose", "tasks") as (settings, on_stage):
            diagnosis = diagnose_all(
                given.recordings, given.simulation, given.options, settings, on_stage
            )
        origin = provenance(session, key, given.recordings, seconds=timer.seconds)
        write_diagnosis(path, diagnosis, origin)
    write_files(session, diagnosis, given.simulation, origin)
    return diagnosis


def start_warning(experiment: "Experiment", given: ToDiagnose) -> str:
    """Say which recordings cannot start in equilibrium, as the diagnosis takes them to.

    Returns
    -------
    str
        One line; empty if there is none.
    """
    from hwid_cli.stages.diagnosis_starts import doubtful_starts, starts_sentence

    names = doubtful_starts(given.recordings, given.simulation, given.options)
    sentence = starts_sentence(names, given.recordings, experiment.calibrate)
    return f"{experiment.source}: {sentence}" if sentence else ""


def what_to_diagnose(session: "Session") -> ToDiagnose:
    """Run the stages before this one, and choose the recordings.

    Raises
    ------
    ConfigError
        If the configuration has no simulation, names unknown recordings, or leaves none
        to train on.
    """
    from hwid_cli.errors import ConfigError
    from hwid_cli.records.experiment import DiagnoseOptions
    from hwid_cli.stages.selection import select_recordings

    experiment = session.experiment
    if experiment.simulation is None:
        raise ConfigError(
            f"{experiment.source}: simulation: missing; expected the physics model that "
            "is compared with the recordings; add the section (configs/README.md "
            "explains it)"
        )
    options = experiment.diagnose or DiagnoseOptions()
    place = f"{experiment.source}: diagnose"
    recordings = select_recordings(
        calibrate_stage(session).recordings,
        options.recordings,
        key=f"{place}.recordings",
    )
    if not isinstance(options.hold_out, str):
        held_out = select_recordings(
            recordings, options.hold_out, key=f"{place}.hold_out"
        )
        if len(held_out) == len(recordings):
            raise ConfigError(
                f"{place}.hold_out: names all {len(recordings)} recordings; expected "
                "at least one left to train on; take one out, or write 'auto'"
            )
    return ToDiagnose(recordings, experiment.simulation, options)


def write_files(
    session: "Session",
    diagnosis: "Diagnosis",
    simulation: "SimulationOptions",
    origin: "Provenance",
) -> None:
    """Write everything that a diagnosis leaves besides ``results.h5``.

    Parameters
    ----------
    simulation : SimulationOptions
        As it was given.
    origin : Provenance
        Of the run that gave the diagnosis.
    """
    from hwid_cli.config.extended_simulation import write_extended_simulation
    from hwid_cli.stages.diagnose import extended_options
    from hwid_cli.store.diagnosis_results import (
        write_diagnosis_json,
        write_diagnosis_tables,
    )

    figures = _drawn_before(session.out, origin)
    if figures is None:
        figures = _draw(session.out, diagnosis)
    write_diagnosis_json(
        session.out / "diagnosis.json",
        diagnosis,
        origin.seconds,
        origin,
        figures=figures,
    )
    write_diagnosis_tables(session.out, diagnosis)
    write_extended_simulation(
        session.out / "extended_simulation.yaml",
        session.experiment,
        extended_options(diagnosis, simulation),
    )


def _drawn_before(out: Path, origin: "Provenance") -> list[str] | None:
    """Names of the figures of this very run, if all of them are still there."""
    from hwid_cli.errors import CacheError
    from hwid_cli.store.diagnosis_results import read_diagnosis

    try:
        found = read_diagnosis(out / "diagnosis.json") or {}
    except CacheError:
        return None
    about, names = found.get("provenance") or {}, found.get("figures") or []
    # Seconds tell one run from another one with the same key (--force).
    is_same = about.get("key") == origin.key and found.get("seconds") == origin.seconds
    is_there = all((out / _FIGURES / name).is_file() for name in names)
    return names if is_same and names and is_there else None


def _draw(out: Path, diagnosis: "Diagnosis") -> list[str]:
    from hwid_cli.files.atomic import replace_file
    from hwid_cli.report.figures.diagnosis import diagnosis_figures
    from hwid_cli.report.plots import as_png

    folder = out / _FIGURES
    figures = diagnosis_figures(diagnosis)
    drawn = {f"{name}.png": as_png(figure) for name, figure in figures.items()}
    for path in folder.glob("diagnosis_*.png"):
        # Another verdict may have fewer figures.
        if path.name not in drawn:
            path.unlink()
    for name, png in drawn.items():
        replace_file(folder / name, png)
    return sorted(drawn)


def show_diagnosis(session: "Session", diagnosis: "Diagnosis") -> None:
    """Show the verdict, what it rests on, and what to do next."""
    from hwid_cli.cli.session import show
    from hwid_cli.report.diagnosis import diagnosis_blocks

    show(session, *diagnosis_blocks(diagnosis))
