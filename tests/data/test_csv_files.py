import gzip

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hwid_cli.data import csv_files
from hwid_cli.data.formats import list_columns, read_columns
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns

BY_NAME = Columns(time="t", input="u", output="y")
BY_NUMBER = Columns(time=0, input=1, output=2)


@pytest.fixture
def read(tmp_path):
    def read_text(text, columns=BY_NAME, encoding="utf-8"):
        path = tmp_path / "run.csv"
        path.write_bytes(text.encode(encoding))
        found = read_columns(path, columns)
        return found.time.values, found.input.values, found.output.values

    return read_text


EXPECTED = ([0, 0.5], [1.5, 2], [-3, 1e-4])


@pytest.mark.parametrize(
    "text",
    [
        "t,u,y\n0,1.5,-3\n0.5,2,1e-4\n",
        "t;u;y\n0;1.5;-3\n0.5;2;1e-4\n",
        "t;u;y\n0;1,5;-3\n0,5;2;1e-4\n",
        "t\tu\ty\n0\t1,5\t-3\n0,5\t2\t1E-4\n",
        "\ufefft,u,y\r\n0,1.5,-3\r\n0.5,2,1e-4\r\n",
        "t,u,y\r0,1.5,-3\r0.5,2,1e-4\r",
        '"t","u","y"\n"0","1.5","-3"\n"0.5","2","1e-4"\n',
        '"t", "u", "y"\n 0 , 1.5, -3\n 0.5 , 2 , 1e-4',
        "# made by hand\n\nt,u,y\n# units s,A,m\n0,1.5,-3\n\n0.5,2,1e-4\n\n",
        "t,u,y,\n0,1.5,-3,\n0.5,2,1e-4,\n",
        "note,y,u,t\na,-3,1.5,0\nb;c,1e-4,2,0.5\n",
        "# t,u,y\n0,1.5,-3\n0.5,2,1e-4\n",
        "# t u\n# t;u;y\n0;1,5;-3\n0,5;2;1e-4\n",
        "t,u,y\n0,1.5,-3\n0.5,2,1e-4\n,,\n,,\n",
    ],
)
def test_columns_are_found_by_header_name(read, text):
    for found, expected in zip(read(text), EXPECTED, strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "text",
    [
        "0,1.5,-3\n0.5,2,1e-4\n",
        "time,current,travel\n0,1.5,-3\n0.5,2,1e-4\n",
        "0;1,5;-3\n0,5;2;1e-4\n",
    ],
)
def test_columns_are_found_by_number_with_or_without_header(read, text):
    for found, expected in zip(read(text, BY_NUMBER), EXPECTED, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_other_encodings_of_header_and_numbers_are_read(read):
    columns = Columns(time="t", input="u", output="Weg [µm]")
    for encoding in ("latin-1", "utf-8-sig", "utf-16"):
        time, _, output = read("t,u,Weg [µm]\n0,1,2\n1,2,3\n", columns, encoding)
        assert (time.tolist(), output.tolist()) == ([0, 1], [2, 3])


def test_columns_that_end_in_blank_cells_are_shorter(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("t,u,y\n0,1,5\n1,2,\n2,,\n")
    found = read_columns(path, BY_NAME)
    assert found.time.values.tolist() == [0, 1, 2]
    assert found.input.values.tolist() == [1, 2]
    assert found.output.values.tolist() == [5]


def test_the_last_number_of_a_torn_row_is_none(tmp_path):
    """A byte that a serial line has lost tears 92 into 9, and takes what follows."""
    rows = [f"{20 * k},92,{k}" for k in range(200)]
    rows[70] = "1400,9"
    path = tmp_path / "log.txt"
    path.write_text("\n".join(rows))
    found = read_columns(path, BY_NUMBER)
    assert np.flatnonzero(np.isnan(found.input.values)).tolist() == [70]
    assert np.flatnonzero(np.isnan(found.output.values)).tolist() == [70]
    assert found.time.values[70] == 1400


def test_rows_without_a_cell_for_a_slow_column_are_whole(tmp_path):
    rows = [f"{k},{k}" + (f",{k}" if k % 4 == 0 else "") for k in range(200)]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(["t,u,y", *rows]))
    found = read_columns(path, BY_NAME)
    assert found.input.values.tolist() == list(range(200))
    assert np.isfinite(found.output.values).sum() == 50


def test_rows_are_lines_of_the_file_counted_from_one(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text('# note\n"t\nx",u,y\n\n0,1,5\n# pause\n1,2,6\n')
    found = read_columns(path, Columns(input="u", output="y"))
    assert found.input.rows.tolist() == [5, 7]
    assert not found.input.rows_from_zero


def test_cell_without_a_number_is_kept_as_text_of_its_row(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("t,u,y\n0,1,5\n1,off,6\n2,1_0,7\n3,,8\n4,nan,9\n")
    column = read_columns(path, BY_NAME).input
    assert column.texts == {3: "off", 4: "1_0", 5: ""}
    assert np.isnan(column.values[1:]).all()


@pytest.mark.parametrize(
    ("text", "columns", "message"),
    [
        (
            "hello world\n0,1,2\n",
            BY_NAME,
            r"row 1: has no column 'u' for the input; expected one of hello world; name "
            "one of them, or rename the column",
        ),
        ("T,u,y\n0,1,2\n", BY_NAME, r"run.csv, row 1: has no column 't' .*mean 'T'\?"),
        ("t,cur,y\n0,1,2\n", BY_NAME, r"'u' for the input; expected one of t, cur, y"),
        ("t,u,u,y\n0,1,2,3\n", BY_NAME, r"row 1: column 'u' occurs 2 times"),
        ("0,1\n1,2\n", BY_NUMBER, r"no column 2 for the output; .*from 0 to 1;"),
        ("t,u,y\n", BY_NAME, r"run.csv: holds a header and no rows; .*export the"),
        ("t,u,y\n# 0,1,2\n", BY_NAME, r"run.csv: holds a header and no rows"),
        ("\n\n", BY_NAME, r"run.csv: holds no rows; expected rows of numbers"),
        ("# t,u,y\n", BY_NAME, r"run.csv: holds no rows; expected rows of numbers"),
        (
            "t,u,y\n0,0,1,5,2\n",
            BY_NAME,
            r"run.csv, row 2: has 5 cells; expected 3 as in row 1; if commas are",
        ),
        (
            "t;u;y\n0;1,5;2\n1;1.5;2\n",
            BY_NAME,
            r"run.csv, row 3: input 'u' is '1.5', while other rows use the other",
        ),
        (
            "t;u;y\n0;1.234,5;2\n1;1,234.5;2\n",
            BY_NAME,
            r"run.csv, row 3: input 'u' is '1,234.5'",
        ),
        (
            "t;u;y\n0;1,234;2\n1;999;2\n",
            BY_NAME,
            r"run.csv, row 2: input 'u' is '1,234', .* read in two ways; .*thousands",
        ),
        ('t,u,y\n0,"1' + "2" * 200_000, BY_NAME, r"row 2: field larger .*a quote"),
    ],
)
def test_file_that_cannot_be_understood_is_refused(read, text, columns, message):
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text, columns)
    assert "\n" not in str(caught.value)


@given(
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20),
    st.sampled_from([",", ";", "\t"]),
    st.booleans(),
)
def test_every_float_is_read_back_bit_by_bit(tmp_path_factory, values, mark, decimal):
    cells = [repr(value) for value in values]
    if decimal and mark != ",":
        cells = [cell.replace(".", ",") for cell in cells]
    path = tmp_path_factory.mktemp("csv") / "run.csv"
    lines = [mark.join(["u", "y"])] + [mark.join([cell, cell]) for cell in cells]
    path.write_text("\n".join(lines))
    found = read_columns(path, Columns(input="u", output="y"))
    assert found.input.values.tobytes() == np.array(values).tobytes()
    assert found.output.values.tobytes() == np.array(values).tobytes()


HEADS = (
    "",
    "t;u;y\n",
    "# logger 3\n# fs = 200\nt;u;y\ns;mA;mm\n",
    "Rate;200\nChannel;a;b\n\nt [s];u [A];y [mm]\n",
    "1;2;3\nnotes;and;more\nt;u;y\n",
    "word;word;1\n" * 90 + "t;u;y\n",
)
# What may stand among plain rows, or end them.
ODD = ("", "nan;1;2", "1;2", "1;2;3;4", "12:00:01;2;3", "x;y;z", "1;;3", '"1";2;3', "#")


@pytest.mark.thorough
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    head=st.sampled_from(HEADS),
    mark=st.sampled_from("\t;,| "),
    decimal=st.sampled_from(".,"),
    rows=st.sampled_from((0, 20, 60, 150, 1200)),
    odd=st.sampled_from(ODD),
    place=st.integers(0, 150),
)
def test_more_rows_of_the_same_kind_tell_nothing_new(
    tmp_path, head, mark, decimal, rows, odd, place
):
    lines = [f"{n * 0.5:g};{n % 7};-{n}.25e-3" for n in range(rows)]
    if odd and place < rows:
        lines.insert(place, odd)
    text = "\n".join(line.replace(".", decimal) for line in lines)
    path = tmp_path / "long.csv"
    path.write_text((head + text).replace(";", mark))

    def told():
        try:
            found = list_columns(path)
        except MeasurementError as error:
            return str(error)
        return [(one.title, one.key, one.values.tobytes(), one.unit) for one in found]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(csv_files, "_PLAIN_LINES", 10**6)
        patch.setattr(csv_files, "_forms", {})
        by_all = told()

    assert told() == by_all


