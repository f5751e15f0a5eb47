import pytest

from hwid_cli.data.table_heads import read_head, sample_time_named

BODY = [[f"{k}.5", f"{k}", f"{-k}"] for k in range(20)]


def head(*rows, wanted=(), body=BODY):
    return read_head([*map(list, rows), *body], wanted=wanted)


def test_a_lone_header_is_one_of_names():
    found = head(["t", "u", "y"])
    assert (found.body, found.names, found.units) == (1, ("t", "u", "y"), {})


def test_units_stand_below_the_names():
    found = head(["title"], ["t", "u", "y"], ["ms", "[mA]", "inc"])
    assert (found.body, found.names) == (3, ("t", "u", "y"))
    assert found.units == {0: "ms", 1: "mA", 2: "inc"}


def test_a_logger_says_below_names_and_units_how_numbers_came_about():
    found = head(
        ["TOA5", "Plate", "CR1000", "34211"],
        ["TIMESTAMP", "RECORD", "Heater", "T_in", "T_out"],
        ["TS", "RN", "%", "Deg C", "Deg C"],
        ["", "", "Smp", "Avg", "Avg"],
        body=[
            [f"2023-02-13 08:00:{k:02d}", f"{k}", "1.5", "20.1", "20.2"]
            for k in range(20)
        ],
    )
    assert found.names == ("TIMESTAMP", "RECORD", "Heater", "T_in", "T_out")
    assert found.body == 4
    assert {k: found.units[k] for k in (2, 3, 4)} == {2: "%", 3: "Deg C", 4: "Deg C"}


def test_columns_that_are_called_as_a_way_of_counting_keep_their_names():
    assert head(["mean", "min", "max"]).names == ("mean", "min", "max")


def test_no_header_is_no_name():
    assert head().names == ()
    assert head().body == 0


def test_settings_of_a_preamble_are_no_rows_of_the_table():
    found = head(
        ["Record length", "1000", ""],
        ["Sample Interval", "2e-3", ""],
        ["Vertical Units", "V", "mm"],
        ["", "", ""],
        ["TIME", "CH1", "CH2"],
    )
    assert found.body == 5
    assert found.names == ("TIME", "CH1", "CH2")
    assert found.units == {1: "V", 2: "mm"}
    assert found.settings == (("Sample Interval", 0.002),)


def test_settings_may_stand_beside_the_numbers():
    rows = [["Sample Interval", "4e-3", "", *row[:2]] for row in BODY[:1]]
    rows += [["", "", "", *row[:2]] for row in BODY[1:]]
    found = read_head(rows)
    assert (found.body, found.numeric) == (0, (3, 4))
    assert found.settings == (("Sample Interval", 0.004),)


def test_a_unit_of_time_below_the_word_time_is_no_name():
    found = head(["Time", "Analog 1", "Analog 2"], ["ms", "Servo speed", "Torque"])
    assert found.names == ("Time", "Servo speed", "Torque")
    assert found.units == {0: "ms"}


def test_words_in_front_of_pairs_of_columns_are_no_names():
    pairs = [[row[0], row[1], row[0], row[2]] for row in BODY]
    found = read_head(
        [
            ["Name", "I_ist", "Name", "x_ist"],
            ["Data-Type", "REAL", "Data-Type", "REAL"],
            ["Unit", "A", "Unit", "mm"],
            *pairs,
        ]
    )
    assert found.names == ("", "I_ist", "", "x_ist")
    assert found.units == {1: "A", 3: "mm"}


def test_behind_a_word_for_units_any_text_is_one():
    found = head(["Units", "inc", "ticks"], body=[["", *row[:2]] for row in BODY])
    assert found.units == {1: "inc", 2: "ticks"}


def test_a_damaged_first_row_belongs_to_the_table():
    for body in ([["0", "off", "1"], *BODY], [["0", "", ""], *BODY]):
        assert head(["t", "u", "y"], body=body).body == 1
    assert head(body=[["0", "off", "1"], *BODY]).body == 0


