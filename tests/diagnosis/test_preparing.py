"""From recordings and a configuration to the problem."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.problem import prepare
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording

TRAIN = Recording("a", np.array([0.0, 2.0, -3.0]), np.array([0.0, 0.1, -0.4]), 1e-3)
HELD = Recording("b", np.array([0.0, 9.0, 0.0]), np.array([0.0, 0.8, 0.0]), 1e-3)


def prepared(**changes):
    options = DiagnoseOptions(**changes)
    return prepare([TRAIN, HELD], SimulationOptions(), options, ["b"])


def test_references_are_the_largest_magnitudes_of_the_training_recordings():
    drive = prepared().drive
    assert drive.reference_current_A == 3.0
    assert drive.reference_displacement_m == pytest.approx(0.4)


def test_references_of_the_configuration_stand():
    simulation = SimulationOptions(
        reference_current_A=7.0, reference_displacement_m=0.5
    )
    drive = prepare([TRAIN], simulation, DiagnoseOptions(), []).drive
    assert (drive.reference_current_A, drive.reference_displacement_m) == (7.0, 0.5)


def test_a_recording_without_motion_leaves_references_that_can_be_divided_by():
    still = replace(TRAIN, input=np.zeros(3), output=np.zeros(3))
    drive = prepare([still], SimulationOptions(), DiagnoseOptions(), []).drive
    assert (drive.reference_current_A, drive.reference_displacement_m) == (1.0, 1.0)


def test_if_all_are_held_out_they_give_the_references():
    drive = prepare([HELD], SimulationOptions(), DiagnoseOptions(), ["b"]).drive
    assert drive.reference_current_A == 9.0


def test_the_names_that_are_held_out_are_marked():
    assert [one.is_held_out for one in prepared().signals] == [False, True]


def test_at_least_one_sample_is_judged():
    assert [one.n_judged for one in prepared(skip_samples=2).signals] == [1, 1]
    assert [one.n_judged for one in prepared(skip_samples=99).signals] == [1, 1]


def test_the_start_is_estimated_only_where_the_options_say_so():
    assert prepared().start == "rest"
    assert prepared(initial_state="estimated").start == "estimated"


def test_the_input_drives_and_the_output_is_compared():
    first = prepared().signals[0]
    np.testing.assert_array_equal(first.driven_by, TRAIN.input)
    np.testing.assert_array_equal(first.compared, TRAIN.output)


def test_under_a_controller_the_reference_drives_and_the_command_is_compared():
    path = np.array([0.0, 0.2, -0.5])
    simulation = SimulationOptions(controller=Controller(20.0, 50.0))
    one = replace(TRAIN, reference=path)
    (signals,) = prepare([one], simulation, DiagnoseOptions(), []).signals

    np.testing.assert_array_equal(signals.driven_by, path)
    np.testing.assert_array_equal(signals.compared, TRAIN.input)
    np.testing.assert_array_equal(signals.output, TRAIN.output)


def test_every_setting_of_the_simulation_reaches_the_drive():
    simulation = SimulationOptions(
        mass_kg=2.0,
        damping_N_s_per_m=3.0,
        stiffness_N_per_m=4.0,
        force_constant_N_per_A=5.0,
        effects={"coulomb_friction": {"force_N": 6.0}},
        reference_current_A=7.0,
        reference_displacement_m=8.0,
        resistance_ohm=9.0,
        inductance_H=10.0,
        back_emf_V_s_per_m=11.0,
        hold="smooth",
    )
    drive = prepare([TRAIN], simulation, DiagnoseOptions(), []).drive
    for name in vars(simulation):
        if name != "kind":
            assert getattr(drive, name) == getattr(simulation, name), name
