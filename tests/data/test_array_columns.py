import h5py
import numpy as np
import pytest
import scipy.io

from hwid_cli.data.formats import read_columns
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns

TABLE = np.arange(12.0).reshape(4, 3)
BY_NUMBER = Columns(variable="data", time=0, input=2, output=1)
BY_NAME = Columns(time="t", input="u", output="y")


def matlab_73(path, variables):
    """Write HDF5 as MATLAB's version 7.3 does: a user block, arrays transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in variables.items():
            dataset = file.create_dataset(name, data=np.atleast_2d(values).T)
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
        file.create_group("#refs#")["hidden"] = np.zeros(3)


def plain_hdf5(path, variables):
    with h5py.File(path, "w") as file:
        for name, values in variables.items():
            file[name] = values


WRITERS = {
    "v5.mat": lambda path, variables: scipy.io.savemat(path, variables),
    "v73.mat": matlab_73,
    "a.npz": lambda path, variables: np.savez(path, **variables),
    "b.h5": plain_hdf5,
    "UPPER.MAT": lambda path, variables: scipy.io.savemat(path, variables),
}


@pytest.fixture(params=WRITERS)
def write(request, tmp_path):
    """Write variables in one format after the other."""

    def write_variables(**variables):
        path = tmp_path / request.param
        WRITERS[request.param](path, variables)
        return path

    return write_variables


def test_columns_are_found_by_number_in_a_table(write):
    found = read_columns(write(data=TABLE), BY_NUMBER)
    np.testing.assert_array_equal(found.time.values, TABLE[:, 0])
    np.testing.assert_array_equal(found.input.values, TABLE[:, 2])
    np.testing.assert_array_equal(found.output.values, TABLE[:, 1])


@pytest.mark.parametrize("shape", [(4,), (4, 1), (1, 4)])
def test_named_variables_may_be_rows_or_columns(write, shape):
    vectors = {name: np.arange(4.0).reshape(shape) + k for k, name in enumerate("tuy")}
    found = read_columns(write(**vectors), BY_NAME)
    np.testing.assert_array_equal(found.output.values, np.arange(4.0) + 2)
    assert found.output.rows.tolist() == [0, 1, 2, 3]
    assert found.output.rows_from_zero


def test_whole_numbers_become_floats(write):
    path = write(
        t=np.arange(3), u=np.array([1, 2, 3], np.int16), y=np.ones(3, np.uint8)
    )
    assert read_columns(path, BY_NAME).input.values.dtype == np.float64


def test_name_beside_a_table_is_found(write):
    path = write(data=TABLE, t=np.arange(4.0))
    columns = Columns(variable="data", time="t", input=2, output=1)
    np.testing.assert_array_equal(read_columns(path, columns).time.values, np.arange(4))


def test_variables_may_differ_in_length(write):
    found = read_columns(write(t=np.arange(5.0), u=np.ones(5), y=np.ones(3)), BY_NAME)
    assert (found.input.values.size, found.output.values.size) == (5, 3)


@pytest.mark.parametrize(
    ("variables", "columns", "message"),
    [
        (
            {"Data": TABLE},
            BY_NUMBER,
            r"has no variable 'data' for recordings.columns.variable; did you mean 'Da",
        ),
        (
            {"t": np.ones(3), "current": np.ones(3), "y": np.ones(3)},
            BY_NAME,
            r"no variable 'u' for recordings.columns.input; expected one of",
        ),
        (
            {"data": TABLE[:, :2]},
            BY_NUMBER,
            r"'data' has 2 columns, so none with number 2 for the input; .*from 0 to 1",
        ),
        (
            {"t": np.ones(3), "u": TABLE, "y": np.ones(3)},
            BY_NAME,
            r"variable 'u' has shape \(4, 3\); expected one row or one column",
        ),
        (
            {"data": TABLE},
            Columns(time=0, input=1, output=2),
            r"the input is column number 1 of no variable; .*name the table",
        ),
        (
            {"data": np.zeros((2, 2, 2))},
            BY_NUMBER,
            r"'data' has shape \(2, 2, 2\); expected a table of rows and columns",
        ),
    ],
)
def test_wrong_columns_are_refused(write, variables, columns, message):
    path = write(**variables)
    with pytest.raises(MeasurementError, match=message) as caught:
        read_columns(path, columns)
    assert str(caught.value).startswith(f"{path}: ")


def test_members_of_a_matlab_struct_are_found(tmp_path):
    path = tmp_path / "struct.mat"
    members = {"t": np.arange(4.0), "u": np.ones(4), "y": np.arange(4.0) + 7}
    scipy.io.savemat(path, {"run": members})
    for columns in (
        Columns(variable="run", time="t", input="u", output="y"),
        Columns(time="run.t", input="run.u", output="run.y"),
    ):
        found = read_columns(path, columns)
        np.testing.assert_array_equal(found.output.values, np.arange(4.0) + 7)


@pytest.mark.parametrize(
    ("name", "write_file"), [("s.mat", matlab_73), ("g.h5", plain_hdf5)]
)
def test_members_of_a_group_are_found(tmp_path, name, write_file):
    path = tmp_path / name
    members = {"run/t": np.arange(4.0), "run/u": np.ones(4), "run/y": np.arange(4.0)}
    write_file(path, members)
    mark = "." if name.endswith("mat") else "/"
    for columns in (
        Columns(variable="run", time="t", input="u", output="y"),
        Columns(time=f"run{mark}t", input=f"run{mark}u", output=f"run{mark}y"),
    ):
        found = read_columns(path, columns)
        np.testing.assert_array_equal(found.output.values, np.arange(4.0))


def test_fields_of_a_structured_array_are_found(tmp_path):
    table = np.zeros(4, dtype=[("t", float), ("u", float), ("y", float)])
    table["y"] = np.arange(4)
    np.savez(tmp_path / "a.npz", run=table)
    plain_hdf5(tmp_path / "b.h5", {"run": table})
    columns = Columns(variable="run", time="t", input="u", output="y")
    for name in ("a.npz", "b.h5"):
        found = read_columns(tmp_path / name, columns)
        np.testing.assert_array_equal(found.output.values, np.arange(4))


@pytest.mark.parametrize(
    ("values", "what"),
    [(np.array(["a", "b"]), "text"), (np.array([1j, 2j]), "complex numbers")],
)
def test_variable_that_holds_no_real_numbers_is_refused(tmp_path, values, what):
    np.savez(tmp_path / "a.npz", t=np.ones(2), u=values, y=np.ones(2))
    with pytest.raises(MeasurementError, match=f"variable 'u' holds {what}; expected"):
        read_columns(tmp_path / "a.npz", BY_NAME)


def test_hidden_parts_of_a_matlab_73_file_are_no_variables(tmp_path):
    matlab_73(tmp_path / "a.mat", {"data": TABLE})
    with pytest.raises(MeasurementError, match=r"'u' .*; expected one of data$"):
        read_columns(tmp_path / "a.mat", BY_NAME)


def test_text_of_a_matlab_73_file_is_refused(tmp_path):
    path = tmp_path / "text.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in "tuy":
            file[name] = np.array([[104, 105]], np.uint16)
            file[name].attrs["MATLAB_class"] = np.bytes_("char")
    with pytest.raises(MeasurementError, match="holds text; expected an array of real"):
        read_columns(path, BY_NAME)


def test_pickled_objects_are_never_loaded(tmp_path):
    objects = np.array([{}], dtype=object)
    np.savez(tmp_path / "a.npz", t=objects, u=objects, y=objects)
    with pytest.raises(MeasurementError, match=r"a.npz: cannot be read .*allow_pickle"):
        read_columns(tmp_path / "a.npz", BY_NAME)


def test_single_array_under_the_ending_of_an_archive_is_refused(tmp_path):
    with (tmp_path / "a.npz").open("wb") as file:
        np.save(file, np.ones(3))
    with pytest.raises(MeasurementError, match=r"holds a single array; .*numpy.savez"):
        read_columns(tmp_path / "a.npz", BY_NAME)


@pytest.mark.parametrize("name", [*WRITERS, "c.csv"])
def test_empty_file_is_refused(tmp_path, name):
    path = tmp_path / name
    path.touch()
    with pytest.raises(MeasurementError, match=f"{name}: is empty; expected a measure"):
        read_columns(path, BY_NAME)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_damaged_file_is_one_clear_line(write, share):
    path = write(t=np.arange(900.0), u=np.ones(900), y=np.ones(900))
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(
        MeasurementError, match=r"cannot be read \(.*export it"
    ) as caught:
        read_columns(path, BY_NAME)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", [*WRITERS, "c.csv"])
def test_folder_is_no_measurement(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(MeasurementError, match="cannot be read"):
        read_columns(tmp_path / name, BY_NAME)


def test_noise_is_no_mat_file(tmp_path):
    path = tmp_path / "noise.mat"
    path.write_bytes(np.random.default_rng(3).bytes(5000))
    with pytest.raises(MeasurementError, match=r"noise.mat: cannot be read \("):
        read_columns(path, BY_NAME)


def test_unknown_ending_is_refused(tmp_path):
    path = tmp_path / "run.docx"
    path.write_text("x")
    with pytest.raises(
        MeasurementError, match=r"ending '.docx'; expected one of .csv,"
    ):
        read_columns(path, BY_NAME)
