"""A folder with one file in another unit, whose name says a unit of two meanings."""

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main


def invoke(*arguments):
    return CliRunner().invoke(main, [str(one) for one in arguments])


@pytest.fixture
def config(tmp_path):
    rng = np.random.default_rng(2)
    (tmp_path / "data").mkdir()
    for number, size in enumerate((1.0, 1.0, 1000.0, 1.0)):
        u = np.repeat(rng.uniform(-1, 1, 30), 20)
        y = np.convolve(u, np.exp(-np.arange(60) / 12.0))[:600]
        rows = [f"{0.01 * k:.2f},{u[k]:.6f},{size * y[k]:.6f}" for k in range(600)]
        text = "\n".join(["time [s],current [A],probe (mils)", *rows])
        (tmp_path / "data" / f"run_{number}.csv").write_text(text)
    return tmp_path / "mine.yaml"


@pytest.mark.thorough
def test_it_is_named_by_every_command_that_looks_at_the_files(config):
    out = config.parent / "results"
    said = "run_2: for its input the output is"
    found = invoke("init", config.parent / "data", "--out", config)
    assert f"note: NOT SURE: {said}" in found.output
    assert (
        "may be thou or mrad: say which as units: {output: ...}" in config.read_text()
    )

    checked = " ".join(invoke("check", config, "--out", out).output.split())
    assert said in checked

    calibrated = invoke("calibrate", config, "--out", out, "--jobs", "1")
    assert calibrated.exit_code == 0
    assert f"recordings: {said}" in calibrated.stderr
