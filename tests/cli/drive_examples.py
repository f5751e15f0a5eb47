"""Measurements of a drive with dry friction, and a simulation that lacks it."""

import math

import numpy as np

MASS, DAMPING, STIFFNESS, FORCE_CONSTANT, FRICTION = 0.3, 15.0, 1184.0, 5.0, 0.8
STEP_S, SUBSTEPS, N = 1e-3, 10, 500
NOISE = 2e-5
CONFIG = """\
name: drive
recordings:
  files: data/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
  kind: {step: "step_*", sine: "sine_*"}
orders: {nb: 1, nk: 1}
simulation:
  mass_kg: 0.3
  damping_N_s_per_m: 16.0
  stiffness_N_per_m: 1150.0
  force_constant_N_per_A: 5.1
diagnose: {effects: [coulomb_friction, quadratic_drag], max_effects: 1}
"""


def displacement(current):
    """Small steps; friction holds the mass where it could only turn it back."""
    x = v = 0.0
    h = STEP_S / SUBSTEPS
    found = np.zeros(current.size)
    # Plain numbers: numpy's own take five times as long one by one.
    at = current.tolist()
    for k in range(1, current.size):
        for j in range(SUBSTEPS):
            i = at[k - 1] + (at[k] - at[k - 1]) * (j + 0.5) / SUBSTEPS
            push = FORCE_CONSTANT * i - STIFFNESS * x - DAMPING * v
            free = v + h * push / MASS
            most = h * FRICTION / MASS
            v = math.copysign(max(abs(free) - most, 0.0), free)
            x += h * v
        found[k] = x
    return found


def currents():
    time = STEP_S * np.arange(N)
    for number, amplitude in enumerate((1.0, 2.0, 3.0, 4.0), start=1):
        there_and_back = np.interp(time, [0.05, 0.08, 0.35, 0.40], [0, 1, 1, 0])
        yield f"step_{number:02d}", amplitude * there_and_back
    for number, (amplitude, frequency) in enumerate(
        ((2.0, 4.0), (3.0, 7.0), (4.0, 4.0), (4.0, 11.0)), start=1
    ):
        yield f"sine_{number:02d}", amplitude * np.sin(2 * np.pi * frequency * time)


def write_measurements(folder):
    """Write a CSV file for each recording."""
    rng = np.random.default_rng(7)
    folder.mkdir(parents=True)
    for name, current in currents():
        output = displacement(current) + NOISE * rng.standard_normal(N)
        rows = np.column_stack([STEP_S * np.arange(N), current, output])
        head = "time_s,current_A,displacement_m"
        np.savetxt(
            folder / f"{name}.csv", rows, delimiter=",", header=head, comments=""
        )
