"""The sections ``simulation`` and ``diagnose``: what is accepted and what is refused."""

import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.drive.catalogue import configured_effects
from hwid_cli.errors import ConfigError
from hwid_cli.records.drive import Controller

EFFECTS = configured_effects()
RECORDINGS = "recordings: {files: a.csv, columns: {time: t, input: u, output: y%s}}\n"


@pytest.fixture
def load(write_config):
    return lambda text: load_experiment(write_config(f"name: tiny\n{text}\n"))


@pytest.fixture
def load_effect(load):
    def load_one(text):
        return load(f"simulation: {{effects: {{{text}}}}}").simulation.effects

    return load_one


def some_value(one):
    return one.words[0] if one.words else 0.25


def written(values):
    return ", ".join(f"{name}: {value}" for name, value in values.items())


def test_every_effect_is_accepted_with_all_of_its_parameters(load_effect):
    for identifier, parameters in EFFECTS.items():
        values = {one.name: some_value(one) for one in parameters}
        found = load_effect(f"{identifier}: {{{written(values)}}}")
        assert found == {identifier: values}


def test_what_an_effect_needs_is_required_and_the_rest_is_not(load_effect):
    for identifier, parameters in EFFECTS.items():
        needed = {one.name: some_value(one) for one in parameters if one.is_needed}
        found = load_effect(f"{identifier}: {{{written(needed)}}}")
        assert found == {identifier: needed}
        for left_out in needed:
            others = {name: one for name, one in needed.items() if name != left_out}
            with pytest.raises(
                ConfigError, match=rf"effects\.{identifier}\.{left_out}: missing; exp"
            ):
                load_effect(f"{identifier}: {{{written(others)}}}")


