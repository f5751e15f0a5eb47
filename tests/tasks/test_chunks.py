from collections import deque

import pytest

from hwid_cli.errors import WorkerError
from hwid_cli.tasks import chunks
from hwid_cli.tasks.chunks import Chunks
from hwid_cli.tasks.task import Task


def waiting(count):
    return Chunks(
        [Task(f"key {n}", f"task {n}", sum, ((n,),), int) for n in range(count)]
    )


def keys(chunk):
    return [task.key for task in chunk]


def test_the_first_chunks_hold_one_task():
    found = waiting(100)
    assert keys(found.take(2)) == ["key 0"]
    assert keys(found.take(2)) == ["key 1"]


def test_chunks_last_as_long_as_they_shall():
    found = waiting(1000)
    found.is_done(found.take(2), chunks.CHUNK_S / 5)
    assert keys(found.take(2)) == [f"key {n}" for n in range(1, 6)]


def test_short_tasks_are_not_packed_without_limit():
    found = waiting(1000)
    found.is_done(found.take(2), 1e-9)
    assert len(found.take(2)) == chunks.MOST_IN_CHUNK


def test_the_last_tasks_are_divided_among_all():
    found = waiting(43)
    found.is_done(found.take(2), chunks.LEAST_CHUNK_S / 2)
    sizes = []
    while found:
        sizes.append(len(found.take(2)))
    assert sizes == [7, 5, 5, 4, 3, 3, 2, 2, 2, 2, 2, 2, 2, 1]


def test_the_last_tasks_do_not_wait_for_one_worker_to_take_them_all():
    found = waiting(4)
    found.is_done(found.take(2), 1e-9)
    assert [len(found.take(2)) for _ in range(2)] == [2, 1]


def test_a_round_goes_on_at_the_pace_of_the_one_before():
    recent = deque(maxlen=chunks.RECENT)
    first = Chunks([Task("k", "t", sum, ((1,),), int)], recent)
    first.is_done(first.take(2), chunks.CHUNK_S / 4)
    tasks = [Task(f"k {n}", "t", sum, ((1,),), int) for n in range(99)]
    assert len(Chunks(tasks, recent).take(2)) == 4


def test_a_chunk_over_which_workers_died_is_taken_apart():
    found = waiting(3)
    found.is_done(found.take(1), 1e-9)
    chunk = found.take(1)
    assert len(chunk) == 2
    assert found.has_died(chunk) == "task 1, task 2"
    assert [keys(found.take(1)) for _ in range(2)] == [["key 1"], ["key 2"]]
    assert not found
    found.check()


def test_a_task_over_which_workers_die_twice_is_given_up_and_named():
    found = waiting(2)
    for _ in range(2):
        found.has_died(found.take(2))
    assert keys(found.take(2)) == ["key 1"]
    assert not found
    with pytest.raises(WorkerError, match="task 0: workers died"):
        found.check()
