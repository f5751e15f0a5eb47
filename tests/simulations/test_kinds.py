"""Simulations of the user's own: functions, programs and models, and what goes wrong."""

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

import hwid_cli.simulations
from hwid_cli import FitOptions, Orders, Recording, fit, simulate
from hwid_cli.errors import SimulationError
from hwid_cli.records.programs import (
    CommandSimulation,
    FreeParameter,
    ModelSimulation,
    PythonSimulation,
    RunRequest,
)
from hwid_cli.simulations.kinds import KINDS, kind_named
from tests.black_boxes.plants import LINEAR

STEP_S, N = 1e-3, 300
TIME = STEP_S * np.arange(N)
INPUT = np.sin(2 * np.pi * 5 * TIME)
FORCE = np.cos(2 * np.pi * 3 * TIME)


@pytest.fixture
def python(tmp_path):
    (tmp_path / "plant.py").write_text(LINEAR.text)
    return PythonSimulation(
        file=str(tmp_path / "plant.py"), input="current_A", output="displacement_m",
        force_input="force", velocity="speed",
        parameters={"m": 0.8, "c": FreeParameter(11.0), "k": 2100.0, "kt": 9.0},
    )  # fmt: skip


def request(options, force=FORCE, **values):
    parameters = {**options.values, **values}
    return RunRequest("r1", STEP_S, INPUT, force, parameters)


def expected(damping=11.0):
    force = 9.0 * INPUT + FORCE
    return lsim(([1.0], [0.8, damping, 2100.0]), force, TIME)[1]


def run(options, **values):
    return kind_named(options.kind).run(options, request(options, **values))


@pytest.mark.thorough
def test_a_function_gives_what_the_transfer_function_gives(python):
    found = run(python)
    # Four steps of Runge-Kutta a sample.
    np.testing.assert_allclose(found.output, expected(), atol=1e-9)
    np.testing.assert_allclose(
        found.velocity[1:-1], np.gradient(expected(), STEP_S)[1:-1], atol=1e-4
    )
    np.testing.assert_allclose(run(python, c=30.0).output, expected(30.0), atol=1e-9)


def test_without_a_force_the_force_input_is_zero(python):
    found = kind_named("python").run(python, request(python, np.zeros(0)))
    plain = lsim(([9.0], [0.8, 11.0, 2100.0]), INPUT, TIME)[1]
    np.testing.assert_allclose(found.output, plain, atol=1e-9)


COMPILED = """import numpy as np
from numba import njit


@njit(cache=True)
def doubled(values):
    return 2.0 * values


def simulate(time_s, inputs, parameters):
    return {"displacement_m": doubled(inputs["current_A"]), "speed": 0.0 * time_s}
"""


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["plant", "signal", "my plant"])
def test_what_a_function_keeps_compiled_can_be_read_by_its_own_scripts(
    python, tmp_path, name
):
    """numba names the module of what it keeps: nobody else knew hwid's name for it."""
    folder = tmp_path / "own"
    folder.mkdir()
    file = folder / f"{name}.py"
    file.write_text(COMPILED)
    options = replace(python, file=str(file))
    np.testing.assert_array_equal(run(options).output, 2.0 * INPUT)
    if name != "plant":
        return
    script = "import numpy as np, plant; print(plant.doubled(np.ones(2)))"
    said = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert said.stdout == "[2. 2.]\n", said.stderr


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def simulate(t, u, p):\n    return {'x': t}", "expected 'displacement_m'"),
        ("def simulate(t, u, p):\n    return t", "gave a ndarray; expected a dict"),
        ("def simulate(t, u):\n    return {}", "expected three arguments"),
        ("def other(t, u, p):\n    pass", "it defines other"),
        ("import nothing_of_this_name", "line 1: ModuleNotFoundError"),
        ("def simulate(t, u, p):\n    return 1 / 0", "line 2: ZeroDivisionError"),
        ("import sys\nsys.exit(0)", "called exit(0)"),
        ("def simulate(t, u, p):\n    raise SystemExit(0)", "called exit(0)"),
        ("import os\ndef simulate(t, u, p):\n    os._exit(0)", "crashes on it, code 0"),
        (
            "def simulate(t, u, p):\n    import os\n    os.abort()",
            "crashes on it, SIGABRT",
        ),
        (
            "def simulate(t, u, p):\n    while True: pass",
            "did not come back within 2 s",
        ),
        (
            "def simulate(t, u, p):\n    return {'displacement_m': t[1:]}",
            "of shape (299,); expected (300,)",
        ),
        (
            "def simulate(t, u, p):\n    return {'displacement_m': t / (t - t[7])}",
            "= inf at 0.007 s",
        ),
        (
            "def simulate(t, u, p):\n    y = 0 * t\n    y[-1] = float('nan')\n"
            "    return {'displacement_m': y}",
            "= nan at 0.299 s",
        ),
        (
            "import numpy\ndef simulate(t, u, p):\n    return {'x': numpy.zeros(10**15)}",
            "line 3: MemoryError",
        ),
    ],
)
def test_a_function_that_gives_no_answer_is_one_line(python, tmp_path, text, said):
    (tmp_path / "plant.py").write_text(text)
    options = replace(python, velocity=None, time_limit_s=2.0)
    with pytest.raises(SimulationError) as error:
        run(options)
    line = str(error.value)
    assert said in line
    assert "'r1' with m=0.8, c=11, k=2100, kt=9" in line
    assert "\n" not in line
    # The next one runs.
    (tmp_path / "other.py").write_text(LINEAR.text)
    there = replace(python, file=str(tmp_path / "other.py"))
    np.testing.assert_allclose(run(there).output, expected(), atol=1e-9)


