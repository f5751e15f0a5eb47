"""What holds for every configuration and every recording, tried on random ones."""

import contextlib
import tempfile
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import yaml
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from hwid_cli.config.load import load_experiment
from hwid_cli.data.formats import read_columns
from hwid_cli.data.recordings import read_recordings
from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.records.experiment import Columns, Experiment
from hwid_cli.records.recordings import Recording

COLUMNS = Columns(input="u", output="y", time="t")
NAMES = [
    "name",
    "recordings",
    "files",
    "columns",
    "time",
    "input",
    "output",
    "orders",
    "nb",
    "nk",
    "fit",
    "units",
    "maps",
    "starts",
    "calibrate",
    "step",
    "sine",
    "group",
    "keep",
    "top",
    "best",
    "simulation",
    "kind",
    "effects",
    "simulate",
    "plan",
    "samples",
    "seed",
    "diagnose",
    "hold_out",
    "linear_block",
    "delays",
]
KEYS = st.sampled_from(NAMES) | st.text(max_size=5) | st.integers() | st.none()
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=20)
    | st.sampled_from(["all", "auto", "gun", "servo", "drive", "poles", "delay", "t"])
    | st.dates()
    | st.binary(max_size=5)
    | st.sampled_from([10**30, -(10**400), 2**63, "\0", "\x1b[2J", "../x"])
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4)
    ),
    max_leaves=12,
)
GOOD = {
    "name": "tiny",
    "recordings": {"files": "run.csv", "columns": {"time": 0, "input": 1, "output": 2}},
    "orders": {"nb": [1, 2], "nk": [1, 2]},
    "fit": {"units": 3},
    "group": {"keep": {"top": 1}},
    "simulation": {"kind": "drive", "mass_kg": 1.0},
}


@st.composite
def nearly_good(draw):
    """A good configuration with one value replaced."""
    content = yaml.safe_load(yaml.safe_dump(GOOD))
    section = draw(st.sampled_from([content, *filter(is_section, content.values())]))
    key = draw(st.sampled_from(sorted(section)) | KEYS)
    section[key] = draw(VALUES)
    return content


def is_section(value):
    return isinstance(value, dict)


def loaded(folder, content):
    path = Path(folder) / "config.yaml"
    # Surrogates have no place in a file; as an escape they have.
    text = yaml.safe_dump(content, allow_unicode=False)
    path.write_text(text, encoding="utf-8")
    with contextlib.suppress(ConfigError):
        return load_experiment(path)
    return None


@pytest.mark.thorough
@given(st.dictionaries(KEYS, VALUES, max_size=5) | nearly_good())
@hypothesis_settings(max_examples=30)
def test_any_mapping_is_an_experiment_or_an_error_to_mend(content):
    with tempfile.TemporaryDirectory() as folder:
        found = loaded(folder, content)

    assert found is None or isinstance(found, Experiment)


@pytest.mark.slow
@given(st.dictionaries(KEYS, VALUES, max_size=5) | nearly_good())
@hypothesis_settings(max_examples=5000)
def test_many_mappings_are_experiments_or_errors_to_mend(content):
    with tempfile.TemporaryDirectory() as folder:
        found = loaded(folder, content)

    assert found is None or isinstance(found, Experiment)


@pytest.mark.slow
@given(st.text(max_size=300))
@hypothesis_settings(max_examples=3000)
def test_any_text_is_an_experiment_or_an_error_to_mend(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_text(text, encoding="utf-8", errors="replace")
        with contextlib.suppress(ConfigError):
            load_experiment(path)


def save(path, ending, columns):
    if ending == ".csv":
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
        path.write_text("\n".join(lines) + "\n")
    elif ending == ".npz":
        np.savez(path, **columns)
    elif ending == ".mat":
        scipy.io.savemat(path, columns)
    else:
        with h5py.File(path, "w") as file:
            file.update(columns)


SIGNALS = arrays.arrays(
    np.float64, 80, elements=st.floats(allow_nan=False, allow_infinity=False)
)


@pytest.mark.parametrize("ending", [".csv", ".npz", ".mat", ".h5"])
@given(current=SIGNALS, output=SIGNALS)
@hypothesis_settings(max_examples=15)
def test_numbers_come_back_bit_by_bit_from_every_format(ending, current, output):
    columns = {"t": np.arange(80.0), "u": current, "y": output}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"run{ending}"
        save(path, ending, columns)
        found = read_columns(path, COLUMNS)

    for name, column in zip(
        "tuy", (found.time, found.input, found.output), strict=True
    ):
        np.testing.assert_array_equal(column.values, columns[name])


ANY = arrays.arrays(
    np.float64, st.integers(0, 90), elements=st.floats() | st.sampled_from([0.0, 1e308])
)


@pytest.mark.thorough
@pytest.mark.parametrize("ending", [".npz", ".mat"])
@given(time=ANY | st.just(np.arange(80.0)), current=ANY, output=ANY)
@hypothesis_settings(max_examples=25)
def test_any_arrays_are_recordings_or_an_error_to_mend(ending, time, current, output):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"run{ending}"
        save(path, ending, {"t": time, "u": current, "y": output})
        config = Path(folder) / "config.yaml"
        config.write_text(
            f"name: a\nrecordings: {{files: {path.name}, columns: "
            "{time: t, input: u, output: y}}\norders: {nb: 1, nk: 1}\n"
        )
        with contextlib.suppress(MeasurementError):
            for raw in read_recordings(load_experiment(config), Path(folder)):
                Recording(raw.name, raw.input, raw.output, raw.sample_time_s)
