"""Records of a drive refuse what has no meaning."""

import pytest

from hwid_cli.records.drive import BASE_PARAMETERS, CHANGING, HOLDS, Controller, Drive


def test_a_drive_of_defaults_is_a_free_mass():
    drive = Drive()
    assert (drive.mass_kg, drive.stiffness_N_per_m) == (1.0, 0.0)
    assert drive.effects == {}
    assert drive.controller is None


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mass_kg", 0.0),
        ("mass_kg", float("nan")),
        ("damping_N_s_per_m", -1.0),
        ("stiffness_N_per_m", -1.0),
        ("stiffness_N_per_m", float("nan")),
        ("inductance_H", -1e-3),
        ("resistance_ohm", 0.0),
        ("reference_current_A", 0.0),
        ("reference_displacement_m", -1.0),
        ("hold", "cubic"),
    ],
)
def test_a_parameter_without_meaning_is_refused_by_its_name(name, value):
    with pytest.raises(ValueError, match=name):
        Drive(**{name: value})


@pytest.mark.parametrize("hold", HOLDS)
def test_every_hold_is_accepted(hold):
    assert Drive(hold=hold).hold == hold


def test_a_force_constant_may_point_either_way():
    assert Drive(force_constant_N_per_A=-5.0).force_constant_N_per_A == -5.0


@pytest.mark.parametrize("name", ["position_gain_per_s", "velocity_gain", "limit"])
def test_gains_and_limit_of_a_controller_are_positive(name):
    values = {"position_gain_per_s": 1.0, "velocity_gain": 1.0, "limit": 1.0}
    assert Controller(**values).limit == 1.0
    with pytest.raises(ValueError, match=name):
        Controller(**{**values, name: 0.0})


def test_a_controller_needs_no_limit():
    assert Controller(1.0, 1.0).limit is None


@pytest.mark.parametrize(
    ("drive", "source", "is_force"),
    [
        (Drive(), "current", False),
        (Drive(resistance_ohm=2.0), "voltage", False),
        (Drive(input_unit="V"), "voltage", False),
        (Drive(input_unit="N"), "force", True),
        (Drive(input_unit="N m", axis="rotary"), "torque", True),
    ],
)
def test_what_drives_it_says_what_sets_the_scale(drive, source, is_force):
    assert drive.source == source
    assert drive.is_driven_by_force == is_force
    assert ("mass_kg" in drive.fitted_base) == is_force
    assert ("force_constant_N_per_A" in drive.fitted_base) == (not is_force)


def test_what_is_fitted_are_fields_of_the_drive():
    assert set(BASE_PARAMETERS) <= set(vars(Drive()))
    assert "mass_kg" not in BASE_PARAMETERS
    for which in CHANGING:
        # The mass is held in a fit; between recordings it may differ.
        assert any(name.startswith(which) for name in (*BASE_PARAMETERS, "mass_kg"))
