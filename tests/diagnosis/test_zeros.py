"""Recordings that a sensor reads from different zeros."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.diagnose import diagnose
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import NOISE, in_turn, recordings, simulation
from tests.stages.diagnosed_drive import FRICTION

FEW = ("coulomb_friction", "constant_load", "sensor_drift")


def found(given, of=None):
    options = DiagnoseOptions(effects=FEW, max_effects=1)
    return diagnose(given, of or simulation(), options, in_turn, lambda what, n: None)


def moved(given, zeros):
    return [
        replace(one, output=one.output + zero)
        for one, zero in zip(given, zeros, strict=True)
    ]


ZEROS = 1e-3 * np.random.default_rng(3).standard_normal(9)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("stiffness", "verdict"), [(1184.0, "none"), (1000.0, "parameters")]
)
def test_zeros_that_differ_are_no_effect(stiffness, verdict):
    diagnosis = found(
        moved(recordings(), ZEROS), simulation(stiffness_N_per_m=stiffness)
    )

    assert diagnosis.verdict == verdict
    assert "the sensor's zero, which differs between recordings" in diagnosis.summary
    after = {one.name: one.after for one in diagnosis.base}
    assert after["stiffness_N_per_m"] == pytest.approx(1184.0, rel=2e-3)
    assert diagnosis.after.held_out_rms == pytest.approx(NOISE, rel=0.05)


@pytest.mark.thorough
def test_one_zero_of_all_recordings_is_a_constant_load():
    diagnosis = found(moved(recordings(), np.full(9, 1e-3)))

    assert diagnosis.verdict == "named"
    assert [one.id for one in diagnosis.effects] == ["constant_load"]


@pytest.mark.thorough
def test_zeros_hide_no_friction():
    diagnosis = found(recordings(FRICTION))

    assert [one.id for one in diagnosis.effects] == ["coulomb_friction"]


@pytest.mark.thorough
def test_where_more_is_missing_the_zeros_are_not_the_cause():
    diagnosis = found(moved(recordings(FRICTION), ZEROS))

    assert diagnosis.verdict not in ("none", "parameters")
