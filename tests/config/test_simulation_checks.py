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
        # Some effects need a circuit.
        text = f"simulation: {{resistance_ohm: 1, effects: {{{text}}}}}"
        return load(text).simulation.effects

    return load_one


def some_value(one):
    numbers = (0.25, 1.25)
    fitting = [n for n in numbers if all(limit.holds(n) for limit in one.limits)]
    return one.words[0] if one.words else fitting[0]


def written(values):
    return ", ".join(f"{name}: {value}" for name, value in values.items())


def test_every_effect_is_accepted_with_all_of_its_parameters(load_effect):
    for identifier, parameters in EFFECTS.items():
        values = {one.name: some_value(one) for one in parameters}
        found = load_effect(f"{identifier}: {{{written(values)}}}")
        assert found == {identifier: values}


@pytest.mark.thorough
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


def test_an_inductance_needs_a_circuit(load):
    text = "simulation: {effects: {winding_inductance: {inductance_H: 0.01}}}"
    with pytest.raises(
        ConfigError,
        match=r"effects\.winding_inductance: found without simulation\.resistance_ohm, "
        r"so that the input is the current; expected simulation\.resistance_ohm too; add",
    ):
        load(text)


def test_an_effect_may_stand_in_a_list_twice(load):
    text = """
simulation:
  effects:
  - one_sided_stop: {position_m: -0.01, stiffness_N_per_m: 9}
  - cogging: {amplitude_N: 1, period_m: 0.01}
  - one_sided_stop: {position_m: 0.02, stiffness_N_per_m: 7, exponent: 1.5}
"""
    assert load(text).simulation.effects == {
        "one_sided_stop": {"position_m": -0.01, "stiffness_N_per_m": 9},
        "cogging": {"amplitude_N": 1, "period_m": 0.01},
        "one_sided_stop:second": {
            "position_m": 0.02,
            "stiffness_N_per_m": 7,
            "exponent": 1.5,
        },
    }


def test_a_list_without_a_repeat_is_the_same_simulation(load):
    listed = load("simulation: {effects: [{coulomb_friction: {force_N: 1}}]}")
    section = load("simulation: {effects: {coulomb_friction: {force_N: 1}}}")
    assert listed.simulation == section.simulation


