from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.records.machines import (
    GunMachine,
    GunPlan,
    ParameterChange,
    Sensors,
    ServoMachine,
)
from hwid_cli.stages.simulate import simulate_machine

IDEAL = Sensors(
    displacement_noise_m=0.0,
    displacement_offset_m=0.0,
    displacement_resolution_m=0.0,
    current_noise_A=0.0,
    current_offset_A=0.0,
    damaged_samples=0,
)
SAMPLES = 400
SHORT = GunMachine(plan=GunPlan(samples=SAMPLES))


@pytest.fixture(scope="module")
def gun():
    return {one.name: one for one in simulate_machine(SHORT)}


@pytest.fixture(scope="module")
def ideal_gun():
    machine = replace(SHORT, sensors=IDEAL)
    return {one.name: one for one in simulate_machine(machine)}


def bytes_of(measurements):
    return [
        (one.name, one.time_s.tobytes(), one.input.tobytes(), one.output.tobytes())
        for one in measurements
    ]


# The gun ------------------------------------------------------------------------------


def test_gun_delivers_its_whole_plan_in_order(gun):
    assert list(gun)[:2] == ["step_01", "step_02"]
    assert list(gun)[-1] == "random_05"
    assert len(gun) == 43


def test_same_seed_gives_the_same_bytes_and_another_seed_others(gun):
    machine = replace(SHORT, plan=replace(SHORT.plan, only=("step_04", "sine_09")))
    first = bytes_of(simulate_machine(machine))
    assert first == bytes_of(simulate_machine(machine))
    assert first != bytes_of(simulate_machine(replace(machine, seed=2)))


def test_recording_does_not_depend_on_which_others_are_made(gun):
    plan = replace(
        SHORT.plan,
        only=("step_09", "random_03"),
        sine_amplitudes_A=(1.0,),
        sine_left_out=(),
    )
    alone = simulate_machine(replace(SHORT, plan=plan))
    assert bytes_of(alone) == bytes_of([gun["step_09"], gun["random_03"]])


def test_raw_columns_differ_in_length_and_hold_the_useful_samples(gun):
    assert sum(one.input.size != one.output.size for one in gun.values()) > 35
    for one in gun.values():
        assert min(one.input.size, one.output.size) >= (
            one.plan["lead_in_samples"] + SAMPLES
        )
        assert one.time_s.size == max(one.input.size, one.output.size)
        assert one.time_s[1] == 0.005


def test_gun_rests_during_a_lead_in_of_varying_length(ideal_gun):
    lengths = {one.plan["lead_in_samples"] for one in ideal_gun.values()}
    assert min(lengths) >= 150
    assert max(lengths) <= 400
    assert len(lengths) > 30
    for one in ideal_gun.values():
        lead_in = one.plan["lead_in_samples"]
        np.testing.assert_array_equal(one.input[:lead_in], 0.0)
        np.testing.assert_array_equal(one.output[:lead_in], one.plan["rest_position_m"])


def test_rest_positions_lie_within_the_stiction_band(ideal_gun):
    rests = np.array([one.plan["rest_position_m"] for one in ideal_gun.values()])
    softest = 968.0 * (1 - 0.1)
    assert np.max(np.abs(rests)) <= 0.8 * 7.2 / softest
    assert np.std(rests) > 1e-3


def test_recorded_input_is_the_command_also_where_the_drive_saturates(ideal_gun):
    recording = ideal_gun["step_05"]
    assert recording.input[-1] == 10.0
    limited = replace(SHORT, sensors=IDEAL, current_limit_A=5.0)
    weak = {one.name: one for one in simulate_machine(limited)}
    assert weak["step_05"].output[-1] < 0.7 * recording.output[-1]
    np.testing.assert_array_equal(weak["step_05"].input, recording.input)
    np.testing.assert_array_equal(weak["step_01"].output, ideal_gun["step_01"].output)


def test_static_travel_is_about_five_centimetres_per_ampere(ideal_gun):
    # Ramps overshoot little: 2 s suffice to settle. The stiffness may be 10 % off, and
    # friction holds 5 mm of the smallest travel of 100 mm.
    for name, amplitude in (("step_06", 2.0), ("step_07", 4.0), ("step_08", 6.0)):
        travel = ideal_gun[name].output[-1]
        assert travel == pytest.approx(0.05 * amplitude, rel=0.16)
    # 9.5 A against spring and contact: 0.40 m, with the same tolerance.
    assert 0.34 < ideal_gun["step_10"].output[-1] < 0.46


def test_only_some_recordings_have_a_changed_parameter(ideal_gun):
    factors = np.array([one.plan["parameter_factor"] for one in ideal_gun.values()])
    changed = factors[factors != 1.0]
    # 43 draws with probability 0.7: within three standard deviations of 30.
    assert 21 < changed.size < 39
    assert np.max(np.abs(changed - 1.0)) <= 0.1
    assert np.std(changed) > 0.025