def test_the_row_with_the_names_that_are_asked_for_is_the_row_of_names():
    rows = (["t", "u", "y"], ["time in s", "current in A", "way in mm"])
    assert head(*rows).names == ("time in s", "current in A", "way in mm")
    assert head(*rows, wanted=["u", "y"]).names == ("t", "u", "y")


def test_columns_of_words_are_no_columns_of_numbers():
    body = [["run", *row, ""] for row in BODY]
    found = head(["note", "t", "u", "y", "free"], body=body)
    assert (found.numeric, found.texts) == ((1, 2, 3), (0,))


@pytest.mark.parametrize(
    ("title", "value", "unit", "step_s"),
    [
        ("Abtastzeit [ms]", 2.0, "", 0.002),
        ("SampleTime[ms]", 1.0, "", 0.001),
        ("Sample Rate", 2.0, "kHz", 0.0005),
        ("fs", 500.0, "Hz", 0.002),
        ("Delta_X", 0.01, "", 0.01),
        ("Interval", 3.0, "furlong", None),
        ("Number of sampling data", 1024.0, "", None),
        ("Ts", -1.0, "", None),
    ],
)
def test_sample_times_are_told_by_their_words(title, value, unit, step_s):
    assert sample_time_named(title, value, unit) == step_s


def test_a_setting_may_stand_in_one_cell():
    found = head(["Sampling rate: 250 Hz"], ["t", "u", "y"])
    assert found.settings == (("Sampling rate", 0.004),)


@pytest.mark.parametrize(
    "said", ["CH1: motor current [mA]", "Channel 1 = motor current [mA]"]
)
def test_a_preamble_says_what_channels_are(said):
    found = head([said], ["Operator: Meyer"], ["Time", "CH1", "CH2"])
    assert found.said == {1: "motor current [mA]"}
    assert found.units == {1: "mA"}


def test_a_row_of_units_holds_whatever_a_preamble_says():
    found = head(["CH1: way [mm]"], ["Time", "CH1", "CH2"], ["s", "V", "V"])
    assert found.said == {1: "way [mm]"}
    assert found.units == {0: "s", 1: "V", 2: "V"}


def test_a_setting_of_a_channel_is_no_name():
    assert head(["CH1: 20"], ["Time", "CH1", "CH2"]).said == {}


def test_dates_of_a_preamble_are_no_rows_of_the_table():
    """As a trend of a controller says when it began and ended."""
    rows = [
        ["Start Time:", "5/6/2024", "10:10:59;120"],
        ["Stop Time:", "5/6/2024", "10:11:11;120"],
        ["Header:", "Date", "Time", "Position", "Torque"],
        *(["Data", "5/6/2024", f"10:10:59;{120 + n}", f"{n}", "2"] for n in range(20)),
    ]
    head = read_head(rows)
    assert head.body == 3
    assert head.names[2:] == ("Time", "Position", "Torque")


@pytest.mark.parametrize(
    ("date", "names"),
    [
        ("Datum", ("Load cell U9C", "Gauge WA50")),
        ("Date", ("MX840_CH 1 [N]", "MX840_CH 2 [mm]")),
    ],
)
def test_names_may_stand_further_up_or_down_than_their_units(date, names):
    found = head(
        ["Time 1 [s]", "MX840_CH 1 [N]", "MX840_CH 2 [mm]"],
        ["SR: 300 Hz", "Type: Float 4", "Type: Float 4"],
        [f"{date}: 11.03.2024", "Load cell U9C", "Gauge WA50"],
    )
    assert found.names[1:] == names
    assert date == "Date" or found.units == {0: "s", 1: "N", 2: "mm"}


def test_of_comments_the_one_of_as_many_cells_as_columns_names_them():
    rows = [["t(s)", "u(V)", "x(cm)"], ["step", "response,", "amplitude", "0"], *BODY]
    assert read_head(rows, comments={0, 1}).names == ("t(s)", "u(V)", "x(cm)")


def test_a_resolution_is_a_sample_time_only_in_a_unit_of_time():
    assert sample_time_named("Resolution", 250.0, "us") == pytest.approx(250e-6)
    assert sample_time_named("Resolution", 12.0, "bit") is None
    assert sample_time_named("Resolution", 12.0) is None
