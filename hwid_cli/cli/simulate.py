"""``hwid simulate``: virtual measurements, and a physics model beside the recordings."""

import logging

from hwid_cli.cli.closing import say_end
from hwid_cli.cli.driver import result_of, show_blocks
from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import Session, Timer, context_of, open_session
from hwid_cli.diagnosis.run_starts import starts_sentence
from hwid_cli.report.diagnosis import simulated_table
from hwid_cli.report.formats import counted
from hwid_cli.stages.diagnose import choose, simulated_recordings
from hwid_cli.stages.table import stage_named
from hwid_cli.store.diagnosis_results import write_simulated_csv

_log = logging.getLogger(__name__)


def simulate(name: str, choices: Choices) -> None:
    """Make virtual measurements, or simulate what was measured.

    Parameters
    ----------
    name : str
        Of the stage.
    """
    session = open_session(choices, name)
    experiment = session.experiment
    is_drive = experiment.simulation is not None
    # Virtual measurements need no recordings section as long as nothing reads them.
    is_read = experiment.simulate is None or experiment.recordings is not None
    is_made = experiment.simulate is not None or not is_drive
    if is_made:
        session.plan(name)
        result_of(session, name)
    if is_drive and is_read:
        session.plan("calibrate")
        _simulate_drive(session)
    say_end(session, name, ("raw", "simulated"))


def _simulate_drive(session: Session) -> None:
    """Simulate the recordings by the physics model and show how far off it is."""
    result_of(session, "calibrate")
    given, timer = choose(context_of(session)), Timer()
    if session.experiment.foreign_simulation is not None:
        for said in stage_named("diagnose").warnings(context_of(session), given):
            _log.warning("%s", said)
    curves = simulated_recordings(given)
    folder = session.out / "simulated"
    for one in curves:
        columns = (one.time_s, one.input, one.measured, one.simulated)
        write_simulated_csv(folder / f"{one.name}.csv", columns)
    session.note(f"simulate: {counted(len(curves), 'recording')} simulated, {timer}")
    # In a closed loop it is the controller's command that the two are compared by.
    has_controller = getattr(given.simulation, "controller", None) is not None
    side = "input" if has_controller else "output"
    unit = getattr(given.recordings[0], f"{side}_unit")
    if said := starts_sentence({one.name: one.start for one in curves}, unit):
        _log.warning("%s", said)
    show_blocks(session, [simulated_table(curves, side, unit)])
