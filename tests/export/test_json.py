import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from hwid_cli import load_model, simulate
from hwid_cli.errors import HwidError, ModelFileError
from hwid_cli.export.json_reader import read_exported
from hwid_cli.export.json_writer import described, write_json
from hwid_cli.export.map_parts import map_schema
from hwid_cli.export.predict import predict
from hwid_cli.model.parameter_steps import parameter_vector
from hwid_cli.records.drive import Controller, Drive
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ExportedSimulation, ModelCard
from hwid_cli.records.maps import OwnFunction, StaticMap
from hwid_cli.records.trust import ModelTrust
from hwid_cli.trust.visited import visited_by
from tests.export.model_examples import (
    KINDS,
    example_input,
    example_model,
    exported_of,
)
from tests.store.record_examples import assert_same

_TEXT = (files("hwid_cli.export") / "model.schema.json").read_text()
SCHEMA = jsonschema.Draft202012Validator(json.loads(_TEXT))
OWN = """
from hwid_cli import MapFunction
square = MapFunction(
    value=lambda v, p: v + p[0] * v**2,
    by_argument=lambda v, p: 1.0 + 2.0 * p[0] * v,
    by_parameters=lambda v, p: v[:, None] ** 2,
    start=[0.1],
)
"""


def written(path, exported):
    write_json(path, exported)
    return read_exported(path)


