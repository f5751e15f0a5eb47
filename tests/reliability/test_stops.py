"""Ctrl-C, ``kill`` and a terminal that closes: soon, one line, and nobody left behind."""

import os
import re
import signal
import time

import pytest

from tests.reliability import harness

# Fits of seconds each, so that signals meet workers that compute.
LONG = (
    harness.CONFIG.replace("samples: 400", "samples: 1200")
    .replace("starts: 1, max_iterations: 4", "max_iterations: 60")
    .replace("units: 3", "units: 8")
)
# The promise is two seconds on a machine that does nothing else.
MOST_SECONDS = 2.0
SIGNALS = [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)]


def stop(process, name, *, whole_group):
    """Send a signal, and give what was said and how long the end took."""
    begin = time.monotonic()
    number = getattr(signal, name)
    (os.killpg if whole_group else os.kill)(process.pid, number)
    _, complaint = process.communicate(timeout=30)
    return complaint, time.monotonic() - begin


def assert_clean(process, complaint, code):
    assert process.returncode == code, complaint
    assert harness.wait_until_gone(process.pid, 2) == []
    return re.fullmatch(
        r"hwid: interrupted(?: by SIG\w+)?; (\d+) finished results are kept in \S+; "
        r"run the same command again to go on\n",
        complaint,
    )


@pytest.mark.slow
@pytest.mark.parametrize(("name", "code"), SIGNALS)
@pytest.mark.parametrize("jobs", ["1", "2"])
@pytest.mark.parametrize("whole_group", [False, True], ids=["one", "group"])
@pytest.mark.parametrize("count", [1, 5])
def test_a_signal_ends_a_run_soon_with_one_line(
    tmp_path, out, name, code, jobs, whole_group, count
):
    config = harness.write_config(tmp_path, LONG)
    process = harness.start(config, out, "--jobs", jobs, command="identify")
    harness.wait_for_entries(process, out, count)
    complaint, seconds = stop(process, name, whole_group=whole_group)
    found = assert_clean(process, complaint, code)

    assert found is not None, complaint
    assert int(found[1]) == len(harness.entries(out)) >= count
    assert seconds < MOST_SECONDS
    harness.assert_readable(out)


@pytest.mark.slow
@pytest.mark.parametrize("delay_s", [0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.7, 2.0, 2.3, 2.6])
def test_a_signal_while_the_program_starts_leaves_no_traceback(config, out, delay_s):
    process = harness.start(config, out, "--jobs", "2", command="identify")
    time.sleep(delay_s)
    complaint, seconds = stop(process, "SIGINT", whole_group=True)

    assert process.returncode == 130, complaint
    assert complaint.startswith("hwid: interrupted; ")
    assert complaint.count("\n") == 1
    assert seconds < MOST_SECONDS
    assert harness.wait_until_gone(process.pid, 2) == []


@pytest.mark.slow
def test_workers_end_when_the_program_alone_is_killed(tmp_path, out):
    config = harness.write_config(tmp_path, LONG)
    process = harness.start(config, out, "--jobs", "2", command="identify")
    harness.wait_for_entries(process, out, 3)
    process.kill()
    process.wait()

    assert harness.wait_until_gone(process.pid, 5) == []
    process.communicate()


@pytest.mark.slow
def test_nohup_stays_nohup(config, out):
    process = harness.start(
        config,
        out,
        "--jobs",
        "1",
        command="identify",
        hear=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    harness.wait_for_entries(process, out, 1)
    os.kill(process.pid, signal.SIGHUP)
    _, complaint = process.communicate(timeout=60)

    assert process.returncode == 0, complaint
