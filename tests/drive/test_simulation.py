"""Laws that the simulation of a drive must keep, whatever the effects."""

import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.mechanics import simulate_motion
from hwid_cli.drive.simulation import (
    drive_effects,
    parameter_vector,
    run,
    simulate_drive,
)
from hwid_cli.records.drive import Controller, Drive
from hwid_cli.records.mechanics import Contact, Friction, Mechanics
from tests.drive.drive_cases import (
    COULOMB,
    EVERY,
    LOAD,
    SAMPLE_TIME_S,
    SCALES,
    SINGLE,
    STRIBECK,
    TIMES_S,
    machine_of,
    rms,
    tool,
)

# Rounding of some thousand steps on motions of 1e-2 m.
ROUNDING_M = 1e-13
MIRRORED = {
    "asymmetric_friction": {"force_forward_N": 0.4, "force_backward_N": 0.8},
    "quadratic_stiffness": {"stiffness_N_per_m2": -1e4},
    "one_sided_stop": {"position_m": 0.008, "stiffness_N_per_m": 1e4},
    "constant_load": {"force_N": -2.0},
    "cogging": {"amplitude_N": 0.5, "period_m": 5e-3, "phase_rad": -0.3},
    "periodic_force": {
        "amplitude_N": 0.5,
        "frequency_Hz": 25.0,
        "phase_rad": 0.4 + np.pi,
    },
    "gravity": {"torque_N_m": 4.0, "angle_rad": -0.7},
    "position_friction": {
        "force_N": 0.8,
        "variation_share": 0.6,
        "period_m": 8e-3,
        "phase_rad": np.pi - 0.4,
    },
    "torque_ripple": {"share": 0.2, "per_turn": 900.0, "phase_rad": np.pi - 0.5},
}
BENT_SPRING = {"cubic_stiffness": {"stiffness_N_per_m3": 5e3}}
# Parameters at which an effect is none.
NEUTRAL = {
    "coulomb_friction": {"force_N": 0.0},
    "asymmetric_friction": {"force_forward_N": 0.0, "force_backward_N": 0.0},
    "stribeck_friction": {
        "force_N": 0.0,
        "static_excess_N": 0.0,
        "velocity_m_per_s": 0.01,
    },
    "hysteresis": {"force_N": 0.0, "yield_m": 1e-3},
    "quadratic_drag": {"drag_N_s2_per_m2": 0.0},
    "cubic_stiffness": {"stiffness_N_per_m3": 0.0},
    "quadratic_stiffness": {"stiffness_N_per_m2": 0.0},
    "end_stop": {"position_m": 1.0, "stiffness_N_per_m": 1e4},
    "one_sided_stop": {"position_m": 1.0, "stiffness_N_per_m": 1e4},
    "spring_gap": {"half_gap_m": 1e-16},
    "second_mode": {"mass_kg": 1e-14, "frequency_Hz": 40.0, "damping_ratio": 0.05},
    "cogging": {"amplitude_N": 0.0, "period_m": 5e-3},
    "constant_load": {"force_N": 0.0},
    "input_dead_zone": {"threshold_A": 1e-15},
    "input_saturation": {"limit_A": 10.0},
    "rate_limit": {"rate_A_per_s": 1e4},
    "input_delay": {"delay_s": 1e-15},
    "actuator_lag": {"time_constant_s": 1e-13},
    "actuator_lag:second_order": {"time_constant_s": 1e-14, "damping_ratio": 1.0},
    "force_constant_saturation": {"loss_at_reference": 0.0},
    "supply_sag": {"loss_at_reference": 0.0},
    "thermal_gain_loss": {"loss_at_reference": 0.0, "time_constant_s": 1.0},
    "voltage_limit": {"limit_A": 100.0, "slope_A_s_per_m": 1.0},
    "periodic_force": {"amplitude_N": 0.0, "frequency_Hz": 25.0},
    "sensor_quadratic": {"coefficient": 0.0},
    "sensor_cubic": {"coefficient": 0.0},
    "sensor_drift": {"drift_m_per_s": 0.0},
    "output_backlash": {"half_gap_m": 1e-16},
    "gravity": {"torque_N_m": 0.0, "angle_rad": 1.0},
    "spring_preload": {"force_N": 0.0},
    "load_friction:spring": {"force_N": 0.0, "load_share": 0.0},
    "load_friction:drive": {"force_N": 0.0, "load_share": 0.0},
    "position_friction": {"force_N": 0.0, "variation_share": 0.5, "period_m": 1e-3},
    "torque_ripple": {"share": 0.0, "per_turn": 900.0},
    "end_stop:contact": {
        "position_m": 1.0,
        "stiffness_N_per_m": 1e4,
        "exponent": 1.5,
        "damping_s_per_m": 1.0,
    },
    "one_sided_stop:dashpot": {
        "position_m": 1.0,
        "stiffness_N_per_m": 1e4,
        "damping_N_s_per_m": 10.0,
    },
    "hysteresis:bouc_wen": {"force_N": 0.0, "yield_m": 1e-3, "exponent": 2.0},
    "one_sided_stop:second": {"position_m": 1.0, "stiffness_N_per_m": 1e4},
    "cogging:second": {"amplitude_N": 0.0, "period_m": 5e-3},
}