def test_what_completes_a_law_may_be_given(load_effect):
    text = "cogging: {amplitude_N: 1, period_m: 0.01, phase_rad: -0.5}"
    assert load_effect(text)["cogging"]["phase_rad"] == -0.5
    text = "gear_backlash: {half_gap_m: 1e-3, stiffness_N_per_m: 9, motor_share: 0.4}"
    assert load_effect(text)["gear_backlash"]["motor_share"] == 0.4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "coulomb_frictoin: {force_N: 1}",
            r"simulation.effects: found 'coulomb_frictoin'; did you mean 'coulomb_fric",
        ),
        (
            "coulomb_friction: {forceN: 1}",
            r"effects.coulomb_friction.forceN: unknown key; did you mean 'force_N'\?",
        ),
        ("coulomb_friction: {force_N: -1}", r"force_N: found -1.0; .*a number >= 0"),
        ("coulomb_friction: {force_N: many}", r"force_N: found 'many'; .*a finite num"),
        ("coulomb_friction: {force_N: .nan}", r"force_N: found nan; expected .*finite"),
        (
            "coulomb_friction: {force_N: true}",
            r"force_N: found True; expected .*finite",
        ),
        (
            "input_dead_zone: {threshold_A: 0}",
            r"threshold_A: found 0.0; .*a number > 0",
        ),
        (
            "output_backlash: {half_gap_m: -1}",
            r"half_gap_m: found -1.0; .*a number > 0",
        ),
        (
            "input_saturation: {limit_A: 0}",
            r"limit_A: found 0.0; expected a number > 0",
        ),
        ("actuator_lag: {time_constant_s: 0}", r"constant_s: found 0.0; .*number > 0"),
        (
            "cogging: {amplitude_N: 1, period_m: 0}",
            r"period_m: found 0.0; .*number > 0",
        ),
        (
            "periodic_force: {amplitude_N: 1, frequency_Hz: 0}",
            r"frequency_Hz: found 0.0; expected a number > 0",
        ),
        (
            "second_mode: {mass_kg: 0, frequency_Hz: 9, damping_ratio: 0.1}",
            r"mass_kg: found 0.0; expected a number > 0",
        ),
        (
            "parameter_change: {which: stifness, spread: 0.1}",
            r"parameter_change.which: found 'stifness'; did you mean 'stiffness'\?",
        ),
        (
            "parameter_change: {which: 3, spread: 0.1}",
            r"parameter_change.which: found 3.0; expected one of stiffness, force_con",
        ),
        (
            "parameter_change: {which: damping, spread: wide}",
            r"parameter_change.spread: found 'wide'; expected a finite number",
        ),
        (
            "gear_backlash: {half_gap_m: 1, stiffness_N_per_m: 9, motor_share: 1}",
            r"motor_share: found 1.0; expected a share of the mass below 1",
        ),
        (
            "gear_backlash: {half_gap_m: 1, stiffness_N_per_m: 9, "
            "contact_damping_ratio: -1}",
            r"contact_damping_ratio: found -1.0; expected a number >= 0",
        ),
        ("coulomb_friction: 1", r"coulomb_friction: found 1; expected a section"),
    ],
)
def test_effect_that_cannot_be_simulated_is_one_line(load_effect, text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load_effect(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("kind: drve", r"simulation.kind: found 'drve'; did you mean 'drive'\?"),
        ("hold: linaer", r"simulation.hold: found 'linaer'; did you mean 'linear'\?"),
        ("mass_kg: 0", r"simulation.mass_kg: found 0.0; expected a number > 0"),
        ("force_constant_N_per_A: -5", r"force_constant_N_per_A: found -5.0; .*> 0"),
        ("stiffness_N_per_m: -1", r"stiffness_N_per_m: found -1.0; .*a number >= 0"),
        ("damping_N_s_per_m: -1", r"damping_N_s_per_m: found -1.0; .*a number >= 0"),
        ("reference_current_A: 0", r"reference_current_A: found 0.0; .*a number > 0"),
        ("resistance_ohm: 0", r"resistance_ohm: found 0.0; expected a number > 0"),
        ("inductance_H: 1", r"inductance_H: found 1.0; expected simulation.resistance"),
        ("back_emf_V_s_per_m: 1", r"back_emf_V_s_per_m: found 1.0; .*resistance_ohm"),
        ("mass: 1", r"simulation.mass: unknown key; did you mean 'mass_kg'\?"),
        (
            "controller: {position_gain_per_s: 0, velocity_gain: 1}",
            r"simulation.controller.position_gain_per_s: found 0.0; .* number > 0",
        ),
        (
            "controller: {position_gain_per_s: 1}",
            r"simulation.controller.velocity_gain: missing; expected a finite number",
        ),
    ],
)
def test_drive_that_cannot_be_simulated_is_one_line(load, text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load(f"simulation: {{{text}}}")
    assert "\n" not in str(caught.value)


def test_circuit_and_controller_are_read(load):
    text = (
        "simulation: {resistance_ohm: 2, inductance_H: 0.001, back_emf_V_s_per_m: 0, "
        "hold: zero, controller: {position_gain_per_s: 160, velocity_gain: 243, "
        "limit: 10}}"
    )
    simulation = load(RECORDINGS % ", reference: r" + text).simulation
    assert simulation.resistance_ohm == 2.0
    assert simulation.back_emf_V_s_per_m == 0.0
    assert simulation.controller == Controller(160.0, 243.0, 10.0)


def test_controller_needs_the_column_that_it_follows(load):
    text = "simulation: {controller: {position_gain_per_s: 1, velocity_gain: 1}}"
    with pytest.raises(
        ConfigError,
        match=r"recordings.columns.reference: missing; .*controller follows",
    ):
        load(RECORDINGS % "" + text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max_effects: -1", r"diagnose.max_effects: found -1; expected .* >= 0"),
        ("skip_samples: -1", r"diagnose.skip_samples: found -1; expected .* >= 0"),
        ("initial_state: res", r"diagnose.initial_state: found 'res'; did you mean 'r"),
        ("effects: [cogging, coging]", r"diagnose.effects: found 'coging'; did you m"),
        ("effects: [cogging, cogging]", r"diagnose.effects: 'cogging' is listed twice"),
        ("hold_out: []", r"diagnose.hold_out: found \[\]; expected auto, or at least"),
        ("hold_out: [a, a]", r"diagnose.hold_out: 'a' is listed twice"),
        ("recordings: []", r"diagnose.recordings: found \[\]; expected at least one"),
        ("recordings: [a, a]", r"diagnose.recordings: 'a' is listed twice"),
        (
            "recordings: [run_1, run_2], hold_out: [run_3]",
            r"diagnose.hold_out: found 'run_3'; did you mean 'run_2' or 'run_1'\?",
        ),
        (
            "recordings: [a, b], hold_out: [b, a]",
            r"diagnose.hold_out: found \['b', 'a'\]; .*left to train on",
        ),
    ],
)
def test_impossible_diagnosis_is_one_line(load, text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load(f"simulation:\ndiagnose: {{{text}}}")
    assert "\n" not in str(caught.value)


def test_diagnosis_needs_a_simulation(load):
    with pytest.raises(
        ConfigError,
        match=r"tiny.yaml: simulation: missing; .*that diagnose judges; add",
    ) as caught:
        load("diagnose: {}")
    assert "\n" not in str(caught.value)


def test_diagnosis_options_are_read(load):
    options = load(
        "simulation:\ndiagnose: {effects: [cogging], hold_out: [a], recordings: [a, b], "
        "initial_state: estimated, skip_samples: 50, max_effects: 0}"
    ).diagnose
    assert options.effects == ("cogging",)
    assert options.hold_out == ("a",)
    assert (options.initial_state, options.skip_samples) == ("estimated", 50)
