"""The kinds of simulation that a configuration may name: the only list of them.

A kind is a module of this room with one ``KIND``, loaded when a simulation of it runs.
Whoever runs a simulation looks its kind up here and knows none by name.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hwid_cli.simulations.simulation import SimulationKind

# What ``simulation.kind`` may say.
KINDS = ("drive", "python", "fmu", "command", "outputs", "model")


def kind_named(name: str) -> "SimulationKind":
    """Load a kind of simulation.

    Parameters
    ----------
    name : str
        One of ``KINDS``.
    """
    kind: SimulationKind = import_module(f"hwid_cli.simulations.{name}").KIND
    return kind
