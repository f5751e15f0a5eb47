import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.data.column_clocks import guess_time, unused_times
from hwid_cli.data.column_roles import guess_signals
from hwid_cli.data.units import unit_in_name
from hwid_cli.records.starter import FoundColumn

N = 800


def plant(seed=0):
    """An input that holds its levels and, from it, a current, a speed and a position."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, N // 20), 20) + 1e-3 * rng.standard_normal(N)
    i, v, x = np.zeros(N), np.zeros(N), np.zeros(N)
    for k in range(1, N):
        i[k] = 0.6 * i[k - 1] + 0.4 * u[k - 1]
        v[k] = 0.95 * v[k - 1] + 0.05 * i[k - 1] - 0.02 * x[k - 1]
        x[k] = x[k - 1] + v[k - 1]
    noise = 1e-4 * rng.standard_normal((3, N))
    return u, i + noise[0], v + noise[1], x + noise[2]


def column(title, values, unit="", key=None):
    return FoundColumn(title, key if key is not None else title, values, None, unit)


def guessed(*columns):
    found = guess_signals([column(*one) for one in columns])
    return found.input.key, found.output.key, found


VOLTAGE, CURRENT, SPEED, POSITION = plant()


@pytest.mark.parametrize(
    ("titles", "first", "last"),
    [
        (("U_mot", "I_ist", "n_ist", "pos_ist"), "I_ist", "pos_ist"),
        (("cmd", "foo", "vel_fb", "pos_fb"), "cmd", "pos_fb"),
        (("Spannung", "Strom", "Drehzahl", "Lage"), "Strom", "Lage"),
        (("SetVoltage", "ActCurrent", "ActVelo", "ActPos"), "ActCurrent", "ActPos"),
        (("u", "i_meas", "omega", "phi"), "i_meas", "phi"),
    ],
)
def test_names_of_two_languages_say_the_roles(titles, first, last):
    found = guessed(*zip(titles, (VOLTAGE, CURRENT, SPEED, POSITION), strict=True))
    assert found[:2] == (first, last)
    assert not any("NOT SURE" in note for note in found[2].notes)


def test_a_wanted_position_is_a_reference_and_a_wanted_current_an_input():
    *_, found = guessed(
        ("pos_cmd", np.roll(POSITION, -9)), ("I_soll", VOLTAGE), ("pos_act", POSITION)
    )
    assert found.reference.key == "pos_cmd"
    assert (found.input.key, found.output.key) == ("I_soll", "pos_act")


def test_of_a_voltage_and_a_current_the_voltage_drives():
    """Both are inputs of a drive by their names."""
    for columns in ((("I", CURRENT), ("U", VOLTAGE)), (("U", VOLTAGE), ("I", CURRENT))):
        assert guessed(*columns)[:2] == ("U", "I")


def battery(seed=3):
    """A load's current in steps, and the voltage of the cell that answers to it."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.choice([-5.0, 0.0, 2.0, 10.0], 30), 40)
    slow = np.zeros(current.size)
    for row in range(1, current.size):
        slow[row] = slow[row - 1] + (current[row - 1] - slow[row - 1]) / 25
    voltage = 3.7 - 0.02 * current - 0.015 * slow
    return current, voltage + rng.normal(0, 0.003, current.size)


def test_a_current_that_is_held_in_steps_drives_the_voltage_that_answers():
    current, voltage = battery()
    for columns in (
        (("Voltage(V)", voltage), ("Current(A)", current)),
        (("Current(A)", current), ("Voltage(V)", voltage)),
    ):
        first, last, found = guessed(*columns)
        assert (first, last) == ("Current(A)", "Voltage(V)")
        assert "by its content" in found.reasons["input"]


def test_of_a_voltage_and_a_current_that_answer_to_neither_nothing_is_sure():
    rng = np.random.default_rng(5)
    first, last, found = guessed(
        ("U", rng.normal(size=900)), ("I", rng.normal(size=900))
    )
    assert (first, last) == ("U", "I")
    assert any("NOT SURE whether 'U' drives 'I'" in note for note in found.notes)


def test_units_say_the_roles_of_channels():
    found = guessed(("CH1", POSITION, "mm"), ("CH2", CURRENT, "A"))
    assert found[:2] == ("CH2", "CH1")
    assert found[2].reasons["input"] == "by its unit, A"


