"""Small measurements of a drive that lacks one effect, beside its simulation."""

from dataclasses import replace
from functools import cache

import numpy as np

from hwid_cli.diagnosis.problem import Compared, DiagnosisProblem, Signals
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Drive

SAMPLE_TIME_S = 1e-3
DRIVE = Drive(
    mass_kg=0.3,
    damping_N_s_per_m=15.0,
    stiffness_N_per_m=1184.0,
    force_constant_N_per_A=5.0,
    reference_current_A=5.0,
    reference_displacement_m=0.02,
)
FULL_SCALE = 0.028


def white(rms):
    return NoiseFloor(rms, "differences", 0.0, False, (1.0,), "")


@cache
def inputs():
    """Steps, sines and multisines after 100 samples of rest, by name."""
    t = SAMPLE_TIME_S * np.arange(1450)
    found = {}
    for size in range(1, 6):
        for ramp in (0.005, 0.05, 0.2):
            found[f"step_{size}_{ramp}"] = size * np.interp(
                t, [0, 0.1, 0.1 + ramp, 0.7, 0.7 + ramp, 2], [0, 0, 1, 1, 0, 0]
            )
    for frequency in (1, 3, 7, 12, 25):
        for size in (2, 5):
            found[f"sine_{size}_{frequency}"] = size * np.sin(
                2 * np.pi * frequency * np.maximum(t - 0.1, 0)
            )
    for seed in range(2):
        phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 20)
        lines = [
            np.sin(2 * np.pi * f * (t - 0.1) + q) - np.sin(q)
            for f, q in zip(range(1, 41, 2), phases, strict=True)
        ]
        found[f"multisine_{seed}"] = np.where(t > 0.1, sum(lines) / 2, 0.0)
    return found


@cache
def motion_of_the_drive(name):
    """What the drive without effects makes of an input; not to be altered."""
    return simulate_drive(inputs()[name], DRIVE, sample_time_s=SAMPLE_TIME_S)


def compared(effects, *, noise_rms=2.8e-5, base=DRIVE, true=None, chosen=None, seed=1):
    """Measurements of the base with effects, beside the base's simulation."""
    true = replace(base if true is None else true, effects=effects)
    rng = np.random.default_rng(seed)
    found = []
    for name, driven_by in inputs().items():
        if chosen is not None and not name.startswith(chosen):
            continue
        truth = simulate_drive(driven_by, true, sample_time_s=SAMPLE_TIME_S)
        if base is DRIVE:
            motion = motion_of_the_drive(name)
        else:
            motion = simulate_drive(driven_by, base, sample_time_s=SAMPLE_TIME_S)
        measured = truth.output + rng.normal(0, noise_rms, driven_by.size)
        signals = Signals(
            name, name.split("_")[0], driven_by, measured, driven_by, measured,
            SAMPLE_TIME_S,
        )  # fmt: skip
        found.append(Compared(signals, motion.output, motion.position, motion.velocity))
    return found


def problem_of(measured, driven_by, drive=DRIVE):
    """Measurements without any simulation."""
    signals = tuple(
        Signals(f"r{j}", "step", u, y, u, y, SAMPLE_TIME_S)
        for j, (u, y) in enumerate(zip(driven_by, measured, strict=True))
    )
    return DiagnosisProblem(signals, drive)