def sine(amplitude=3.0, hertz=7.0, count=600):
    return amplitude * np.sin(2 * np.pi * hertz * SAMPLE_TIME_S * np.arange(count))


def exact_base(command, *, hold):
    """Linear drive by the matrix exponential, apart from the tool's series."""
    a = np.zeros((4, 4))
    a[0, 1], a[1, 0], a[1, 1], a[1, 2] = 1.0, -1184 / 0.3, -15.1 / 0.3, 5 / 0.3
    a[2, 3] = 1.0 / SAMPLE_TIME_S
    step = expm(a * SAMPLE_TIME_S)
    state, found = np.zeros(2), []
    for now, after in zip(command, np.append(command[1:], 0.0), strict=True):
        found.append(state[0])
        rise = 0.0 if hold == "zero" else after - now
        state = step[:2, :2] @ state + step[:2, 2] * now + step[:2, 3] * rise
    return np.array(found)


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_the_base_is_the_exact_linear_solution(hold):
    expected = exact_base(sine(), hold=hold)
    assert rms(tool({}, sine(), hold=hold).position - expected) < ROUNDING_M


def test_a_controller_computes_its_output_at_every_sample_and_holds_it():
    gains = {"position_gain_per_s": 20.0, "velocity_gain": 4.0}
    reference = 0.02 * np.minimum(np.arange(400) / 100, 1.0)
    motion = tool({}, reference, controller=Controller(**gains, limit=0.9))

    again = tool({}, motion.command, hold="zero")
    assert rms(again.position - motion.position) < ROUNDING_M
    wanted = 4.0 * (20.0 * (reference - motion.position) - motion.velocity)
    np.testing.assert_allclose(motion.command, np.clip(wanted, -0.9, 0.9), atol=1e-14)
    assert np.max(motion.command) == 0.9


def test_an_inductance_that_vanishes_leaves_the_resistance():
    circuit = {"resistance_ohm": 0.5, "back_emf_V_s_per_m": 5.0}
    without = tool({}, **circuit).position
    # The current is late by L / R = 2 us: 1e-6 s times 1 m/s.
    assert rms(tool({}, **circuit, inductance_H=1e-6).position - without) < 3e-6
    assert rms(tool({}, **circuit, inductance_H=1e-8).position - without) < 3e-8


def test_sliding_and_sticking_agree_with_the_power_series_of_the_gun():
    friction = Friction(coulomb_N=0.8, break_away_N=0.8)
    contact = Contact(position_m=0.008, stiffness_N_per_m=1e4)
    gun = Mechanics(0.3, 15.1, 1184.0, 5.0, friction, contact)
    expected, _ = simulate_motion(sine(), gun, sample_time_s=SAMPLE_TIME_S)
    stop = {"one_sided_stop": {"position_m": 0.008, "stiffness_N_per_m": 1e4}}

    assert rms(tool(COULOMB | stop, sine()).position - expected) < ROUNDING_M


def test_a_narrow_stribeck_excess_is_a_break_away_force():
    friction = Friction(coulomb_N=0.8, break_away_N=1.2)
    contact = Contact(position_m=1.0, stiffness_N_per_m=0.0)
    gun = Mechanics(0.3, 15.1, 1184.0, 5.0, friction, contact)
    slow = sine(amplitude=1.0, hertz=2.0)
    expected, _ = simulate_motion(slow, gun, sample_time_s=SAMPLE_TIME_S)
    narrow = {"force_N": 0.8, "static_excess_N": 0.4, "velocity_m_per_s": 1e-6}
    found = tool({"stribeck_friction": narrow}, slow).position

    # Getting faster than 1e-6 m/s takes some 0.1 ms, in which the excess still holds.
    assert rms(found - expected) < 1e-6
    assert rms(tool(COULOMB, slow).position - expected) > 1e-5


