"""Diagnoses of other drives and other recordings: voltage, controller, one alone."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import Controller
from hwid_cli.records.recordings import Recording
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


def test_a_change_between_recordings_is_extended_by_its_word():
    factors = 1 + 0.05 * np.sin(2.1 * np.arange(9))
    given = recordings(
        own=lambda number, drive: replace(
            drive, stiffness_N_per_m=1184.0 * factors[number]
        )
    )
    found = diagnosed(given, effects=("parameter_change", "coulomb_friction"))
    assert [one.id for one in found.effects] == ["parameter_change"]
    which, spread = found.effects[0].parameters
    assert which.text == "stiffness"
    true = factors.std(ddof=1) / factors.mean()
    # Every factor is known to some 0.1 %.
    assert spread.value == pytest.approx(true, rel=0.05)
    assert spread.low < true < spread.high

    extended = extended_options(found, simulation())
    assert extended.effects["parameter_change"]["which"] == "stiffness"
    assert diagnosed(given, extended, effects=("coulomb_friction",)).verdict == "none"


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


def test_a_voltage_is_an_input_too():
    driven = replace(DRIVE, **VOLTAGE)
    given = recordings(FRICTION, drive=driven)
    found = diagnosed(
        given, simulation(**VOLTAGE), effects=("coulomb_friction", "input_dead_zone")
    )
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.01)
    assert not any("before the current" in text for text in found.not_observable)


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


def test_under_a_controller_the_command_tells():
    given, model = closed_loop(FRICTION)
    found = diagnosed(given, model)
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    # Noise of 0.01 A is 0.05 N, in 2400 samples.
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.02)
    assert found.output_unit != "m"
    # What only the sensor sees, the loop would have answered.
    assert ("output_backlash",) not in {one.effects for one in found.candidates}


def test_under_a_controller_nothing_is_named_where_nothing_is_missing():
    given, model = closed_loop({})
    assert diagnosed(given, model).verdict == "none"


def test_recordings_that_begin_in_motion_are_diagnosed():
    cut = [
        replace(one, input=one.input[60:], output=one.output[60:])
        for one in recordings(FRICTION)[5:]
    ]
    found = diagnosed(cut, initial_state="estimated")
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.02)
