"""What a text says of a unit, and the factors between units."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.constants as c

from hwid_cli.data.units import (
    bare_unit,
    factor_between,
    in_unit,
    is_unitless,
    looks_like_unit,
    quantity_of,
    readings_of,
    unit_in_name,
)


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("mm", "m", c.milli),
        ("µm", "m", c.micro),
        ("μm", "m", c.micro),
        ("um", "m", c.micro),
        ("inch", "m", c.inch),
        ("mA", "A", c.milli),
        ("us", "s", c.micro),
        ("min", "s", c.minute),
        ("deg", "rad", c.degree),
        ("°", "rad", c.degree),
        ("turn", "rad", 2 * c.pi),
        ("rpm", "rad/s", 2 * c.pi / 60),
        ("1/min", "rad/s", 2 * c.pi / 60),
        ("°/s", "rad/s", c.degree),
        ("km/h", "m/s", c.kmh),
        ("mm s^-1", "m/s", c.milli),
        ("mm.s-1", "m/s", c.milli),
        ("Nm", "N m", 1.0),
        ("mNm", "N m", c.milli),
        ("N*mm", "N m", c.milli),
        ("lbf", "N", c.lbf),
        ("bar", "Pa", c.bar),
        ("m/s**2", "m/s^2", 1.0),
        ("anything", "anything", 1.0),
    ],
)
def test_factors_are_those_of_another_library(unit, target, factor):
    # Tables of constants carry 16 digits.
    assert factor_between(unit, target) == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "target"),
    [
        ("mm", "rad"),
        ("A", "m"),
        ("rad", "m"),
        # A frequency is no angular velocity: 2 pi lies between them.
        ("Hz", "rad/s"),
        ("rad", "-"),
        # Degrees or gradians?
        ("grad", "rad"),
        # Of an inch or of a radian?
        ("mils", "rad"),
        ("mil", "m"),
        # Zero lies elsewhere.
        ("degC", "K"),
        ("inc", "m"),
        ("ma", "A"),
        ("m" * 50, "m"),
        ("9**9**9**9", "m"),
        ("m**9", "m"),
        ("", "m"),
    ],
)
def test_what_cannot_be_converted_has_no_factor(unit, target):
    assert factor_between(unit, target) is None


def test_units_of_something_else_are_no_quantity_of_a_drive():
    assert [quantity_of(unit) for unit in ("kg", "K", "t", "Hz", "%", "inc")] == [
        ""
    ] * 6


def test_decimal_numbers_keep_their_digits():
    # 0.3 mm is 3e-4 m and no 2.9999999999999997e-4 m.
    assert in_unit(np.array([0.3, 12.345]), "mm", "m").tolist() == [3e-4, 0.012345]
    with pytest.raises(ValueError, match="'A' is no 'm'"):
        in_unit(1.0, "A", "m")


@pytest.mark.parametrize(
    ("title", "role", "unit"),
    [
        ("position_mm", "output", "mm"),
        ("current [mA]", "input", "mA"),
        ("I (mA)", "input", "mA"),
        ("U/V", "input", "V"),
        ("t_ms", "time", "ms"),
        ("Zeit in ms", "time", "ms"),
        ("speed_m_per_s", "output", "m/s"),
        ("Winkel [°]", "output", "°"),
        ("Drehzahl [1/min]", "output", "1/min"),
        ("torque_Nm", "input", "Nm"),
        ("position [inc]", "output", "inc"),
        ("current_A", "output", "A"),
        ("x_m", "output", "m"),
        ("position [-]", "output", "-"),
        ("y [1]", "output", "-"),
        ("Enc(cnt)", "output", "cnt"),
        ("Enc (Counts)", "output", "Counts"),
        ("pos(incr)", "output", "incr"),
        ("Cmd(%)", "input", "%"),
        ("I(mA)", "input", "mA"),
        # Indices, arguments and words.
        ("f(x)", "output", ""),
        ("u(1)", "input", ""),
        ("run(2)", "input", ""),
        ("pos(raw)", "output", ""),
        ("theta_m", "output", ""),
        ("i_m", "input", ""),
        ("i_s", "input", ""),
        ("pos_A", "time", ""),
        ("x[k]", "output", ""),
        ("y(t)", "output", ""),
        ("y[12]", "output", ""),
        ("position (filtered)", "output", ""),
        ("position", "output", ""),
        ("_mm", "output", ""),
    ],
)
def test_names_say_a_unit_where_it_surely_is_one(title, role, unit):
    assert unit_in_name(title, role) == unit


def test_cells_above_numbers_may_be_units():
    assert bare_unit(" [mm] ") == "mm"
    assert looks_like_unit("(1/min)")
    assert not looks_like_unit("displacement")
    assert [is_unitless(one) for one in ("-", "1", "none", "mm")] == [True] * 3 + [
        False
    ]


@pytest.mark.thorough
def test_plain_units_do_not_load_the_library():
    script = (
        "import sys\n"
        "from hwid_cli.data.units import factor_between, quantity_of, unit_in_name\n"
        "assert quantity_of('A') == 'current' and factor_between('m', 'm') == 1.0\n"
        "assert unit_in_name('displacement_m', 'output') == 'm'\n"
        "import hwid_cli.cli.main, hwid_cli.stages.diagnose, hwid_cli.cli.check\n"
        "assert 'pint' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_what_nobody_can_tell_has_readings():
    assert readings_of("mils") == ("thou", "mrad")
    assert readings_of("Grad") == ("deg", "gon")
    assert all(quantity_of(one) for one in (*readings_of("mils"), *readings_of("grad")))
    assert readings_of("mm") == ()


@pytest.mark.parametrize("unit", ["degC", "°C", "K", "g", "l/min", "%FS", "mils"])
def test_what_is_measured_beside_a_drive_keeps_its_unit_as_a_label(unit):
    assert unit_in_name(f"Response ({unit})", "output") == unit
    assert quantity_of(unit) == ""


def test_units_may_be_written_with_raised_digits_and_capitals():
    assert quantity_of("m/s²") == "acceleration"
    assert factor_between("RPM", "rpm") == pytest.approx(1.0)
    assert factor_between("dps", "deg/s") == pytest.approx(1.0)
