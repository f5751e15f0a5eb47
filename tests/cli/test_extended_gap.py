"""What a diagnosis writes is what it says: its extended simulation leaves the stated gap."""

import csv
import json
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from tests.black_boxes.plants import Hidden, Plant, integrate

STEP_S, N = 4e-3, 500
NOISE = 2e-4
# A pendulum on a motor; the user's simulation has its own numbers.
RATES = """def rates(y, u, push, p):
    from math import sin
    x, v = y
    return v, ({gain} * u + push - {damping} * v - {weight} * sin(x)) / 0.012
"""
MACHINE = RATES.format(gain=0.11, damping=0.02, weight=0.55)
THEIRS = RATES.format(gain=0.12, damping=0.025, weight=0.5)
FRICTION = Hidden("coulomb", (), dry=0.03)
SIMULATION = """\
import numpy as np


def simulate(time_s, inputs, parameters):
    p = {"gain": 0.12, "damping": 0.025, "weight": 0.5, **parameters}
    push, step = p["gain"] * inputs["current_A"], time_s[1] - time_s[0]
    if "torque_N_m" in inputs:
        push = push + inputs["torque_N_m"]
    x, v, found = 0.0, 0.0, [0.0]
    for before, after in zip(push[:-1], push[1:]):
        for share in (0.125, 0.375, 0.625, 0.875):
            force = before + share * (after - before)
            half_x, half_v = x + step / 8 * v, v + step / 8 * rate(x, v, force, p)
            x, v = x + step / 4 * half_v, v + step / 4 * rate(half_x, half_v, force, p)
        found.append(x)
    return {"angle_rad": np.array(found)}


def rate(x, v, force, p):
    return (force - p["damping"] * v - p["weight"] * np.sin(x)) / 0.012
"""
PROGRAM = """
if __name__ == "__main__":
    import json, sys

    given = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
    inputs = {name: given[name] for name in given.dtype.names}
    found = simulate(given["time_s"], inputs, json.load(open(sys.argv[2])))
    table = np.column_stack([given["time_s"], found["angle_rad"]])
    np.savetxt(sys.argv[3], table, delimiter=",", header="time_s,angle_rad", comments="")
"""
FREE = """  parameters:
    damping: {value: 0.025, bounds: [0.001, 0.5]}
    weight: {value: 0.5, bounds: [0.1, 2]}
    gain: {value: 0.12, bounds: [0.05, 0.3]}
"""
PYTHON = """  kind: python
  file: plant.py
  input: current_A
  output: angle_rad
"""
KINDS = {
    "parameters": PYTHON + "  force_input: torque_N_m\n" + FREE,
    "parameters, no force input": PYTHON + FREE,
    "nothing is free": PYTHON + "  force_input: torque_N_m\n",
    "program": f"""  kind: command
  command: ["{sys.executable}", plant.py, "{{inputs}}", "{{parameters}}", "{{outputs}}"]
  input: current_A
  output: angle_rad
"""
    + FREE,
    "outputs": "  kind: outputs\n",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings whose current is read with noise from the first sample on."""
    path = tmp_path_factory.mktemp("pendulum")
    (path / "plant.py").write_text(SIMULATION + PROGRAM)
    (path / "raw").mkdir()
    rng, time = np.random.default_rng(3), STEP_S * np.arange(N)
    plants = [Plant("m", one, 2, {}, (), 3.0, 0.012, 0.5) for one in (MACHINE, THEIRS)]
    levels = [np.repeat(rng.uniform(-3, 3, 10), N // 10) for _ in range(3)]
    sines = [
        size * np.sin(2 * np.pi * hertz * time) for size, hertz in ((3, 1.3), (2, 2.1))
    ]
    for row, driven in enumerate((*levels, *sines)):
        read = driven + 0.01 * rng.standard_normal(N)
        # The user's own columns: what was measured, and what the simulation made of it.
        moved = integrate(plants[0], {}, driven, STEP_S, FRICTION)
        moved = moved + NOISE * rng.standard_normal(N)
        theirs = integrate(plants[1], {}, read, STEP_S)
        np.savetxt(
            path / "raw" / f"run_{row}.csv", np.column_stack([time, read, moved, theirs]),
            delimiter=",", header="time_s,current_A,angle_rad,theirs_rad", comments="",
        )  # fmt: skip
    return path


def hwid(*arguments):
    done = CliRunner().invoke(main, [str(one) for one in (*arguments, "--jobs", 1)])
    assert done.exit_code == 0, done.output
    return done.output


def rms_of_tables(folder):
    found = {}
    for path in folder.glob("*.csv"):
        table = np.genfromtxt(path, delimiter=",", names=True)
        found[path.stem] = np.sqrt(
            np.mean((table["measured"] - table["simulated"]) ** 2)
        )
    return found


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_extended_simulation_leaves_the_stated_gap(folder, kind, tmp_path):
    columns = "time: time_s, input: current_A, output: angle_rad"
    if kind == "outputs":
        columns += ", simulated: theirs_rad"
    config = folder / f"{kind.replace(' ', '_').replace(',', '')}.yaml"
    config.write_text(
        f"name: mine\nrecordings:\n  files: raw/*.csv\n  columns: {{{columns}}}\n"
        f"simulation:\n{KINDS[kind]}diagnose: {{effects: [coulomb_friction, cogging]}}\n"
    )
    hwid("diagnose", config, "--out", tmp_path / "found")
    found = json.loads((tmp_path / "found" / "diagnosis.json").read_text())
    named = [one["id"] for one in found["effects"]]
    # A stand-in of outputs alone knows too little of a pendulum to name anything.
    assert named == ([] if kind == "outputs" else ["coulomb_friction"])

    if "weight" in KINDS[kind]:
        # Without friction the fit had made up for it with nearly twice the damping.
        truth = {"damping": 0.02, "weight": 0.55, "gain": 0.11}
        assert found["base"]["after"] == pytest.approx(truth, rel=0.03)

    extended = tmp_path / "found" / "extended_simulation.yaml"
    hwid("simulate", extended, "--out", tmp_path / "again")
    left = rms_of_tables(tmp_path / "again" / "simulated")
    with (tmp_path / "found" / "gaps.csv").open() as file:
        said = {
            one["recording"]: float(one["rms_after"]) for one in csv.DictReader(file)
        }
    assert set(left) == set(said)
    for name, value in said.items():
        assert left[name] == pytest.approx(value, rel=0.15, abs=0.2 * NOISE), name
