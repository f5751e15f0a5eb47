"""The page on simulations of one's own, followed literally."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from tests.black_boxes.plants import Hidden, Plant, integrate

PAGE = Path(__file__).parents[2] / "docs" / "any_simulation.md"
STEP_S, N = 1e-3, 500
# The machine of the page, with friction that the simulation lacks; own equations.
MACHINE = Plant(
    "page",
    """def rates(y, u, push, p):
    x, v = y
    return v, (5.0 * u + push - 15.0 * v - 1184.0 * x) / 0.3
""",
    2, {}, (), 3.0, 0.3, 0.012,
)  # fmt: skip
FRICTION = Hidden("coulomb", (), dry=0.8)


def blocks():
    """The function and the configuration of the page."""
    found = re.findall(
        r"```(\w+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL
    )
    return dict(reversed(found))


@pytest.fixture
def folder(tmp_path):
    texts = blocks()
    (tmp_path / "plant.py").write_text(texts["python"])
    (tmp_path / "mine.yaml").write_text(texts["yaml"])
    (tmp_path / "raw").mkdir()
    time, rng = STEP_S * np.arange(N), np.random.default_rng(2)
    on = time > 0.05
    inputs = {
        f"step_{n}": size * (on & (time < 0.3)) for n, size in enumerate((1.5, -2.5, 3))
    }
    for n, (hertz, size) in enumerate(((4, 3), (7, 2), (9, 3))):
        inputs[f"sine_{n}"] = size * np.sin(2 * np.pi * hertz * (time - 0.05)) * on
    for name, u in inputs.items():
        y = integrate(MACHINE, {}, u, STEP_S, FRICTION) + 2e-5 * rng.standard_normal(N)
        np.savetxt(
            tmp_path / "raw" / f"{name}.csv", np.column_stack([time, u, y]),
            delimiter=",", header="time_s,current_A,displacement_m", comments="",
        )  # fmt: skip
    return tmp_path


def hwid(folder, *arguments):
    done = CliRunner().invoke(
        main, [*arguments, "--out", str(folder / "out"), "--jobs", "1"]
    )
    assert done.exit_code == 0, done.output
    return done


@pytest.mark.thorough
def test_the_simulation_of_the_page_is_run_beside_the_recordings(folder):
    done = hwid(folder, "simulate", str(folder / "mine.yaml"))
    assert "6 recordings simulated" in done.output
    with (folder / "out" / "simulated" / "step_0.csv").open() as file:
        simulated = np.genfromtxt(file, delimiter=",", names=True)["simulated"]
    command = 1.5 * ((STEP_S * np.arange(N) > 0.05) & (STEP_S * np.arange(N) < 0.3))
    expected = integrate(
        Plant("given", MACHINE.rates.replace("15.0", "13.0"), 2, {}, (), 3.0, 0.3, 0.012),
        {}, command, STEP_S,
    )  # fmt: skip
    # Between samples the solver sees straight lines as well, to its tolerance.
    assert np.max(np.abs(simulated - expected)) < 5e-3 * np.max(np.abs(expected))


@pytest.mark.slow
def test_the_page_leads_to_the_name_of_what_is_hidden(folder):
    done = hwid(folder, "diagnose", str(folder / "mine.yaml"))
    assert "runs" in done.stderr
    assert str(folder / "plant.py") in done.stderr
    found = json.loads((folder / "out" / "diagnosis.json").read_text())
    assert (found["verdict"], found["confirmed"]) == ("named", "simulation")
    assert found["capabilities"] == ["run", "parameters", "force"]
    (effect,) = found["effects"]
    assert effect["id"] == "coulomb_friction"
    assert effect["parameters"]["force_N"]["value"] == pytest.approx(0.8, rel=0.01)
    assert found["base"]["after"]["damping"] == pytest.approx(15.0, rel=0.02)
    # Runs of the simulation come from the cache.
    again = hwid(folder, "diagnose", str(folder / "mine.yaml"), "--force")
    assert "from the cache" in again.output
    # The extended simulation lacks nothing.
    extended = str(folder / "out" / "extended_simulation.yaml")
    hwid(folder, "simulate", extended)
    with (folder / "out" / "simulated" / "step_2.csv").open() as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    left = np.std(table["measured"] - table["simulated"])
    assert left < 1.2 * 2e-5
    done = CliRunner().invoke(
        main, ["diagnose", extended, "--out", str(folder / "out2"), "--jobs", "1"]
    )
    assert done.exit_code == 0, done.output
    after = json.loads((folder / "out2" / "diagnosis.json").read_text())
    assert after["verdict"] in ("none", "parameters")
    assert after["gap"]["after"]["ratio_to_noise"] < 1.1
