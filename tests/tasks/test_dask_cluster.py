"""Tasks on a real scheduler with real workers, on this machine."""

import os
import signal
import time

import numpy as np
import pytest

from hwid_cli.errors import ConfigError, WorkerError
from hwid_cli.tasks import cluster
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, run_tasks
from hwid_cli.tasks.task import Task
from hwid_cli.tasks.workers import Workers
from tests import dask_processes

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    with dask_processes.scheduler(tmp_path_factory.mktemp("dask")) as (found, _):
        yield found


def slow_sum(values, offset, seconds):
    time.sleep(seconds)
    return float(values.sum() + offset)


def fatal(values, offset, seconds):
    os.kill(os.getpid(), signal.SIGKILL)


def failing(values, offset, seconds):
    raise ValueError(f"no {offset}")


VALUES = np.arange(5000.0)


def tasks_of(function, count, seconds=0.0):
    return [
        Task(f"key {n}", f"task {n}", function, (VALUES, n, seconds), float)
        for n in range(count)
    ]


def settings(scheduler, on_done=None):
    return RunSettings(MemoryStore(), Workers(None, "dask", scheduler), on_done=on_done)


@pytest.mark.thorough
def test_results_and_errors_are_those_of_this_process(address, tmp_path):
    with dask_processes.workers(address, tmp_path):
        there = run_tasks(tasks_of(slow_sum, 60), settings(address))
        with pytest.raises(ValueError, match="no 0"):
            run_tasks(tasks_of(failing, 1), settings(address))
    here = run_tasks(tasks_of(slow_sum, 60), RunSettings(MemoryStore(), Workers(1)))
    assert [one.result for one in there] == [one.result for one in here]
    assert [one.task.name for one in there] == [one.task.name for one in here]


@pytest.mark.slow
def test_a_large_argument_is_sent_once(address, tmp_path):
    with dask_processes.workers(address, tmp_path):
        run_tasks(tasks_of(slow_sum, 40), settings(address))
        connected = cluster._cluster(address, Workers().count)
        sent = [one for one, _ in connected._sent.values() if one is VALUES]
    assert len(sent) == 1


@pytest.mark.slow
def test_nothing_is_lost_when_one_of_two_workers_is_killed(address, tmp_path):
    done = []
    with dask_processes.workers(address, tmp_path) as numbers:

        def kill_one(item):
            done.append(item.task.name)
            if len(done) == 5:
                os.kill(numbers[0], signal.SIGKILL)

        found = run_tasks(tasks_of(slow_sum, 40, 0.05), settings(address, kill_one))
    assert [one.result for one in found] == [VALUES.sum() + n for n in range(40)]
    assert sorted(done) == sorted(f"task {n}" for n in range(40))


@pytest.mark.slow
def test_a_task_that_kills_its_workers_is_named(address, tmp_path):
    store = MemoryStore()
    mixed = [*tasks_of(slow_sum, 3), *tasks_of(fatal, 5)[4:]]
    there = RunSettings(store, Workers(None, "dask", address))
    with (
        dask_processes.workers(address, tmp_path, count=5),
        pytest.raises(WorkerError, match="task 4: workers died over it"),
    ):
        run_tasks(mixed, there)
    # All the others are done all the same.
    assert all(store.get(f"key {n}", float) is not None for n in range(3))


def test_a_worker_of_another_version_is_refused():
    with pytest.raises(ConfigError, match=r"a worker has hwid .*; expected 0\.0\.0"):
        cluster.run_chunk("0.0.0", [])


@pytest.mark.thorough
def test_a_scheduler_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT_S", 0.5)
    with pytest.raises(ConfigError, match=r"--scheduler tcp://127\.0\.0\.1:9: "):
        run_tasks(tasks_of(slow_sum, 1), settings("tcp://127.0.0.1:9"))
