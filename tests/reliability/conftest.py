import pytest

from tests.conftest import leave_figures_blank
from tests.reliability import harness


@pytest.fixture(autouse=True)
def _blank_figures(blank_figures):
    """What is rendered here is the matter of tests/report."""


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """What the tiny campaign finds when nothing happens to it."""
    folder = tmp_path_factory.mktemp("undisturbed")
    out = folder / "out"
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_figures_blank(monkeypatch)
        done = harness.run_here(harness.write_config(folder), out)
    assert harness.count_computed(done.stderr) == len(harness.entries(out))
    return out


@pytest.fixture
def config(tmp_path):
    return harness.write_config(tmp_path)


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"
