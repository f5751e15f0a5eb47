import pytest

from hwid_cli.data.column_words import meaning_of
from hwid_cli.data.table_heads import sample_time_named


@pytest.mark.parametrize(
    ("title", "role", "unit"),
    [
        ("current_A", "input", "A"),
        ("heater_W", "input", "W"),
        ("pump_drive_pct", "input", "%"),
        ("pump_flow_lpm", "output", "l/min"),
        ("transmitter", "output", ""),
        ("flow_sensor_mA", "output", "mA"),
        ("sensor_current", "input", ""),
        ("thermocouple_mV", "output", "mV"),
        ("speed_radps", "output", "rad/s"),
        ("contraction_mm", "output", "mm"),
        ("Strom [mA]", "input", "mA"),
        ("i_motor", "input", ""),
        ("u", "input", ""),
        ("Spannung (V)", "input", "V"),
        ("Drehmoment [Nm]", "input", "Nm"),
        ("y", "output", ""),
        ("position_mm", "output", "mm"),
        ("Weg/mm", "output", "mm"),
        ("Istposition [m]", "output", "m"),
        ("Drehzahl [1/min]", "output", "1/min"),
        ("displacement_m", "output", "m"),
        ("winkel_rad", "output", "rad"),
        ("speed_m_per_s", "output", "m/s"),
        ("t", "time", ""),
        ("time_ms", "time", "ms"),
        ("Zeit [s]", "time", "s"),
        ("pos_ref", "reference", ""),
        ("Sollposition [m]", "reference", "m"),
        ("Sollstrom [A]", "input", "A"),
        ("Kanal 3 [A]", "input", "A"),
        ("Nr", "counter", ""),
        ("data.input", "input", ""),
        ("Temperatur [K]", "output", "K"),
        ("foo", "", ""),
    ],
)
def test_names_in_two_languages_say_role_and_unit(title, role, unit):
    found = meaning_of(title)
    assert (found.role, found.unit) == (role, unit)


def test_a_measured_current_comes_before_a_wanted_one():
    assert meaning_of("Iststrom [A]").rank < meaning_of("Sollstrom [A]").rank


@pytest.mark.parametrize(
    ("title", "value", "step"),
    [("Ts", 0.01, 0.01), ("fs", 500.0, 0.002), ("dt", 0.0, None), ("kp", 2.0, None)],
)
def test_settings_may_state_the_sample_time(title, value, step):
    assert sample_time_named(title, value) == step


def test_a_letter_before_ref_is_what_is_wanted():
    assert meaning_of("xref_um").role == "reference"
    assert meaning_of("Vref").role == "reference"
    assert meaning_of("iref_A").role == "input"
    assert meaning_of("x_um").role == "output"


def test_what_was_measured_is_said_by_another_word_or_it_is_the_output():
    assert meaning_of("Istwert").role == "output"
    assert meaning_of("measured").role == "output"
    assert meaning_of("measured_current").role == "input"
    assert meaning_of("Drehmomentistwert").role == "input"
    assert meaning_of("Drehzahlistwert").role == "output"


@pytest.mark.parametrize(
    ("title", "role"),
    [
        ("T_air_degC", "output"),
        ("T_K [K]", "output"),
        ("T Luft [°C]", "output"),
        ("t [s]", "time"),
        ("t", "time"),
        ("T_ms", "time"),
    ],
)
def test_a_capital_t_may_be_a_temperature(title, role):
    assert meaning_of(title).role == role


@pytest.mark.parametrize(
    ("title", "role"),
    [
        ("q_axis_current", "input"),
        ("x_force", "input"),
        ("t_position", "output"),
        ("q_motor", "output"),
        ("u_measured", "input"),
        ("i_q", "input"),
    ],
)
def test_a_whole_word_says_more_than_a_letter(title, role):
    assert meaning_of(title).role == role
