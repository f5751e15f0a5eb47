"""An error at each write in turn: one line, earlier results whole, and on it goes."""

import errno
import shutil
import sys

import pytest

from tests.reliability import harness
from tests.reliability.write_faults import fault

# Every kind of file at least once, and as few entries as can be.
SMALL = (
    harness.CONFIG.replace("sine_12, random_02", "random_02")
    .replace("  sine: [cut, input_offset, output_offset, recut]\n", "")
    .replace("nb: [1, 2], nk: [1, 3]", "nb: 1, nk: 1")
)
ERRORS = (errno.ENOSPC, errno.EIO, errno.EROFS, errno.EDQUOT)


@pytest.fixture
def small(tmp_path):
    return harness.write_config(tmp_path, SMALL)


@pytest.fixture
def whole(small, tmp_path):
    """Results, and the changes that making them takes."""
    out = tmp_path / "whole"
    with fault(out, 0, errno.EIO) as seen:
        harness.run_here(small, out, command="run")
    return harness.results(out), list(seen)


def check_fault(small, out, number, whole):
    """Let one write fail; say what became of it."""
    expected, _ = whole
    with fault(out, number, ERRORS[number % len(ERRORS)]) as seen:
        done = harness.run_here(small, out, command="run", code=None)
    event = f"{number}: {seen[number - 1]}: {done.output}"
    assert done.exception is None or isinstance(done.exception, SystemExit), event
    if done.exit_code == 0:
        # What may fail: cleaning up, and notes for people.
        assert harness.results(out) == expected, event
    else:
        assert done.exit_code == 1, event
        assert done.stderr.count("\n") == 1, event
    if out.exists():
        harness.assert_readable(out)
    before = harness.entries(out)
    again = harness.run_here(small, out, command="run")
    now = harness.entries(out)
    assert {name: now[name] for name in before} == before, event
    assert harness.results(out) == expected, event
    assert harness.temporary_files(out) == [], event
    assert "hwid: " not in again.stderr, event
    return done.exit_code


@pytest.mark.slow
@pytest.mark.usefixtures("blank_figures")
def test_an_error_at_each_write_in_turn(small, tmp_path, whole):
    out = tmp_path / "out"
    codes = []
    for number in range(1, len(whole[1]) + 1):
        codes.append(check_fault(small, out, number, whole))
        shutil.rmtree(out)
        sys.stdout.write(f"\r{number} of {len(whole[1])} writes")
        sys.stdout.flush()
    sys.stdout.write(
        f"\n{len(codes)} writes failed in turn, {codes.count(0)} of no consequence\n"
    )
    assert codes.count(1) > 50


@pytest.mark.slow
@pytest.mark.usefixtures("blank_figures")
def test_errors_at_some_writes(small, tmp_path, whole):
    last = len(whole[1])
    for number in (last // 3, last - 1):
        out = tmp_path / f"out{number}"
        check_fault(small, out, number, whole)
