"""What a kind of simulation must offer."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hwid_cli.records.drive import DriveResponse
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording


@dataclass(frozen=True, eq=False)
class SimulationKind:
    """How simulations of one kind are run.

    Parameters
    ----------
    simulate : callable
        From recordings, the simulation and how recordings start to each recording beside
        what the simulation makes of its input; NaN where it runs away.
    """

    simulate: Callable[
        [Sequence[Recording], SimulationOptions, DiagnoseOptions],
        tuple[DriveResponse, ...],
    ]
