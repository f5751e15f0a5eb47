"""One run of the program: its experiment, its folder, and who computes.

Imported by commands when they run, so that ``hwid --help`` stays fast.
"""

import logging
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import click

from hwid_cli.cli.folders import enter_folders
from hwid_cli.cli.options import Choices
from hwid_cli.cli.timing import start_timer
from hwid_cli.config.load import describe_experiment, load_experiment
from hwid_cli.data.recordings import check_unchanged
from hwid_cli.errors import CacheError, ConfigError
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.recordings import Recording
from hwid_cli.report.progress import StageProgress
from hwid_cli.stages.own_functions import check_own_functions
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.store.result_files import Provenance, current_versions, read_stage_key
from hwid_cli.tasks.runner import RunSettings, TaskDone, Workers

Result = TypeVar("Result")

_log = logging.getLogger(__name__)

STAGES = ("simulate", "calibrate", "identify", "crossval", "group", "test", "diagnose")


@dataclass(frozen=True, eq=False)
class Session:
    """What all stages of one run share.

    Parameters
    ----------
    out : Path
        Folder of the results; exists.
    cache : Path
        Folder of what was computed before.
    forced : tuple of str
        Stages that ignore their cached results.
    finished : dict
        Results of the stages that ran in this session, see ``stages.once``.
    read : dict of str to str
        SHA-256 of the recordings' files that were read, by file.
    """

    experiment: Experiment
    out: Path
    cache: Path
    workers: Workers
    forced: tuple[str, ...]
    is_quiet: bool
    finished: dict[str, Any] = field(default_factory=dict)
    read: dict[str, str] = field(default_factory=dict)

    @property
    def calibrated_path(self) -> Path:
        """File of calibrated recordings."""
        return self.out / "calibrated.h5"

    @property
    def results_path(self) -> Path:
        """File of models and scores."""
        return self.out / "results.h5"


def open_session(choices: Choices, *stages: str, is_alone: bool = True) -> Session:
    """Read the configuration and make the folder of the results.

    Parameters
    ----------
    *stages : str
        What ``--force`` computes again.
    is_alone : bool
        Whether no other run may work in the folder meanwhile.

    Raises
    ------
    ConfigError
        If the configuration or the folder cannot be used.
    CacheError
        If another run works in the folder.
    """
    experiment = load_experiment(choices.config)
    check_own_functions(experiment)
    out = choices.out or Path("results") / experiment.name
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            f"--out {out}: {error.strerror}; expected a folder that can be made and "
            "written; choose another one"
        ) from error
    cache = choices.cache or out / "cache"
    enter_folders(out, cache, is_alone=is_alone)
    return Session(
        experiment=experiment,
        out=out,
        cache=cache,
        workers=Workers(choices.jobs, choices.backend, choices.scheduler),
        forced=stages if choices.force else (),
        is_quiet=choices.quiet,
    )


def say(session: Session, text: str) -> None:
    """Show text to people, unless they asked for quiet."""
    if not session.is_quiet:
        click.echo(text)


def show(session: Session, *blocks: object) -> None:
    """Show tables and paragraphs to people, set off by a line."""
    from hwid_cli.report.table import as_text

    text = as_text(
        blocks,
        width=screen_width(),
        initial_state=session.experiment.fit.initial_state,
        thesis_names=session.experiment.thesis_names,
    )
    say(session, f"\n{text}")


def screen_width() -> int:
    """Characters in a line of the terminal; 80 where there is none.

    Returns
    -------
    int, [characters]
    """
    return shutil.get_terminal_size((80, 24)).columns


def is_unchanged(session: Session, stage: str, key: str) -> bool:
    """Whether the stored results of a stage are those that it would give now.

    Parameters
    ----------
    key : str
        Of everything that the stage depends on.
    """
    if stage in session.forced:
        return False
    is_calibrate = stage == "calibrate"
    path = session.calibrated_path if is_calibrate else session.results_path
    return read_stage_key(path, stage) == key


def read_unchanged(
    session: Session, stage: str, key: str, read: Callable[[Path], Result]
) -> Result | None:
    """Read the stored results of a stage if they are those that it would give now.

    Parameters
    ----------
    key : str
        Of everything that the stage depends on.
    read : callable
        From the path of the results to the result.

    Returns
    -------
    Result or None
        None where the stage has to run; results that cannot be read are named in the
        log, and the cache has what they were made of.
    """
    if not is_unchanged(session, stage, key):
        return None
    path = session.calibrated_path if stage == "calibrate" else session.results_path
    try:
        return read(path)
    except CacheError as error:
        _log.warning("%s (%s comes back from the cache now)", error, stage)
        return None


def provenance(
    session: Session,
    key: str,
    recordings: tuple[Recording, ...],
    *,
    seconds: float = float("nan"),
) -> Provenance:
    """Say where results come from, right before they are stored.

    Parameters
    ----------
    key : str
        Of everything that the stage depends on.
    recordings : tuple of Recording
        That it used.
    seconds : float, [s]
        What the run took that gave the results; NaN unknown.

    Raises
    ------
    MeasurementError
        If the file of a recording has changed since it was read.
    """
    check_unchanged(session.read)
    return Provenance(
        key,
        describe_experiment(session.experiment),
        {recording.name: recording.sha256 for recording in recordings},
        seconds,
        current_versions(),
    )


@contextmanager
def stage_tasks(
    session: Session, stage: str, total: int, unit: str, *, part: str = ""
) -> Iterator[RunSettings]:
    """Run the tasks of a stage under a progress bar, and sum up at the end.

    Parameters
    ----------
    total : int, [-]
        Tasks.
    unit : str
        What one task is, in the plural.
    part : str
        Which part of the stage, where it has several.
    """
    with _progress(session, stage, total, unit, part=part) as (settings, _):
        yield settings


@contextmanager
def stage_rounds(
    session: Session, stage: str, unit: str
) -> Iterator[tuple[RunSettings, Callable[[str, int], None]]]:
    """Run the tasks of a stage that come in rounds, each with a progress bar.

    Parameters
    ----------
    unit : str
        What one task is, in the plural.

    Yields
    ------
    callable
        Takes what the next round does and how many tasks it has.
    """
    with _progress(session, stage, 0, unit) as (settings, progress):
        yield (
            settings,
            lambda text, total: progress.begin_round(f"{stage}: {text}", total),
        )


@contextmanager
def _progress(
    session: Session, stage: str, total: int, unit: str, *, part: str = ""
) -> Iterator[tuple[RunSettings, StageProgress]]:
    timer, label = start_timer(), f"{stage} {part}".rstrip()
    with StageProgress(label, total, unit, is_silent=session.is_quiet) as progress:

        def on_done(item: TaskDone) -> None:
            progress.advance(from_cache=item.from_cache)

        store = Hdf5Store(session.cache)
        settings = RunSettings(
            store=store,
            workers=session.workers,
            force=stage in session.forced,
            on_done=on_done,
        )
        yield settings, progress
    if store.unusable:
        _log.warning(
            "%s: %d damaged entries of the cache set aside, computed again (such as %s)",
            label,
            len(store.unusable),
            store.unusable[0],
        )
    say(
        session,
        f"{label}: {progress.from_cache} {unit} from the cache, "
        f"{progress.computed} computed, {timer()}",
    )
