"""A package that may not be written, and no cache of the user's: it computes all the same."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hwid_cli
from tests.bad_input import trial

PACKAGE = Path(hwid_cli.__file__).parent
# The lowest version of numba that is allowed gives up where it finds no such folder.
PYTHON = os.environ.get("HWID_LOWEST_PYTHON", sys.executable)


@pytest.fixture
def read_only(tmp_path):
    """The package on a disk that may only be read."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=100m", "tmpfs", str(folder)]
    if subprocess.run(command, capture_output=True, check=False).returncode != 0:
        pytest.skip("may not mount a disk")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PACKAGE, folder / "hwid_cli", ignore=ignored)
    subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=False)


@pytest.mark.slow
def test_a_package_that_may_not_be_written_computes(read_only, tmp_path):
    trial.make_good(tmp_path / "work")
    loops = tmp_path / "temporary"
    loops.mkdir()
    given = {name: one for name, one in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    nowhere = {"XDG_CACHE_HOME": "/proc/none", "HOME": "/proc/none"}
    config = tmp_path / "work" / "config.yaml"
    with config.open("a") as file:
        file.write("fit: {units: 3, starts: 1, max_iterations: 2}\n")
    done = subprocess.run(
        [PYTHON, "-m", "hwid_cli", "identify", config, "--out", tmp_path / "out"],
        env={**given, **nowhere, "PYTHONPATH": str(read_only), "TMPDIR": str(loops)},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stderr
    assert "4 computed" in done.stderr
    # What was compiled went with the program.
    assert list(loops.glob("hwid_loops_*")) == []
