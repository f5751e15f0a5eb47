"""``hwid check``: is a configuration sound, what would it run, and for how long."""

from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from hwid_cli.cli.calibrate import NAME_LISTS

if TYPE_CHECKING:
    from hwid_cli.records.check import FitCost
    from hwid_cli.records.experiment import Experiment
    from hwid_cli.stages.recording_facts import Checked

_EXIT_PROBLEMS = 1


@click.command("check")
@click.argument("config", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of the results.  [default: results/<name>]",
)
@click.option(
    "--cache",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of what was computed before.  [default: cache in that folder]",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes to estimate for.  [default: one for each core]",
)
@click.option(
    "--timing/--no-timing",
    default=True,
    help="Time one fit on these data for the estimate (about two seconds).",
)
def command(
    config: Path, out: Path | None, cache: Path | None, jobs: int | None, timing: bool
) -> None:
    """Check a configuration and its data, and say what would run.

    Lists the recordings with what looks odd in them, the tasks of every stage, what is in
    the cache already, and an estimate of time and disk. Computes no result and writes
    nothing. Every problem is one line; the exit code is 1 if there is any.
    """
    from hwid_cli.config.problems import config_problems

    problems, experiment = config_problems(config)
    if experiment is None:
        _end_with(problems)
    folder = out or Path("results") / experiment.name
    if not problems and _is_waiting(experiment, folder):
        return
    checked, more = _data(experiment, folder)
    if problems or more:
        _end_with((*problems, *more))
    _show_starts(experiment, checked)
    _show_plan(experiment, checked, (cache or folder / "cache", jobs, timing))


def _is_waiting(experiment: "Experiment", folder: Path) -> bool:
    """Whether there are no data to check yet, which is no fault."""
    from hwid_cli.data.paths import find_files, missing_files_message, recordings_base
    from hwid_cli.errors import MeasurementError

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


def _data(experiment: "Experiment", folder: Path) -> "tuple[Checked, tuple[str, ...]]":
    """Show the recordings, and collect what is wrong with them or their names."""
    from hwid_cli.data.survey import survey_recordings
    from hwid_cli.errors import HwidError
    from hwid_cli.report.check import recordings_table
    from hwid_cli.report.table import as_text
    from hwid_cli.stages.own_functions import check_own_functions
    from hwid_cli.stages.recording_facts import check_recordings

    problems: list[str] = []
    try:
        check_own_functions(experiment)
    except HwidError as error:
        problems.append(str(error))
    survey = survey_recordings(experiment, folder)
    checked = check_recordings(survey.recordings, experiment, survey.jitter)
    problems += [*survey.problems, *checked.problems]
    if checked.facts:
        click.echo(as_text([recordings_table(checked.facts)]))
    known = {one.name for one in survey.recordings} | set(survey.unusable)
    if known:
        problems += _names(experiment, known)
    return checked, tuple(dict.fromkeys(problems))


def _names(experiment: "Experiment", known: set[str]) -> list[str]:
    """Names of recordings that there are not, in any section."""
    from hwid_cli.files.messages import did_you_mean

    problems = []
    for section, keys in NAME_LISTS.items():
        options = getattr(experiment, section)
        for key in keys if options is not None else ():
            names = getattr(options, key)
            for name in () if names in (None, "auto") else names:
                if name not in known:
                    place = f"{experiment.source}: {section}.{key}"
                    problems.append(
                        f"{place}: no recording {name!r}; {did_you_mean(name, known)}"
                    )
    return problems


def _show_starts(experiment: "Experiment", checked: "Checked") -> None:
    """Warn of recordings that a diagnosis would start wrongly."""
    from hwid_cli.cli.diagnose import ToDiagnose, start_warning
    from hwid_cli.stages.selection import select_recordings

    simulation, options = experiment.simulation, experiment.diagnose
    if simulation is None or options is None:
        return
    recordings = select_recordings(
        checked.recordings, options.recordings, key="diagnose.recordings"
    )
    warning = start_warning(experiment, ToDiagnose(recordings, simulation, options))
    if warning:
        click.echo(f"hwid: {warning}", err=True)


def _show_plan(
    experiment: "Experiment",
    checked: "Checked",
    how: tuple[Path, int | None, bool],
) -> None:
    from hwid_cli.report.check import stages_table
    from hwid_cli.report.table import as_text
    from hwid_cli.stages.check import plan_stages
    from hwid_cli.store.cache import Hdf5Store
    from hwid_cli.tasks.task import one_thread
    from hwid_cli.tasks.workers import Workers

    cache, jobs, timing = how
    with one_thread():
        cost = _cost(experiment, checked, timing=timing)
        store = Hdf5Store(cache, sets_aside=False)
        workers = Workers(jobs).count
        plans = plan_stages(
            experiment, checked.recordings, cost, store, workers=workers
        )
    click.echo(f"\n{as_text([stages_table(plans, cost, workers)])}")


def _cost(experiment: "Experiment", checked: "Checked", *, timing: bool) -> "FitCost":
    from hwid_cli.stages.fit_seconds import MEASURED, compiled_loops_place, time_one_fit

    if not timing:
        return MEASURED
    if not any(
        Path(compiled_loops_place()).glob("derivative_rows.derivative_rows*.nbi")
    ):
        click.echo("\nThe first run compiles its loops: about 20 s more, once.")
        return MEASURED
    return time_one_fit(checked.recordings, experiment.orders, experiment.fit)


def _end_with(problems: tuple[str, ...]) -> NoReturn:
    for problem in problems:
        click.echo(f"hwid: {' '.join(problem.split())}", err=True)
    raise click.exceptions.Exit(_EXIT_PROBLEMS)
