"""The kinds of simulation that a configuration may name, and where each is found.

The table of kinds is the union ``ForeignSimulation`` of ``records.programs``, to which the
drive comes. A kind is a record of that union and the module of this room that bears its
name, with one ``KIND``; it is loaded when it is asked for. Whoever runs a simulation looks
its kind up here and asks it what it can do. What only one kind has stays with its name:
an FMU with effects inside (``export.extended_fmu``), and what the drive is beyond a
simulation, which is all that a diagnosis opens.
"""

from importlib import import_module
from typing import TYPE_CHECKING, get_args

from hwid_cli.records.programs import ForeignSimulation

if TYPE_CHECKING:
    from hwid_cli.simulations.simulation import SimulationKind

# What ``simulation.kind`` may say.
KINDS = ("drive", *(str(one.kind) for one in get_args(ForeignSimulation)))


def kind_named(name: str) -> "SimulationKind":
    """Load a kind of simulation.

    Parameters
    ----------
    name : str
        One of ``KINDS``.
    """
    kind: SimulationKind = import_module(f"hwid_cli.simulations.{name}").KIND
    return kind
