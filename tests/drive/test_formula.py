"""Formulas of the user's own: what is read, what is refused, and what is computed."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from hwid_cli.drive import formula as text
from hwid_cli.drive import slots
from hwid_cli.drive.interpreter import formula_value
from hwid_cli.records.rules import Refused

# Called from Python, which the program itself never does.
VALUES = {"x": 0.3, "v": -1.7, "u": 2.2, "t": 0.4}
FORMULAS = (
    "-(2 + 30*abs(x))*sign(v)",
    "3*x**3 - x**5 + v*Abs(v)",
    "Max(x - 0.1, 0)*Min(v, 2)",
    "sin(2*pi*x/0.05)*exp(-t/3) + cos(t)",
    "tanh(v/0.1) + atan(x) + sinh(x) - cosh(v)/10",
    "sqrt(abs(v))*sign(v) + log(2 + x) - tan(x)",
    "Heaviside(x)*u**2 - 2**x/u",
    "-u**2 - -v",
    "x - (v - u) - t/(2/u)",
)


def compiled_value(node, values, way):
    steps = np.array(text.program(node))
    depth = text.depth(node)
    p = np.zeros(slots.N_SLOTS + depth + steps.size)
    p[slots.OWN_PILE] = slots.N_SLOTS
    p[slots.N_SLOTS + depth :] = steps
    arguments = [values[one] for one in text.VARIABLES]
    at = float(slots.N_SLOTS + depth)
    return formula_value.py_func(at, *arguments, way, p)


@pytest.mark.parametrize("given_text", FORMULAS)
def test_sympy_arrays_and_loops_agree(given_text, monkeypatch):
    from hwid_cli.drive import interpreter

    for name in ("_variable", "_combined", "_changed", "_curved"):
        monkeypatch.setattr(interpreter, name, getattr(interpreter, name).py_func)
    node = text.parsed(given_text)
    found = float(text.evaluate(node, VALUES))
    by_sympy = sympy.sympify(text.as_text(node)).subs(VALUES).evalf()
    # Text has six digits of its numbers.
    assert float(by_sympy) == pytest.approx(found, rel=1e-5)
    assert compiled_value(node, VALUES, -1.0) == pytest.approx(found, rel=1e-12)


@pytest.mark.thorough
@given(st.recursive(st.sampled_from(["x", "v", "2", "0.5"]), lambda inner: st.one_of(
    st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda p: f"({p[0]}){p[1]}({p[2]})"),
    inner.map(lambda p: f"-({p})"), inner.map(lambda p: f"abs({p})**2"),
), max_leaves=8))  # fmt: skip
@settings(deadline=None, max_examples=150)
def test_text_is_read_as_what_it_was_written_from(given_text):
    node = text.parsed(given_text)
    again = text.parsed(text.as_text(node))
    before, after = (text.evaluate(one, VALUES) for one in (node, again))
    assert np.allclose(before, after, equal_nan=True)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("__import__('os').system('true')", "must be one of abs, sign"),
        ("x.real", "must be numbers, names"),
        ("[x for x in (1,)]", "must be numbers, names"),
        ("x if v else u", "must be numbers, names"),
        ("lambda: 1", "must be numbers, names"),
        ("x^2", r"a power is written \*\*"),
        ("sin(x, v)", "sin of 1 value"),
        ("Max(x)", "Max of 2 values"),
        ("sin(x=1)", "must be one of abs"),
        ("'x'", "must be numbers, names"),
        ("True", "must be numbers, names"),
        ("1e999", "finite"),
        ("9" * 400, "a formula such as"),
        ("0x" + "f" * 400, "a formula such as"),
        ("x +", "a formula such as"),
        ("", "a formula such as"),
        ("(" * 60 + "x" + ")" * 60 + "+x" * 300, "at most 500 characters"),
        ("-" * 100 + "x", "at most 40 brackets"),
        ("x\0", "a formula such as"),
    ],
)
def test_anything_else_is_refused(wrong, said):
    with pytest.raises(Refused, match=said):
        text.parsed(wrong)


def test_numbers_take_the_place_of_parameters_and_are_computed():
    node = text.with_values(text.parsed("a*(b + 2)*x"), {"a": 2.0, "b": 1.0})
    assert text.as_text(node) == "6*x"


def test_edges_and_waves_are_seen():
    assert text.edges(text.parsed("v*abs(v) - sign(v)")) == (False, False)
    assert text.edges(text.parsed("Max(x - 1, 0)")) == (False, True)
    assert text.edges(text.parsed("sign(x)*v")) == (True, True)
    assert text.waves(text.parsed("sin(40*x + v) + cos(3*t)"), "x") == pytest.approx(40)
    assert text.waves(text.parsed("sin(40*x + v) + cos(3*t)"), "t") == pytest.approx(3)
    assert text.has_friction(text.parsed("2*sign(v)*x"))
    assert not text.has_friction(text.parsed("sign(x)*v"))


@pytest.mark.parametrize(
    ("formula", "sticks"),
    [
        ("abs(v)**0.5*sign(v)", False),
        ("2*Max(abs(v) - 0.3, 0)*sign(v)*x", False),
        ("-sign(v)*v*x", False),
        ("sign(v)*abs(v)*sign(v)", False),
        ("abs(v)**0.5*sign(v) - 3*sign(v)", True),
        ("(abs(v) + 1)*sign(v)", True),
        ("x*sign(v)", True),
        ("sign(v)/(1 + v)", True),
        ("sqrt(abs(v))*sign(v)/3", False),
        ("cos(v)*sign(v)", True),
    ],
)
def test_a_sign_times_what_is_0_at_rest_is_no_friction(formula, sticks):
    assert text.has_friction(text.parsed(formula)) is sticks
