"""A recording that changes or vanishes while it is used: no results under its name."""

import shutil

import pytest

from hwid_cli.data import recordings
from hwid_cli.stages import identify
from tests.reliability import harness


@pytest.fixture
def measured(tmp_path, undisturbed, out):
    """A campaign on files of the user's own, of which nothing is computed yet."""
    shutil.copytree(undisturbed / "raw", tmp_path / "measured")
    begin = harness.CONFIG.index("simulate:")
    end = harness.CONFIG.index("recordings:")
    text = harness.CONFIG[:begin] + harness.CONFIG[end:]
    config = harness.write_config(
        tmp_path,
        text.replace("raw/*.csv", "measured/*_*.csv"),
    )
    return config, tmp_path / "measured" / "step_02.csv"


def during_fits(monkeypatch, act):
    """Do something when the recordings have been read and fits begin."""
    fit_grid = identify.fit_grid

    def act_and_fit(*arguments):
        act()
        return fit_grid(*arguments)

    monkeypatch.setattr(identify, "fit_grid", act_and_fit)


def change(path):
    text = path.read_text().splitlines(keepends=True)
    path.write_text("".join(text[:-1]))


@pytest.mark.slow
@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize(
    ("act", "said"),
    [
        (change, "changed while this run used it"),
        (lambda path: path.unlink(), "cannot be read (No such file or directory)"),
    ],
    ids=["changed", "gone"],
)
def test_results_are_not_stored_for_a_file_that_is_no_longer_there(
    measured, out, undisturbed, monkeypatch, act, said
):
    config, path = measured
    before = path.read_bytes()
    with monkeypatch.context() as patched:
        during_fits(patched, lambda: act(path))
        done = harness.run_here(config, out, code=1)

    assert done.stderr.count("\n") == 1
    assert f"{path}: {said}" in done.stderr
    assert not (out / "results.h5").exists()
    # The fits of what had been read are kept.
    path.write_bytes(before)
    again = harness.run_here(config, out)
    assert "identify: 18 fits from the cache, 0 computed" in again.stderr
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.slow
def test_a_file_that_changes_while_it_is_read_is_refused(measured, out, monkeypatch):
    config, path = measured
    read_columns = recordings.read_columns

    def read_and_change(place, columns):
        found = read_columns(place, columns)
        if place == path:
            change(path)
        return found

    monkeypatch.setattr(recordings, "read_columns", read_and_change)
    done = harness.run_here(config, out, code=1)

    assert done.stderr.count("\n") == 1
    assert f"{path}: changed while it was read" in done.stderr
    assert not (out / "calibrated.h5").exists()
