"""From recordings to the problem: signals, what is held out, what is evaluated."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.problem import (
    Compared,
    DiagnosisProblem,
    Signals,
    held_out_names,
    prepare,
    rest_length,
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


def test_the_rest_ends_where_the_input_has_moved():
    assert rest_length(np.array([2.0, 2.0, 2.0, 3.0, 2.0])) == 3


def test_a_change_below_a_thousandth_of_the_input_is_rest():
    assert rest_length(np.array([0.0, 0.0009, 0.0, 1.0])) == 3
    assert rest_length(np.array([0.0, 0.0011, 0.0, 1.0])) == 1


def test_a_constant_input_rests_all_the_time():
    assert rest_length(np.full(7, 2.0)) == 7


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


TIME = 1e-3 * np.arange(400)


def recording(name, current, kind="step"):
    return Recording(name, current, np.zeros(current.size), 1e-3, kind=kind)


def step(name, size, ramp=0.05):
    return recording(name, size * np.interp(TIME, [0.1, 0.1 + ramp], [0, 1]))


def sine(name, size, frequency):
    current = size * np.sin(2 * np.pi * frequency * TIME)
    return recording(name, current, "sine")


def table():
    """Every size with every speed."""
    return [
        step(f"{size}_{ramp}", size, ramp)
        for size in (1.0, 2.0, 3.0)
        for ramp in (0.005, 0.02, 0.1)
    ]


def test_every_third_of_a_table_is_held_out():
    assert len(held_out_names(table())) == 3


def test_every_size_and_every_speed_is_on_both_sides():
    held = held_out_names(table())
    sizes = {name.split("_")[0] for name in held}
    speeds = {name.split("_")[1] for name in held}
    assert (len(sizes), len(speeds)) == (3, 3)


def test_repeats_are_on_both_sides():
    repeats = [step(f"r{k}", 2.0) for k in range(3)]
    assert len(held_out_names(repeats)) == 1


def test_repeats_of_a_noisy_current_are_still_repeats():
    rng = np.random.default_rng(3)
    repeats = [
        recording(f"r{k}", step("", 2.0).input + 1e-3 * rng.standard_normal(400))
        for k in range(6)
    ]
    assert len(held_out_names(repeats)) == 2


def test_every_kind_is_on_both_sides():
    given = [
        *(step(f"step_{k}", k) for k in (1, 2, 3)),
        *(sine(f"sine_{k}", 2.0, k) for k in (2, 5, 9)),
    ]
    held = held_out_names(given)
    assert {name.split("_")[0] for name in held} == {"step", "sine"}
    assert len(held) == 2


def test_a_lone_recording_of_a_kind_trains():
    given = [*(step(f"step_{k}", k) for k in (1, 2, 3)), sine("sine", 2.0, 5)]
    assert "sine" not in held_out_names(given)


def test_of_two_recordings_one_is_held_out():
    assert len(held_out_names([step("a", 1.0), step("b", 2.0)])) == 1
    assert len(held_out_names([step("a", 1.0), sine("b", 2.0, 5)])) == 1


def test_of_few_recordings_at_most_half_are_held_out_small_and_large_ones():
    rng = np.random.default_rng(0)
    for _ in range(40):
        sizes, speeds = rng.uniform(0.5, 3, 9), rng.uniform(0.5, 6, 9)
        n = int(rng.integers(3, 10))
        pairs = list(zip(sizes, speeds, strict=True))[:n]
        given = [sine(f"r{row}", *one) for row, one in enumerate(pairs)]
        held = [int(name[1:]) for name in held_out_names(given)]
        assert 1 <= len(held) <= n / 2
        # Where many are, they are of several sizes.
        if len(held) > 2:
            assert np.ptp(sizes[held]) > 0.3 * np.ptp(sizes[:n])


def test_a_single_recording_is_not_held_out():
    assert held_out_names([step("a", 1.0)]) == ()


def test_names_are_in_the_order_of_the_recordings():
    given = table()
    names = [one.name for one in given]
    held = held_out_names(given)
    assert list(held) == [name for name in names if name in held]


@pytest.mark.parametrize("n", range(2, 13))
def test_both_sides_always_have_a_recording(n):
    rng = np.random.default_rng(n)
    given = [
        sine(f"r{k}", size, frequency)
        for k, (size, frequency) in enumerate(rng.uniform(1, 20, (n, 2)))
    ]
    assert 1 <= len(held_out_names(given)) < n


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


def test_at_least_a_quarter_is_held_out_and_training_sees_all_of_the_range():
    rng = np.random.default_rng(1)
    for _ in range(200):
        n = int(rng.integers(8, 14))
        sizes, speeds = rng.uniform(0.5, 3, n), rng.uniform(0.5, 6, n)
        pairs = zip(sizes, speeds, strict=True)
        given = [sine(f"r{row}", *one) for row, one in enumerate(pairs)]
        held = [int(name[1:]) for name in held_out_names(given)]
        assert len(held) >= n // 4
        assert np.delete(sizes, held).max() >= 0.95 * sizes.max()
