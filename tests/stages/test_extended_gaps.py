"""What a diagnosis says is left, and what the simulation that it writes leaves."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.causes import without_repeats
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.simulations.drive import simulate_recordings
from hwid_cli.stages.diagnose import extended_options
from tests.diagnosis.small_drive import DRIVE, recordings, simulation
from tests.stages.diagnosed_drive import FRICTION, diagnosed

FREE = replace(DRIVE, stiffness_N_per_m=0.0)


def with_repeats():
    """A sine whose input, on a grid, is read with single repeats."""
    found = recordings(FRICTION)
    rows = np.arange(57, 380, 17)
    for row, one in enumerate(found):
        if one.name == "sine_2":
            noise = np.random.default_rng(3).standard_normal(one.n_samples)
            read = np.round(one.input + 0.2 * noise, 2)
            read[rows] = read[rows - 1]
            found[row] = replace(one, input=read)
    return found


def in_motion():
    """Recordings of which the first samples are cut off."""
    return [
        replace(one, input=one.input[75:], output=one.output[75:])
        for one in recordings(FRICTION)
    ]


MACHINES = {
    "spring": (recordings(FRICTION), simulation(), "rest"),
    "free": (
        recordings(FRICTION, drive=FREE), simulation(stiffness_N_per_m=0.0), "rest"
    ),
    "in motion": (in_motion(), simulation(), "estimated"),
    "held": (recordings(FRICTION), simulation(), "held"),
    "repeats": (with_repeats(), simulation(), "rest"),
}  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("name", MACHINES)
def test_the_written_simulation_leaves_what_the_diagnosis_says(name):
    read, model, start = MACHINES[name]
    found = diagnosed(read, model, effects=("coulomb_friction",), initial_state=start)
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    options = DiagnoseOptions(initial_state=start)
    runs = simulate_recordings(read, extended_options(found, model), options)
    for gap, run in zip(found.gaps, runs, strict=True):
        assert run.rms == pytest.approx(gap.rms_after, rel=1e-5), gap.name


def test_the_repeats_above_are_seen_as_such():
    read, model, _ = MACHINES["repeats"]
    problem = prepare(read, model, DiagnoseOptions(), ())
    changed = [
        one.name
        for one, before in zip(
            without_repeats(problem).signals, problem.signals, strict=True
        )
        if one is not before
    ]
    assert changed == ["sine_2"]