def test_a_measured_torque_drives_and_a_wanted_speed_does_not():
    """As drives log themselves: what was wanted, the speed and the torque that was."""
    titles = ("n_soll [1/min]", "Drehzahlistwert [1/min]", "Drehmomentistwert [Nm]")
    wanted = np.roll(SPEED, -9)
    found = guessed(*zip(titles, (wanted, SPEED, CURRENT), strict=True))
    assert found[:2] == (titles[2], titles[1])


def test_the_path_of_a_port_says_that_it_is_a_reference():
    found = guessed(
        ("Model/Ref/Out1", np.roll(POSITION, -9), "mm"),
        ("Model/Plant/Out1", POSITION, "mm"),
        ("Model/Ctrl/Out1", CURRENT, "Nm"),
    )
    assert found[:2] == ("Model/Ctrl/Out1", "Model/Plant/Out1")


def test_a_supply_that_the_output_does_not_answer_to_is_no_input():
    supply = 48.0 + 0.1 * np.random.default_rng(8).standard_normal(N)
    found = guessed(("BusVoltage", supply), ("Torque", CURRENT), ("Angle", POSITION))
    assert found[:2] == ("Torque", "Angle")
    assert "'BusVoltage' has nothing to do" in found[2].reasons["input"]


def test_two_units_of_one_column_are_said():
    *_, found = guessed(
        ("1: Current [mA]", CURRENT, "A"), ("2: Way [mm]", POSITION, "Volt")
    )
    (note,) = [note for note in found.notes if "NOT SURE" in note]
    assert "write output_unit: mm" in note


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_content_says_what_drives_what_where_no_name_does(order):
    columns = [("AI0", VOLTAGE, "V"), ("AI1", SPEED, "V")]
    found = guessed(*(columns[number] for number in order))
    assert found[:2] == ("AI0", "AI1")
    assert not any("NOT SURE" in note for note in found[2].notes)


def test_a_doubtful_choice_is_said_with_what_to_write_instead():
    rng = np.random.default_rng(3)
    first, last, found = guessed(
        ("a", rng.standard_normal(N)), ("b", rng.standard_normal(N))
    )
    (note,) = [note for note in found.notes if "NOT SURE" in note]
    assert f"columns: {{input: {last!r}, output: {first!r}}}" in note


def test_names_that_the_numbers_contradict_are_kept_and_said():
    first, last, found = guessed(("current_A", SPEED), ("position_mm", VOLTAGE))
    assert (first, last) == ("current_A", "position_mm")
    (note,) = [note for note in found.notes if "NOT SURE" in note]
    assert "in the numbers 'current_A' answers to 'position_mm'" in note
    assert "input: 'position_mm', output: 'current_A'" in note


@pytest.mark.parametrize(
    ("values", "unit", "wanted", "is_sure"),
    [
        (np.arange(N), "", "ms", False),
        (1000.0 * np.arange(N), "", "us", False),
        (np.arange(N), "s", "s", True),
        (0.001 * np.arange(N), "", "", True),
        (0.5 * np.arange(N), "", "", False),
        (1.7e9 + 0.01 * np.arange(N), "", "s", True),
        (1.7e12 + 10 * np.arange(N), "", "ms", True),
        (1.7e15 + 10 * np.arange(N), "", "us", True),
    ],
)
def test_the_unit_of_a_time_is_told_from_its_size_and_doubts_are_said(
    values, unit, wanted, is_sure
):
    found = guess_time([column("time", np.asarray(values, float), unit)])
    assert found.role.unit == wanted
    assert (found.notes == ()) is is_sure
    assert all("NOT SURE" in note and "units: {time:" in note for note in found.notes)


@pytest.mark.parametrize(
    ("step", "wanted", "is_sure"),
    [
        (20.0, "ms", False),
        # Of samples, one by one.
        (1.0, "", True),
    ],
)
def test_whole_numbers_without_a_name_are_a_clock_of_milliseconds(
    step, wanted, is_sure
):
    ticks = 1043 + step * np.arange(N)
    found = guess_time([column("", ticks, key=0), column("u", VOLTAGE)])
    assert (found.role.unit if found.role else "") == wanted
    assert (found.notes == ()) is is_sure


def test_a_stated_interval_says_the_unit_of_the_time():
    interval = FoundColumn("Sample time [ms]", "x", np.array([2e-3]), None, "s")
    found = guess_time([column("time", 2.0 * np.arange(N)), interval])
    assert (found.role.unit, found.notes) == ("ms", ())
    assert "Sample time [ms] says its unit" in found.reason


