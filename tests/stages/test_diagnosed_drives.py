"""Diagnoses of other drives and other recordings: voltage, controller, one alone."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import SimulationOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.report.diagnosis import base_table, effects_table
from hwid_cli.stages.diagnose import extended_options
from tests.diagnosis.small_drive import (
    DRIVE,
    STEP_S,
    N,
    recordings,
    simulation,
)
from tests.stages.diagnosed_drive import FRICTION, diagnosed, parameters

PAIR = {**FRICTION, "cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
VOLTAGE = {"resistance_ohm": 2.0, "inductance_H": 2e-3, "back_emf_V_s_per_m": 5.0}


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("word", "name"), [("stiffness", "stiffness_N_per_m"), ("mass", "mass_kg")]
)
def test_a_change_between_recordings_is_extended_by_its_word(word, name):
    factors = 1 + 0.05 * np.sin(2.1 * np.arange(9))

    def changed(number, drive):
        return replace(drive, **{name: getattr(drive, name) * factors[number]})

    given = recordings(own=changed)
    found = diagnosed(given, effects=("parameter_change", "coulomb_friction"))
    assert [one.id for one in found.effects] == ["parameter_change"]
    which, spread = found.effects[0].parameters
    assert which.text == word
    true = factors.std(ddof=1) / factors.mean()
    # Every factor is known to some 0.1 %.
    assert spread.value == pytest.approx(true, rel=0.05)
    assert spread.low < true < spread.high
    told = [one.factor for one in found.gaps]
    np.testing.assert_allclose(told, factors / factors.mean(), atol=5e-3)

    extended = extended_options(found, simulation())
    assert extended.effects["parameter_change"]["which"] == word
    assert diagnosed(given, extended, effects=("coulomb_friction",)).verdict == "none"


@pytest.mark.thorough
def test_friction_by_load_is_told_and_extended_with_its_word():
    friction = {"force_N": 0.2, "load_share": 0.1, "load": "spring"}
    given = recordings({"load_friction": friction})
    effects = ("load_friction", "coulomb_friction")
    found = diagnosed(given, effects=effects)
    assert [one.id for one in found.effects] == ["load_friction"]
    force, share, load = found.effects[0].parameters
    # Noise of 20 um on 10 mm.
    assert force.value == pytest.approx(0.2, rel=0.05)
    assert share.value == pytest.approx(0.1, rel=0.05)
    assert (load.name, load.text) == ("load", "spring")

    extended = extended_options(found, simulation())
    assert extended.effects["load_friction"]["load"] == "spring"
    assert diagnosed(given, extended, effects=effects).verdict == "none"


@pytest.mark.thorough
def test_a_second_stop_is_found_beside_the_one_of_the_simulation():
    first = {"position_m": 0.008, "stiffness_N_per_m": 2e4}
    second = {"position_m": -0.006, "stiffness_N_per_m": 1e4}
    given = recordings({"one_sided_stop": first, "one_sided_stop:second": second})
    with_one = simulation(effects={"one_sided_stop": first})
    found = diagnosed(given, with_one, effects=("one_sided_stop", "cogging"))
    assert [one.id for one in found.effects] == ["one_sided_stop"]
    assert parameters(found.effects[0])["position_m"] == pytest.approx(-6e-3, rel=0.01)

    extended = extended_options(found, with_one)
    assert set(extended.effects) == {"one_sided_stop", "one_sided_stop:second"}
    # Found again as they are, and nothing beside them.
    assert diagnosed(given, extended, effects=("cogging",)).verdict == "none"


@pytest.mark.thorough
def test_a_force_from_outside_is_named_whatever_its_phases():
    force = {"amplitude_N": 0.4, "frequency_Hz": 31.0}
    given = recordings(
        own=lambda number, drive: replace(
            drive, effects={"periodic_force": {**force, "phase_rad": 0.9 * number}}
        )
    )
    found = diagnosed(given, effects=("periodic_force", "coulomb_friction"))
    (effect,) = found.effects
    assert (effect.id, found.complete) == ("periodic_force", True)
    # Recordings of 0.4 s: a hundredth of a period is 0.1 % of the frequency.
    assert parameters(effect)["frequency_Hz"] == pytest.approx(31.0, rel=0.01)
    assert parameters(effect)["amplitude_N"] == pytest.approx(0.4, rel=0.05)
    assert "phase_rad" not in parameters(effect)


def test_a_single_recording_is_diagnosed():
    found = diagnosed(recordings(FRICTION)[5:6])
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert found.held_out == ()
    assert any("only one" in text for text in found.not_observable)


@pytest.mark.thorough
def test_a_voltage_is_an_input_too():
    driven = replace(DRIVE, **VOLTAGE)
    given = recordings(FRICTION, drive=driven)
    found = diagnosed(
        given, simulation(**VOLTAGE), effects=("coulomb_friction", "input_dead_zone")
    )
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.01)
    assert not any("before the current" in text for text in found.not_observable)


@pytest.mark.thorough
def test_an_input_that_was_filtered_is_smooth_between_samples():
    given = recordings(PAIR, drive=replace(DRIVE, hold="smooth"))
    found = diagnosed(
        given,
        simulation(hold="smooth", effects=FRICTION),
        effects=("coulomb_friction", "cubic_stiffness"),
    )
    assert [one.id for one in found.effects] == ["cubic_stiffness"]
    assert [one.id for one in found.present] == ["coulomb_friction"]
    assert found.complete


def closed_loop(effects):
    """A cascade that follows smooth strokes; its command is measured with noise."""
    controller = Controller(position_gain_per_s=30.0, velocity_gain=40.0)
    drive = replace(
        DRIVE, stiffness_N_per_m=0.0, controller=controller, effects=effects
    )
    rng = np.random.default_rng(8)
    time = STEP_S * np.arange(N)
    found = []
    for number, (size, period) in enumerate(
        (
            (0.02, 0.3),
            (0.05, 0.2),
            (0.03, 0.12),
            (0.04, 0.25),
            (0.01, 0.15),
            (0.05, 0.3),
        )
    ):
        path = size * (1 - np.cos(2 * np.pi * np.maximum(time - 0.03, 0) / period))
        motion = simulate_drive(path, drive, sample_time_s=STEP_S)
        found.append(
            Recording(
                f"path_{number}",
                motion.command + 0.01 * rng.standard_normal(N),
                motion.output,
                STEP_S,
                reference=path,
            )
        )
    return found, simulation(stiffness_N_per_m=0.0, controller=controller)


@pytest.mark.thorough
def test_under_a_controller_the_command_tells():
    given, model = closed_loop(FRICTION)
    found = diagnosed(given, model)
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    # Noise of 0.01 A is 0.05 N, in 2400 samples.
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.02)
    assert found.output_unit != "m"
    assert found.compared == "command u"
    # What only the sensor sees, the loop would have answered.
    assert ("output_backlash",) not in {one.effects for one in found.candidates}


def test_under_a_controller_nothing_is_named_where_nothing_is_missing():
    given, model = closed_loop({})
    assert diagnosed(given, model).verdict == "none"


def test_a_loop_starts_where_its_machine_stood_not_where_a_noisy_sensor_says():
    # The controller knows the position exactly, the log within 0.1 mm: 50 A/m of its
    # gain times that are 5 mA of the command's beginning, ten times its rounding.
    position_gain, velocity_gain, constant = 10.0, 5.0, DRIVE.force_constant_N_per_A
    mass, damping = DRIVE.mass_kg, DRIVE.damping_N_s_per_m
    # Exact step of m dv/dt = F - c v under a held force.
    decay = np.exp(-damping * STEP_S / mass)
    rng = np.random.default_rng(3)
    given = []
    for number, period in enumerate((0.12, 0.2, 0.3, 0.25)):
        stands = 0.25 + 2e-4 * number
        time = STEP_S * np.arange(N)
        path = stands + 0.02 * (
            1 - np.cos(2 * np.pi * np.maximum(time - 0.03, 0) / period)
        )
        x, v = stands, 0.0
        command, moved = np.zeros(N), np.zeros(N)
        for k in range(N):
            moved[k] = x
            command[k] = velocity_gain * (position_gain * (path[k] - x) - v)
            final = constant * command[k] / damping
            x += final * STEP_S + (v - final) * (1 - decay) * mass / damping
            v = final + (v - final) * decay
        logged = moved + 1e-4 * rng.standard_normal(N)
        given.append(
            Recording(
                f"path_{number}", command.round(3), logged, STEP_S, reference=path
            )
        )
    controller = Controller(position_gain, velocity_gain)
    found = diagnosed(given, simulation(stiffness_N_per_m=0.0, controller=controller))
    assert found.verdict == "none"


@pytest.mark.thorough
def test_recordings_that_begin_in_motion_are_diagnosed():
    cut = [
        replace(one, input=one.input[60:], output=one.output[60:])
        for one in recordings(FRICTION)[5:]
    ]
    found = diagnosed(cut, initial_state="estimated")
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("sensor", ["motor", "load"])
def test_an_elastic_coupling_is_extended_by_the_place_of_its_sensor(sensor):
    hidden = {"stiffness_N_per_m": 2e4, "motor_share": 0.4, "damping_ratio": 0.05}
    given = recordings({"elastic_coupling": hidden | {"sensor": sensor}})
    found = diagnosed(given, effects=("elastic_coupling", "gear_backlash"))
    (effect,) = found.effects
    assert (effect.id, found.complete) == ("elastic_coupling", True)
    assert [one.text for one in effect.parameters if one.text] == [sensor]
    values = parameters(effect)
    # 50 Hz in 0.4 s: some percent of the frequency's square.
    assert values["stiffness_N_per_m"] == pytest.approx(2e4, rel=0.05)
    assert values["motor_share"] == pytest.approx(0.4, abs=0.05)

    extended = extended_options(found, simulation())
    assert extended.effects["elastic_coupling"]["sensor"] == sensor
    after = diagnosed(given, extended, effects=("second_mode",))
    assert after.verdict == "none"
    assert [one.text for one in after.present[0].parameters if one.text] == [sensor]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("hidden", "others"),
    [
        ({"sensor_saturation": {"limit_m": 0.009}}, ("end_stop", "input_saturation")),
        (
            {"sensor_eccentricity": {"amplitude_m": 3e-4, "period_m": 6e-3}},
            ("cogging", "sensor_cubic"),
        ),
        ({"clock_skew": {"ratio": 0.98}}, ("input_delay",)),
    ],
)
def test_what_the_sensor_does_is_named(hidden, others):
    found = diagnosed(recordings(hidden), effects=(*hidden, *others))
    ((identifier, values),) = hidden.items()
    assert [one.id for one in found.effects] == [identifier]
    assert found.complete
    told = parameters(found.effects[0])
    for name, value in values.items():
        assert told[name] == pytest.approx(value, rel=0.01)


@pytest.mark.thorough
def test_a_ratio_of_clocks_is_found_to_a_tenth_of_a_thousandth():
    found = diagnosed(
        recordings({"clock_skew": {"ratio": 1.004}}, seed=2), effects=("clock_skew",)
    )
    (ratio,) = found.effects[0].parameters
    # Of what the noise leaves: 20 um on 1 m/s after 0.4 s.
    assert ratio.value == pytest.approx(1.004, abs=1e-4)
    assert ratio.low < 1.004 < ratio.high


@pytest.mark.thorough
def test_a_hum_of_the_sensor_is_no_force():
    hum = {"amplitude_m": 4e-4, "frequency_Hz": 31.0}
    given = recordings(
        own=lambda number, drive: replace(
            drive, effects={"sensor_hum": hum | {"phase_rad": 0.9 * number}}
        )
    )
    found = diagnosed(given, effects=("sensor_hum", "periodic_force"))
    assert [one.id for one in found.effects] == ["sensor_hum"]
    told = parameters(found.effects[0])
    assert told["amplitude_m"] == pytest.approx(4e-4, rel=0.02)
    assert told["frequency_Hz"] == pytest.approx(31.0, rel=0.002)


@pytest.mark.thorough
def test_a_coil_delays_what_a_voltage_does():
    circuit = {"resistance_ohm": 1.0, "back_emf_V_s_per_m": 5.0}
    coil = {"winding_inductance": {"inductance_H": 4e-3}}
    given = recordings(coil, drive=replace(DRIVE, **circuit))
    found = diagnosed(
        given, simulation(**circuit), effects=(*coil, "actuator_lag", "input_delay")
    )
    assert [one.id for one in found.effects] == ["winding_inductance"]
    told = parameters(found.effects[0])["inductance_H"]
    assert told == pytest.approx(4e-3, rel=0.02)


def speeds(effects, **drive):
    """Recordings of a velocity, with noise of some per mille."""
    measured = recordings(
        effects, drive=replace(DRIVE, output="velocity", **drive), noise=1e-3
    )
    return [replace(one, output_unit="m/s") for one in measured]


@pytest.mark.thorough
@pytest.mark.parametrize("stiffness", [1184.0, 0.0], ids=["spring", "free"])
def test_a_velocity_is_compared_where_it_is_measured(stiffness):
    base = {"stiffness_N_per_m": stiffness}
    options = simulation(output="velocity", **base)
    found = diagnosed(
        speeds(FRICTION, **base), options, effects=("coulomb_friction", "cogging")
    )
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert (found.complete, found.output_unit) == (True, "m/s")
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.01)
    assert found.noise.rms == pytest.approx(1e-3, rel=0.05)
    assert any("velocity is measured" in text for text in found.not_observable)

    extended = extended_options(found, options)
    after = diagnosed(speeds(FRICTION, **base), extended, effects=("cogging",))
    assert after.verdict == "none"


@pytest.mark.thorough
def test_a_saturated_sensor_of_the_velocity_has_a_limit_in_its_unit():
    found = diagnosed(
        speeds({"sensor_saturation": {"limit_m": 0.25}}),
        simulation(output="velocity"),
        effects=("sensor_saturation", "input_saturation"),
    )
    assert [one.id for one in found.effects] == ["sensor_saturation"]
    limit = parameters(found.effects[0])["limit_m"]
    assert limit == pytest.approx(0.25, rel=0.002)


@pytest.mark.thorough
def test_a_rotating_axis_is_told_by_its_own_names():
    rotary = SimulationOptions(
        inertia_kg_m2=DRIVE.mass_kg,
        damping_N_m_s_per_rad=DRIVE.damping_N_s_per_m,
        stiffness_N_m_per_rad=DRIVE.stiffness_N_per_m,
        torque_constant_N_m_per_A=DRIVE.force_constant_N_per_A,
        reference_current_A=DRIVE.reference_current_A,
        reference_displacement_m=DRIVE.reference_displacement_m,
    )
    given = [replace(one, output_unit="rad") for one in recordings(FRICTION)]
    found, straight = diagnosed(given, rotary), diagnosed(recordings(FRICTION))
    assert (found.axis, found.output_unit) == ("rotary", "rad")
    assert [one.name for one in found.base] == [
        "damping_N_m_s_per_rad",
        "stiffness_N_m_per_rad",
        "torque_constant_N_m_per_A",
    ]
    for one, other in zip(found.base, straight.base, strict=True):
        assert (one.before, one.refitted, one.after) == (
            other.before,
            other.refitted,
            other.after,
        )
    assert parameters(found.effects[0]) == parameters(straight.effects[0])
    assert any("the inertia itself: torque" in one for one in found.not_observable)
    assert {one.unit for one in found.latent_force} <= {"rad", "rad/s", "A", "A/s", "s"}
    assert effects_table(found).rows[0][-1] == "N m"
    assert [row[-1] for row in base_table(found).rows] == [
        "N m s/rad",
        "N m/rad",
        "N m/A",
    ]

    extended = extended_options(found, rotary)
    assert extended.torque_constant_N_m_per_A == found.base[2].after
    assert extended.mass_kg == 1.0
    after = diagnosed(given, extended, effects=("cogging",))
    assert (after.verdict, after.axis) == ("none", "rotary")