def exported_drive(**values):
    drive = Drive(mass_kg=0.3, stiffness_N_per_m=1e3, **values)
    card = ModelCard("simulation", "simulation", Columns("u", "y", "t"), (-5.0, 5.0))
    return ExportedSimulation(card, drive, 1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_a_model_comes_back_bit_by_bit_and_predicts_the_same(kind, tmp_path):
    rule = ("zero", "steady", "estimated")[KINDS.index(kind) % 3]
    given = exported_of(example_model(1, kinds=(kind, kind), nf=3, nk=2, rule=rule))
    found = written(tmp_path / "m.json", given)
    u = example_input(2)

    assert_same(found, given)
    assert np.array_equal(predict(found, u), simulate(given.model, u))
    assert np.array_equal(
        simulate(load_model(tmp_path / "m.json"), u), simulate(given.model, u)
    )


def with_trust(exported):
    u = example_input(3)
    trust = ModelTrust(
        visited_by([u], [np.repeat([0.0, 1.0], 200)]),
        np.random.default_rng(1).normal(
            0, 0.01, (3, parameter_vector(exported.model).size)
        ),
        noise_rms=0.02,
        scale=1.7,
        judged_on=("a", "b"),
        scatter=0.01,
        reason="of an example",
    )
    return replace(exported, trust=trust)


def test_what_is_known_of_errors_comes_back_bit_by_bit(tmp_path):
    given = with_trust(exported_of(example_model(1)))

    assert_same(written(tmp_path / "m.json", given), given)
    SCHEMA.validate(described(given))


@pytest.mark.parametrize(
    ("keys", "value", "said"),
    [
        (
            ("steps", 1),
            [1.0],
            r"trust.steps\[1\]: found 1 numbers; expected .*, one a p",
        ),
        (("steps",), [], r"trust.steps: found none; expected the steps of the cov"),
        (("scale",), 0.0, r"trust.scale: found 0.0; expected a finite number above 0"),
        (("visited", "inner", "edges", 1), 9e9, "inner.edges: .* numbers that rise"),
        (("visited", "input", "lowest_rate"), [1.0], "found 1 numbers; expected 32"),
    ],
)
def test_damaged_knowledge_of_errors_is_refused(keys, value, said, tmp_path):
    path = tmp_path / "m.json"
    content = described(with_trust(exported_of(example_model(1))))
    place = content["trust"]
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    content["trust"]["reason"] = ""
    path.write_text(json.dumps(content))

    with pytest.raises(ModelFileError, match=said):
        read_exported(path)


@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_describes_what_is_written(kind):
    content = described(exported_of(example_model(1, kinds=("none", kind))))

    SCHEMA.validate(content)
    content["output_map"]["surprise"] = 1
    with pytest.raises(jsonschema.ValidationError):
        SCHEMA.validate(content)


@pytest.mark.parametrize(
    "controller",
    [
        Controller(20.0, 3.0, 4.0, 5.0),
        Controller(proportional_gain=20.0, integral_gain=3.0, derivative_gain=0.1),
    ],
)
def test_a_simulation_comes_back_and_fits_the_schema(tmp_path, controller):
    given = exported_drive(
        effects={"coulomb_friction": {"force_N": 0.7}}, controller=controller
    )
    found = written(tmp_path / "s.json", given)

    assert found.drive == given.drive
    SCHEMA.validate(described(given))
    with pytest.raises(ModelFileError, match="physics simulation"):
        load_model(tmp_path / "s.json")


@pytest.mark.parametrize("values", [{}, {"resistance_ohm": 2.0}])
def test_a_rotating_axis_is_written_by_its_own_names(tmp_path, values):
    given = exported_drive(effects={}, axis="rotary", output="velocity", **values)
    content = described(given)

    SCHEMA.validate(content)
    assert "mass_kg" not in content["simulation"]
    assert content["simulation"]["inertia_kg_m2"] == given.drive.mass_kg
    assert written(tmp_path / "s.json", given).drive == given.drive


@pytest.mark.parametrize("name", ["mass_kg", "inertia_kg_m2"])
def test_a_simulation_without_one_of_its_base_is_refused(tmp_path, name):
    axis = "linear" if name == "mass_kg" else "rotary"
    content = described(exported_drive(effects={}, axis=axis))
    del content["simulation"][name]
    path = tmp_path / "s.json"
    path.write_text(json.dumps(content))
    with pytest.raises(ModelFileError, match=rf"simulation.{name}: "):
        read_exported(path)


def test_two_effects_of_one_id_come_back_and_fit_the_schema(tmp_path):
    effects = {
        "one_sided_stop": {"position_m": -0.01, "stiffness_N_per_m": 1e4},
        "one_sided_stop:second": {"position_m": 0.02, "stiffness_N_per_m": 1e5},
        "load_friction": {"force_N": 0.1, "load_share": 0.1, "load": "drive"},
    }
    given = exported_drive(effects=effects)
    content = described(given)

    assert written(tmp_path / "s.json", given).drive == given.drive
    SCHEMA.validate(content)
    assert [list(one) for one in content["simulation"]["effects"]] == [
        ["one_sided_stop"],
        ["one_sided_stop"],
        ["load_friction"],
    ]
    content["simulation"]["effects"][0]["cogging"] = {}
    with pytest.raises(jsonschema.ValidationError):
        SCHEMA.validate(content)


def test_a_start_is_chosen(tmp_path):
    model = example_model(3, rule="estimated")
    exported, u = exported_of(model), example_input(1)
    steady = predict(exported, u, initial_state="steady")
    empty = predict(exported, u, initial_state="empty")

    assert np.array_equal(steady, simulate(model, u, initial_state="steady"))
    assert np.array_equal(empty, simulate(model, u, initial_state=np.zeros(2)))
    assert not np.array_equal(empty, steady)


def test_a_python_function_runs_only_where_it_is_trusted(tmp_path):
    own = StaticMap(
        "own_function", np.array([0.3]), function=OwnFunction("square", OWN)
    )
    model = example_model(1, kinds=("none", "none"))
    model = type(model)(**{**vars(model), "input_map": own})
    path = tmp_path / "m.json"
    write_json(path, exported_of(model))
    SCHEMA.validate(json.loads(path.read_text()))

    with pytest.raises(ModelFileError, match="carries the Python function 'square'"):
        load_model(path)
    trusted = load_model(path, run_own_functions=True)
    u = example_input(1)
    assert np.array_equal(simulate(trusted, u), simulate(model, u))


def change(key, value):
    """A fault: sets the value below a key with dots; drops the key for None."""

    def made(content):
        *way, last = key.split(".")
        inner = content
        for one in way:
            inner = inner[one]
        if value is None:
            del inner[last]
        else:
            inner[last] = value

    return made


FAULTS = {
    "other version": (change("schema_version", 2), "schema_version 2; expected"),
    "other format": (change("format", "x"), "format x"),
    "no kind": (change("kind", "neural"), "kind: found neural; expected one of"),
    "missing key": (change("input_map", None), "input_map: found nothing"),
    "unknown key": (change("inputmap", 1), "inputmap: unknown key; did you mean"),
    "no sample time": (change("sample_time_s", 0), "sample_time_s: found 0; expected"),
    "text": (change("linear_block.delay", "1"), "delay: found 1; expected an integer"),
    "negative delay": (change("linear_block.delay", -1), "delay: found -1"),
    "huge delay": (change("linear_block.delay", 10**12), "expected an integer from 0"),
    "infinite": (
        change("linear_block.numerator", [10**400]),
        "numerator[0]: found 1000",
    ),
    "true": (change("linear_block.numerator", [True]), "numerator[0]: found True"),
    "no numerator": (
        change("linear_block.numerator", []),
        "numerator: found no numbers",
    ),
    "not monic": (
        change("linear_block.denominator", [2.0, 1.0]),
        "[0]: found 2.0; expected 1",
    ),
    "many poles": (
        change("linear_block.denominator", [1.0] * 5000),
        "denominator: found 5000 numbers; expected at most 1001",
    ),
    "orders": (change("orders.nf", 3), "orders.nf: found 3; expected 2"),
    "rule": (change("initial_state.rule", "warm"), "rule: found warm"),
    "state": (change("initial_state.free_response", [1.0]), "1 numbers; expected 2"),
    "map": (change("input_map.kind", "spline"), "input_map.kind: found spline"),
    "falling": (
        change("input_map.break_points", [1.0, 0.0]),
        "break_points: found [1.0, 0.0]; expected numbers that rise",
    ),
    "lengths": (change("input_map.values", [1.0] * 9), "expected as many values"),
    "domain": (change("input_map.domain", [1.0, 1.0]), "domain: found [1.0, 1.0]"),
    "widths": (change("output_map.widths", [0.0]), "numbers above 0"),
    "extrapolation": (
        change("output_map.extrapolation.arguments", [1.0, 0.0]),
        "output_map.extrapolation.arguments: found [1.0, 0.0]; expected numbers that rise",
    ),
    "extrapolated values": (
        change("output_map.extrapolation.values", [1.0, 0.0]),
        "output_map.extrapolation.values: found 2 numbers; expected 10, one an argument",
    ),
    "visited": (
        change("output_map.extrapolation.visited", [1.0, 0.0]),
        "visited: found [1.0, 0.0]; expected pairs of rising numbers",
    ),
    "half a stretch": (
        change("output_map.extrapolation.visited", [1.0, 2.0, 3.0]),
        "visited: found [1.0, 2.0, 3.0]; expected pairs of rising numbers",
    ),
    "range": (change("input_range", [1.0]), "input_range: found [1.0]"),
    "column": (change("columns.input", -1), "columns.input: found -1"),
    "unit": (change("units.input", 3), "units.input: found 3; expected text"),
    "scale": (change("scales.input", 0.0), "scales.input: found 0.0"),
    "section": (change("provenance", "me"), "provenance: found text"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_a_model_is_one_line(fault, tmp_path):
    alter, said = FAULTS[fault]
    path = tmp_path / "m.json"
    content = described(exported_of(example_model(1)))
    alter(content)
    path.write_text(json.dumps(content))

    with pytest.raises(ModelFileError) as error:
        read_exported(path)
    assert said in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "m.json: holds no key 'format'; expected a model that 'hwid export"),
        ("", "is no JSON"),
        ("{", "is no JSON"),
        ("[]", "holds a list"),
        ('{"a": NaN}', "NaN is no number"),
        ('{"a": 1, "a": 2}', "key 'a' occurs twice"),
        ("[" * 100_000, "is no JSON"),
    ],
)
def test_what_is_no_model_is_refused(text, said, tmp_path):
    path = tmp_path / "m.json"
    path.write_text(text)
    with pytest.raises(ModelFileError, match=said):
        read_exported(path)
    with pytest.raises(ModelFileError, match="no such file"):
        read_exported(Path("nowhere.json"))


