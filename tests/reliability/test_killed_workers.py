"""A worker that the system kills: its tasks are tried once more, and the rest is kept."""

import os
import re
import signal
from pathlib import Path

import pytest

from hwid_cli.errors import WorkerError
from hwid_cli.records.model import Orders
from hwid_cli.tasks import workers
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Task, Workers, run_tasks


def orders_after_deaths(number, deaths, folder, by=signal.SIGKILL):
    """Orders, after so many workers have died of making them."""
    begun = Path(folder) / f"{number}-{os.getpid()}"
    if len(list(Path(folder).glob(f"{number}-*"))) < deaths:
        begun.touch()
        # As the system does when memory runs out: without a word.
        os.kill(os.getpid(), by)
    return Orders(number, 1, 1)


@pytest.fixture
def tasks(tmp_path, monkeypatch):
    """Tasks of which the fifth kills its worker so many times."""
    # The first task would run in this process.
    monkeypatch.setattr(workers, "_compiled", {orders_after_deaths})

    def make(deaths, by=signal.SIGKILL):
        return [
            Task(
                f"{n:064x}",
                f"step_{n:02d}/1/1",
                orders_after_deaths,
                (n, deaths if n == 5 else 0, str(tmp_path), by),
                Orders,
            )
            for n in range(1, 13)
        ]

    return make


@pytest.mark.slow
def test_the_tasks_of_a_killed_worker_are_tried_once_more(tasks, caplog):
    store = MemoryStore()
    done = run_tasks(tasks(1), RunSettings(store, Workers(2)))

    assert [item.result for item in done] == [Orders(n, 1, 1) for n in range(1, 13)]
    (record,) = caplog.records
    assert re.fullmatch(
        r"a worker was killed by the system \(SIGKILL\(-9\)\), most likely for lack of "
        r"memory; under way were .*; tried once more, one at a time",
        record.getMessage(),
    )


@pytest.mark.slow
def test_memory_is_blamed_for_one_signal_only(tasks, caplog):
    made = tasks(99, by=signal.SIGTERM)
    with pytest.raises(WorkerError) as refused:
        run_tasks(made, RunSettings(MemoryStore(), Workers(2)))

    assert "SIGTERM(-15)" in str(refused.value)
    said = [str(refused.value), *(one.getMessage() for one in caplog.records)]
    assert all("lack of memory" not in text for text in said)


@pytest.mark.slow
def test_a_task_that_kills_every_worker_is_named_and_the_rest_kept(tasks):
    store, made = MemoryStore(), tasks(99)
    with pytest.raises(WorkerError, match=r"^step_05/1/1: .*fewer processes \(--jobs"):
        run_tasks(made, RunSettings(store, Workers(2)))

    kept = [task for task in made if store.get(task.key, Orders) is not None]
    assert len(kept) >= 2


@pytest.mark.slow
def test_each_task_has_its_own_second_chance(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "_compiled", {orders_after_deaths})
    made = [
        Task(
            f"{n:064x}",
            str(n),
            orders_after_deaths,
            (n, int(n % 5 == 0), str(tmp_path)),
            Orders,
        )
        for n in range(1, 31)
    ]
    done = run_tasks(made, RunSettings(MemoryStore(), Workers(2)))

    assert [item.result for item in done] == [Orders(n, 1, 1) for n in range(1, 31)]