def test_a_counter_of_samples_is_no_time_where_an_interval_is_stated():
    interval = FoundColumn("Increment", "x", np.array([0.37]), None, "s")
    found = guess_time([column("time", 1.0 * np.arange(N)), interval])
    assert (found.role, found.sample_time_s) == (None, 0.37)


def stamped(samples, first=0):
    """A clock that shows whole seconds, 500 samples to each."""
    return np.floor((first + np.arange(samples)) / 500.0 + 1e-9)


@pytest.mark.parametrize("first", [0, 120])
def test_stamps_of_whole_seconds_tell_the_sample_time(first):
    columns = [column("timestamp", stamped(1700, first), "s"), column("u", VOLTAGE)]
    found = guess_time(columns)
    assert (found.role, found.sample_time_s) == (None, pytest.approx(0.002))
    assert found.notes == (
        "NOT SURE: a sample every 0.002 s, if the samples between two ticks of "
        "'timestamp' are evenly apart",
    )
    assert unused_times(columns) == ()


def test_stamps_that_are_held_unevenly_tell_nothing():
    uneven = np.repeat(np.arange(4.0), [400, 500, 450, 300])
    back = stamped(1700)[::-1]
    gap = stamped(1700) + 3.0 * (np.arange(1700) >= 1000)
    late = np.repeat(np.arange(4.0), [900, 500, 500, 300])
    for values in (uneven, back, gap, late):
        columns = [column("timestamp", values, "s"), column("u", VOLTAGE)]
        assert guess_time(columns).sample_time_s is None
        assert "NOT USED: 'timestamp'" in unused_times(columns)[0]


def test_a_unit_says_more_than_a_plug_of_an_instrument():
    first, last, found = guessed(
        ("Amp Out", CURRENT, "mA"), ("Encoder In", POSITION, "um")
    )
    assert (first, last) == ("Amp Out", "Encoder In")
    assert found.reasons["input"] == "by its unit, mA"


def test_an_array_of_structures_is_one_recording_and_the_way_to_all_is_said():
    found = []
    for number in (1, 2, 3):
        voltage, _, _, position = plant(number)
        found += [
            (f"run({number}).u", voltage, ""),
            (f"run({number}).y", position, ""),
        ]
    first, last, guess = guessed(*found)
    assert (first, last) == ("run(1).u", "run(1).y")
    (note,) = guess.notes
    assert note.startswith("'run' is an array of 3 structures")
    assert "for k = 1:numel(run), s = run(k); save(" in note


def test_signals_of_one_recording_in_an_array_are_no_recordings():
    *_, guess = guessed(
        ("u", VOLTAGE, "", "signals(1).values"),
        ("y", POSITION, "", "signals(2).values"),
        ("i", CURRENT, "", "signals(3).values"),
    )
    assert not [note for note in guess.notes if "array" in note]


def test_numbered_pairs_in_a_file_are_said_to_be_recordings_of_their_own():
    found = []
    for number in (1, 2, 3):
        voltage, _, _, position = plant(number)
        found += [(f"u{number}", voltage, ""), (f"z{number}", position, "")]
    first, last, guess = guessed(*found)
    assert (first[0], last[0]) == ("u", "z")
    (note,) = [one for one in guess.notes if one.startswith("NOT USED")]
    others = [f"'u{n}' and 'z{n}'" for n in (1, 2, 3) if str(n) != first[1]]
    assert note.startswith(f"NOT USED: {others[0]}, {others[1]} look like further")
    assert not [one for one in guess.notes if one.startswith("other columns")]


def test_columns_of_one_recording_that_are_numbered_are_no_pairs():
    voltage, _, current, position = plant(1)
    *_, guess = guessed(
        ("u1", voltage, ""), ("y1", position, ""), ("current2", current, "")
    )
    assert not [one for one in guess.notes if one.startswith("NOT USED")]


@pytest.mark.parametrize("warm", ["T [°C]", "Temp [°C]", "Motortemperatur", "T [K]"])
@pytest.mark.parametrize("moves", ["n [1/min]", "v [m/s]", "Drehzahl"])
def test_a_speed_is_meant_rather_than_a_temperature(warm, moves):
    rng = np.random.default_rng(1)
    warmth = 40 + 0.1 * rng.standard_normal(N)
    found = guessed(("U_A [V]", VOLTAGE), (warm, warmth), (moves, SPEED))
    assert found[:2] == ("U_A [V]", moves)


def test_a_place_is_meant_rather_than_how_it_shakes():
    found = guessed(("F (N)", VOLTAGE), ("acc (g)", CURRENT), ("gap (mm)", POSITION))
    assert found[:2] == ("F (N)", "gap (mm)")


