"""All stages on a cluster of this machine, with a worker that is killed in mid-run."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests import dask_processes

pytest.importorskip("distributed")
CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"
PATIENCE_S = 300


def command(out, *options):
    words = ["run", str(CONFIG), "--out", str(out), *options]
    return [sys.executable, "-m", "hwid_cli", *words]


def stored(out):
    """All numbers of the results, by their place."""
    found = {}

    def note(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fi":
            found[name] = item[()]

    with h5py.File(out / "results.h5") as file:
        file.visititems(note)
    return {name: values for name, values in found.items() if "seconds" not in name}


def entries(out):
    return len(list((out / "cache").glob("??/*.h5")))


@pytest.mark.slow
def test_a_run_that_loses_a_worker_gives_the_numbers_of_local_workers(tmp_path):
    local, cluster = tmp_path / "local", tmp_path / "cluster"
    subprocess.run(command(local), check=True, capture_output=True)
    with (
        dask_processes.scheduler(tmp_path) as (address, _),
        dask_processes.workers(address, tmp_path) as numbers,
    ):
        run = subprocess.Popen(
            command(cluster, "--backend", "dask", "--scheduler", address),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        end = time.monotonic() + PATIENCE_S
        while entries(cluster) < 3 and time.monotonic() < end:
            time.sleep(0.01)
        os.kill(numbers[0], signal.SIGKILL)
        said, _ = run.communicate(timeout=PATIENCE_S)
    assert run.returncode == 0, said
    here, there = stored(local), stored(cluster)
    assert here.keys() == there.keys()
    for name, values in here.items():
        np.testing.assert_array_equal(values, there[name], err_msg=name)
    assert entries(local) == entries(cluster)


@pytest.mark.slow
def test_a_cluster_of_its_own_is_started_where_no_scheduler_is_named(tmp_path):
    options = ("--backend", "dask", "--jobs", "2", "--quiet")
    done = subprocess.run(
        command(tmp_path / "out", *options), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert stored(tmp_path / "out")