def test_the_mirrored_drive_moves_the_other_way():
    quadratic = {"sensor_quadratic": {"coefficient": 0.1}}
    for effect, values in (SINGLE | quadratic).items():
        mirrored = MIRRORED.get(effect, values)
        if effect == "sensor_quadratic":
            mirrored = {"coefficient": -0.1}
        one = tool({effect: values}, sine()).output
        other = tool({effect: mirrored}, -sine()).output
        # Events are located to 1e-12 of a step, and rattling amplifies that.
        assert np.max(abs(one + other)) < 1e-11, effect


def test_an_effect_at_its_neutral_value_leaves_the_base():
    base = tool({}, sine()).output
    for effect, values in NEUTRAL.items():
        found = tool({effect: values}, sine()).output
        assert rms(found - base) < ROUNDING_M, effect


@pytest.mark.parametrize("effects", [COULOMB, STRIBECK], ids="+".join)
def test_a_drive_that_sticks_does_not_move_by_one_bit(effects):
    held = np.concatenate([np.linspace(0, 2, 50), np.full(300, 2.0), np.full(50, 2.1)])
    motion = tool(effects, held)

    assert motion.position[0] == 0.0
    assert len(set(motion.position[250:])) == 1
    assert np.all(motion.velocity[250:] == 0.0)


@pytest.mark.parametrize("effect", ["coulomb_friction", "quadratic_drag", "end_stop"])
def test_what_resists_motion_takes_energy(effect):
    motion = tool({effect: SINGLE[effect]}, np.zeros(400), start=(0.01, 1.0))
    energy = 1184 * motion.position**2 + 0.3 * motion.velocity**2
    if effect == "end_stop":
        energy += 2e4 * np.maximum(abs(motion.position) - 0.012, 0.0) ** 2
    # Rounding and the error of Runge-Kutta steps, far below 1e-1 at the start.
    assert np.max(np.diff(energy)) < 1e-9
    assert energy[-1] < 0.1 * energy[0]


def test_a_load_starts_deflected_and_in_equilibrium():
    motion = tool(LOAD, np.zeros(50))
    np.testing.assert_allclose(motion.position, 2.0 / 1184.0, rtol=1e-13)


def test_a_recording_starts_in_equilibrium_with_its_first_command():
    effects = {
        name: SINGLE[name] for name in ("cubic_stiffness", "end_stop", "cogging")
    }
    effects |= LOAD | {"second_mode": SINGLE["second_mode"]}
    motion = tool(effects, np.full(50, 3.0))
    assert np.ptp(motion.position) < ROUNDING_M
    assert motion.position[0] > 0.005


def test_a_saturated_start_does_not_move_under_a_rate_limit():
    effects = {
        "input_saturation": {"limit_A": 2.0},
        "rate_limit": {"rate_A_per_s": 5.0},
    }
    motion = tool(effects, np.full(100, 4.0))
    np.testing.assert_allclose(motion.position, 2.0 * 5.0 / 1184.0, rtol=1e-12)


def test_a_free_axis_starts_where_it_rests_and_stays_there():
    drive = Drive(stiffness_N_per_m=0.0, effects={"coulomb_friction": {"force_N": 1.0}})
    command = np.full(50, 0.9)
    motion = simulate_drive(command, drive, sample_time_s=1e-3, rest_position_m=0.7)
    assert np.all(motion.position == 0.7)


def test_shorter_samples_of_the_same_command_change_nothing():
    for effect, values in SINGLE.items():
        coarse = tool({effect: values}).position
        fine = tool({effect: values}, sample_time=SAMPLE_TIME_S / 8).position[::8]
        # Runge-Kutta steps leave up to 1e-7 m, see test_drive_oracle; a rattling gear
        # amplifies rounding.
        assert rms(coarse - fine) < 1e-7, effect


@pytest.mark.parametrize("effect", sorted(set(SINGLE) - {"gear_backlash"}))
def test_no_last_bit_decides_how_the_drive_moves(effect):
    # A steep ramp after a rest: what leaves within a sample must not wait for the next.
    time = 1e-3 * np.arange(200)
    command = 4.0 * np.interp(time, [0.04, 0.045, 0.12, 0.125], [0, 1, 1, 0])
    base = Drive(effects={effect: SINGLE[effect]})
    moved = [
        simulate_drive(
            command,
            replace(base, force_constant_N_per_A=constant),
            sample_time_s=1e-3,
        ).position
        for constant in 5.0 * (1 + 1e-7 * np.arange(41))
    ]
    # A ten-millionth more force: some nanometres, and each time about as many.
    assert max(rms(step) for step in np.diff(moved, axis=0)) < 5e-8


