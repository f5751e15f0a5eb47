"""Own effects of a configuration: what is refused, in one line, and what is written."""

import pytest

from hwid_cli.config.extended_simulation import write_extended_simulation
from hwid_cli.config.load import experiment_of, load_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.records.own_effects import is_own, own_of


def content(effect=None, *, name="mine", drive=None, **more):
    stated = {
        "force_N": "-(a + b * abs(x)) * sign(v)",
        "parameters": {
            "a": {"unit": "N", "positive": True},
            "b": {"unit": "N/m", "positive": True},
        },
    }
    return {
        "name": "t",
        "recordings": {
            "files": "raw/*.csv",
            "columns": {"time": "t", "input": "i", "output": "x"},
        },
        "simulation": {"mass_kg": 0.3, **(drive or {})},
        "own_effects": {name: stated if effect is None else effect},
        "diagnose": {},
        **more,
    }


def with_formula(text, **units):
    parameters = {key: {"unit": unit} for key, unit in units.items()}
    return {"force_N": text, "parameters": parameters}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (content(with_formula("-a*w", a="N")), "own_effects.mine.force_N: found 'w', which is no variable and no parameter; expected x, v, u, t and the names"),
        (content(with_formula("-aa*x", a="N/m")), "found 'aa', which is no variable.*did you mean 'a'"),
        (content(with_formula("-a*x", a="N")), "found '-a\\*x', which is in N m; expected N; correct a unit"),
        (content(with_formula("-(a + x)*v", a="N s/m")), "a is in N s/m, x is?.*m; expected terms of one unit"),
        (content(with_formula("-0.5*sign(v) + a", a="N")), "expected terms of one unit; correct a unit, or give a number"),
        (content(with_formula("a*sin(x)", a="N")), "x in sin\\(...\\) is in m; expected a plain number or rad"),
        (content(with_formula("a*x**n", a="N/m", n="-")), "takes a power that is fitted of what is in m; expected a plain number there"),
        (content(with_formula("-a*x", a="N/mm")), "own_effects.mine.parameters.a.unit: found 'N/mm'; expected the SI unit N/m"),
        (content(with_formula("-a*x", a="apples")), "parameters.a.unit: found 'apples'; expected a unit such as N"),
        (content(with_formula("-v*x", v="N/m")), "parameters.v: found 'v'; expected a name that no variable"),
        (content(with_formula("-a*x", a="N/m", b="N")), "parameters.b: found 'b'; expected a name that the formula '-a\\*x' has"),
        (content(with_formula("-a*x^3", a="N/m")), "force_N: found 'a \\* x \\^ 3'|found .*; expected numbers, names.*a power is written"),
        (content(with_formula("open('x')", a="N")), "own_effects.mine.force_N: found 'open'; expected one of abs, sign"),
        (content(name="coulomb_friction"), "own_effects.coulomb_friction: is an effect of the catalogue too; expected a name of its own; rename it"),
        (content(name="2nd"), "expected a name of letters, digits and _: a letter first"),
        (content({"force_N": "-a*x"}), "own_effects.mine.parameters: missing; expected at least one parameter"),
        (content({"parameters": {"a": {}}}), "own_effects.mine: found none; expected one of force_N, input and output"),
        (content({"force_N": "a", "output": "x", "parameters": {"a": {}}}), "found force_N and output; expected one of"),
        (content({"force_N": "-a*x", "parameters": {"a": {"unit": "N/m", "start": 5, "bounds": [1, 2]}}}), "own_effects.mine.parameters.a.start: found 5.0; expected a number within its bounds, 1 to 2"),
        (content({"force_N": "-a*x", "parameters": {"a": {"unit": "N/m", "bounds": [2, 1]}}}), "parameters.a.bounds: found \\[2.0, 1.0\\]; expected two numbers, the lower one first"),
        (content({"force_N": "-a*x", "parameters": {"a": {"unit": "N/m", "start": -5, "positive": True}}}), "parameters.a.start: found -5.0; expected a number > 0"),
        (content({"force_N": "-a*x", "parameters": {"a": {"unit": "N/m", "begin": 5}}}), "own_effects.mine.parameters.a.begin: unknown key"),
        (content({"force": "-a*x", "parameters": {"a": {"unit": "N/m"}}}), "own_effects.mine.force: unknown key; did you mean 'force_N'"),
        (content(drive={"effects": {"mine": {"a": 1.0}}}), "simulation.effects.mine.b: missing; expected a finite number"),
        (content(drive={"effects": {"mine": {"a": -1.0, "b": 1.0}}}), "simulation.effects.mine.a: found -1.0; expected a number > 0"),
        (content(drive={"effects": {"mine": {"a": 1.0, "b": 1.0, "c": 1.0}}}), "simulation.effects.mine.c: unknown key"),
        (content(drive={"effects": {"mein": {"a": 1.0}}}), "simulation.effects: found 'mein'; did you mean 'mine'"),
        (content(diagnose={"effects": ["mein"]}), "diagnose.effects: found 'mein'; did you mean 'mine'"),
        (content({"input": "u - a*x", "parameters": {"a": {"unit": "V/m"}}}), "u is in A, a\\*x in"),
        (content({"output": "x + a*v", "parameters": {"a": {"unit": "m"}}}), "x is in m, a\\*v in"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_one_line(given, said):
    with pytest.raises(ConfigError, match=said) as caught:
        experiment_of(given, "c.yaml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("identifier", "values", "said"),
    [
        ('a:{"force_N":"-a*x","parameters":{"a":{}}}', {"a": 1.0}, None),
        ('a:{"force_N":"-a*x","parameters":{"a":{}}}', {"b": 1.0}, "a.b: unknown key"),
        (
            'a:{"force_N":"-w*x","parameters":{"a":{}}}',
            {"a": 1.0},
            "expected an effect",
        ),
        ("a:{nonsense", {"a": 1.0}, "expected an effect"),
        ('a:{"force_N":"open(1)","parameters":{"a":{}}}', {}, "expected an effect"),
    ],
)
def test_an_id_of_an_exported_simulation_holds_the_formula(identifier, values, said):
    given = content(drive={"effects": {identifier: values}})
    if said is None:
        assert list(experiment_of(given, "c").simulation.effects) == [identifier]
        return
    with pytest.raises(ConfigError, match=said):
        experiment_of(given, "c")


def test_units_of_a_rotating_axis_and_of_a_voltage():
    rotating = content(
        with_formula("-a*sin(x) - b*v*abs(v)", a="N m", b="N m s^2"), drive={"inertia_kg_m2": 0.1}
    )  # fmt: skip
    del rotating["simulation"]["mass_kg"]
    assert experiment_of(rotating, "c.yaml").own_effects
    volts = content(
        {"input": "u - a*sign(u)", "parameters": {"a": {"unit": "V"}}}, drive={"resistance_ohm": 2.0}
    )  # fmt: skip
    assert experiment_of(volts, "c.yaml").own_effects


def test_a_foreign_simulation_leaves_the_units_of_its_signals_open():
    given = content()
    given["simulation"] = {
        "kind": "python",
        "file": "p.py",
        "input": "u",
        "output": "y",
    }
    assert experiment_of(given, "c.yaml").own_effects


def test_what_is_read_has_ids_and_is_written_as_it_was(tmp_path):
    given = content(drive={"effects": {"mine": {"a": 0.5, "b": 20.0}}})
    experiment = experiment_of(given, str(tmp_path / "c.yaml"))
    (identifier,) = experiment.simulation.effects
    assert is_own(identifier)
    assert own_of(identifier)[0] == "mine"
    assert experiment.diagnose.own_effects == experiment.own_effects
    path = tmp_path / "results" / "extended_simulation.yaml"
    path.parent.mkdir()
    write_extended_simulation(path, experiment, experiment.simulation)
    again = load_experiment(path)
    assert again.simulation.effects == experiment.simulation.effects
    assert again.own_effects == experiment.own_effects
    assert "exponents" not in path.read_text()
