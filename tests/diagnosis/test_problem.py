"""What a diagnosis works on: recordings as signals, what is judged, typical sizes."""

import numpy as np
import pytest

from hwid_cli.diagnosis.problem import Compared, Problem, Signals, rest_length, scales
from hwid_cli.records.drive import Controller, Drive


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


def test_skipped_samples_are_not_judged():
    one = signals([0, 1, 1, 1], [9.0, 9.0, 1.0, 3.0], skip=2)
    beside = Compared(one, np.zeros(4), np.zeros(4), np.zeros(4))

    assert one.n_judged == 2
    np.testing.assert_array_equal(beside.residual, [1.0, 3.0])
    assert beside.rms == pytest.approx(np.sqrt(5.0))


def test_a_problem_is_parted_into_held_out_and_other_recordings():
    first, second = signals([0, 1], [0, 1]), signals([0, 1], [0, 1], held_out=True)
    whole = Problem((first, second), Drive(), start="held")

    assert whole.n_judged == 4
    assert whole.part(held_out=True).signals == (second,)
    assert whole.part(held_out=False).signals == (first,)
    assert whole.part(held_out=True).start == "held"


def test_under_a_controller_the_command_is_compared():
    one = signals([0, 1], [0, 1])
    assert not Problem((one,), Drive()).compares_command
    assert Problem((one,), Drive(controller=Controller(1.0, 1.0))).compares_command


def two_recordings(**drive):
    return Problem(
        (
            signals([0.0, 2.0, 2.0], [0.0, -0.3, 0.1]),
            signals([0.0, -3.0, -2.5, -2.5], [0.0, 0.2, 0.0, 0.0]),
        ),
        Drive(**drive),
    )


def test_scales_are_the_largest_of_all_recordings():
    of = two_recordings(
        mass_kg=2.0, stiffness_N_per_m=50.0, force_constant_N_per_A=-4.0
    )
    found = scales(of, [np.array([0.5, -0.7]), np.array([0.6, np.nan])], (12.0,))

    assert found.displacement_m == pytest.approx(0.3)
    assert found.stroke_m == pytest.approx(0.4)
    assert found.current_A == pytest.approx(3.0)
    assert found.current_rate_A_per_s == pytest.approx(300.0)
    assert found.velocity_m_per_s == pytest.approx(0.7)
    assert found.force_N == pytest.approx(12.0)
    assert found.duration_s == pytest.approx(0.04)
    assert found.frequencies_Hz == (12.0,)


def test_the_natural_frequency_comes_from_mass_and_spring():
    of = two_recordings(mass_kg=2.0, stiffness_N_per_m=2.0 * (2 * np.pi * 80) ** 2)
    assert scales(of, [np.ones(2)] * 2).natural_Hz == pytest.approx(80.0)


def test_a_free_axis_has_two_periods_in_its_longest_recording():
    of = two_recordings(stiffness_N_per_m=0.0)
    assert scales(of, [np.ones(2)] * 2).natural_Hz == pytest.approx(50.0)


def test_the_force_of_a_voltage_is_that_of_its_current():
    of = two_recordings(force_constant_N_per_A=4.0, resistance_ohm=8.0)
    assert scales(of, [np.ones(2)] * 2).force_N == pytest.approx(1.5)


def test_scales_of_recordings_without_motion_are_not_zero():
    still = Problem((signals([0, 1, 1], [0, 0, 0]),), Drive())
    found = scales(still, [np.zeros(3)])
    assert min(found.displacement_m, found.velocity_m_per_s, found.stroke_m) > 0
