"""Simulations of a user's own that cannot be used: one line each, at the command."""

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main

HEAD = """name: bad
recordings:
  files: raw/*.csv
  columns: {time: t, input: i, output: x, simulated: s}
"""
PYTHON = """simulation:
  kind: python
  file: plant.py
  input: i
  output: x
  parameters: {damping: {value: 11.0}}
"""
FUNCTION = "def simulate(t, inputs, p):\n    return {'x': inputs['i'] * p['damping']}\n"
OUTPUTS = "simulation: {kind: outputs}\n"
NO_COLUMN = HEAD.replace(", simulated: s", "")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "raw").mkdir()
    t = 1e-3 * np.arange(200)
    for row, size in enumerate((1.0, -2.0, 1.5)):
        u = size * (t > 0.02)
        x = 1e-3 * size * (1 - np.exp(-np.maximum(t - 0.02, 0) / 0.03))
        table = np.column_stack([t, u, x, 0.9 * x])
        np.savetxt(
            tmp_path / "raw" / f"step_{row}.csv", table,
            delimiter=",", header="t,i,x,s", comments="", fmt="%.9g",
        )  # fmt: skip
    (tmp_path / "plant.py").write_text(FUNCTION)
    return tmp_path


def told(folder, text):
    (folder / "bad.yaml").write_text(text)
    arguments = [str(folder / "bad.yaml"), "--out", str(folder / "out"), "--jobs", "1"]
    result = CliRunner().invoke(main, ["simulate", *arguments, "-q"])
    assert result.exit_code == 1, result.output
    assert len(result.stderr.splitlines()) == 1
    return result.stderr


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("plant.py", "gone.py", "gone.py', No such file or directory; expected a file"),
        (
            "input: i\n  o",
            "input: j\n  o",
            "KeyError: 'i'; it is given j, damping; correct",
        ),
        (
            "output: x\n  p",
            "output: y\n  p",
            "expected 'y' (simulation.output); expected",
        ),
        ("damping", "drag", "KeyError: 'damping'; it is given i, drag; correct"),
        ("kind: python", "kind: pyton", "found 'pyton'; did you mean 'python'"),
        (
            "11.0",
            "11.0, bounds: [12, 20]",
            "found 11.0; expected a number within its b",
        ),
        (
            "input: i\n  o",
            "function: run\n  input: i\n  o",
            "it defines simulate; name one",
        ),
    ],
)
def test_a_section_that_does_not_fit_the_function(folder, old, new, expected):
    section = PYTHON.replace(old, new)
    assert section != PYTHON
    assert expected in told(folder, NO_COLUMN + section)


def test_a_function_with_other_arguments(folder):
    (folder / "plant.py").write_text("def simulate(t, u):\n    return {}\n")
    said = told(folder, NO_COLUMN + PYTHON)
    assert "takes (t, u); expected three arguments: time_s, inputs, parameters" in said


def test_a_program_that_is_not_there(folder):
    section = PYTHON.replace("python", "command").replace(
        "file: plant.py", 'command: [./gone, "{inputs}", "{parameters}", "{outputs}"]'
    )
    assert "found './gone'; expected a program that can be" in told(
        folder, NO_COLUMN + section
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("file: plant.py", "file: gone.py", "gone.py', No such file or directory"),
        (
            "kind: python\n  file: plant.py",
            "kind: command\n  command: [./gone, '{inputs}', '{parameters}', '{outputs}']",
            "simulation.command: found './gone'; expected a program that can be run",
        ),
    ],
)
def test_check_says_what_is_not_there_before_anything_runs(folder, old, new, words):
    (folder / "bad.yaml").write_text(NO_COLUMN + PYTHON.replace(old, new))
    arguments = [str(folder / "bad.yaml"), "--out", str(folder / "out"), "--no-timing"]
    result = CliRunner().invoke(main, ["check", *arguments])

    assert result.exit_code == 1, result.output
    assert words in result.stderr


def test_a_column_of_outputs_with_gaps(folder):
    path = folder / "raw" / "step_1.csv"
    lines = path.read_text().splitlines()
    for row in range(50, 60):
        lines[row] = lines[row].rsplit(",", 1)[0] + ","
    path.write_text("\n".join(lines) + "\n")
    said = told(folder, HEAD + OUTPUTS)
    assert "step_1.csv, row 51" in said
    assert "'s'" in said


def test_no_column_of_outputs(folder):
    said = told(folder, NO_COLUMN + OUTPUTS)
    assert (
        "recordings.columns.simulated: missing; expected the column with what" in said
    )
    assert "has no column 'z'" in told(
        folder, HEAD.replace("simulated: s", "simulated: z") + OUTPUTS
    )


@pytest.mark.parametrize("section", ["own_effects", "simulation"])
def test_two_effects_of_one_name(folder, section):
    own = "own_effects:\n" + 2 * '  mine: {force_N: "-a*v", parameters: {a: {}}}\n'
    twice = "  effects:\n" + 2 * "    coulomb_friction: {force_N: 1.0}\n"
    text = NO_COLUMN + PYTHON + (own if section == "own_effects" else twice)
    assert "is given twice, first in line" in told(folder, text)


@pytest.mark.parametrize("is_apart", [True, False])
def test_recordings_that_start_elsewhere_are_compared_from_there_and_it_is_said(
    folder, is_apart
):
    for row, path in enumerate(sorted((folder / "raw").glob("*.csv"))):
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        table[:, 2] += 0.002 * (row - 1) * is_apart
        np.savetxt(path, table, delimiter=",", header="t,i,x,s", comments="")
    (folder / "bad.yaml").write_text(HEAD + OUTPUTS)
    arguments = [str(folder / "bad.yaml"), "--out", str(folder / "out"), "--jobs", "1"]
    result = CliRunner().invoke(main, ["simulate", *arguments])
    assert result.exit_code == 0, result.output
    said = "recordings start -0.002 to 0.002 from where the simulation does"
    assert (said in result.stderr) == is_apart
    for path in (folder / "out").glob("**/simulated/*.csv"):
        found = np.loadtxt(path, delimiter=",", skiprows=1)
        # A tenth of the motion is missing, at most 0.2 mm.
        assert np.max(np.abs(found[:, 2] - found[:, 3])) < 2.1e-4
