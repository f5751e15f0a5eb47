"""``hwid check``: is a configuration sound, what would it run, and for how long."""

import json
import sys
import time
from collections.abc import Sequence
from contextlib import nullcontext, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import click

from hwid_cli.config.problems import config_problems
from hwid_cli.data.recording_files import (
    find_files,
    missing_files_message,
    recordings_base,
)
from hwid_cli.data.recordings import survey_recordings
from hwid_cli.errors import HwidError, MeasurementError
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.check import FitCost, RecordingFacts, StagePlan
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.recordings import Calibrated
from hwid_cli.report.check import check_document, recordings_table, stages_table
from hwid_cli.report.table import as_text
from hwid_cli.stages.crossval import loose_threshold
from hwid_cli.stages.fit_seconds import MEASURED, compiled_loops_place, time_fits
from hwid_cli.stages.foreign_simulation import content_of, placed
from hwid_cli.stages.identify import recordings_with_models, stored_fits
from hwid_cli.stages.joint_seconds import time_joint_fits
from hwid_cli.stages.own_functions import check_own_functions
from hwid_cli.stages.recording_facts import Checked, check_recordings
from hwid_cli.stages.run_seconds import page_plan, with_start
from hwid_cli.stages.selection import named_recordings
from hwid_cli.stages.simulation_units import (
    calibrated_in_simulation_units,
    overruled_units,
    refused_units,
)
from hwid_cli.stages.stage import Context, Planning
from hwid_cli.stages.table import named, needed, none_named, stage_named, to_run
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.tasks.cache import Store
from hwid_cli.tasks.task import one_thread
from hwid_cli.tasks.workers import Workers

_EXIT_PROBLEMS = 1
# As many files with the same problem are told one by one.
_FEW = 3


def check(
    config: Path,
    out: Path | None,
    cache: Path | None,
    jobs: int | None,
    timing: bool,
    as_json: bool,
) -> None:
    """Check a configuration and its data, and say what would run."""
    # What people read is no part of a document for programs.
    with redirect_stdout(sys.stderr) if as_json else nullcontext():
        found = _checked(config, out, cache, jobs, timing=timing)
    if as_json and found is not None:
        click.echo(json.dumps(check_document(*found), indent=2, allow_nan=False))


def _checked(
    config: Path,
    out: Path | None,
    cache: Path | None,
    jobs: int | None,
    *,
    timing: bool,
) -> tuple[Sequence[RecordingFacts], Sequence[StagePlan], int] | None:
    """Show what was found, and give it; None where there is no measurement yet."""
    problems, experiment = config_problems(config)
    if experiment is None:
        _end_with(problems)
    folder = out or Path("results") / experiment.name
    if not problems and _is_waiting(experiment, folder):
        return None
    begun = time.perf_counter()
    checked, more = _data(experiment, folder)
    reading_seconds = time.perf_counter() - begun
    if problems or more:
        _end_with((*problems, *more))
    _show_warnings(experiment, checked, folder)
    how = (cache or folder / "cache", jobs, timing, reading_seconds)
    return checked.facts, *_show_plan(experiment, checked, how)


def _is_waiting(experiment: Experiment, folder: Path) -> bool:
    """Whether there are no data to check yet, which is no fault."""
    if experiment.recordings is None and experiment.simulate is not None:
        click.echo(f"{experiment.source} is sound; it simulates and does nothing else.")
        return True
    if experiment.recordings is None:
        return False
    base = recordings_base(experiment, folder)
    try:
        if find_files(experiment, base):
            return False
    except MeasurementError:
        if experiment.simulate is None:
            return False
        source = experiment.source
        click.echo(
            f"{source} is sound; its measurements are not simulated yet. Run 'hwid "
            f"simulate {source}', then check again to see what else would run."
        )
        return True
    click.echo(f"skipped: {missing_files_message(experiment, base)}")
    return True


def _data(experiment: Experiment, folder: Path) -> tuple[Checked, tuple[str, ...]]:
    """Show the recordings, and collect what is wrong with them or their names."""
    problems: list[str] = []
    try:
        check_own_functions(experiment, click.echo)
    except HwidError as error:
        problems.append(str(error))
    survey = survey_recordings(experiment, folder)
    checked = check_recordings(
        survey.recordings, experiment, survey.jitter, survey.missing
    )
    problems += [*survey.problems, *checked.problems]
    drive = experiment.drive_simulation
    converted = calibrated_in_simulation_units(drive, checked.recordings, checked.logs)
    problems += refused_units(experiment, *converted)
    problems += _missing_program(experiment)
    if checked.facts:
        click.echo(as_text([recordings_table(checked.facts)]))
    known = {one.name for one in survey.recordings} | set(survey.unusable)
    if known:
        problems += _names(experiment, known)
    return checked, tuple(dict.fromkeys(problems))