def test_the_form_of_a_long_file_is_told_from_few_rows(tmp_path, monkeypatch):
    path = tmp_path / "long.csv"
    rows = "".join(f"{n * 1e-3:.3f},{n % 5},{n % 7}\n" for n in range(5000))
    path.write_text(f"time_s,current_A,displacement_m\n{rows}")
    looked_at = []
    real = csv_files.read_head

    def read_head(rows, **options):
        looked_at.append(len(rows))
        return real(rows, **options)

    monkeypatch.setattr(csv_files, "read_head", read_head)
    monkeypatch.setattr(csv_files, "_forms", {})
    (_, time), *_ = csv_files.read_csv_columns(path, BY_NUMBER)

    assert time.values.size == 5000
    assert looked_at == [26]  # the names and 25 rows of numbers
    # Other numbers below the same names are of the same form.
    path.write_text(path.read_text().replace(",3,", ",-3e-2,"))
    csv_files.read_csv_columns(path, BY_NUMBER)
    assert looked_at == [26]
    path.write_text(path.read_text().replace("current_A", "current_mA"))
    found = dict(csv_files.read_csv_columns(path, BY_NUMBER))
    assert looked_at == [26, 26]
    assert found["input"].unit == "mA"


@pytest.mark.thorough
@given(
    st.lists(
        st.tuples(
            st.integers(0, 399),
            st.integers(0, 2),
            st.sampled_from(["", "-", "x", '"1"']),
        ),
        max_size=4,
    ),
    st.sampled_from([",", ";", "\t", " "]),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_rows_of_numbers_between_others_are_read_as_cell_by_cell(
    tmp_path, monkeypatch, odd, mark
):
    rows = [[f"{k / 8}", f"{k % 7 - 3}.25", f"{-k}e-3"] for k in range(400)]
    for number, place, cell in odd:
        rows[number][place] = cell if cell or mark != " " else "nan"
    path = tmp_path / "run.csv"
    path.write_text("\n".join(map(mark.join, [["t", "u", "y"], *rows])) + "\n")

    def columns():
        found = read_columns(path, BY_NAME)
        return [
            (one.values.tolist(), one.rows.tolist(), one.texts)
            for one in (found.time, found.input, found.output)
        ]

    with monkeypatch.context() as patch:
        # Blocks so short that most of them follow others, whose way of writing is known.
        patch.setattr(csv_files, "_BLOCK_LINES", 100)
        fast = columns()
        patch.setattr(csv_files, "_add_plain", lambda *_: 0)
        slow = columns()

    assert repr(fast) == repr(slow)


def test_few_cells_are_read_one_by_one_where_columns_end_early(tmp_path, monkeypatch):
    rows = [f"{k / 8},1.5,{-k}.5" for k in range(5000)] + ["625.0,,1.5"] * 3
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["t,u,y", *rows]))
    seen = []
    add_cells = csv_files.ColumnParts.add_cells
    monkeypatch.setattr(
        csv_files.ColumnParts,
        "add_cells",
        lambda parts, rows: (seen.append(len(rows)), add_cells(parts, rows))[1],
    )
    found = read_columns(path, BY_NAME)

    assert found.input.values.size == 5000
    # Of 5003 rows at most twice those in which a block is not halved any more.
    assert 3 <= sum(seen) <= 2 * csv_files._PLAIN_LINES + 3