def random_effects(rng):
    """Some effects with parameters between their bounds' usual sizes."""
    names = rng.choice(list(SINGLE), size=rng.integers(1, 5), replace=False)
    effects = {}
    for name in names:
        sizes = np.exp(rng.normal(0.0, 1.0, size=len(SINGLE[name])))
        drawn = {
            parameter: float(value * size)
            for (parameter, value), size in zip(
                SINGLE[name].items(), sizes, strict=True
            )
        }
        if "motor_share" in drawn:
            drawn["motor_share"] = float(rng.uniform(0.05, 0.95))
        effects[str(name)] = drawn
    return effects


def test_every_mixture_of_effects_ends_in_time():
    rng = np.random.default_rng(7)
    command = 5.0 * rng.standard_normal(2000)
    tool({}, command)
    slowest = 0.0
    for _ in range(60):
        effects = random_effects(rng)
        begin = time.perf_counter()
        motion = tool(effects, command)
        slowest = max(slowest, time.perf_counter() - begin)
        assert np.isfinite(motion.position).all() or np.isnan(motion.position[-1])
    # A mixture takes some ms; an endless loop takes for ever.
    assert slowest < 5.0


def test_a_drive_that_runs_away_ends_in_not_a_number():
    motion = tool({"cubic_stiffness": {"stiffness_N_per_m3": -1e8}}, sine(5.0))
    assert np.isnan(motion.position[-1])


def test_an_unknown_effect_is_refused():
    with pytest.raises(ValueError, match="'magic' is not in the catalogue"):
        parameter_vector(Drive(), {"magic": {}})


def test_two_kinds_of_dry_friction_push_together():
    both = COULOMB | {
        "asymmetric_friction": {"force_forward_N": 0.1, "force_backward_N": 0.2}
    }
    one = {"asymmetric_friction": {"force_forward_N": 0.9, "force_backward_N": 1.0}}
    assert rms(tool(both).position - tool(one).position) < ROUNDING_M


def test_a_change_between_recordings_scales_its_parameter():
    drive = Drive(mass_kg=0.3, damping_N_s_per_m=15.1, stiffness_N_per_m=1184.0)
    change = {"parameter_change:stiffness": {"log_stiffness": 0.2}}
    found = run(sine(), parameter_vector(drive, change), SAMPLE_TIME_S).output
    stiffer = {"stiffness_N_per_m": 1184.0 * np.exp(0.2), "force_constant_N_per_A": 1.0}
    assert rms(found - tool({}, sine(), **stiffer).output) < ROUNDING_M


def test_every_effect_of_the_catalogue_is_seen_in_the_output():
    for effect, values in EVERY.items():
        machine = machine_of(effect)
        change = tool({effect: values}, **machine).output
        change = change - tool({}, **machine).output
        # A ten-thousandth of the motion of 12 mm rms; drift is the smallest.
        assert 1e-6 < rms(change) < 0.1, effect


def with_one_at_its_largest(effect):
    """Values of an effect, each time with another of its parameters very large."""
    for one in effect.parameters:
        largest = one.bounds(SCALES)[1]
        if np.isinf(largest):
            # Far beyond what a search begins with, as a search may get there.
            largest = 1e6 * max(map(abs, one.starts(SCALES)))
        # Those of a change of the drive itself are not among the cases.
        values = EVERY.get(effect.id, {})
        yield {**values, one.name: largest}


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=lambda one: one.id)
def test_motion_stays_finite_however_large_an_effect_is(effect):
    # A force whose stiffness or damping is missing in curved.step_limit is followed in
    # steps that are too long for it, and the motion explodes.
    step = np.where(TIMES_S < 0.05, 0.0, 5.0)
    # Beside a curved spring, straight forces are followed in steps too.
    for values, beside in product(with_one_at_its_largest(effect), ({}, BENT_SPRING)):
        effects = {**beside, effect.id: values}
        motion = tool(effects, step, **machine_of(effect.id))

        assert np.isfinite(motion.output).all(), values