def test_the_content_of_a_function_is_its_file_and_those_beside_it(python, tmp_path):
    content = kind_named("python").content
    before = content(python)
    (tmp_path / "beside.py").write_text("a = 1")
    beside = content(python)
    (tmp_path / "plant.py").write_text(LINEAR.text + "\n")
    assert len({before, beside, content(python)}) == 3
    with pytest.raises(SimulationError, match=r"nowhere\.py.*expected a file"):
        content(replace(python, file=str(tmp_path / "nowhere.py")))


PROGRAM = """
import csv, json, sys
import numpy as np
from plant import simulate
rows = list(csv.DictReader(open(sys.argv[1])))
inputs = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
found = simulate(inputs.pop("time_s"), inputs, json.load(open(sys.argv[2])))
table = np.column_stack([found["displacement_m"], found["speed"]])
np.savetxt(sys.argv[3], table, delimiter=",", header="displacement_m,speed", comments="")
"""


@pytest.fixture
def program(python, tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    places = ("{inputs}", "{parameters}", "{outputs}")
    return CommandSimulation(
        command=(sys.executable, str(tmp_path / "program.py"), *places),
        input="current_A", output="displacement_m", force_input="force",
        velocity="speed", parameters=python.parameters,
    )  # fmt: skip


def test_a_program_gives_what_the_function_gives(python, program):
    found, same = run(program), run(python)
    np.testing.assert_allclose(found.output, same.output, rtol=1e-12)
    np.testing.assert_allclose(found.velocity, same.velocity, rtol=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("raise ValueError('no licence')", "ended with code 1: ValueError: no licence"),
        ("", "wrote no outputs"),
        ("import time\ntime.sleep(60)", "did not end within 1 s"),
        ("open(sys.argv[3], 'w').write('a,b\\n1,2\\n')", "gave 'a', 'b'; expected"),
        ("open(sys.argv[3], 'w').write('a\\nx\\n')", "outputs that are no numbers"),
        ("open(sys.argv[3], 'w').write('a,b\\n1\\n')", "2 names and 1 columns"),
    ],
)
def test_a_program_that_gives_no_answer_is_one_line(program, tmp_path, text, said):
    (tmp_path / "program.py").write_text(f"import sys\n{text}")
    with pytest.raises(SimulationError) as error:
        run(replace(program, time_limit_s=1.0))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.thorough
def test_what_a_program_has_started_ends_with_it(program, tmp_path):
    (tmp_path / "program.py").write_text(
        "import subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(str(child.pid))\n"
        "time.sleep(60)\n"
    )
    with pytest.raises(SimulationError, match="did not end within 2 s"):
        run(replace(program, time_limit_s=2.0))
    pid = int((tmp_path / "pid").read_text())
    for _ in range(100):
        state = Path(f"/proc/{pid}/stat")
        # Z: has ended, and nobody has asked how.
        if not state.exists() or state.read_text().rpartition(")")[2].split()[0] == "Z":
            return
        time.sleep(0.05)
    pytest.fail("it still runs")


def test_a_program_that_is_not_there_is_told_before_it_runs(program):
    gone = replace(program, command=("no_such_program", "{inputs}"))
    with pytest.raises(SimulationError, match=r"'no_such_program'; expected a program"):
        kind_named("command").content(gone)


def test_a_program_gets_its_parameters_as_json_and_leaves_no_files(program, tmp_path):
    (tmp_path / "program.py").write_text(
        "import shutil, sys\n"
        f"shutil.copy(sys.argv[2], {str(tmp_path / 'seen.json')!r})\n"
        f"open({str(tmp_path / 'where')!r}, 'w').write(sys.argv[2])\n"
    )
    with pytest.raises(SimulationError):
        run(program, c=12.5)
    seen = json.loads((tmp_path / "seen.json").read_text())
    assert seen == {"m": 0.8, "c": 12.5, "k": 2100.0, "kt": 9.0}
    assert not (tmp_path / (tmp_path / "where").read_text()).exists()


@pytest.mark.thorough
def test_a_fitted_model_gives_what_simulate_gives():
    output = lsim(([9.0], [0.8, 11.0, 2100.0]), INPUT, TIME)[1]
    recording = Recording("r1", INPUT, output, STEP_S)
    model = fit([recording], Orders(2, 2, 1), FitOptions()).model
    options = ModelSimulation(file="x.json", model=model, model_sample_time_s=STEP_S)
    kind = kind_named("model")
    found = kind.run(options, RunRequest("r1", STEP_S, INPUT, np.zeros(0), {}))
    expected = simulate(model, INPUT, initial_state="steady")
    np.testing.assert_array_equal(found.output, expected)
    with pytest.raises(SimulationError, match=r"every 0\.002 s; expected 0\.001 s"):
        kind.run(options, RunRequest("r1", 2e-3, INPUT, np.zeros(0), {}))


def test_what_each_kind_can_do(python, program):
    room = Path(hwid_cli.simulations.__file__).parent
    made = {one.stem for one in room.glob("*.py") if "\nKIND = " in one.read_text()}
    assert made == set(KINDS)
    able = kind_named("python").capabilities(python)
    assert (able.run, able.parameters, able.force, able.step) == (
        True,
        True,
        True,
        False,
    )
    fixed = replace(program, force_input=None, parameters={"c": 1.0})
    able = kind_named("command").capabilities(fixed)
    assert (able.run, able.parameters, able.force) == (True, False, False)
    assert not kind_named("outputs").capabilities(None).run