def rows_of_four(count=200):
    return [f"{0.5 * n:g},{n},{100 + n},{3 * n}" for n in range(count)]


def test_a_row_that_was_still_being_written_is_no_sample(read):
    rows = rows_of_four()
    rows[-1] = "99.5,199,2"
    t, _, y = read("\n".join(["t,u,y,T", *rows]))
    assert (t[-1], y[-1], y.size) == (99.0, 298.0, 199)
    # With a line end the column at the right has ended.
    t, _, y = read("\n".join(["t,u,y,T", *rows]) + "\n")
    assert (y[-1], y.size) == (2.0, 200)


def test_a_row_that_is_torn_in_the_last_column_wanted_has_no_number_there(read):
    rows = rows_of_four()
    rows[120] = "60,120,2"
    _, u, y = read("\n".join(["t,u,y,T", *rows]) + "\n")
    assert np.isnan(y[120])
    assert u[120] == 120
    assert np.isfinite(np.delete(y, 120)).all()


@pytest.mark.parametrize(
    "row",
    [
        "t={},u={},y={}",
        "t:{}\tu:{}\ty:{}",
        "t: {} u: {} y: {}",
        "t = {}; u = {}; y = {}",
    ],
)
def test_a_value_may_stand_behind_its_name_in_every_row(read, row):
    rows = [row.format(0.5 * n, 1 + n, -n - 0.25) for n in range(60)]
    t, u, y = read("\n".join(["ready.", *rows]) + "\n")
    np.testing.assert_array_equal(t, 0.5 * np.arange(60))
    np.testing.assert_array_equal(u, 1 + np.arange(60))
    np.testing.assert_array_equal(y, -0.25 - np.arange(60))


