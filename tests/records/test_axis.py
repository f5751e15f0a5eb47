"""Names and units of straight and rotating axes."""

import pytest

from hwid_cli.records.axis import (
    ROTARY_NAMES,
    MotionUnits,
    base_of,
    check_axis,
    name_inside,
    name_on,
    unit_of_effect,
    unit_on,
    units_note,
)
from hwid_cli.records.experiment import SimulationOptions


def test_names_go_there_and_back():
    for old, new in ROTARY_NAMES.items():
        assert name_on("rotary", old) == new
        assert name_inside(new) == name_inside(old) == name_on("linear", old) == old


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("m", "rad"),
        ("m/s", "rad/s"),
        ("N", "N m"),
        ("N/m", "N m/rad"),
        ("N/m^3", "N m/rad^3"),
        ("N s^2/m^2", "N m s^2/rad^2"),
        ("A s/m", "A s/rad"),
        ("kg", "kg m^2"),
        ("A", "A"),
        ("Hz", "Hz"),
        ("-", "-"),
        ("1/s", "1/s"),
        # Of a rotating axis already.
        ("N m", "N m"),
        ("N m s/rad", "N m s/rad"),
        ("kg m^2", "kg m^2"),
        ("rad", "rad"),
    ],
)
def test_units_turn_with_the_axis(unit, expected):
    assert unit_on("rotary", unit) == expected
    assert unit_on("linear", unit) == unit


def test_what_a_sensor_reads_has_its_unit():
    read = {"axis": "rotary", "output": "velocity", "units": MotionUnits()}
    assert unit_of_effect("sensor_saturation", "m", **read) == "rad/s"
    assert unit_of_effect("sensor_drift", "m/s", **read) == "rad/s^2"
    # Ways are ways whatever is read.
    assert unit_of_effect("sensor_eccentricity", "m", **read) == "rad"
    assert unit_of_effect("end_stop", "m", **read) == "rad"


def test_a_note_says_what_units_stand_for():
    assert units_note(axis="linear", output="position") == ""
    assert units_note(axis="rotary", output="velocity") == (
        "m stands for rad, N for N m, kg for kg m^2; "
        "lengths that a sensor reads are velocities"
    )


def test_a_rotating_base_has_the_numbers_of_a_straight_one():
    rotary = SimulationOptions(
        inertia_kg_m2=0.3, stiffness_N_m_per_rad=1184.0, torque_constant_N_m_per_A=5.0
    )
    assert base_of(rotary) == {
        "axis": "rotary",
        "mass_kg": 0.3,
        "stiffness_N_per_m": 1184.0,
        "force_constant_N_per_A": 5.0,
    }
    linear = base_of(SimulationOptions(mass_kg=0.3))
    assert (linear["axis"], linear["mass_kg"]) == ("linear", 0.3)


def test_both_axes_together_are_refused():
    with pytest.raises(ValueError, match=r"mass_kg found 2\.0 beside inertia_kg_m2"):
        SimulationOptions(mass_kg=2.0, inertia_kg_m2=1.0)
    with pytest.raises(ValueError, match="inertia_kg_m2 missing"):
        SimulationOptions(torque_constant_N_m_per_A=2.0)
    check_axis(["mass_kg", "back_emf_V_s_per_m"])