def test_a_temperature_alone_is_the_output():
    assert guessed(("heater [V]", VOLTAGE), ("T [°C]", SPEED))[:2] == (
        "heater [V]",
        "T [°C]",
    )


@pytest.mark.parametrize(
    ("title", "unit", "is_sure"),
    [("ms_today", "ms", True), ("tick", "ms", False), ("us since start", "us", True)],
)
def test_whole_numbers_that_grow_evenly_are_no_seconds(title, unit, is_sure):
    found = guess_time([column(title, 40_000.0 + 20 * np.arange(N))])
    assert (found.role.title, found.role.unit) == (title, unit)
    assert any("NOT SURE" in note for note in found.notes) != is_sure


@pytest.mark.parametrize("title", ["sample", "position"])
def test_what_is_named_otherwise_is_no_clock(title):
    assert guess_time([column(title, 20.0 * np.arange(N))]).role is None


@pytest.mark.parametrize(
    ("units", "said"),
    [
        (("V", "A"), "'U_mot' may be the input as well: a voltage"),
        (("V", ""), None),
        (("N m", "A"), None),
    ],
)
def test_both_ends_of_a_circuit_are_told(units, said):
    found = guess_signals(
        [
            column("U_mot", VOLTAGE, units[0]),
            column("I_mot", CURRENT, units[1]),
            column("pos", POSITION, "mm"),
        ]
    )
    notes = [one for one in found.notes if "may be the input as well" in one]
    assert (found.input.key, bool(notes)) == ("I_mot", said is not None)
    assert said is None or (said in notes[0] and "{input: 'U_mot'}" in notes[0])