def test_what_may_be_left_out_has_the_default_of_its_declaration():
    for effect, given in EVERY.items():
        parameters = CATALOGUE[effect].parameters
        defaults = {
            one.name: one.default for one in parameters if one.default is not None
        }
        needed = {
            one.name: given[one.name] for one in parameters if one.default is None
        }
        short, full = (
            parameter_vector(Drive(), {effect: values})
            for values in (needed, needed | defaults)
        )
        np.testing.assert_array_equal(short, full, err_msg=effect)


def test_every_place_that_an_effect_fills_is_read_by_a_kernel():
    folder = Path(slots.__file__).parent
    text = "".join(path.read_text() for path in folder.rglob("*.py"))
    for effect in CATALOGUE.values():
        for place in effect.places():
            assert f"slots.{place}]" in text or f"slots.{place}," in text, place


def test_a_drive_is_told_with_the_defaults_of_what_it_leaves_out():
    gear = {"half_gap_m": 1e-4, "stiffness_N_per_m": 5e4}
    told = drive_effects(Drive(effects={"gear_backlash": gear}))
    assert told["gear_backlash"] == gear | {
        "motor_share": 0.5,
        "motor_damping_share": 0.0,
        "contact_damping_ratio": 0.0,
    }
    own = {"amplitude_N": 1.0, "frequency_Hz": 9.0}
    assert drive_effects(Drive(effects={"periodic_force": own})) == {
        "periodic_force": own
    }


def test_a_force_beside_the_input_is_as_much_input():
    drive = Drive(
        mass_kg=0.3, damping_N_s_per_m=15.0, stiffness_N_per_m=1184.0,
        force_constant_N_per_A=5.0,
    )  # fmt: skip
    time = SAMPLE_TIME_S * np.arange(600)
    command, force = np.sin(20.0 * time), np.cos(33.0 * time) + np.sin(90.0 * time)
    for effects in (
        {},
        {"coulomb_friction": {"force_N": 0.5}},
        {"hysteresis": {"force_N": 0.5, "yield_m": 1e-3}},
        {
            "periodic_force": {
                "amplitude_N": 0.2,
                "frequency_Hz": 12.0,
                "phase_rad": 0.0,
            }
        },
    ):
        vector = parameter_vector(drive, effects)
        beside = run(command, vector, SAMPLE_TIME_S, force=force)
        assert rms(beside.output) > 1e-4
        as_input = run(command + force / 5.0, vector, SAMPLE_TIME_S)
        assert rms(beside.output - as_input.output) < ROUNDING_M, effects


def test_a_force_beside_the_input_does_not_pass_the_command():
    drive = Drive(
        mass_kg=0.3, damping_N_s_per_m=15.0, stiffness_N_per_m=1184.0,
        force_constant_N_per_A=5.0,
    )  # fmt: skip
    force = np.sin(30.0 * SAMPLE_TIME_S * np.arange(600))
    nothing = np.zeros(600)
    plain = run(force / 5.0, parameter_vector(drive, {}), SAMPLE_TIME_S)
    for effects in (
        {"input_delay": {"delay_s": 0.02}},
        {"input_dead_zone": {"threshold_A": 3.0}},
        {"input_saturation": {"limit_A": 0.01}},
        {"actuator_lag": {"time_constant_s": 0.05}},
        {"force_constant_saturation": {"loss_at_reference": 0.5}},
    ):
        found = run(
            nothing, parameter_vector(drive, effects), SAMPLE_TIME_S, force=force
        )
        assert rms(found.output - plain.output) < ROUNDING_M, effects


def test_a_drive_that_runs_away_between_teeth_ends():
    # A stop throws it to where a softening spring drives it on, to infinity in 0.3 s: no
    # step that leads there is long enough.
    drive = Drive(
        mass_kg=0.036,
        damping_N_s_per_m=0.0639,
        stiffness_N_per_m=1.08,
        force_constant_N_per_A=0.289,
        effects={
            "gear_backlash": {
                "half_gap_m": 0.0441,
                "stiffness_N_per_m": 3551.0,
                "motor_share": 0.7357,
                "motor_damping_share": 0.7767,
                "contact_damping_ratio": 0.107,
            },
            "one_sided_stop": {"position_m": -0.4743, "stiffness_N_per_m": 142.8},
            "cubic_stiffness": {"stiffness_N_per_m3": -0.1688},
        },
    )
    found = simulate_drive(
        np.zeros(117), drive, sample_time_s=0.005, start=(-1.1355, -1.2676)
    )
    away = np.isnan(found.position)
    assert 50 < np.argmax(away) < 90
    assert away[np.argmax(away) :].all()
