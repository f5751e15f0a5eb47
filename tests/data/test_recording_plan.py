import numpy as np
import pytest

from hwid_cli.data.recording_plan import read_plan
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns, RecordingsOptions

OPTIONS = RecordingsOptions(("*.csv",), Columns("u", "y", "t"), input_scale=2.0)


def plan(tmp_path, text):
    path = tmp_path / "plan.csv"
    path.write_text(text)
    return path


def test_a_row_is_a_file_or_says_how_it_is_made(tmp_path):
    (tmp_path / "a.csv").write_text("t,u\n0,1\n0.01,3\n")
    path = plan(
        tmp_path,
        "name,file,kind,amplitude,frequency_Hz,last_frequency_Hz,duration_s\n"
        "a,a.csv,,,,,\n"
        "b,,step,2,,,1\n"
        "c,,sine,2,5,,1\n"
        "d,,sweep,2,1,20,1\n",
    )
    found = {one.name: one for one in read_plan(path, OPTIONS, 0.01)}

    # The scale is that of the recordings' files.
    assert found["a"].values.tolist() == [2.0, 6.0]
    assert found["b"].values.tolist() == [0.0] * 5 + [2.0] * 95
    time = 0.01 * np.arange(95)
    assert np.allclose(found["c"].values[5:], 2 * np.sin(2 * np.pi * 5 * time))
    assert found["d"].words == "a sweep of 2 from 1 to 20 Hz"
    # Twice as many crossings of zero in the second half as in the first, at least.
    crossings = np.flatnonzero(np.diff(np.sign(found["d"].values[6:])))
    assert np.sum(crossings > 47) > 2 * np.sum(crossings <= 47)


def test_spreadsheets_may_write_decimal_commas(tmp_path):
    text = "name,kind,amplitude,duration_s\nb,step,2.5,1\n"
    other = text.replace(",", ";").replace("2.5", "2,5")

    (one,) = read_plan(plan(tmp_path, text), OPTIONS, 0.01)
    (same,) = read_plan(plan(tmp_path, other), OPTIONS, 0.01)

    assert np.array_equal(one.values, same.values)
    assert one.values.max() == 2.5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty; expected a table with the columns name"),
        ("name,kind\n", "has no rows; expected a table .* a row for each"),
        ("kind\nstep\n", "has no column 'name'"),
        ("name,amplitud\na,1\n", "row 1: unknown column 'amplitud'; did you mean 'amp"),
        ("name,kind\na,pulse\n", "row 2: kind: found 'pulse'; expected one of step"),
        ("name,kind,amplitude,duration_s\na,step,x,1\n", "amplitude: found 'x'; expec"),
        ("name,kind,amplitude,duration_s\na,step,1,0\n", "duration_s: .* a number > 0"),
        ("name,kind,amplitude,duration_s\na,step,1,1e9\n", "2 to 5000000 samples"),
        ("name,file\n,a.csv\n", "row 2: name: found ''; expected a name"),
        ("name,file\n../a,a.csv\n", "row 2: name: found '../a'; expected a name"),
        ("name,file\na,none.csv\n", "row 2: file: found 'none.csv'; expected a file w"),
        (f"name,file\na,{'x' * 10**5}.csv\n", r"^.{0,300}row 2: file: found .{0,200}$"),
        ("name,file\na,/dev/zero\n", "row 2: file: found '/dev/zero'; expected a file"),
        ("name,file\na,huge.csv\n", "huge.csv: its input holds .* beyond 1e"),
        ("name,kind,amplitude,duration_s\na,step,1e308,1\n", "a finite number up to"),
        ("name,kind,amplitude,duration_s\na,step,nan,1\n", "amplitude: found 'nan'"),
        ("name,kind,amplitude,frequency_Hz,duration_s\na,sine,1,50,1\n",
         "frequency_Hz: found '50'; expected less than half the sample rate, 50 Hz"),
        ("name,kind,amplitude,frequency_Hz,duration_s\na,step,1,5,1\n",
         "frequency_Hz: found '5'; expected an empty cell: a step has none"),
        ("name,file,amplitude\na,a.csv,1\n",
         "amplitude: found '1'; expected an empty cell: a row with a file has none"),
        (
            "name,kind,amplitude,duration_s\na,step,1,1\na,step,2,1\n",
            "row 3: name: found 'a'; expected a name that no row before has",
        ),
    ],
)  # fmt: skip
def test_a_plan_that_cannot_be_used_is_refused_in_one_line(tmp_path, text, said):
    (tmp_path / "a.csv").write_text("t,u\n0,1\n0.01,2\n")
    (tmp_path / "huge.csv").write_text("t,u\n0,1\n0.01,1e200\n")
    with pytest.raises(MeasurementError, match=said) as refused:
        read_plan(plan(tmp_path, text), OPTIONS, 0.01)
    assert "\n" not in str(refused.value)


def test_a_missing_plan_names_the_key(tmp_path):
    with pytest.raises(MeasurementError, match=r"cannot be read .* correct next\.plan"):
        read_plan(tmp_path / "none.csv", OPTIONS, 0.01)
