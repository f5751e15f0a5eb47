import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from tests.conftest import leave_figures_blank

# Small enough for a second: two steps and a sine, two pairs of orders.
CONFIG = """
name: tiny
simulate:
  kind: gun
  plan: {samples: 400, only: [step_02, step_12, sine_12]}
recordings:
  files: raw/*.csv
  columns: {time: time_s, input: current_A, output: displacement_m}
calibrate:
  step: [cut, output_offset]
  sine: [cut, input_offset, output_offset, recut]
  samples: 400
orders: {nb: 1, nk: [1, 2]}
fit: {units: 3, starts: 1, max_iterations: 4}
identify: {}
crossval: {threshold: 0.01}
"""


@pytest.fixture(autouse=True)
def _blank_figures(blank_figures):
    """Figures are rendered in tests/report and by the smoke run."""


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "configs" / "tiny.yaml"
    path.parent.mkdir()
    path.write_text(CONFIG)
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


@pytest.fixture
def hwid(config, out):
    """Run a command on the tiny experiment, in this process."""

    def invoke(command, *options, path=config, folder=out):
        arguments = [command, str(path), "--out", str(folder), "--jobs", "1"]
        return CliRunner().invoke(main, [*arguments, *options])

    return invoke


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """Results of all stages, made once."""
    folder = tmp_path_factory.mktemp("finished")
    path = folder / "tiny.yaml"
    path.write_text(CONFIG)
    arguments = ["run", str(path), "--out", str(folder / "out"), "--jobs", "1"]
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    (folder / "out" / "said.txt").write_text(result.output)
    return folder / "out"


@pytest.fixture
def after_run(finished, out):
    """Begin with the results of a first run."""
    shutil.copytree(finished, out)


@pytest.fixture
def edit(config):
    """Change a line of the configuration."""

    def replace(old, new):
        text = config.read_text()
        assert old in text
        config.write_text(text.replace(old, new))

    return replace


@pytest.fixture
def project():
    return Path(__file__).parents[2]