def test_times_of_day_are_no_names_of_values(tmp_path):
    rows = [f"12:00:{n:02d};{n};{n * n}" for n in range(60)]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["t;u;y", *rows]) + "\n")
    assert [one.title for one in list_columns(path)] == ["t", "u", "y"]


def test_titles_between_blocks_are_no_rows(read):
    block = [f"{0.5 * n:g} {n} {3 * n}" for n in range(30)]
    text = "\n".join(["# t u y", '"run 1"', *block, "", "", '"run 2"', *block])
    t, u, _ = read(text + "\n")
    np.testing.assert_array_equal(t, np.r_[0.5 * np.arange(30), 0.5 * np.arange(30)])
    assert np.isfinite(u).all()


def test_what_is_beyond_an_oscilloscopes_range_is_no_number(read):
    rows = [f"{n};{n / 8};{n}".replace(".", ",") for n in range(60)]
    rows[30] = "30;∞;30"
    _, u, _ = read("\n".join(["t;u;y", *rows]) + "\n")
    assert np.flatnonzero(np.isnan(u)).tolist() == [30]


def test_what_is_packed_badly_or_is_no_text_is_one_line(tmp_path):
    text = "t,u,y\n" + "\n".join(f"{n},{n},{2 * n}" for n in range(200))
    packed = gzip.compress(text.encode())
    (tmp_path / "run.csv.gz").write_bytes(packed)
    (tmp_path / "half.csv.gz").write_bytes(packed[: len(packed) // 2])
    (tmp_path / "run.mat.gz").write_bytes(packed)
    columns = Columns(time="t", input="u", output="y")
    found = read_columns(tmp_path / "run.csv.gz", columns)
    np.testing.assert_array_equal(found.output.values, 2.0 * np.arange(200))
    with pytest.raises(MeasurementError, match=r"half.csv.gz: cannot be read \(Compre"):
        read_columns(tmp_path / "half.csv.gz", columns)
    with pytest.raises(MeasurementError, match=r"run.mat.gz: is packed, .*unpack it"):
        read_columns(tmp_path / "run.mat.gz", columns)
