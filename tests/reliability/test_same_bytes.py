"""Two runs of the same give the same files, byte by byte, but for what takes time to tell.

docs/reliability.md names the exceptions: seconds, the lock, and what is made of them.
"""

import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from hwid_cli.files.locks import RUN_LOCK
from tests.reliability import harness

DEMO = Path(__file__).parents[2] / "configs" / "demo.yaml"
# Hold seconds, and checksums or keys over them.
WITH_SECONDS = ("calibrated.h5", "results.h5", "report.html", "diagnosis.json")


def files(folder):
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in paths
        if path.name != RUN_LOCK
    }


def content(path):
    """All that an HDF5 file holds, without seconds and references inside it."""
    found = {}

    def note(name, item):
        for key, value in item.attrs.items():
            if key not in ("REFERENCE_LIST", "DIMENSION_LIST", "seconds"):
                found[f"{name}@{key}"] = _comparable(value)
        if isinstance(item, h5py.Dataset):
            found[name] = _comparable(item[()])

    with h5py.File(path) as file:
        file.visititems(note)
    return found


def _comparable(value):
    """Numbers bit by bit, for NaN is not equal to itself."""
    values = np.asarray(value)
    return values.tobytes() if values.dtype.kind in "fiubc" else values.tolist()


def assert_same(one, other):
    first, second = files(one), files(other)
    assert first.keys() == second.keys()
    different = [name for name in first if first[name] != second[name]]
    assert [name for name in different if Path(name).name not in WITH_SECONDS] == []
    for name in ("calibrated.h5", "results.h5"):
        assert content(one / name) == content(other / name)
    assert _page(first["report.html"]) == _page(second["report.html"])


def _page(page):
    """The page without seconds of stages, and without what says what it was drawn from."""
    text = page.decode().rpartition("<!-- drawn from")[0]
    return re.sub(r"<td>\d+\.\d</td>", "<td>s</td>", text)


@pytest.mark.thorough
def test_two_runs_of_a_campaign_give_the_same_bytes(tmp_path):
    config = harness.write_config(tmp_path)
    for name in ("one", "two"):
        harness.run_here(config, tmp_path / name, command="run")

    assert_same(tmp_path / "one", tmp_path / "two")


@pytest.mark.slow
def test_two_runs_of_the_demo_give_the_same_bytes_whatever_the_jobs(tmp_path):
    for jobs in ("1", "2"):
        words = [
            sys.executable,
            "-m",
            "hwid_cli",
            "run",
            DEMO,
            "--out",
            tmp_path / jobs,
        ]
        subprocess.run([*words, "--jobs", jobs], check=True, capture_output=True)

    assert_same(tmp_path / "1", tmp_path / "2")
