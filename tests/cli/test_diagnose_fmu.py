"""The whole way with an FMU that lacks friction, from recordings to a module."""

import json
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.simulations import fmu
from tests.cli.drive_examples import (
    CONFIG,
    FRICTION,
    NOISE,
    currents,
    displacement,
    write_measurements,
)
from tests.conftest import leave_figures_blank
from tests.simulations.fmu_examples import fmpy, make_fmu, needs_compiler

pytestmark = needs_compiler
BEFORE, AFTER = CONFIG.split("simulation:\n")
DIAGNOSE = AFTER[AFTER.index("diagnose:") :]
SECTION = """\
simulation:
  kind: fmu
  file: drive.fmu
  input: current_A
  output: displacement_m
  velocity: velocity_m_per_s
  force_input: force_N
  parameters:
    damping: {value: 16.0, bounds: [1.0, 100.0]}
    stiffness: {value: 1150.0, bounds: [100.0, 10000.0]}
    kt: {value: 5.1, bounds: [1.0, 20.0]}
"""
ASK = """\
import json, sys
from simulation import simulate
time_s, current = json.load(sys.stdin)
found = simulate(time_s, {"current_A": current})
json.dump({name: list(one) for name, one in found.items()}, sys.stdout)
"""


@pytest.fixture
def folder(tmp_path):
    write_measurements(tmp_path / "data")
    make_fmu(tmp_path)
    (tmp_path / "drive.yaml").write_text(BEFORE + SECTION + DIAGNOSE)
    yield tmp_path
    fmu._PROCESS.end()


def hwid(folder, command, *options):
    arguments = [command, str(folder / "drive.yaml"), "--jobs", "1", *options]
    return CliRunner().invoke(main, [*arguments, "--out", str(folder / "out")])


@pytest.mark.slow
def test_an_fmu_that_lacks_friction(folder, monkeypatch):
    leave_figures_blank(monkeypatch)

    said = hwid(folder, "diagnose")

    assert said.exit_code == 0, said.output
    found = json.loads((folder / "out" / "diagnosis.json").read_text())
    assert found["confirmed"] == "simulation"
    assert found["capabilities"] == ["run", "parameters", "force", "step"]
    assert [one["id"] for one in found["effects"]] == ["coulomb_friction"]
    force = found["effects"][0]["parameters"]["force_N"]["value"]
    assert force == pytest.approx(FRICTION, rel=0.02)
    for ending, names in ALONE.items():
        said = hwid(folder, "export", "--diagnosis", "--format", ending)
        assert said.exit_code == 0, said.output
        assert [one.split("/")[-1] for one in said.stdout.splitlines()] == names
    _check_unit(folder, hwid(folder, "export", "--diagnosis", "--format", "fmu"))
    _check_module(folder, hwid(folder, "export", "--diagnosis", "--format", "python"))


ALONE = {
    "c": ["effect.c"],
    "simulink": ["effect.c", "effect_sfun.c"],
    "modelica": ["effects.mo"],
}


def _check_unit(folder, said):
    """The FMU runs by FMPy alone, and moves as the machine does."""
    assert said.exit_code == 0, said.output
    assert "differs from the extended simulation by 0." in said.stderr
    fresh = dict(currents())["sine_02"][::-1].copy()
    given = np.zeros(fresh.size, [("time", float), ("current_A", float)])
    given["time"], given["current_A"] = 1e-3 * np.arange(fresh.size), fresh
    output = fmpy.simulate_fmu(
        str(folder / "out" / "models" / "simulation.fmu"),
        stop_time=given["time"][-1], output_interval=1e-4,
        input=given, output=["displacement_m"],
    )["displacement_m"][::10]  # fmt: skip
    truth = displacement(fresh)
    assert np.std(truth - output) < 0.01 * np.std(truth)


def _check_module(folder, said):
    """It runs elsewhere, without the configuration and the FMU that it was made from."""
    assert said.exit_code == 0, said.output
    models = shutil.move(folder / "out" / "models", folder.parent / "elsewhere")
    (folder / "drive.fmu").unlink()
    fresh = dict(currents())["sine_02"][::-1].copy()
    time_s = 1e-3 * np.arange(fresh.size)

    done = subprocess.run(
        [sys.executable, "-c", ASK],
        cwd=models,
        input=json.dumps([time_s.tolist(), fresh.tolist()]),
        capture_output=True,
        text=True,
        check=True,
    )

    truth, output = displacement(fresh), json.loads(done.stdout)["displacement_m"]
    # Fitted parameters and the friction are a few thousandths off.
    assert np.std(truth - output) < 0.01 * np.std(truth)
    assert np.std(truth - output) < 2 * NOISE


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("input: current_A", "input: current", "simulation.input: found 'current', wh"),
        ("drive.fmu", "gone.fmu", "simulation.file: found '.*gone.fmu', No such file"),
        ("damping: {", "dampng: {", "simulation.parameters: found 'dampng'.*'damping'"),
    ],
)
def test_a_fault_of_the_section_is_one_line(folder, old, new, expected):
    (folder / "drive.yaml").write_text(BEFORE + SECTION.replace(old, new) + DIAGNOSE)

    said = hwid(folder, "diagnose", "-q")

    assert said.exit_code == 1
    assert len(said.stderr.splitlines()) == 1
    assert re.search(f"drive.yaml: {expected}", said.stderr)


@pytest.mark.thorough
def test_another_platform_is_one_line(folder):
    other = "win64" if fmpy.platform != "win64" else "linux64"
    make_fmu(folder, platform=other)

    said = hwid(folder, "diagnose", "-q")

    assert said.exit_code == 1
    assert f"other platforms ({other})" in said.stderr


@pytest.mark.parametrize("file_format", ["json", "mat"])
def test_a_format_for_models_is_refused_with_those_for_programs(folder, file_format):
    said = hwid(folder, "export", "--diagnosis", "--format", file_format, "-q")

    assert said.exit_code == 1
    expected = (
        "simulation.kind is fmu; expected one of fmu, python, c, simulink, modelica"
    )
    assert expected in said.stderr
    assert len(said.stderr.splitlines()) == 1
