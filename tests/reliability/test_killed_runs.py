"""``kill -9`` of whole runs: nothing that was finished is lost, and nothing is broken."""

import random
import shutil
import sys

import pytest

from tests.reliability import harness

JOBS = ("--jobs", "2")


def assert_whole(out, before, said, undisturbed):
    """A restarted campaign ended as if nothing had happened."""
    now = harness.entries(out)
    # What was there has been read, not written again.
    assert {name: now[name] for name in before} == before
    assert harness.count_computed(said) == len(now) - len(before)
    assert harness.results(out) == harness.results(undisturbed)
    assert harness.temporary_files(out) == []
    assert list(out.rglob("*.bad")) == []


def kill_when(config, out, count, jobs):
    process = harness.start(config, out, "--jobs", jobs, command="test")
    harness.wait_for_entries(process, out, count)
    harness.kill(process)
    _, complaint = process.communicate()
    assert process.returncode == -harness.signal.SIGKILL, complaint
    assert harness.wait_until_gone(process.pid, 5) == []


@pytest.mark.slow
def test_three_kills_lose_nothing_and_leave_nothing(config, out, undisturbed):
    # Workers take a second each to start.
    for count, jobs in ((1, "1"), (5, "2"), (20, "1")):
        kill_when(config, out, count, jobs)
        harness.assert_readable(out)
    # As a kill in the middle of a write leaves them.
    litter = f".x.h5.{'0' * 32}.tmp"
    for folder in (out, out / "raw", next((out / "cache").glob("??"))):
        (folder / litter).write_bytes(b"half")
    before = harness.entries(out)
    said = harness.finish(config, out, "--jobs", "1", command="test")

    assert len(before) >= 20
    assert_whole(out, before, said, undisturbed)


@pytest.mark.slow
def test_a_hundred_kills_at_random_moments(config, out, undisturbed):
    rng = random.Random(20)
    kills = campaigns = longest = 0
    while kills < 100:
        process = harness.start(config, out, *JOBS)
        try:
            said, complaint = process.communicate(timeout=rng.uniform(0.3, 5.0))
        except harness.subprocess.TimeoutExpired:
            harness.kill(process)
            process.communicate()
            kills += 1
            harness.assert_readable(out)
            before, longest = harness.entries(out), longest + 1
            if longest < 12:
                continue
            said, complaint = harness.finish(config, out, *JOBS), ""
        else:
            assert process.returncode == 0, complaint
        assert "Traceback" not in said + complaint
        assert_whole(out, before if longest else {}, said + complaint, undisturbed)
        campaigns, longest = campaigns + 1, 0
        shutil.rmtree(out)
    sys.stdout.write(f"\n{kills} kills in {campaigns} campaigns, nothing lost\n")