@pytest.mark.parametrize("parameter", ["stiffness", "damping", "force_constant"])
def test_each_parameter_can_be_the_one_that_changes(parameter):
    def outputs(largest):
        machine = replace(
            SHORT,
            sensors=IDEAL,
            change=ParameterChange(parameter, largest, share=1.0),
            plan=replace(SHORT.plan, only=("step_03",)),
        )
        return simulate_machine(machine)[0].output

    assert np.max(np.abs(outputs(0.1) - outputs(0.0))) > 1e-4


def test_sensors_do_not_change_command_and_motion(gun, ideal_gun):
    for name, noisy in gun.items():
        for key in ("lead_in_samples", "parameter_factor", "rest_position_m"):
            assert noisy.plan[key] == ideal_gun[name].plan[key]


def test_readings_differ_from_the_truth_by_offset_noise_and_listed_damage(
    gun, ideal_gun
):
    for name, noisy in gun.items():
        for column, noise, offset in (
            ("input", 0.004, "input_offset_A"),
            # Uniform rounding to 1e-4 m adds 1e-4 / sqrt(12) to the noise of 1e-4.
            ("output", 1.04e-4, "output_offset_m"),
        ):
            error = getattr(noisy, column) - getattr(ideal_gun[name], column)
            error = error - noisy.plan[offset]
            damaged = [int(index) for index in noisy.plan[f"damaged_{column}"].split()]
            # 43 columns of some 700 values: 6 standard deviations are never reached.
            assert list(np.flatnonzero(np.abs(error) > 6 * noise)) == damaged
            usual = np.delete(error, damaged)
            # Standard error of a deviation from 600 values is 3 %, of rounding more.
            assert np.std(usual) == pytest.approx(noise, rel=0.15)


def test_displacement_is_read_in_steps_of_the_resolution(gun):
    undamaged = gun["sine_16"].output[:100]
    counts = undamaged / 1e-4
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)


def test_sine_runs_at_its_frequency_and_amplitude(ideal_gun):
    recording = ideal_gun["sine_13"]
    excited = recording.input[recording.plan["lead_in_samples"] :]
    n = np.arange(excited.size)
    grown = 3.0 * np.minimum(n / 500, 1.0)
    np.testing.assert_allclose(excited, grown * np.sin(0.22 * n))


def test_small_plan_runs_with_few_samples():
    plan = GunPlan(
        samples=30,
        shortest_lead_in_samples=0,
        longest_lead_in_samples=0,
        shortest_tail_samples=0,
        longest_tail_samples=0,
        only=("step_01",),
    )
    (measurement,) = simulate_machine(GunMachine(plan=plan))
    assert measurement.input.size == measurement.output.size == 30


def test_name_that_is_not_in_the_plan_is_refused():
    machine = replace(SHORT, plan=replace(SHORT.plan, only=("sine_24",)))
    with pytest.raises(ConfigError, match=r"simulate\.plan\.only: 'sine_24' is none"):
        simulate_machine(machine)


# The servo ----------------------------------------------------------------------------


def test_servo_makes_one_step_for_each_current():
    measurements = simulate_machine(ServoMachine())
    assert [one.name for one in measurements] == [f"step_0{i}" for i in range(1, 6)]
    for current, one in enumerate(measurements, start=1):
        assert one.kind == "step"
        assert one.plan["resistance_ohm"] == pytest.approx(220.0 / current)
        # The motor's own 3.9 ohm takes its part of the nominal current.
        expected = 220.0 / (220.0 / current + 3.9)
        assert one.input[-1] == pytest.approx(expected, rel=1e-4)
        np.testing.assert_array_equal(one.output[:200], 0.0)


def test_servo_without_currents_uses_its_resistor():
    (only,) = simulate_machine(ServoMachine(currents_A=()))
    assert only.plan["resistance_ohm"] == 100.0


def test_servo_travel_is_read_at_the_wheel_rim():
    small = simulate_machine(ServoMachine(wheel_radius_m=1.0, back_emf_V_per_rpm=1e-6))
    # Static travel is torque / (k r): twice the radius halves it.
    large = simulate_machine(ServoMachine(wheel_radius_m=2.0, back_emf_V_per_rpm=1e-6))
    ratio = large[4].output[-1] / small[4].output[-1]
    assert ratio == pytest.approx(0.5, rel=1e-3)


def test_servo_noise_is_relative_to_the_largest_value_and_seeded():
    quiet = simulate_machine(ServoMachine())
    noisy = simulate_machine(ServoMachine(noise_relative=0.01))
    again = simulate_machine(ServoMachine(noise_relative=0.01))
    assert bytes_of(noisy) == bytes_of(again)
    for one, other in zip(quiet, noisy, strict=True):
        for column in ("input", "output"):
            true, reading = getattr(one, column), getattr(other, column)
            expected = 0.01 * np.max(np.abs(true))
            # Three standard errors of a deviation from 2500 values.
            assert np.std(reading - true) == pytest.approx(expected, rel=0.05)