def test_brackets_of_any_depth_are_refused(tmp_path):
    path = tmp_path / "m.json"
    content = described(exported_of(example_model(1, kinds=("none", "none"))))
    text = json.dumps({**content, "name": "deep"})
    said = []
    # Python's own limit, 1000, lies between them.
    for depth in (10, 900, 940, 980, 1100):
        path.write_text(text.replace('"deep"', "[" * depth + "]" * depth))
        with pytest.raises(ModelFileError) as error:
            read_exported(path)
        said.append(str(error.value))
    assert "name: found [[[" in said[0]
    assert "is no JSON" in said[-1]


def test_effects_of_a_simulation_are_checked_as_in_a_configuration(tmp_path):
    path = tmp_path / "s.json"
    content = described(exported_drive())
    content["simulation"]["effects"] = {"coulomb_friction": {"force": 1.0}}
    path.write_text(json.dumps(content))

    with pytest.raises(HwidError, match=r"effects.coulomb_friction.force: unknown key"):
        read_exported(path)


def test_an_unstable_model_does_not_predict():
    model = example_model(1)
    model = type(model)(**{**vars(model), "denominator": np.array([1.0, -2.0, 0.5])})

    with pytest.raises(ModelFileError, match=r"m.json: .*pole of magnitude 1.7071"):
        predict(exported_of(model), np.ones(3), place="m.json")


def test_the_schema_says_of_maps_what_their_kinds_say():
    # Written by tools/model_schema.py.
    assert json.loads(_TEXT)["$defs"]["map"] == map_schema()