def test_what_words_tell_apart_may_stand_there_together(load):
    text = (
        "simulation: {effects: ["
        "{load_friction: {force_N: 1, load_share: 0.1, load: spring}}, "
        "{load_friction: {force_N: 1, load_share: 0.1, load: %s}}]}"
    )
    assert len(load(text % "drive").simulation.effects) == 2
    with pytest.raises(
        ConfigError,
        match=r"simulation.effects: load_friction is listed twice; expected each "
        r"load_friction with another load; remove one",
    ):
        load(text % "spring")


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (
            "[{coulomb_friction: {force_N: 1}}, {coulomb_friction: {force_N: 2}}]",
            r"coulomb_friction is listed twice; expected twice only cogging, one_sided_",
        ),
        (
            "[cogging: {amplitude_N: 1, period_m: 1}, cogging: {amplitude_N: 2, "
            "period_m: 2}, cogging: {amplitude_N: 3, period_m: 3}]",
            r"effects: 'cogging' is there a third time; an effect may occur twice",
        ),
        (
            "[{cogging: {amplitude_N: 1, period_m: 1}, coulomb_friction: {force_N: 1}}]",
            r"simulation.effects: found .*; expected an effect: one key with its param",
        ),
        ("[cogging]", r"effects: found 'cogging'; expected an effect: one key"),
        (
            "{'cogging:second': {amplitude_N: 1, period_m: 1}}",
            r"effects: found 'cogging:second'; expected the id of an effect; write a l",
        ),
        (
            "[cogging: {amplitude_N: 1, period_m: 1}, cogging: {amplitude_N: 2}]",
            r"effects.cogging:second.period_m: missing; expected a finite number",
        ),
        (
            "[cogging: {amplitude_N: 1, period_m: 1}, cogging: {amplitude_N: many, "
            "period_m: 1}]",
            r"effects.cogging:second.amplitude_N: found 'many'; expected a finite num",
        ),
        ("3", r"simulation.effects: found 3; expected a section with keys"),
    ],
)
def test_lists_of_effects_that_cannot_be_are_refused(load, effects, message):
    with pytest.raises(ConfigError, match=message):
        load(f"simulation: {{effects: {effects}}}")


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
            "elastic_coupling: {stiffness_N_per_m: 9, sensor: gear}",
            r"elastic_coupling\.sensor: found 'gear'; expected one of motor, load",
        ),
        (
            "clock_skew: {ratio: 11}",
            r"clock_skew\.ratio: found 11\.0; expected a ratio from 0\.1 to 10",
        ),
        (
            "gear_backlash: {half_gap_m: 1, stiffness_N_per_m: 9, motor_share: 1}",
            r"motor_share: found 1.0; expected a share below 1",
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
            r"simulation.controller.velocity_gain: missing; expected a number > 0; add",
        ),
        (
            # Even where the number is that of the default.
            "mass_kg: 1.0, inertia_kg_m2: 0.2",
            r"simulation.mass_kg: found 1.0 beside inertia_kg_m2; expected names of one "
            r"axis, straight or rotating; write inertia_kg_m2$",
        ),
        (
            "inertia_kg_m2: 0.2, force_constant_N_per_A: 3, stiffness_N_m_per_rad: 1",
            r"simulation.force_constant_N_per_A: found 3.0 beside inertia_kg_m2; .*; "
            r"write torque_constant_N_m_per_A$",
        ),
        (
            "torque_constant_N_m_per_A: 3",
            r"simulation.inertia_kg_m2: missing; expected the inertia, because "
            r"torque_constant_N_m_per_A is of a rotating axis; add the key$",
        ),
        (
            "inertia_kg_m2: 0",
            r"simulation.inertia_kg_m2: found 0.0; expected a number > 0",
        ),
        (
            "inertia_kg_m2: 1, back_emf_V_s_per_rad: 1",
            r"simulation.back_emf_V_s_per_rad: found 1.0; expected .*resistance_ohm too",
        ),
        (
            "output: speed",
            r"simulation.output: found 'speed'; expected one of position, velocity",
        ),
        (
            "output: velocity, controller: {position_gain_per_s: 1, velocity_gain: 2}",
            r"controller.position_gain_per_s: found 1.0; expected a controller of the "
            r"velocity \(proportional_gain, .*because simulation.output is velocity",
        ),
        (
            "controller: {limit: 1}",
            r"controller.position_gain_per_s: missing; expected a number > 0; add the key, "
            r"or proportional_gain of a PID controller",
        ),
        (
            "controller: {integral_gain: 1}",
            r"controller.proportional_gain: missing; expected a number > 0; add the key$",
        ),
        (
            "controller: {position_gain_per_s: 1, velocity_gain: 2, integral_gain: 3}",
            r"controller.integral_gain: found 3.0 beside position_gain_per_s; expected a "
            r"cascade \(position_gain_per_s, velocity_gain, reset_rate_per_s\) or a PID "
            r"controller \(proportional_gain, integral_gain, derivative_gain\); remove one",
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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[force_constant_N_per_A]", {"force_constant_N_per_A": 0.02}),
        ("force_constant_N_per_A", {"force_constant_N_per_A": 0.02}),
        (
            "{force_constant_N_per_A: 0.05, damping_N_s_per_m: 0}",
            {"force_constant_N_per_A": 0.05, "damping_N_s_per_m": 0.0},
        ),
        ("{}", {}),
    ],
)
def test_known_parameters_may_be_a_list_or_have_tolerances(load, text, expected):
    assert load(f"simulation: {{known: {text}}}").simulation.known == expected


TORQUE = (
    "recordings: {files: x.csv, columns: {input: u, output: y}, sample_time_s: 0.001, "
    "input_unit: N m}"
)


def test_a_mass_may_be_known_where_the_input_is_the_force(load):
    text = "simulation: {inertia_kg_m2: 1, known: {inertia_kg_m2: 0.1}}"
    assert load(f"{TORQUE}\n{text}").simulation.known == {"inertia_kg_m2": 0.1}
    with pytest.raises(ConfigError, match="expected one of damping_N_m_s_per_rad"):
        load(text)


@pytest.mark.parametrize(
    "name", ["torque_constant_N_m_per_A", "force_constant_N_per_A"]
)
def test_what_is_known_of_a_rotating_axis_has_its_names_too(load, name):
    text = f"simulation: {{inertia_kg_m2: 1, known: {{{name}: 0}}}}"
    assert load(text).simulation.known == {name: 0.0}


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("[force_constant_N_per_V]", "known: found 'force_constant_N_per_V'; did you"),
        ("[mass_kg]", "simulation.known: found 'mass_kg'; expected one of damping"),
        ("{damping_N_s_per_m: -0.1}", r"known.damping_N_s_per_m: found -0.1; expected"),
        ("{damping_N_s_per_m: 5}", r"a share from 0 to 1, such as 0.05"),
        ("{damping_N_s_per_m: little}", r"found 'little'; expected a finite number"),
        ("[1]", r"simulation.known: found \[1\]; expected a section"),
    ],
)
def test_known_parameters_that_make_no_sense_are_refused(load, text, match):
    with pytest.raises(ConfigError, match=match):
        load(f"simulation: {{known: {text}}}")
