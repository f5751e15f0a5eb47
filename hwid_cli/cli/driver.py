"""How any stage is brought up to date and shown: the one driver of all of them."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from hwid_cli.cli.closing import say_end
from hwid_cli.cli.options import Choices
from hwid_cli.cli.progress_lines import ProgressLines
from hwid_cli.cli.report import FILE, write_report
from hwid_cli.cli.session import (
    Session,
    Timer,
    context_of,
    open_session,
    say_damaged,
    screen_width,
)
from hwid_cli.cli.stage_runner import StageRunner
from hwid_cli.config.load import describe_experiment
from hwid_cli.data.recording_files import recordings_options
from hwid_cli.data.recordings import check_unchanged
from hwid_cli.errors import CacheError, HwidError
from hwid_cli.report.table import WIDTH, Block, as_text
from hwid_cli.stages.stage import Stage
from hwid_cli.stages.table import STAGES, named, needed, stage_named
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.store.result_files import Provenance, current_versions, read_provenance

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
            if before == "calibrate":
                _refuse_early(session)
    return session.results[name]


def _refuse_early(session: Session) -> None:
    """Let later stages refuse what they would, before others have computed for hours."""
    for name in session.planned:
        if name not in STAGES or name in session.results:
            continue
        stage = stage_named(name)
        stage.require(session.experiment)
        if set(needed(name, session.experiment)) <= set(session.results):
            stage.choose(context_of(session))


def run_command(name: str, choices: Choices) -> None:
    """Do what the command of a stage does: bring it up to date, and show it.

    Parameters
    ----------
    name : str
        One of ``STAGES``.
    """
    stage, session = stage_named(name), open_session(choices, name)
    has_page = (session.out / FILE).is_file()
    session.plan(*needed(name, session.experiment), name)
    if has_page:
        session.plan("report")
    result_of(session, name)
    if not session.is_quiet:
        for shown in (*stage.shows_before, name):
            show_blocks(session, blocks_of(session, shown))
    if has_page:
        refresh_report(session)
    session.results.update(_current(session))
    say_end(session, name)


def refresh_report(session: Session) -> None:
    """Draw the page anew that shows older results; one that cannot be stays."""
    try:
        write_report(session)
    except HwidError as error:
        _log.warning("%s stays as it was: %s", session.out / FILE, error)


def _current(session: Session) -> dict[str, Any]:
    """Results of later stages that are there and still hold, as the page shows them."""
    found: dict[str, Any] = {}
    for name in named(session.experiment):
        stage = stage_named(name)
        needs = needed(name, session.experiment)
        if name in session.results or stage.storage is None or stage.key is None:
            continue
        known = {**session.results, **found}
        if not set(needs) <= set(known):
            continue
        try:
            given = stage.choose(replace(context_of(session), results=known))
            is_stored, result = _stored(session, stage, stage.key(given))
        except HwidError:
            continue
        if is_stored:
            found[name] = result
    return found


def blocks_of(session: Session, name: str) -> Sequence[Block]:
    """Tables and paragraphs of a stage that has run."""
    store = Hdf5Store(session.cache)
    context = replace(context_of(session), store=store)
    blocks = stage_named(name).tables(context, session.results[name])
    say_damaged(name, store)
    return blocks


def show_blocks(session: Session, blocks: Sequence[Block]) -> None:
    """Show tables and paragraphs to people, set off by a line; nothing where none are."""
    if blocks and not session.is_quiet:
        session.say(f"\n{text_of(session, blocks, screen_width())}")


def text_of(session: Session, blocks: Sequence[Block], width: int = WIDTH) -> str:
    """Tables and paragraphs of the session as plain text.

    Parameters
    ----------
    width : int, [characters]
        Of a line.
    """
    experiment = session.experiment
    return as_text(
        blocks,
        width=width,
        initial_state=experiment.fit.initial_state,
        thesis_names=experiment.thesis_names,
    )


def _run(session: Session, stage: Stage) -> Any:
    runner = StageRunner(session, stage.name)
    with ProgressLines(session, lambda: runner.doing):
        return _bring_up_to_date(session, stage, runner)


def _bring_up_to_date(session: Session, stage: Stage, runner: "StageRunner") -> Any:
    context, timer = context_of(session), Timer()
    given = session.given[stage.name] = stage.choose(context)
    for warning in stage.warnings(context, given):
        _log.warning("%s", warning)
    key = "" if stage.key is None else stage.key(given)
    is_stored, result = _stored(session, stage, key)
    origin = None
    if not is_stored:
        result = stage.compute(given, runner)
        if stage.storage is not None:
            origin = _origin(session, given, key, timer.seconds)
            stage.storage.write(session.out / stage.storage.file, given, result, origin)
    elif stage.storage is not None and stage.storage.is_hdf5:
        origin = read_provenance(session.out / stage.storage.file, stage.name)
    stage.write_files(session.out, given, result, origin, not is_stored)
    summary = stage.summary(given, result, is_stored)
    said = [one for one in (runner.counted, summary) if one]
    if said:
        session.note_end(stage.name, ", ".join(said), timer)
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
        check_unchanged(
            {one.source: one.sha256 for one in measured.recordings},
            recordings_options(session.experiment).columns,
        )
    return Provenance(
        key,
        describe_experiment(session.experiment),
        {one.name: one.sha256 for one in given.recordings},
        seconds,
        current_versions(),
    )