def _missing_program(experiment: Experiment) -> list[str]:
    """What keeps a simulation of the user's own from being found."""
    foreign = experiment.foreign_simulation
    if foreign is None:
        return []
    try:
        content_of(placed(foreign, experiment.source), experiment.source)
    except HwidError as error:
        return [str(error)]
    return []


def _names(experiment: Experiment, known: set[str]) -> list[str]:
    """Names of recordings that there are not, in any section."""
    return [
        f"{experiment.source}: {key}: no recording {name!r}; {did_you_mean(name, known)}"
        for key, names in named_recordings(experiment)
        for name in names
        if name not in known
    ]


def _show_warnings(experiment: Experiment, checked: Checked, out: Path) -> None:
    """Say what stages would warn of that work on calibrated recordings alone."""
    calibrated = Calibrated(checked.recordings, checked.logs, "")
    context = Context(experiment, out, {"calibrate": calibrated})
    # What a simulation is compared with needs no section 'diagnose' to be looked at.
    extra = () if experiment.simulation is None else ("diagnose",)
    said = list(checked.warnings)
    for name in dict.fromkeys((*named(experiment), *extra)):
        stage = stage_named(name)
        # Their results are all that is there.
        if {*needed(name, experiment)} - {"simulate"} == {"calibrate"}:
            said += stage.warnings(context, stage.choose(context))
    source = str(experiment.source)
    said += overruled_units(source, checked.logs)
    if experiment.crossval is not None:
        said += loose_threshold(experiment.crossval, checked.recordings, source)
    said += [fault] if (fault := none_named(experiment)) else []
    for warning in dict.fromkeys(said):
        click.echo(f"hwid: {warning}", err=True)


def _show_plan(
    experiment: Experiment,
    checked: Checked,
    how: tuple[Path, int | None, bool, float],
) -> tuple[list[StagePlan], int]:

    cache, jobs, timing, reading_seconds = how
    with one_thread():
        store = Hdf5Store(cache, sets_aside=False)
        cost = _cost(experiment, checked, store, timing=timing)
        workers = Workers(jobs).count
        planning = Planning(
            experiment,
            checked.recordings,
            cost,
            store,
            workers,
            checked.logs,
            reading_seconds,
            timing,
        )
        plans = with_start(
            [
                plan
                for name in to_run(experiment)
                for plan in stage_named(name).plan(planning)
            ]
            + [page_plan(planning)],
            workers,
        )
    click.echo(f"\n{as_text([stages_table(plans, cost, workers)])}")
    return plans, workers


def _cost(
    experiment: Experiment, checked: Checked, store: Store, *, timing: bool
) -> FitCost:

    if not timing or "identify" not in to_run(experiment):
        return MEASURED
    if not any(
        Path(compiled_loops_place()).glob("derivative_rows.derivative_rows*.nbi")
    ):
        click.echo("\nThe first run compiles its loops: about 20 s more, once.")
        return MEASURED
    found = time_fits(checked.recordings, experiment.orders, experiment.fit)
    chosen = recordings_with_models(checked.recordings, experiment)
    fits, n_stored = stored_fits(experiment, chosen, store)
    if n_stored == len(fits):
        # What follows is there too, most likely.
        return found
    return replace(found, joint=time_joint_fits(experiment, checked.recordings))


def _once(problems: Sequence[str]) -> list[str]:
    """Problems, but of those that many files have, in the same words, the first one.

    A slip in the configuration is one, however many files there are.
    """
    alike: dict[str, list[str]] = {}
    for problem in problems:
        alike.setdefault(problem.partition(": ")[2] or problem, []).append(problem)
    return [
        f"{same[0]} ({len(same) - 1} more files have the same)"
        if len(same) > _FEW
        else problem
        for same in alike.values()
        for problem in (same[:1] if len(same) > _FEW else same)
    ]


def _end_with(problems: Sequence[str]) -> NoReturn:
    for problem in _once(problems):
        click.echo(f"hwid: {' '.join(problem.split())}", err=True)
    raise click.exceptions.Exit(_EXIT_PROBLEMS)
