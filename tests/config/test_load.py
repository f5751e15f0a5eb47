import json
from pathlib import Path

import pytest

from hwid_cli.config.load import describe_experiment, load_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import CalibrateOptions, CrossvalOptions
from hwid_cli.records.machines import GunMachine, ServoMachine
from hwid_cli.records.model import FitOptions

CONFIGS = Path(__file__).parents[2] / "configs"

# The example of the design, its placeholders replaced by real lists.
FULL = """\
name: gun                       # results/gun
recordings:
  files: raw/*.csv              # glob or list, relative to this file
  columns: {time: time_s, input: current_A, output: displacement_m}
  sample_time_s: 0.001          # only where there is no time column
  kind: {step: "step_*", sine: "sine_*", random: "random_*"}
calibrate: {step: [cut, output_offset], sine: [cut, input_offset, output_offset, recut], random: [cut]}
orders: {nb: [1, 10], nk: [1, 10], nk_role: poles}
fit: {input_map: piecewise_linear, output_map: piecewise_linear, units: 10, initial_state: estimated, join: concatenate}
identify: {recordings: [step_01, step_02]}                # default: all
crossval: {threshold: 0.01, recordings: [step_01, step_02]}
group: {start: [step_06, step_07], candidates: [step_08, step_09], validate: [step_01], keep: {coverage_at_least: 7}, max_level: 4}
test: {recordings: [step_05, step_10, step_11]}
simulation:                     # the physics model that diagnose judges, SI units
  kind: drive
  mass_kg: 0.3                  # held fixed: only ratios to it can be identified
  damping_N_s_per_m: 15.0
  stiffness_N_per_m: 1184.0     # 0: no spring (a free axis)
  force_constant_N_per_A: 5.0
  effects: {}                   # effects already in the simulation
diagnose: {recordings: all, hold_out: auto, effects: all, max_effects: 3}
"""
MINIMAL = "name: tiny\n"


@pytest.fixture
def load(write_config):
    return lambda text: load_experiment(write_config(text))


def test_full_example_of_the_design_is_read(load):
    experiment = load(FULL)
    assert experiment.recordings.files == ("raw/*.csv",)
    assert experiment.recordings.columns.output == "displacement_m"
    assert experiment.recordings.kind["sine"] == ("sine_*",)
    assert experiment.calibrate.sine[-1] == "recut"
    assert experiment.orders.nb == tuple(range(1, 11))
    assert experiment.fit == FitOptions()
    assert experiment.identify.recordings == ("step_01", "step_02")
    assert experiment.group.keep == {"coverage_at_least": 7}
    assert experiment.test.recordings == ("step_05", "step_10", "step_11")
    assert experiment.simulation.stiffness_N_per_m == 1184.0
    assert experiment.diagnose.recordings is None
    assert experiment.diagnose.effects is None
    assert experiment.diagnose.hold_out == "auto"


def test_section_that_is_left_out_asks_for_no_work_or_keeps_defaults(load):
    experiment = load(MINIMAL)
    assert experiment.identify is None
    assert experiment.recordings is None
    assert experiment.fit == FitOptions()


def test_section_without_a_body_has_its_defaults(load):
    experiment = load(MINIMAL + "crossval:\ncalibrate:\nfit:\n")
    assert experiment.crossval == CrossvalOptions()
    assert experiment.calibrate == CalibrateOptions()


@pytest.mark.parametrize(
    ("axis", "orders"),
    [
        ("[2, 5]", (2, 3, 4, 5)),
        ("[3, 3]", (3,)),
        ("4", (4,)),
        ("[4]", (4,)),
        ("[1, 3, 9]", (1, 3, 9)),
    ],
)
def test_orders_axis_is_a_range_one_order_or_an_explicit_list(load, axis, orders):
    assert load(f"{MINIMAL}orders: {{nb: {axis}}}").orders.nb == orders


def test_scalar_stands_for_a_list_of_one(load):
    text = "recordings: {files: a.csv, columns: {time: 0, input: 1, output: 2}}\n"
    assert load(MINIMAL + text).recordings.files == ("a.csv",)


def test_machines_are_told_apart_by_kind(load):
    servo = load(MINIMAL + "simulate: {kind: servo, source_voltage_V: 110}").simulate
    gun = load(MINIMAL + "simulate: {kind: gun, plan: {only: step_01}}").simulate
    assert servo == ServoMachine(source_voltage_V=110.0)
    assert isinstance(gun, GunMachine)
    assert gun.plan.only == ("step_01",)


