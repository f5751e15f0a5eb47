"""The MAT file, rebuilt with what MATLAB and Octave have: filter and interp1."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.signal import lfilter

from hwid_cli.errors import ConfigError
from hwid_cli.export.formats import write_exported
from hwid_cli.export.predict import predict
from hwid_cli.records.maps import OwnFunction, StaticMap
from tests.export.model_examples import (
    KINDS,
    STARTS,
    deviation,
    example_input,
    example_model,
    exported_of,
)

# Another form of the filter rounds otherwise, and poles near each other enlarge that.
ROUNDING = 1e-11
OCTAVE = shutil.which("octave-cli")
RUN = """
u = load('u.txt');
y = [{name}(u), {name}(u, 'empty'), {name}(u, 'steady')];
file = fopen('y.bin', 'w');
fwrite(file, y, 'double');
fclose(file);
for wrong = {{'stedy', 'Steady', 1}}
    try
        {name}(u, wrong{{1}});
        error('none of the three words was taken');
    catch problem
        assert(strcmp(problem.identifier, 'hwid:start'));
    end
end
"""


def interp1(points, values, v):
    """Linear interpolation that goes on beyond the ends, as 'extrap' does."""
    k = np.clip(np.searchsorted(points, v, side="right") - 1, 0, points.size - 2)
    slope = np.diff(values) / np.diff(points)
    return values[k] + slope[k] * (v - points[k])


def test_filter_and_interp1_rebuild_the_chain(tmp_path):
    kinds = ("piecewise_linear", "piecewise_linear")
    exported = exported_of(example_model(4, kinds=kinds, nb=3, nf=4, nk=2))
    path = write_exported(tmp_path, exported, "mat")[-1]
    m = loadmat(path, simplify_cells=True)
    u = example_input(4)

    w = interp1(m["input_map"]["break_points"], m["input_map"]["values"], u)
    pulse = np.zeros(u.size)
    pulse[0] = 1.0
    x = lfilter(m["B"], m["F"], w) + lfilter(m["C"], m["F"], pulse)
    y = interp1(m["output_map"]["break_points"], m["output_map"]["values"], x)

    assert deviation(y, predict(exported, u)) < ROUNDING
    assert (m["nb"], m["nf"], m["nk"]) == (3, 4, 2)
    assert m["sample_time_s"] == 1e-3
    assert m["units"] == {"time": "s", "input": "A", "output": "m"}
    assert m["columns"]["input"] == "current_A"
    assert json.loads(m["provenance"]) == {}


def test_the_function_lies_beside_its_numbers(tmp_path):
    exported = exported_of(example_model(1), name="7b+it's/1/2")
    script, path = write_exported(tmp_path, exported, "mat")

    assert script.name == "model_7b_it_s_1_2.m"
    assert path.name == "7b+it's_1_2.mat"
    assert "'7b+it''s_1_2.mat'" in script.read_text()
    assert "@ide" not in script.read_text()


def test_a_python_function_is_refused(tmp_path):
    own = StaticMap("own_function", np.zeros(1), function=OwnFunction("mine", ""))
    model = example_model(1)
    model = type(model)(**{**vars(model), "input_map": own})

    with pytest.raises(ConfigError, match="'mine', which MATLAB does not know"):
        write_exported(tmp_path, exported_of(model), "mat")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(OCTAVE is None, reason="octave-cli is not installed")
@pytest.mark.parametrize("place", range(len(KINDS)))
def test_octave_predicts_as_hwid_does(place, tmp_path):
    kinds = (KINDS[place], KINDS[(place + 4) % len(KINDS)])
    rule = ("zero", "steady", "estimated")[place % 3]
    model = example_model(
        place, kinds=kinds, nb=1 + place, nf=place, nk=place % 6, rule=rule
    )
    exported, u = exported_of(model), example_input(place)
    script = write_exported(tmp_path, exported, "mat")[0]
    np.savetxt(tmp_path / "u.txt", u, fmt="%.17g")
    subprocess.run(
        [OCTAVE, "--quiet", "--norc", "--eval", RUN.format(name=script.stem)],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    found = np.fromfile(tmp_path / "y.bin").reshape(3, -1)
    for start, y in zip(STARTS, found, strict=True):
        expected = predict(exported, u, initial_state=start)
        assert deviation(y, expected) < ROUNDING, start


def test_models_of_like_names_have_functions_of_their_own(tmp_path):
    """Each function loads the numbers beside it, whatever was exported before."""
    long = "x" * 70
    names = [
        "a-b",
        "a_b",
        "a+b",
        "a b",
        "ä_b",
        "ü_b",
        f"{long}1{long}",
        f"{long}2{long}",
    ]
    written = []
    for name in names:
        exported = exported_of(example_model(4), name=f"{name}/1/2")
        written += write_exported(tmp_path, exported, "mat")

    functions = [path for path in written if path.suffix == ".m"]
    assert len(set(functions)) == len(names)
    for function in functions:
        text = function.read_text(encoding="utf-8")
        # MATLAB finds a function by the name of its file.
        assert f" {function.stem}(" in text.splitlines()[0]
        assert len(function.stem) <= 63
        (loaded,) = re.findall(r"load\(.*'(.*)'\)\);", text)
        assert (tmp_path / loaded).is_file()
    loads = [
        re.findall(r"load\(.*'(.*)'\)\);", one.read_text("utf-8")) for one in functions
    ]
    assert len({one for (one,) in loads}) == len(names)


def test_exporting_again_keeps_the_name_of_the_function(tmp_path):
    exported = exported_of(example_model(4), name="a+b/1/2")
    first = write_exported(tmp_path, exported, "mat")

    assert write_exported(tmp_path, exported, "mat") == first
