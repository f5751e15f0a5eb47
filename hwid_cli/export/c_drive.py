"""A physics simulation as one self-contained C99 file."""

import math

from hwid_cli.drive import controller, slots
from hwid_cli.drive.motion import push, state
from hwid_cli.errors import ConfigError
from hwid_cli.export.c_source import card_text, comment_lines, filled, numbers
from hwid_cli.records.exported import ExportedSimulation

_HOLDS = {"linear": "a straight line", "zero": "held"}
# A longer delay would make the state of the model unbearably large, [samples].
_LONGEST_DELAY = 100_000


def drive_source(exported: ExportedSimulation) -> str:
    """Text of a C file that computes what ``hwid predict`` does.

    Parameters
    ----------
    exported : ExportedSimulation
        With its slots.

    Returns
    -------
    str
        ASCII.

    Raises
    ------
    ConfigError
        If it holds something that no program can do sample by sample.
    """
    drive, step = exported.drive, exported.sample_time_s
    if drive.hold not in _HOLDS:
        raise ConfigError(
            f"--format c: simulation.hold {drive.hold}: follows a smooth curve through "
            "inputs that are yet to come; expected linear or zero; use --format json"
        )
    if exported.slots[slots.CLOCK_GAIN] != 0:
        raise ConfigError(
            "--format c: simulation.effects.clock_skew: reads the motion further and "
            "further away from the input's time; expected one clock; use --format json"
        )
    delay = float(exported.slots[slots.DELAY])
    n_history = math.floor(delay / step) + 2
    if n_history > _LONGEST_DELAY:
        raise ConfigError(
            f"--format c: simulation.effects.input_delay.delay_s {delay:g}: expected at "
            f"most {_LONGEST_DELAY} samples of {step:g} s; use --format json"
        )
    effects = ", ".join(drive.effects) or "mass, spring and damper"
    return filled(
        "drive.c",
        {
            **card_text(exported.card, step),
            "effects": comment_lines(effects),
            "hold": _HOLDS[drive.hold],
            "n_slots": exported.slots.size,
            "n_state": state.N_STATE,
            "n_control": controller.N_CONTROL,
            "n_memory": state.N_MEMORY,
            "n_room": push.N_ROOM,
            "n_history": n_history,
            "kernels": filled("drive_kernels.c", {}),
            "parameters": numbers(exported.slots),
        },
    )