def levels_and_answer(seed):
    """Held levels, and what follows them slowly with noise; a sine tells neither way."""
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.uniform(1.2, 3.0, N // 40), 40)
    return level, slow(level) + 1e-3 * rng.standard_normal(N)


def slow(u):
    x = np.full(u.size, u[0])
    for k in range(1, u.size):
        x[k] = 0.9 * x[k - 1] + 0.1 * u[k - 1]
    return x


def test_what_drives_shows_in_some_of_the_recordings_only():
    sine = 2.0 + np.sin(2 * np.pi * np.arange(N) / 50)
    titles = ("pressure", "foo")

    def table(u, y):
        return [column(*one) for one in zip(titles, (u, y), strict=True)]

    # A sine without noise is predicted either way, and then the name says the output.
    first = table(sine, slow(sine))
    alone = guess_signals(first)
    assert alone.input.key == "foo"
    assert any("NOT SURE" in note for note in alone.notes)
    others = [table(*levels_and_answer(seed)) for seed in (1, 2, 3)]
    found = guess_signals(first, others)
    assert (found.input.key, found.output.key) == ("pressure", "foo")
    assert not any("NOT SURE" in note for note in found.notes)


@pytest.mark.parametrize(
    ("driving", "answering"),
    [
        ("pressure_Pa", "contraction_mm"),
        ("fan_speed_rpm", "pressure_Pa"),
        ("foo_mV", "bar"),
        ("bar", "foo_mV"),
        ("heater_pct", "thermocouple_mV"),
    ],
)
def test_names_that_say_little_give_way_to_what_answers(driving, answering):
    u, y = levels_and_answer(4)
    first, last, found = guessed((answering, y), (driving, u))
    assert (first, last) == (driving, answering)
    assert not any("NOT SURE" in note for note in found.notes)


def test_a_position_stays_the_output_whatever_the_numbers_say():
    # A controller makes the input from it.
    u, y = levels_and_answer(5)
    first, last, found = guessed(("position_mm", u), ("foo", y))
    assert (first, last) == ("foo", "position_mm")
    assert any("NOT SURE" in note for note in found.notes)


@pytest.mark.parametrize(
    ("title", "unit"), [("time_min", "min"), ("t_h", "h"), ("Zeit_min", "min")]
)
def test_minutes_and_hours_behind_a_name_of_time(title, unit):
    ticks = 0.5 * np.arange(100)
    guess = guess_time([column(title, ticks), column("u", np.sin(ticks))])
    assert guess.role.unit == unit


def test_the_least_of_something_is_no_time():
    assert unit_in_name("speed_min", "time") == ""


def test_a_coarse_current_that_answers_to_a_voltage_does_not_drive_it():
    rng = np.random.default_rng(8)
    voltage = np.repeat(rng.uniform(-6, 6, 40), 40) + rng.normal(0, 0.05, 1600)
    current = np.zeros(1600)
    for row in range(1, 1600):
        current[row] = current[row - 1] + (voltage[row - 1] - current[row - 1]) / 30
    assert guessed(("U", voltage), ("I", np.round(current)))[:2] == ("U", "I")


def test_an_amplifiers_output_drives_and_a_laser_in_mm_measures():
    first, last, _ = guessed(
        ("amp_out", VOLTAGE, "Volts"), ("laser", POSITION, "mm"), ("mic", SPEED, "Pa")
    )
    assert (first, last) == ("amp_out", "laser")
    # A laser that is driven by a voltage is an input still.
    first, last, _ = guessed(("laser", VOLTAGE, "V"), ("temperature", POSITION, "K"))
    assert (first, last) == ("laser", "temperature")


def test_what_is_calibrated_comes_before_raw_numbers():
    first, last, found = guessed(
        ("Pump [V]", VOLTAGE), ("Level1 [raw]", SPEED), ("Level2 [cm]", POSITION)
    )
    assert (first, last) == ("Pump [V]", "Level2 [cm]")
    assert "'Level1 [raw]' is not calibrated" in found.reasons["output"]


def test_an_output_that_has_nothing_to_do_with_the_input_gives_way():
    rng = np.random.default_rng(5)
    steady = 300.0 + rng.normal(size=N)
    first, last, found = guessed(
        ("Strom", VOLTAGE, "A"), ("Drehzahl", steady, "1/min"), ("Moment", SPEED, "Nm")
    )
    assert (first, last) == ("Strom", "Moment")
    assert "'Drehzahl' has nothing to do with the input" in found.reasons["output"]
    # A temperature answers as well, and is hardly ever meant.
    first, last, _ = guessed(
        ("Strom", VOLTAGE, "A"),
        ("Drehzahl", steady, "1/min"),
        ("Temperatur", SPEED, "K"),
        ("Moment", SPEED + 1e-3 * rng.normal(size=N), "Nm"),
    )
    assert (first, last) == ("Strom", "Moment")
    # Where no other column answers, the name holds.
    other = rng.normal(size=N)
    first, last, _ = guessed(
        ("Strom", VOLTAGE, "A"), ("Drehzahl", steady, "1/min"), ("Moment", other, "Nm")
    )
    assert (first, last) == ("Strom", "Drehzahl")


def test_counts_of_a_position_and_a_sensors_amplifier_are_outputs_still():
    first, last, _ = guessed(
        ("current", VOLTAGE, "A"),
        ("position", POSITION, "counts"),
        ("speed", SPEED, "rpm"),
    )
    assert (first, last) == ("current", "position")
    first, last, _ = guessed(
        ("drive voltage", VOLTAGE, "V"), ("Charge Amp Out", POSITION, "V")
    )
    assert (first, last) == ("drive voltage", "Charge Amp Out")


def test_what_a_pump_is_told_is_its_input_where_nothing_else_is_named_one():
    """Pressure and flow answer to the speed together: neither drives the other."""
    told = np.repeat(np.random.default_rng(5).uniform(800, 2400, N // 40), 40)
    speed = np.zeros(N)
    for k in range(1, N):
        speed[k] = speed[k - 1] + 0.2 * (told[k - 1] - speed[k - 1])
    noise = np.random.default_rng(6).standard_normal((3, N))
    found = guessed(
        ("n_soll", told, "1/min"),
        ("n_ist", np.round(speed + noise[0]), "1/min"),
        ("p_aus", 1e-6 * speed**2 + 0.01 * noise[1], "bar"),
        ("q", 0.01 * speed + 0.05 * noise[2], "l/min"),
    )
    assert found[0] == "n_soll"
    assert found[2].reasons["input"].startswith("by its name, a command")


def test_of_a_command_and_its_noisy_reading_the_command_is_the_input():
    rng = np.random.default_rng(4)
    command = np.repeat(rng.uniform(-1.0, 1.0, 40), 25)
    output = lfilter([0.1], [1.0, -0.9], command) + 0.01 * rng.standard_normal(1000)
    reading = 0.02 * command + 0.3 + 2e-4 * rng.standard_normal(1000)
    columns = [
        FoundColumn(name, name, values)
        for name, values in (("ch.d", reading), ("ch.a", command), ("ch.b", output))
    ]
    found = guess_signals(columns)
    assert (found.input.key, found.output.key) == ("ch.a", "ch.b")
