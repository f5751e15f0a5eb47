"""From recordings to the problem: signals, what is held out, what is evaluated."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.problem import (
    Compared,
    DiagnosisProblem,
    Signals,
    prepare,
)
from hwid_cli.records.axis import ROTARY_NAMES
from hwid_cli.records.drive import Controller, Drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording


def signals(driven_by, output, *, skip=0, held_out=False, step=0.01):
    driven_by, output = np.asarray(driven_by, float), np.asarray(output, float)
    return Signals(
        "r", "other", driven_by, output, driven_by, output, step, skip, held_out
    )  # fmt: skip


def test_the_rest_position_is_the_mean_of_the_output_before_the_input_moves():
    one = signals([0, 0, 0, 1, 1], [1.0, 2.0, 3.0, 50.0, 50.0])
    assert one.rest_position_m == pytest.approx(2.0)


def test_an_input_that_moves_at_once_rests_at_its_first_sample():
    one = signals([0, 1, 1], [4.0, 50.0, 50.0])
    assert one.rest_position_m == 4.0


UP, THERE_AND_BACK = [0.0, 1.0, 2.0, 2.96], [0.0, 2.0, 2.0, 1.8]


@pytest.mark.parametrize(
    ("outputs", "passes_once"),
    [
        ([UP], True),
        ([[0.0, -1.0, -2.0, -1.92]], True),
        ([THERE_AND_BACK], False),
        # Two recordings pass the same places at their own times and speeds.
        ([UP, UP], False),
        # One that only judges teaches nothing.
        ([UP, None], True),
    ],
)
def test_each_place_is_passed_once_by_one_recording_that_does_not_come_back(
    outputs, passes_once
):
    given = [
        signals([0, 1, 1, 1], UP if one is None else one, held_out=one is None)
        for one in outputs
    ]
    found = DiagnosisProblem(tuple(given), Drive(1.0, 1.0, 0.0, 1.0))
    assert found.passes_once == passes_once


@pytest.mark.parametrize(
    ("outputs", "way"),
    [
        ([UP], 2.96),
        # To both sides of where they start: in each of them place and time go together.
        ([UP, [0.0, -1.0, -2.0, -1.92]], 2.96),
        ([UP, THERE_AND_BACK], 0.0),
        # What only judges teaches nothing, of whatever length.
        ([UP, None], 2.96),
    ],
)
def test_the_way_of_recordings_that_do_not_come_back(outputs, way):
    longer = [5.0 * one for one in UP]
    given = [
        signals([0, 1, 1, 1], longer if one is None else one, held_out=one is None)
        for one in outputs
    ]
    found = DiagnosisProblem(tuple(given), Drive(1.0, 1.0, 0.0, 1.0))
    assert found.way_without_return == pytest.approx(way)
    pieces = tuple(replace(one, start=(0.0, 0.0)) for one in found.signals)
    assert replace(found, signals=pieces).way_without_return == 0.0


def test_skipped_samples_are_not_evaluated():
    one = signals([0, 1, 1, 1], [9.0, 9.0, 1.0, 3.0], skip=2)
    beside = Compared(one, np.zeros(4), np.zeros(4), np.zeros(4))

    assert one.n_evaluated == 2
    np.testing.assert_array_equal(beside.residual, [1.0, 3.0])
    assert beside.rms == pytest.approx(np.sqrt(5.0))


def test_a_problem_is_parted_into_held_out_and_other_recordings():
    first, second = signals([0, 1], [0, 1]), signals([0, 1], [0, 1], held_out=True)
    whole = DiagnosisProblem((first, second), Drive(), start="held")

    assert whole.n_evaluated == 4
    assert whole.part(held_out=True).signals == (second,)
    assert whole.part(held_out=False).signals == (first,)
    assert whole.part(held_out=True).start == "held"


def test_under_a_controller_the_command_is_compared():
    one = signals([0, 1], [0, 1])
    assert not DiagnosisProblem((one,), Drive()).compares_command
    assert DiagnosisProblem(
        (one,), Drive(controller=Controller(1.0, 1.0))
    ).compares_command


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


def test_at_least_one_sample_is_evaluated():
    assert [one.n_evaluated for one in prepared(skip_samples=2).signals] == [1, 1]
    assert [one.n_evaluated for one in prepared(skip_samples=99).signals] == [1, 1]


def test_the_start_is_estimated_only_where_the_options_say_so():
    assert prepared().start == "rest"
    assert prepared(initial_state="estimated").start == "estimated"


def test_the_input_drives_and_the_output_is_compared():
    first = prepared().signals[0]
    np.testing.assert_array_equal(first.driven_by, TRAIN.input)
    np.testing.assert_array_equal(first.compared, TRAIN.output)


def test_a_measured_velocity_gives_a_way_and_a_measured_position_a_velocity():
    simulation = SimulationOptions(output="velocity")
    speed = np.full(101, 2.0)
    given = [Recording("a", np.zeros(101), speed, 0.01, output_unit="m/s")]
    (found,) = prepare(given, simulation, DiagnoseOptions(), ()).signals
    np.testing.assert_allclose(found.position, 0.02 * np.arange(101), atol=1e-12)
    np.testing.assert_array_equal(found.velocity, speed)
    assert found.rest_position_m == 0.0

    simulation = SimulationOptions()
    given = [Recording("a", np.zeros(101), 0.02 * np.arange(101), 0.01)]
    (found,) = prepare(given, simulation, DiagnoseOptions(), ()).signals
    np.testing.assert_array_equal(found.position, given[0].output)
    np.testing.assert_allclose(found.velocity, 2.0)


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
        known={"damping_N_s_per_m": 0.1, "inductance_H": 0.0},
        output="velocity",
    )
    problem = prepare([TRAIN], simulation, DiagnoseOptions(), [])
    assert problem.known == simulation.known
    for name in vars(simulation):
        if name not in ("kind", "known", *ROTARY_NAMES.values()):
            assert getattr(problem.drive, name) == getattr(simulation, name), name


def test_an_inductance_that_may_be_fitted_again_is_an_effect_of_the_simulation():
    simulation = SimulationOptions(
        mass_kg=2.0, force_constant_N_per_A=5.0, resistance_ohm=9.0, inductance_H=0.01
    )
    drive = prepare([TRAIN], simulation, DiagnoseOptions(), []).drive
    assert drive.inductance_H == 0.0
    assert drive.effects == {"winding_inductance": {"inductance_H": 0.01}}


def test_a_rotating_axis_reaches_the_drive_by_the_names_of_a_straight_one():
    simulation = SimulationOptions(
        inertia_kg_m2=2.0,
        damping_N_m_s_per_rad=3.0,
        stiffness_N_m_per_rad=4.0,
        torque_constant_N_m_per_A=5.0,
        resistance_ohm=9.0,
        back_emf_V_s_per_rad=11.0,
    )
    drive = prepare([TRAIN], simulation, DiagnoseOptions(), []).drive
    assert drive.axis == "rotary"
    for old, new in ROTARY_NAMES.items():
        assert getattr(drive, old) == getattr(simulation, new)


@pytest.mark.parametrize(
    ("simulation", "start"),
    [
        (SimulationOptions(stiffness_N_per_m=100.0), "held"),
        (SimulationOptions(stiffness_N_per_m=0.0), "rest"),
        (
            SimulationOptions(stiffness_N_per_m=0.0, controller=Controller(20.0, 30.0)),
            "held",
        ),
    ],
)
def test_without_a_spring_nothing_pulls_a_drive_that_is_held(simulation, start):
    referred = [
        replace(one, reference=np.zeros(one.n_samples)) for one in (TRAIN, HELD)
    ]
    options = DiagnoseOptions(initial_state="held")
    assert prepare(referred, simulation, options, ["b"]).start == start
