"""Diagnoses of a small drive, and things that may be hidden in it."""

import joblib
import numpy as np

from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.diagnose import diagnose_all
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Workers
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    STEP_S,
    N,
    inputs,
    simulation,
)

FRICTION = {"coulomb_friction": {"force_N": 0.8}}
FEW = ("coulomb_friction", "input_dead_zone", "output_backlash")


def settings(store=None, *, jobs=1, on_done=None):
    return RunSettings(
        store=MemoryStore() if store is None else store,
        workers=Workers(jobs=jobs),
        on_done=on_done,
    )


_FINISHED = {}


def diagnosed(found, model=None, *, run=None, on_stage=None, **options):
    """Diagnosis with few effects to choose from, one at most.

    Made once for what several tests ask for, unless they say how it is to run.
    """
    options = DiagnoseOptions(**{"effects": FEW, "max_effects": 1, **options})
    model = model or simulation()

    def diagnose():
        announce = on_stage or (lambda what, count: None)
        return diagnose_all(found, model, options, run or settings(), announce)

    if run or on_stage:
        return diagnose()
    key = joblib.hash((found, model, options))
    if key not in _FINISHED:
        _FINISHED[key] = diagnose()
    return _FINISHED[key]


def parameters(effect):
    """Values by name."""
    return {one.name: one.value for one in effect.parameters}


def breathing():
    """A spring that changes all the time: nothing in the catalogue does that."""
    rng = np.random.default_rng(5)
    found = []
    for name, current in inputs().items():
        read = _breathing(current) + NOISE * rng.standard_normal(N)
        found.append(Recording(name, current, read, STEP_S, kind=name.split("_")[0]))
    return found


def _breathing(current):
    """Two steps of the midpoint rule for each sample."""
    h = STEP_S / 2
    fine = np.interp(np.arange(2 * N - 1) / 2, np.arange(N), current)
    x = v = 0.0
    path = np.zeros(2 * N - 1)
    for j in range(1, 2 * N - 1):
        push = DRIVE.force_constant_N_per_A * (fine[j - 1] + fine[j]) / 2
        turn = 2 * np.pi * (j - 0.5) * h / 0.13
        k = DRIVE.stiffness_N_per_m * (1 + 0.3 * np.sin(turn))
        c = DRIVE.damping_N_s_per_m
        middle = v + h / 2 * (push - k * x - c * v) / DRIVE.mass_kg
        half = x + h / 2 * v
        v += h * (push - k * half - c * middle) / DRIVE.mass_kg
        x += h * middle
        path[j] = x
    return path[::2]
