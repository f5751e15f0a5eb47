"""Objects of MATLAB, as mat-io writes them, and arrays of structs of version 7.3."""

import builtins
import warnings

import h5py
import numpy as np
import pandas as pd
import pytest

from hwid_cli.data.array_columns import list_variables, pick_columns
from hwid_cli.data.mat_files import open_mat
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import Columns

with warnings.catch_warnings():
    # The library uses what pandas has announced to change.
    warnings.simplefilter("ignore")
    from matio import save_to_mat
    from matio.utils import MatlabOpaque

N = 90
TIME, CURRENT = 0.002 * np.arange(N), np.sin(np.arange(N))


def save(path, version="v7", **content):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        save_to_mat(str(path), content, version=version)
    return path


def listed(path):
    with open_mat(path) as variables:
        return {one.title: (one.values, one.unit) for one in list_variables(variables)}


def timetable():
    index = pd.to_timedelta(1e6 * TIME, unit="us")
    return pd.DataFrame({"current": CURRENT, "position": 2 * CURRENT}, index=index)


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_a_timetable_is_columns_with_their_time_beside_plain_arrays(tmp_path, version):
    path = save(
        tmp_path / "run.mat", version, log=timetable(), plain=np.arange(float(N))
    )
    found = listed(path)

    np.testing.assert_allclose(found["log.Time"][0], TIME, atol=1e-12)
    assert found["log.Time"][1] == "s"
    np.testing.assert_array_equal(found["log.current"][0], CURRENT)
    np.testing.assert_array_equal(found["plain"][0], np.arange(float(N)))
    with open_mat(path) as variables:
        columns = Columns(time="log.Time", input="log.current", output="log.position")
        picked = dict(pick_columns(path, columns, variables))
    np.testing.assert_array_equal(picked["output"].values, 2 * CURRENT)


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_arrays_in_the_properties_of_other_objects_are_found(tmp_path, version):
    """The names are those that MATLAB stores: private ones end in an underscore."""
    data = MatlabOpaque(
        properties={
            "InputData_": CURRENT[:, None],
            "OutputData_": 2 * CURRENT[:, None],
            "Ts_": 0.01,
            "Notes": "none",
        },
        classname="iddata",
    )
    found = listed(save(tmp_path / "run.mat", version, z=data))

    np.testing.assert_array_equal(found["z.InputData"][0], CURRENT)
    np.testing.assert_array_equal(found["z.OutputData"][0], 2 * CURRENT)
    assert found["z.Ts"][0].tolist() == [0.01]


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_without_the_library_plain_arrays_are_read_and_objects_are_explained(
    tmp_path, version, monkeypatch
):
    both = save(tmp_path / "both.mat", version, log=timetable(), u=CURRENT, y=TIME)
    alone = save(tmp_path / "alone.mat", version, log=timetable())
    real = builtins.__import__

    def without(name, *rest):
        if name.split(".")[0] == "matio":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    np.testing.assert_array_equal(listed(both)["u"][0], CURRENT)
    for path, names in ((both, ("log.current", "y")), (alone, ("u", "y"))):
        with (
            open_mat(path) as variables,
            pytest.raises(
                MeasurementError, match=r"mat-io .*hwid\[formats\].* save plain"
            ),
        ):
            list(pick_columns(path, Columns(*names), variables))
    with pytest.raises(ValueError, match=r"holds no plain arrays; .* is an object"):
        listed(alone)


def test_an_array_of_structs_of_version_73_is_read_by_its_elements(tmp_path):
    """Made after the layout that MATLAB writes: references to the members."""
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        scope = file.create_group("out")
        scope["time"] = TIME[None]
        scope["time"].attrs["MATLAB_class"] = np.bytes_("double")
        signals = scope.create_group("signals")
        store = file.create_group("#refs#")
        places = {"values": [], "label": []}
        for number, (name, values) in enumerate({"i": CURRENT, "x": TIME}.items()):
            store[f"v{number}"] = values[None]
            store[f"v{number}"].attrs["MATLAB_class"] = np.bytes_("double")
            store[f"l{number}"] = np.array([[ord(name)]], dtype="u2")
            store[f"l{number}"].attrs["MATLAB_class"] = np.bytes_("char")
            places["values"].append(store[f"v{number}"].ref)
            places["label"].append(store[f"l{number}"].ref)
        for member, references in places.items():
            made = signals.create_dataset(member, (2, 1), dtype=h5py.ref_dtype)
            made[:, 0] = references
    found = listed(path)

    np.testing.assert_array_equal(found["i"][0], CURRENT)
    np.testing.assert_array_equal(found["x"][0], TIME)
    np.testing.assert_array_equal(found["out.time"][0], TIME)
