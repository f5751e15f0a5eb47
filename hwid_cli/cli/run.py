"""``hwid run``: all stages that a configuration names."""

from contextlib import suppress
from typing import TYPE_CHECKING

import click

from hwid_cli.cli.options import Choices, stage_options

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session


@click.command("run")
@stage_options
def command(choices: Choices) -> None:
    """Run all stages that the configuration names, in order.

    With --force, all of them ignore their cached results.
    """
    from hwid_cli.cli.session import STAGES, open_session, say
    from hwid_cli.errors import HwidError

    session = open_session(choices, *STAGES)
    try:
        run_stages(session)
    except HwidError:
        # What did run is worth looking at all the more, if it can be read.
        with suppress(HwidError):
            _report(session)
        raise
    _report(session)
    say(session, f"\nresults: {session.out}")


def run_stages(session: "Session") -> None:
    """Run all stages that the configuration names, and so those that they need.

    Raises
    ------
    ConfigError
        If it names none.
    """
    from hwid_cli.errors import ConfigError

    experiment = session.experiment
    named = [name for name in _STAGES if getattr(experiment, name) is not None]
    if not named:
        raise ConfigError(
            f"{experiment.source}: names no stage; expected some of "
            f"{', '.join(_STAGES)}; add the section of what is to be done, such as "
            "'crossval: {}'"
        )
    for name in named:
        _STAGES[name](session)


def _simulate(session: "Session") -> None:
    from hwid_cli.cli.simulate import simulate_stage

    simulate_stage(session)


def _calibrate(session: "Session") -> None:
    from hwid_cli.cli.calibrate import calibrate_stage

    calibrate_stage(session)


def _identify(session: "Session") -> None:
    from hwid_cli.cli.identify import identify_stage, show_fits

    show_fits(session, identify_stage(session))


def _crossval(session: "Session") -> None:
    from hwid_cli.cli.crossval import crossval_stage, show_coverage

    show_coverage(session, *crossval_stage(session))


def _order(session: "Session") -> None:
    from hwid_cli.cli.order import map_stage, order_stage, show_advice, show_maps

    show_advice(session, order_stage(session))
    show_maps(session, map_stage(session))


def _group(session: "Session") -> None:
    from hwid_cli.cli.group import group_stage, show_groups

    show_groups(session, group_stage(session))


def _test(session: "Session") -> None:
    from hwid_cli.cli.test import final_test_stage, show_final_test

    show_final_test(session, final_test_stage(session))


def _diagnose(session: "Session") -> None:
    from hwid_cli.cli.diagnose import diagnose_stage, show_diagnosis

    show_diagnosis(session, diagnose_stage(session))


def _report(session: "Session") -> None:
    """Show what has run, unless it is measurements only."""
    from hwid_cli.cli.report import report_stage

    if session.calibrated_path.is_file():
        report_stage(session)


# In the order in which they work; the names are those of the configuration's sections.
_STAGES = {
    "simulate": _simulate,
    "calibrate": _calibrate,
    "identify": _identify,
    "crossval": _crossval,
    "order": _order,
    "group": _group,
    "test": _test,
    "diagnose": _diagnose,
}
