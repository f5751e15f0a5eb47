"""From recordings and a simulation to the problem that a diagnosis works on."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.diagnosis.problem import Problem, Signals
from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording


def prepare(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    held_out: Sequence[str],
) -> Problem:
    """Recordings as the fits need them, and the drive with its references.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one; with a reference each where the simulation has a controller.
    held_out : sequence of str
        Names of the recordings that are not trained on.
    """
    signals = tuple(_signals(one, simulation, options, held_out) for one in recordings)
    train = [one for one in signals if not one.is_held_out] or list(signals)
    return Problem(
        signals,
        drive_of(simulation, train),
        options.initial_state,
        recordings[0].input_unit
        if simulation.controller is not None
        else recordings[0].output_unit,
    )


def drive_of(simulation: SimulationOptions, train: Sequence[Signals]) -> Drive:
    """Drive that a configuration describes.

    Parameters
    ----------
    train : sequence of Signals
        Training recordings, whose largest magnitudes are the references where the
        configuration gives none.
    """
    current = max(float(np.max(np.abs(one.input))) for one in train)
    displacement = max(float(np.max(np.abs(one.output))) for one in train)
    return Drive(
        mass_kg=simulation.mass_kg,
        damping_N_s_per_m=simulation.damping_N_s_per_m,
        stiffness_N_per_m=simulation.stiffness_N_per_m,
        force_constant_N_per_A=simulation.force_constant_N_per_A,
        effects=simulation.effects,
        reference_current_A=simulation.reference_current_A or current or 1.0,
        reference_displacement_m=simulation.reference_displacement_m
        or displacement
        or 1.0,
        resistance_ohm=simulation.resistance_ohm,
        inductance_H=simulation.inductance_H,
        back_emf_V_s_per_m=simulation.back_emf_V_s_per_m,
        hold=simulation.hold,
        controller=simulation.controller,
    )


def _signals(
    recording: Recording,
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    held_out: Sequence[str],
) -> Signals:
    driven_by, compared = recording.input, recording.output
    if simulation.controller is not None and recording.reference is not None:
        driven_by, compared = recording.reference, recording.input
    # Compiled loops tell read-only arrays apart: plain copies need one compilation.
    return Signals(
        name=recording.name,
        kind=recording.kind,
        driven_by=np.array(driven_by),
        compared=np.array(compared),
        input=np.array(recording.input),
        output=np.array(recording.output),
        sample_time_s=recording.sample_time_s,
        skip=min(options.skip_samples, recording.n_samples - 1),
        is_held_out=recording.name in held_out,
    )
