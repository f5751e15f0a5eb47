import numpy as np
import pytest

from hwid_cli.errors import MeasurementError
from hwid_cli.export.prediction import read_input, write_prediction
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ModelCard
from tests.export.model_examples import example_model, exported_of


@pytest.fixture
def exported():
    return exported_of(example_model(1))


def csv(tmp_path, text):
    path = tmp_path / "in.csv"
    path.write_text(text)
    return path


def rows(*values, head="time_s,current_A", step=0.001):
    lines = [f"{step * n!r},{value}" for n, value in enumerate(values)]
    return "\n".join([head, *lines]) + "\n"


def test_time_and_input_are_read_without_an_output(exported, tmp_path):
    time, values = read_input(csv(tmp_path, rows(1.0, 2.0, -3.0)), exported)

    assert np.array_equal(values, [1.0, 2.0, -3.0])
    assert np.allclose(time, [0.0, 1e-3, 2e-3], rtol=1e-15)


def test_an_output_may_go_on_longer(exported, tmp_path):
    text = rows(1.0, 2.0, "", head="time_s,current_A")
    time, values = read_input(csv(tmp_path, text), exported)

    assert values.size == time.size == 2


def test_without_a_time_column_samples_count(tmp_path):
    model = example_model(1)
    card = ModelCard("a/1/1", "a", Columns(input=1, output=0), (-1.0, 1.0))
    exported = type(exported_of(model))(card, model, 1.0)
    time, values = read_input(csv(tmp_path, "y,u\n0,5\n0,6\n"), exported)

    assert np.array_equal(values, [5.0, 6.0])
    assert np.array_equal(time, [0.0, 1e-3])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("time_s,current_A\n", "holds a header and no rows"),
        (rows(1.0, head="time_s,amps"), "has no column 'current_A' for the input"),
        (rows(1.0, head="t,current_A"), "has no column 'time_s' for the time"),
        (rows(1.0, "x", 2.0), "row 3: input 'current_A' is 'x'; expected a finite"),
        (rows(1.0, "nan", 2.0), "row 3: input 'current_A' is 'nan'"),
        (rows(1.0, 1.0, 1.0, step=0.002), r"steps by 0.002 s; expected 0.001 s"),
        ("time_s,current_A\n0,1\n0.001,1\n0.002,1\n0.005,1\n", "row 5: .*by 0.003 s"),
        ("time_s,current_A\n0,1\n,1\n", "2 values and time 'time_s' 1|'' is|is ''"),
    ],
)
def test_an_input_that_does_not_fit_is_one_line(text, said, exported, tmp_path):
    with pytest.raises(MeasurementError, match=said) as error:
        read_input(csv(tmp_path, text), exported)
    assert "in.csv" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_one_line(exported, tmp_path):
    with pytest.raises(MeasurementError, match="no such file"):
        read_input(tmp_path / "in.csv", exported)


def test_a_prediction_has_time_the_input_and_what_is_predicted(exported, tmp_path):
    path = tmp_path / "prediction.csv"
    columns = np.array([[0.0, 0.001], [1.0, 2.0], [0.1, 1 / 3]])
    write_prediction(path, exported, *columns)

    assert path.read_text() == (
        "time,current_A,predicted\n0.0,1.0,0.1\n0.001,2.0,0.3333333333333333\n"
    )
