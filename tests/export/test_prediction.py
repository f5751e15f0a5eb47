import h5py
import numpy as np
import pytest

from hwid_cli import HammersteinWiener
from hwid_cli.errors import MeasurementError, ModelFileError
from hwid_cli.export.predict import predict
from hwid_cli.export.prediction import InputSource, read_input, write_prediction
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.maps import StaticMap
from tests.export.model_examples import example_model, exported_of

NONE = StaticMap("none", np.zeros(0))


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
        (rows(1.0, 2.0, "nan"), "row 4: input 'current_A' is 'nan'"),
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


@pytest.fixture
def of_tables():
    """A model of recordings that were groups of one file."""
    model = example_model(1)
    columns = Columns(input="current", output="way", time="t", variable="*")
    card = ModelCard("a/1/1", "a", columns, (-1.0, 1.0))
    return type(exported_of(model))(card, model, 1.0)


def groups(tmp_path, **values):
    path = tmp_path / "in.h5"
    with h5py.File(path, "w") as file:
        for name, current in values.items():
            group = file if name == "_" else file.create_group(f"runs/{name}")
            group["t"] = 1e-3 * np.arange(len(current))
            group["current"] = np.array(current)
    return path


@pytest.mark.thorough
def test_the_only_table_of_a_file_holds_the_input(of_tables, tmp_path):
    _, values = read_input(groups(tmp_path, a=[1.0, 2.0]), of_tables)
    assert np.array_equal(values, [1.0, 2.0])


def test_columns_that_stand_alone_need_no_table(of_tables, tmp_path):
    _, values = read_input(groups(tmp_path, _=[1.0, 2.0]), of_tables)
    assert np.array_equal(values, [1.0, 2.0])


def test_of_several_tables_one_is_chosen(of_tables, tmp_path):
    path = groups(tmp_path, a=[1.0, 2.0], b=[3.0, 4.0])
    with pytest.raises(
        MeasurementError, match=r"holds 2 tables .*choose it with --tab"
    ):
        read_input(path, of_tables)

    _, values = read_input(path, of_tables, InputSource("runs/b"))
    assert np.array_equal(values, [3.0, 4.0])
    with pytest.raises(MeasurementError, match="no variable 'c'"):
        read_input(path, of_tables, InputSource("c"))


def with_poles(*poles):
    denominator = np.poly(poles)
    model = HammersteinWiener(
        input_map=NONE,
        numerator=np.array([1e-6]),
        denominator=denominator,
        delay=1,
        output_map=NONE,
        sample_time_s=1e-3,
        initial_state="zero",
    )
    return exported_of(model)


def test_poles_that_lie_together_at_one_are_a_free_axis():
    # Rounding moves the roots of three poles at 1 by 1e-5, on both sides of the circle.
    exported = with_poles(1.0, 1.0 - 1e-6, 1.0 - 2e-6, 0.9)
    roots = np.abs(np.roots(exported.model.denominator))
    assert roots.max() > 1.0 + 1e-6

    assert np.isfinite(predict(exported, np.ones(100))).all()
    with pytest.raises(ModelFileError, match=r"pole of magnitude 1\.01"):
        predict(with_poles(1.01, 0.9), np.ones(100))


def test_no_level_is_steady_for_a_model_that_integrates():
    exported = with_poles(1.0, 0.9)
    with pytest.raises(ModelFileError, match=r"integrates .* take one of them"):
        predict(exported, np.ones(100), initial_state="steady")

    assert predict(exported, np.ones(100), initial_state="empty")[-1] > 0.0
    still = predict(with_poles(0.999, 0.9), np.ones(100), initial_state="steady")
    assert np.ptp(still) < 1e-9 * abs(still[0])
