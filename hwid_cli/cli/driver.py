"""How any stage is brought up to date and shown: the one driver of all of them."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import Session, Timer, open_session, screen_width
from hwid_cli.config.load import describe_experiment
from hwid_cli.data.recordings import check_unchanged
from hwid_cli.errors import CacheError
from hwid_cli.report.progress import StageProgress
from hwid_cli.report.table import Block, as_text
from hwid_cli.stages.stage import Context, Stage
from hwid_cli.stages.table import needed, stage_named
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.store.result_files import Provenance, current_versions, read_provenance
from hwid_cli.tasks.runner import RunSettings, TaskDone

_log = logging.getLogger(__name__)


def result_of(session: Session, name: str) -> Any:
    """Bring a stage up to date, after those that it needs.

    Parameters
    ----------
    name : str
        One of ``STAGES``.

    Returns
    -------
    object
        Its results; those of the same session are computed once.
    """
    stage_named(name).require(session.experiment)
    for before in (*needed(name, session.experiment), name):
        if before not in session.results:
            session.results[before] = _run(session, stage_named(before))
    return session.results[name]


def run_command(name: str, choices: Choices) -> None:
    """Do what the command of a stage does: bring it up to date, and show it.

    Parameters
    ----------
    name : str
        One of ``STAGES``.
    """
    stage, session = stage_named(name), open_session(choices, name)
    result_of(session, name)
    for shown in (*stage.shows_before, name):
        show(session, shown)
    there = [file for file in stage.files if (session.out / file).exists()]
    first, *others = there or [""]
    session.say("\n" + ", ".join([f"results: {session.out / first}", *others]))


def show(session: Session, name: str) -> None:
    """Show the tables of a stage that has run."""
    if session.is_quiet:
        return
    stage = stage_named(name)
    show_blocks(session, stage.tables(context_of(session), session.results[name]))


def show_blocks(session: Session, blocks: Sequence[Block]) -> None:
    """Show tables and paragraphs to people, set off by a line; nothing where none are."""
    if not blocks:
        return
    experiment = session.experiment
    text = as_text(
        blocks,
        width=screen_width(),
        initial_state=experiment.fit.initial_state,
        thesis_names=experiment.thesis_names,
    )
    session.say(f"\n{text}")


def context_of(session: Session) -> Context:
    """What stages may know of a session."""
    return Context(session.experiment, session.out, session.results, session.say)


def _run(session: Session, stage: Stage) -> Any:
    context = context_of(session)
    given = session.given[stage.name] = stage.choose(context)
    for warning in stage.warnings(context, given):
        _log.warning("%s", warning)
    timer = Timer()
    key = "" if stage.key is None else stage.key(given)
    is_stored, result = _stored(session, stage, key)
    origin = None
    if not is_stored:
        result = stage.compute(given, StageRunner(session, stage.name))
        if stage.storage is not None:
            origin = _origin(session, given, key, timer.seconds)
            stage.storage.write(session.out / stage.storage.file, given, result, origin)
    elif stage.storage is not None and stage.storage.is_hdf5:
        origin = read_provenance(session.out / stage.storage.file, stage.name)
    stage.write_files(session.out, given, result, origin, not is_stored)
    summary = stage.summary(given, result, is_stored)
    if summary:
        session.say(f"{stage.name}: {summary}, {timer}")
    return result


def _stored(session: Session, stage: Stage, key: str) -> tuple[bool, Any]:
    """Whether the results on disk are those that the stage would give now, and they."""
    storage = stage.storage
    if storage is None or stage.name in session.forced:
        return False, None
    if storage.key(session.out) != key:
        return False, None
    try:
        return True, storage.read(session.out / storage.file)
    except CacheError as error:
        _log.warning("%s (%s comes back from the cache now)", error, stage.name)
        return False, None


def _origin(session: Session, given: Any, key: str, seconds: float) -> Provenance:
    """Where results come from, said right before they are stored."""
    measured = session.given.get("calibrate")
    if measured is not None:
        check_unchanged({one.source: one.sha256 for one in measured.recordings})
    return Provenance(
        key,
        describe_experiment(session.experiment),
        {one.name: one.sha256 for one in given.recordings},
        seconds,
        current_versions(),
    )


@dataclass(frozen=True, eq=False)
class StageRunner:
    """Runs the tasks of a stage, or of a command, with the session's workers and cache.

    Parameters
    ----------
    name : str
        Of the stage, for the progress bar and ``--force``.
    """

    session: Session
    name: str

    @contextmanager
    def tasks(self, total: int, unit: str, *, part: str = "") -> Iterator[RunSettings]:
        """Run tasks of one kind under a progress bar, and sum up at the end.

        Parameters
        ----------
        total : int, [-]
            Tasks.
        unit : str
            What one task is, in the plural.
        part : str
            Which part of the stage, where it has several.
        """
        with self._progress(total, unit, part) as (settings, _):
            yield settings

    @contextmanager
    def rounds(
        self, unit: str
    ) -> Iterator[tuple[RunSettings, Callable[[str, int], None]]]:
        """Run tasks that come in rounds, each with a progress bar.

        Parameters
        ----------
        unit : str
            What one task is, in the plural.

        Yields
        ------
        RunSettings
        callable
            Takes what the next round does and how many tasks it has.
        """
        with self._progress(0, unit, "") as (settings, progress):
            yield (
                settings,
                lambda text, total: progress.begin_round(f"{self.name}: {text}", total),
            )

    @contextmanager
    def _progress(
        self, total: int, unit: str, part: str
    ) -> Iterator[tuple[RunSettings, StageProgress]]:
        session, timer, label = self.session, Timer(), f"{self.name} {part}".rstrip()
        with StageProgress(label, total, unit, is_silent=session.is_quiet) as progress:

            def on_done(item: TaskDone) -> None:
                progress.advance(from_cache=item.from_cache)

            store = Hdf5Store(session.cache)
            is_forced = self.name in session.forced
            settings = RunSettings(store, session.workers, is_forced, on_done)
            yield settings, progress
        if store.unusable:
            _log.warning(
                "%s: %d damaged entries of the cache set aside, computed again "
                "(such as %s)",
                label,
                len(store.unusable),
                store.unusable[0],
            )
        session.say(
            f"{label}: {progress.from_cache} {unit} from the cache, "
            f"{progress.computed} computed, {timer}"
        )
