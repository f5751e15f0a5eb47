"""File systems without locks: nothing is taken for damage, and all numbers are the same."""

import errno
import shutil
import subprocess
import sys

import pytest

from tests.reliability import harness, system_faults


def run(config, out, command, **faults):
    environment = system_faults.environment(**faults)
    words = [sys.executable, "-m", "hwid_cli", command, config, "--out", out]
    return subprocess.run(
        [*words, "--jobs", "1"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.thorough
@pytest.mark.parametrize("error", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS])
def test_a_lock_that_fails_is_no_damage(config, out, undisturbed, error):
    shutil.copytree(undisturbed, out)
    # The stage is written again into a file that holds others.
    with config.open("a") as file:
        file.write("order: {}\n")
    done = run(config, out, "order", locks=error)

    assert done.returncode == 0, done.stderr
    assert list(out.rglob("*.bad")) == []
    assert "cannot be read" not in done.stderr
    assert harness.count_computed(done.stdout) == 0
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.slow
def test_a_whole_campaign_needs_no_locks(config, out, undisturbed):
    done = run(config, out, "run", locks=errno.ENOLCK)

    assert done.returncode == 0, done.stderr
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.thorough
def test_results_that_the_disk_does_not_give_are_no_damage(config, out, undisturbed):
    """Reading fails while a stage is written again: whole results stay in place."""
    shutil.copytree(undisturbed, out)
    content = (out / "results.h5").read_bytes()
    done = run(
        config, out, "test", kind="read", folder=out / "results.h5",
        at=1, errno=errno.EIO,
    )  # fmt: skip

    assert done.returncode == 1, done.stdout
    assert "Traceback" not in done.stderr
    assert (out / "results.h5").read_bytes() == content
    assert list(out.rglob("*.bad")) == []
