"""``hwid run``: all stages that a configuration names."""

from contextlib import suppress

from hwid_cli.cli.closing import TABLES, say_end
from hwid_cli.cli.driver import blocks_of, result_of, show_blocks, text_of
from hwid_cli.cli.options import Choices
from hwid_cli.cli.report import write_report
from hwid_cli.cli.session import Session, open_session
from hwid_cli.errors import ConfigError, HwidError, NothingToDo
from hwid_cli.files.atomic import replace_file
from hwid_cli.stages.table import STAGES, named, needed, none_named, stage_named
from hwid_cli.store.result_files import results_file


def run(choices: Choices) -> None:
    """Run all stages that the configuration names, in order."""
    session = open_session(choices, *STAGES)
    try:
        _run_stages(session)
    except NothingToDo:
        raise
    except HwidError:
        # What did run is worth looking at all the more, if it can be read.
        with suppress(HwidError):
            _report(session)
        raise
    _report(session)
    say_end(session, "run")


def _run_stages(session: Session) -> None:
    experiment = session.experiment
    stages = named(experiment)
    if not stages:
        raise ConfigError(none_named(experiment))
    for name in stages:
        session.plan(*needed(name, experiment), name)
    if "calibrate" in session.planned:
        session.plan("report")
    texts: list[str] = []
    try:
        for name in stages:
            result_of(session, name)
            if stage_named(name).is_shown_in_run:
                texts += _tables(session, name)
    finally:
        if texts:
            replace_file(session.out / TABLES, "\n".join(texts).encode())


def _tables(session: Session, name: str) -> list[str]:
    """Tables of a stage for the file of all tables; shown too where more is asked for."""
    blocks = blocks_of(session, name)
    if session.is_verbose:
        show_blocks(session, blocks)
    return [f"{text_of(session, blocks)}\n"] if blocks else []


def _report(session: Session) -> None:
    """Show what has run, unless it is measurements only."""
    if (session.out / results_file("calibrate")).is_file():
        write_report(session)
