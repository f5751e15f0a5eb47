"""Simulation of a drive on measured inputs, beside what was measured."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.causes import without_damage, without_repeats
from hwid_cli.diagnosis.found_start import with_found_start
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.drive import DriveResponse
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.programs import Capabilities
from hwid_cli.records.recordings import Recording
from hwid_cli.simulations.simulation import SimulationKind


def simulate_recordings(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> tuple[DriveResponse, ...]:
    """Simulate a drive on the inputs of recordings, with the given parameters.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    options : DiagnoseOptions
        How recordings start and from which sample they are judged.

    Returns
    -------
    tuple of DriveResponse
        In the order of the recordings. NaN where the simulation runs away.
    """
    # As a diagnosis does: its numbers are those of the simulation that it writes.
    problem = without_repeats(prepare(recordings, simulation, options, ()))
    problem = with_found_start(without_damage(problem))
    return tuple(
        DriveResponse(
            one.signals.name,
            one.signals.sample_time_s * np.arange(one.signals.compared.size),
            one.signals.driven_by,
            one.signals.compared,
            one.simulated,
            one.rms,
        )
        for one in compared_as_given(problem)
    )


def _capabilities(simulation: SimulationOptions) -> Capabilities:  # noqa: ARG001
    return Capabilities(run=True, parameters=True, force=True)


KIND = SimulationKind(_capabilities)
