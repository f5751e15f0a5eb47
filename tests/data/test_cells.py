import numpy as np
import pytest

from hwid_cli.data.cells import (
    TwoWaysError,
    Writing,
    is_stamp,
    number_in,
    stamp_reader,
    stamps_in_seconds,
    writing_of,
)


@pytest.mark.parametrize(
    ("cells", "numbers"),
    [
        (["1.5", "-2", "3e-3"], [1.5, -2, 0.003]),
        (["1,5", "-2", "3e-3"], [1.5, -2, 0.003]),
        (["1,234.5", "-0.25", "12,345,678.9"], [1234.5, -0.25, 12345678.9]),
        (["1.234,5", "-0,25", "12.345.678,9"], [1234.5, -0.25, 12345678.9]),
        (["1,234,567", "12"], [1234567, 12]),
        (["1 234,5", "2\u202f000,25", "0,5"], [1234.5, 2000.25, 0.5]),
        (["1'234.5", "999.5"], [1234.5, 999.5]),
        (["0,125", "1,250", "999"], [0.125, 1.25, 999]),
    ],
)
def test_a_column_is_read_in_its_own_way_of_writing(cells, numbers):
    writing = writing_of(cells)
    assert [number_in(cell, writing) for cell in cells] == numbers


@pytest.mark.parametrize(
    ("cells", "at"),
    [
        (["0", "1,5", "1.5"], 2),
        (["1.5", "1,5"], 1),
        (["1,234.5", "1.234,5"], 1),
        # 1234 or 1.234?
        (["999", "1,234"], 1),
    ],
)
def test_a_number_that_can_be_read_in_two_ways_is_refused(cells, at):
    with pytest.raises(TwoWaysError) as caught:
        writing_of(cells)
    assert caught.value.args == (at,)


def test_later_cells_keep_to_what_earlier_ones_have_shown():
    known = writing_of(["1.234,5"])
    assert writing_of(["2.000"], known=known) == known
    assert number_in("2.000", known) == 2000
    with pytest.raises(TwoWaysError):
        writing_of(["1,234.5"], known=known)
    with pytest.raises(TwoWaysError):
        number_in("1.5", Writing(","))


def test_words_are_no_numbers():
    for cell in ("off", "1_0", "0x1F", "", "1.2.3.4x", "12-05"):
        assert number_in(cell, Writing(".")) is None


@pytest.mark.parametrize(
    "stamps",
    [
        ["2024-05-01T12:00:00.000", "2024-05-01T12:00:00.250Z"],
        ["2024-05-01 12:00:00,000000", "2024-05-01 12:00:00,250000"],
        ["2024/05/01 12:00:00", "2024/05/01 12:00:00.25"],
        ["01.05.2024 12:00:00.000", "01.05.2024 12:00:00.250"],
        ["05/01/2024 12:00:00.00 PM", "05/01/2024 12:00:00.25 PM"],
        ["12:00:00:000", "12:00:00:250"],
        ["2024-05-01T12:00:00+02:00", "2024-05-01T12:00:00.25+02:00"],
    ],
)
def test_dates_of_many_forms_are_seconds_of_their_first_day(stamps):
    values, others = stamps_in_seconds(stamps)
    assert not others
    # Quarters of a second and their midnight are exact in binary.
    assert np.diff(values).tolist() == [0.25]
    assert values[0] == 43_200.0 - 7_200.0 * ("+02:00" in stamps[0])


def test_time_goes_on_behind_midnight_with_and_without_a_date():
    dated = ["2024-12-31 23:59:59.5", "2025-01-01 00:00:00.5"]
    for stamps in (dated, [stamp[11:] for stamp in dated]):
        assert np.diff(stamps_in_seconds(stamps)[0]).tolist() == [1.0]
        read = stamp_reader()
        first, second = (read([stamp])[0] for stamp in stamps)
        assert second[0] - first[0] == 1.0


def test_what_is_no_stamp_is_told_by_number():
    read = stamp_reader()
    values, others = read(["12:00:00", "", "soon"])
    assert others == {1: "", 2: "soon"}
    assert np.isnan(values[1:]).all()
    assert read(["nie"])[1] == {0: "nie"}


@pytest.mark.parametrize(
    "cells",
    [
        ("11-Mar-24 08:00:00", "11-Mar-24 08:00:01.2"),
        ("T#8h", "T#8h1s200ms"),
        ("TIME#480m", "TIME#480m_1s_200ms"),
        ("5/6/2024 08:00:00;000", "5/6/2024 08:00:01;200"),
        ("08:00:00;000", "08:00:01;200"),
    ],
)
def test_stamps_of_controllers_are_seconds(cells):
    values, others = stamps_in_seconds(cells)
    np.testing.assert_allclose(values, [28800.0, 28801.2], atol=1e-9)
    assert not others
    assert all(map(is_stamp, cells))
