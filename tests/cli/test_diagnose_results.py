"""``hwid diagnose`` on what ``hwid test`` left: one line in the same configuration."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.signal import lsim

from hwid_cli.cli.main import main
from tests.conftest import leave_figures_blank

DT, N = 1e-3, 500
TIME = DT * np.arange(N)
CONFIG = """name: stage
recordings:
  files: raw/*.csv
  columns: {time: t, input: i, output: x}
  kind: {step: "step_*", sine: "sine_*"}
orders: {nb: 2, nk: 2}
fit: {input_map: none, output_map: none, starts: 1}
identify: {recordings: [step_1, step_2, sine_1]}
crossval: {threshold: 0.0003}
group: {start: [step_1, step_2], keep: {best: true}, max_level: 1}
test: {recordings: [step_3, step_4, sine_2, sine_3, sine_4]}
"""
ONE_LINE = "simulation: {kind: model, results: out}\n"
FEW = "diagnose: {effects: [input_delay, coulomb_friction, output_backlash]}\n"
LATE = 0.0043


def inputs():
    on = TIME > 0.04
    for number, size in enumerate((1.0, -2.0, 2.5, -1.5), start=1):
        yield f"step_{number}", size * (on & (TIME < 0.3))
    for number, (size, turns) in enumerate(((2, 4), (1, 7), (2, 9), (1.5, 3)), start=1):
        yield f"sine_{number}", size * np.sin(2 * np.pi * turns * (TIME - 0.04)) * on


@pytest.fixture(scope="module")
def tested(tmp_path_factory):
    """A stage that is measured with a late input once its model has been made."""
    folder = tmp_path_factory.mktemp("stage")
    (folder / "raw").mkdir()
    rng = np.random.default_rng(1)
    for name, u in inputs():
        is_late = name not in ("step_1", "step_2", "sine_1")
        given = np.interp(TIME - LATE * is_late, TIME, u)
        x = lsim(([9.0], [0.8, 11.0, 2100.0]), given, TIME)[1]
        table = np.column_stack([TIME, u, x + 1e-5 * rng.standard_normal(N)])
        path = folder / "raw" / f"{name}.csv"
        np.savetxt(path, table, delimiter=",", header="t,i,x", comments="")
    (folder / "stage.yaml").write_text(CONFIG)
    run("test", folder)
    (folder / "stage.yaml").write_text(CONFIG + ONE_LINE + FEW)
    return folder


def run(command, folder, expected=0):
    arguments = [command, str(folder / "stage.yaml"), "--out", str(folder / "out")]
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        result = CliRunner().invoke(main, [*arguments, "--jobs", "1"])
    assert result.exit_code == expected, result.output
    return result


@pytest.mark.thorough
def test_one_line_finds_what_the_model_lacks_where_it_does_not_cover(tested):
    result = run("diagnose", tested)
    found = json.loads((tested / "out" / "diagnosis.json").read_text())
    assert "runs the model " in result.stderr
    assert "diagnosed are the 5 of 8 recordings that " in result.stderr
    named = {*found["recordings"]["train"], *found["recordings"]["held_out"]}
    assert named == {"step_3", "step_4", "sine_2", "sine_3", "sine_4"}
    assert [one["id"] for one in found["effects"]] == ["input_delay"]
    delay = found["effects"][0]["parameters"]["delay_s"]["value"]
    # A hundredth of a sample is the noise's.
    assert delay == pytest.approx(LATE, abs=2e-4)
    assert found["confirmed"] == "simulation"
    assert found["gap"]["after"]["ratio_to_noise"] < 1.2


@pytest.mark.thorough
def test_another_model_of_the_folder_may_be_named(tested):
    text = ONE_LINE.replace("out}", "out, name: sine_9/2/2}")
    (tested / "stage.yaml").write_text(CONFIG + text + FEW)
    result = run("diagnose", tested, expected=1)
    assert "simulation.results: " in result.stderr
    assert "no model 'sine_9/2/2'; did you mean 'sine_1/2/2'" in result.stderr


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("simulation: {kind: model, results: nowhere}", "simulation.results: found no results of hwid test in .*nowhere; run 'hwid test' first"),
        ("simulation: {kind: model}", "simulation: found neither file nor results; expected file: a model's JSON file, or results"),
        ("simulation: {kind: model, file: a.json, results: out}", "simulation: found file and results; expected"),
    ],
)  # fmt: skip
def test_a_folder_that_holds_nothing_is_one_line(tested, line, said):
    (tested / "stage.yaml").write_text(CONFIG + line + "\n")
    result = run("diagnose", tested, expected=1)
    assert re.search(said, result.stderr)
    assert result.stderr.strip().count("\n") == 0
