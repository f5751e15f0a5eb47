"""``hwid run``: all stages that a configuration names."""

from contextlib import suppress

from hwid_cli.cli.driver import result_of, show
from hwid_cli.cli.options import Choices
from hwid_cli.cli.report import write_report
from hwid_cli.cli.session import Session, open_session
from hwid_cli.errors import ConfigError, HwidError, NothingToDo
from hwid_cli.stages.table import STAGES, named, stage_named
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
    session.say(f"\nresults: {session.out}")


def _run_stages(session: Session) -> None:
    experiment = session.experiment
    stages = named(experiment)
    if not stages:
        raise ConfigError(
            f"{experiment.source}: names no stage; expected some of "
            f"{', '.join(STAGES)}; add the section of what is to be done, such as "
            "'crossval: {}'"
        )
    for name in stages:
        result_of(session, name)
        if stage_named(name).is_shown_in_run:
            show(session, name)


def _report(session: Session) -> None:
    """Show what has run, unless it is measurements only."""
    if (session.out / results_file("calibrate")).is_file():
        write_report(session)
