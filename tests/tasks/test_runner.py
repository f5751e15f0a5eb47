import subprocess
import sys
import textwrap

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from hwid_cli.errors import ConfigError
from hwid_cli.records.model import Orders
from hwid_cli.tasks import workers
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, Task, Workers, run_tasks


def order_tasks(count=6, **changes):
    # Orders is a function that workers can import, and its result is a record.
    return [
        Task(f"key{n}", f"task {n}", Orders, (n + 1, 2, 1), Orders, **changes)
        for n in range(count)
    ]


def results_of(done):
    return [item.result for item in done]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_back_in_the_order_of_the_tasks(jobs):
    tasks = order_tasks()
    done = run_tasks(tasks, RunSettings(MemoryStore(), Workers(jobs)))

    assert results_of(done) == [Orders(n + 1, 2, 1) for n in range(6)]
    assert [item.task for item in done] == tasks
    assert not any(item.from_cache for item in done)


def test_what_the_store_has_is_not_computed():
    store = MemoryStore()
    store.put("key2", Orders(9, 9, 9))
    done = run_tasks(order_tasks(), RunSettings(store, Workers(1)))

    assert [item.from_cache for item in done] == [n == 2 for n in range(6)]
    assert done[2].result == Orders(9, 9, 9)


def test_force_computes_again_and_replaces_what_was_kept():
    store = MemoryStore()
    store.put("key2", Orders(9, 9, 9))
    done = run_tasks(order_tasks(), RunSettings(store, Workers(1), force=True))

    assert done[2].result == store.get("key2", Orders) == Orders(3, 2, 1)


def test_force_spares_what_was_computed_with_the_same_settings():
    settings = RunSettings(MemoryStore(), Workers(1), force=True)
    run_tasks(order_tasks(), settings)
    again = run_tasks(order_tasks(), settings)

    assert all(item.from_cache for item in again)


def test_each_result_is_stored_before_it_is_reported():
    store, seen = MemoryStore(), []

    def on_done(item):
        assert store.get(item.task.key, Orders) == item.result
        seen.append(item.task.name)

    run_tasks(order_tasks(), RunSettings(store, Workers(1), on_done=on_done))

    assert sorted(seen) == [f"task {n}" for n in range(6)]


def test_tasks_of_the_same_content_are_computed_once():
    calls = []

    def count():
        calls.append(1)
        return Orders(1, 1, 1)

    tasks = [Task("same", f"task {n}", count, (), Orders) for n in range(3)]
    done = run_tasks(tasks, RunSettings(MemoryStore(), Workers(1)))

    assert len(calls) == 1
    assert results_of(done) == 3 * [Orders(1, 1, 1)]


def test_linear_algebra_runs_on_one_thread_in_a_task():
    def most_threads():
        return max((pool["num_threads"] for pool in threadpool_info()), default=1)

    task = Task("k", "t", most_threads, (), int)
    # The tests themselves run with one thread, which would hide that nobody limits them.
    with threadpool_limits(2):
        assert most_threads() == 2
        (done,) = run_tasks([task], RunSettings(MemoryStore(), Workers(1)))
    assert done.result == 1


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_exception_in_a_task_is_a_bug_and_comes_through(jobs, monkeypatch):
    # The first task of a function runs here, before the one that fails is handed out.
    monkeypatch.setattr(workers, "_compiled", set())
    tasks = [*order_tasks(3), Task("bad", "bad", Orders, (0, 0, 0), Orders)]
    store = MemoryStore()
    with pytest.raises(ValueError, match="nb must be an integer >= 1"):
        run_tasks(tasks, RunSettings(store, Workers(jobs)))

    assert store.get("key0", Orders) is not None


def test_no_tasks_start_no_workers():
    assert run_tasks([], RunSettings(MemoryStore(), Workers(2))) == ()


def test_an_unknown_backend_is_refused():
    with pytest.raises(ConfigError, match="backend 'ray' is unknown; expected loky"):
        run_tasks(order_tasks(), RunSettings(MemoryStore(), Workers(2, "ray")))


def test_dask_that_is_not_installed_is_named_with_the_way_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=r"pip install 'hwid\[dask\]'"):
        run_tasks(order_tasks(), RunSettings(MemoryStore(), Workers(2, "dask")))


# Sixty tasks of a tenth of a second; the fifth result interrupts the whole group, as
# Ctrl-C in a terminal does.
INTERRUPTED = """
    import os, signal, sys, time
    from pathlib import Path
    from hwid_cli.tasks.runner import RunSettings, Task, Workers, run_tasks
    from hwid_cli.store.cache import Hdf5Store
    from hwid_cli.records.model import Orders

    def slow(n):
        time.sleep(0.1)
        return Orders(n, 1, 1)

    # A shell that starts this in the background has it ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    seen = []

    def on_done(item):
        seen.append(item)
        if len(seen) == 5:
            os.killpg(0, signal.SIGINT)

    tasks = [Task(f"{n:064x}", str(n), slow, (n,), Orders) for n in range(1, 60)]
    try:
        run_tasks(
            tasks,
            RunSettings(Hdf5Store(Path(sys.argv[1])), Workers(2), on_done=on_done),
        )
    except KeyboardInterrupt:
        print("interrupted after", len(seen))
        sys.exit(130)
"""


@pytest.mark.thorough
def test_an_interrupt_keeps_what_was_finished_and_stops_the_workers(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(INTERRUPTED), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=60,
        start_new_session=True,
        check=False,
    )

    assert done.returncode == 130, done.stderr
    assert "interrupted after 5" in done.stdout
    assert "Traceback" not in done.stderr
    assert len(list(tmp_path.rglob("*.h5"))) == 5
