"""Simulations of which only the outputs are at hand: a column of every recording."""

from hwid_cli.records.programs import Capabilities
from hwid_cli.simulations.simulation import SimulationKind

KIND = SimulationKind(lambda options: Capabilities(run=False))
