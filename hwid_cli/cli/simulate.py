"""``hwid simulate``: virtual measurements of a simulated machine."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session


@click.command("simulate")
@stage_options
def command(choices: Choices) -> None:
    """Make virtual measurements of a simulated machine.

    Writes raw/*.csv, as raw as measured ones, and raw/plan.csv, which says how each was
    made.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "simulate")
    simulate_stage(session)
    say(session, f"results: {session.out / 'raw'}")


@once
def simulate_stage(session: "Session") -> None:
    """Bring the virtual measurements up to date.

    Parameters
    ----------
    session : Session

    Raises
    ------
    ConfigError
        If the configuration has no machine to simulate.
    """
    from hwid_cli.campaign.cache import task_key
    from hwid_cli.campaign.simulate import STAGE_VERSION, simulate_machine
    from hwid_cli.cli.session import say, start_timer
    from hwid_cli.errors import ConfigError
    from hwid_cli.files.raw import read_virtual_key, write_virtual_measurements

    machine = session.experiment.simulate
    if machine is None:
        raise ConfigError(
            f"{session.experiment.source}: simulate: missing; expected a machine to "
            "simulate; add the section (configs/README.md explains it), or start with "
            "'hwid calibrate' where measurements exist"
        )
    timer = start_timer()
    key = task_key("simulate", STAGE_VERSION, machine, [])
    if "simulate" not in session.forced and read_virtual_key(session.out) == key:
        say(session, f"simulate: measurements from the cache, {timer()}")
        return
    measurements = simulate_machine(machine)
    write_virtual_measurements(session.out, measurements, key=key)
    say(session, f"simulate: {len(measurements)} measurements computed, {timer()}")
