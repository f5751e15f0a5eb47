"""A few short recordings of a drive, with or without something that hides in it."""

from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate import SearchStart, base_of, fit_candidate
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.diagnosis.scales import scales_of_recordings
from hwid_cli.drive.simulation import drive_effects, simulate_drive
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording

STEP_S = 1e-3
N = 400
NOISE = 2e-5
DRIVE = Drive(
    mass_kg=0.3,
    damping_N_s_per_m=15.0,
    stiffness_N_per_m=1184.0,
    force_constant_N_per_A=5.0,
    reference_current_A=4.0,
    reference_displacement_m=0.02,
)


def inputs(n=N):
    """Steps there and back, and sines after a rest, by name."""
    time = STEP_S * np.arange(n)
    end = time[-1]
    found = {}
    for number, (size, ramp) in enumerate(
        ((1.5, 0.005), (4.0, 0.005), (-3.0, 0.05), (2.5, 0.05), (-1.0, 0.02))
    ):
        corners = [0.04, 0.04 + ramp, 0.6 * end, 0.6 * end + ramp]
        found[f"step_{number}"] = size * np.interp(time, corners, [0, 1, 1, 0])
    for number, (size, frequency) in enumerate(
        ((4.0, 5.0), (2.0, 9.0), (4.0, 14.0), (3.0, 24.0))
    ):
        turns = np.maximum(time - 0.04, 0.0) * frequency
        found[f"sine_{number}"] = size * np.sin(2 * np.pi * turns)
    return found


def recordings(effects=None, *, drive=DRIVE, noise=NOISE, seed=1, n=N, own=None):
    """What a sensor with white noise reads.

    ``own`` may give each recording, by its number, a drive of its own.
    """
    rng = np.random.default_rng(seed)
    found = []
    for number, (name, current) in enumerate(inputs(n).items()):
        true = replace(drive, effects=effects or {})
        true = own(number, true) if own else true
        motion = simulate_drive(current, true, sample_time_s=STEP_S)
        read = motion.output + noise * rng.standard_normal(n)
        found.append(Recording(name, current, read, STEP_S, kind=name.split("_")[0]))
    return found


def simulation(**changes):
    """What the configuration says of the drive: the right base, no effects."""
    return SimulationOptions(
        **{
            "mass_kg": DRIVE.mass_kg,
            "damping_N_s_per_m": DRIVE.damping_N_s_per_m,
            "stiffness_N_per_m": DRIVE.stiffness_N_per_m,
            "force_constant_N_per_A": DRIVE.force_constant_N_per_A,
            "reference_current_A": DRIVE.reference_current_A,
            "reference_displacement_m": DRIVE.reference_displacement_m,
            **changes,
        }
    )


def problem(found=None, *, held_out=(), options=None, **changes):
    """Recordings as the fits need them."""
    found = recordings() if found is None else found
    options = options or DiagnoseOptions()
    return prepare(found, simulation(**changes), options, held_out)


def sizes(of, frequencies_Hz=()):
    """Scales with a speed that the drive may reach."""
    largest = max(float(np.max(np.abs(one.output))) for one in of.signals)
    velocity = [np.full(3, 60.0 * largest) for _ in of.signals]
    return scales_of_recordings(of, velocity, frequencies_Hz)


def white(rms=NOISE):
    """Noise floor of a white sensor."""
    return NoiseFloor(rms, "differences", 0.0, False, (1.0,), "")


def search_start(of, effects=None, *, drive=None):
    """Where a search starts: the base as given, and the values of some effects."""
    present = drive_effects(of.drive)
    return SearchStart(base_of(drive or of.drive), {**present, **(effects or {})})


def fit(of, *starts, drive=None, scales=None):
    """Fit of the effects that the starts give values of; of the base without any."""
    starts = starts or ({},)
    begun = [search_start(of, one, drive=drive) for one in starts]
    return fit_candidate(of, tuple(starts[0]), begun, scales or sizes(of), white())


def in_turn(tasks, *, keep):
    """Run the tasks of a diagnosis one after the other, and keep nothing."""
    return [one.function(*one.arguments) for one in tasks]
