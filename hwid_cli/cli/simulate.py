"""``hwid simulate``: virtual measurements, and a physics model beside the recordings."""

from typing import TYPE_CHECKING

import click

from hwid_cli.cli.options import Choices, stage_options
from hwid_cli.cli.stages import once

if TYPE_CHECKING:
    from hwid_cli.cli.session import Session


@click.command("simulate")
@stage_options
def command(choices: Choices) -> None:
    """Make virtual measurements, or simulate what was measured.

    With a simulate: section, writes raw/*.csv, as raw as measured ones, and
    raw/plan.csv, which says how each was made. With a simulation: section, computes what
    that physics model makes of the input of every recording, writes simulated/*.csv and
    shows the distance to what was measured.
    """
    from hwid_cli.cli.session import open_session, say

    session = open_session(choices, "simulate")
    experiment = session.experiment
    is_drive = experiment.simulation is not None
    # Virtual measurements need no recordings section as long as nothing reads them.
    is_read = experiment.simulate is None or experiment.recordings is not None
    if experiment.simulate is not None or not is_drive:
        simulate_stage(session)
        say(session, f"results: {session.out / 'raw'}")
    if is_drive and is_read:
        simulate_drive(session)


@once
def simulate_stage(session: "Session") -> None:
    """Bring the virtual measurements up to date.

    Raises
    ------
    ConfigError
        If the configuration has no machine to simulate.
    """
    from hwid_cli.cli.session import say, start_timer
    from hwid_cli.data.virtual_measurements import (
        read_virtual_key,
        write_virtual_measurements,
    )
    from hwid_cli.errors import ConfigError
    from hwid_cli.stages.simulate import STAGE_VERSION, simulate_machine
    from hwid_cli.tasks.cache import task_key

    machine = session.experiment.simulate
    if machine is None:
        raise ConfigError(
            f"{session.experiment.source}: simulate: missing; expected a machine to "
            "simulate; add the section (configs/README.md explains it), or simulation: "
            "where measurements exist"
        )
    timer = start_timer()
    key = task_key("simulate", STAGE_VERSION, machine, [])
    if "simulate" not in session.forced and read_virtual_key(session.out) == key:
        say(session, f"simulate: measurements from the cache, {timer()}")
        return
    measurements = simulate_machine(machine)
    write_virtual_measurements(session.out, measurements, key=key)
    say(session, f"simulate: {len(measurements)} measurements computed, {timer()}")


def simulate_drive(session: "Session") -> None:
    """Simulate the recordings by the physics model and show how far off it is.

    Raises
    ------
    ConfigError
        If the configuration has no such model, or names unknown recordings.
    """
    from hwid_cli.cli.diagnose import what_to_diagnose
    from hwid_cli.cli.session import say, show, start_timer
    from hwid_cli.report.diagnosis import simulated_table
    from hwid_cli.stages.simulate_drive import simulate_recordings
    from hwid_cli.store.diagnosis_results import write_simulated_csv

    given = what_to_diagnose(session)
    timer = start_timer()
    curves = simulate_recordings(given.recordings, given.simulation, given.options)
    folder = session.out / "simulated"
    for one in curves:
        columns = (one.time_s, one.input, one.measured, one.simulated)
        write_simulated_csv(folder / f"{one.name}.csv", columns)
    say(session, f"simulate: {len(curves)} recordings simulated, {timer()}")
    # In a closed loop it is the controller's command that the two are compared by.
    side = "output" if given.simulation.controller is None else "input"
    unit = getattr(given.recordings[0], f"{side}_unit")
    show(session, simulated_table(curves, side, unit))
    say(session, f"\nresults: {folder}")