def test_source_is_the_path_as_given_and_no_key(load, write_config):
    path = write_config(MINIMAL)
    assert load_experiment(path).source == str(path)
    with pytest.raises(ConfigError, match=r"source: unknown key"):
        load(MINIMAL + "source: elsewhere\n")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "orders: {nkk: 3}",
            r"tiny.yaml: orders.nkk: unknown key; did you mean 'nk'\?",
        ),
        (
            "order: {nb: 3}",
            r"tiny.yaml: order.nb: unknown key; did you mean 'orders.nb'\?",
        ),
        ("zzz: 1", r"zzz: unknown key; expected one of name, recordings, simulate"),
        ("identify: {recordings: 3}", r"identify.recordings.0: found 3; .*in quotes"),
        ("fit: {units: ten}", r"fit.units: found 'ten'; expected an integer"),
        ("fit: {units: 2.5}", r"fit.units: found 2.5; expected an integer"),
        ("fit: {units: true}", r"fit.units: found True; expected an integer"),
        ("fit: {units: }", r"fit.units: found no value; expected an integer"),
        ("fit: {units: 1}", r"fit.units: found 1; expected an integer >= 2"),
        ("fit: {input_map: wavy}", r"fit.input_map: found 'wavy'; expected one of pi"),
        (
            "fit: {input_map: piecewiselinear}",
            r"fit.input_map: found 'piecewiselinear'; did you mean 'piecewise_linear'\?",
        ),
        ("fit: {join: experiment}", r"fit.join: .*; did you mean 'experiments'\?"),
        ("fit: {loss: hubber}", r"fit.loss: .*; did you mean 'huber'\?"),
        ("fit: {initial_state: 3}", r"fit.initial_state: found 3; expected text"),
        (
            "order_grid: {nb: 1}",
            r"order_grid: unknown key; did you mean 'order' or 'orders'\?",
        ),
        ("fit: 3", r"fit: found 3; expected a section with keys"),
        (
            "crossval: {threshold: 1 mm}",
            r"threshold: found '1 mm'; expected a finite number; write the number alone, "
            "without quotes or a unit",
        ),
        (
            "crossval: {threshold: '0,2'}",
            r"found '0,2'; expected a finite number; write 0.2, with a decimal point",
        ),
        (
            "fit: {units: '3'}",
            r"found '3'; expected an integer; write the number alone",
        ),
        ("fit: {units: three}", r"found 'three'; expected an integer$"),
        ("crossval: {threshold: .inf}", r"threshold: found inf; expected a finite"),
        ("crossval: {threshold: .nan}", r"threshold: found nan; expected a finite"),
        ("test: ", r"test.recordings: missing; expected a list \(each text\); add"),
        ("simulate: {seed: 1}", r"simulate.kind: missing; expected one of servo, gun"),
        (
            "simulate: {kind: gunn}",
            r"simulate.kind: found 'gunn'; did you mean 'gun'\?",
        ),
        ("simulate: {kind: [gun]}", r"simulate.kind: found \['gun'\]; did you mean"),
        (
            "simulate: {kind: gun, plan: {only: [1]}}",
            r"simulate.plan.only.0: found 1; expected text; put it in quotes",
        ),
        (
            "simulate: {kind: gun, mechanics: {friction: {coulomb_N: -1}}}",
            r"tiny.yaml: simulate.mechanics.friction.coulomb_N: found -1.0; .* >= 0",
        ),
        ("simulation: {effects: {1: {}}}", r"effects.1: the key is 1; .*in quotes"),
        ("group: {keep: {top: few}}", r"group.keep.top: found 'few'; .*an integer"),
        ("recordings: {files: a.csv}", r"recordings.columns: missing; expected a"),
    ],
)
def test_wrong_key_or_value_is_one_line_with_its_place(load, text, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load(MINIMAL + text)
    assert "\n" not in str(caught.value)


def test_name_is_required(load):
    with pytest.raises(ConfigError, match=r"tiny.yaml: name: missing; expected text"):
        load("fit:\n")


def test_description_is_plain_data_with_defaults_and_without_the_path(load):
    described = describe_experiment(load(FULL))
    assert json.loads(json.dumps(described)) == described
    assert described["fit"]["max_iterations"] == FitOptions().max_iterations
    assert described["recordings"]["kind"]["step"] == ["step_*"]
    assert described["test"]["recordings"] == ["step_05", "step_10", "step_11"]
    assert "source" not in described


def test_example_of_the_readme_is_read(load):
    text = (CONFIGS / "README.md").read_text(encoding="utf-8")
    example = text.split("```yaml\n")[1].split("```")[0]
    assert load(example).name == "gun"


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_configurations_are_read(path):
    assert load_experiment(path).name
