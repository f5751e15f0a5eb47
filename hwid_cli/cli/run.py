"""``hwid run``: all stages that a configuration names."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.options import Choices, stage_options

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session

# Sections of the configuration whose stages this version does not have.
_LATER = ("group", "test", "diagnose")


@click.command("run")
@stage_options
def command(choices: Choices) -> None:
    """Run all stages that the configuration names, in order.

    With --force, all of them ignore their cached results.
    """
    from hwid_cli.cli.session import STAGES, open_session, say

    session = open_session(choices, *STAGES)
    for section in _LATER:
        if getattr(session.experiment, section) is not None:
            say(
                session,
                f"{section}: named in {session.experiment.source}, but this "
                "version of hwid does not have it yet; left out",
            )
    run_stages(session)
    say(session, f"\nresults: {session.out}")


def run_stages(session: "Session") -> None:
    """Run the last stage that the configuration names, and so all before it.

    Parameters
    ----------
    session : Session

    Raises
    ------
    ConfigError
        If it names none.
    """
    from hwid_cli.cli.calibrate import calibrate_stage
    from hwid_cli.cli.crossval import crossval_stage, show_coverage
    from hwid_cli.cli.identify import identify_stage, show_fits
    from hwid_cli.cli.simulate import simulate_stage
    from hwid_cli.errors import ConfigError

    experiment = session.experiment
    if experiment.crossval is not None:
        identified, crossval = crossval_stage(session)
        show_fits(session, identified)
        show_coverage(session, identified, crossval)
    elif experiment.identify is not None:
        show_fits(session, identify_stage(session))
    elif experiment.calibrate is not None:
        calibrate_stage(session)
    elif experiment.simulate is not None:
        simulate_stage(session)
    else:
        raise ConfigError(
            f"{experiment.source}: names no stage; expected simulate, calibrate, "
            "identify or crossval; add the section of what is to be done, such as "
            "'crossval: {}'"
        )
