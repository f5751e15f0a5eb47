"""Two runs at once: never on one folder of results, as many as one likes on a cache."""

import os
import platform
import re
import shutil

import pytest

from hwid_cli.files.locks import RUN_LOCK, claim_folder, share_folder
from tests.reliability import harness

JOBS = ("--jobs", "1")


def test_the_second_run_on_a_folder_is_refused_in_one_line(config, out):
    out.mkdir()
    with claim_folder(out):
        done = harness.run_here(config, out, code=1)

        assert re.fullmatch(
            rf"hwid: {out}: in use by process {os.getpid()} on {platform.node()} "
            r"since 2\d{3}-.*; expected one run at a time on a folder of results; wait "
            r"until that one has ended or stop it, or choose another folder with --out\n",
            done.stderr,
        )
        assert not (out / "raw").exists()


@pytest.mark.slow
def test_looking_at_results_needs_no_lock(config, out, undisturbed):
    shutil.copytree(undisturbed, out)
    with claim_folder(out):
        harness.run_here(config, out, command="report")


def test_a_lock_that_a_dead_process_has_signed_is_taken_over(out):
    out.mkdir()
    (out / RUN_LOCK).write_text('{"pid": 1, "host": "elsewhere", "since": "ever"}')
    with claim_folder(out):
        assert str(os.getpid()) in (out / RUN_LOCK).read_text()


def test_half_written_files_stay_while_somebody_may_be_writing_them(out):
    out.mkdir()
    litter = out / f".x.csv.{'a' * 32}.tmp"
    litter.write_text("half")
    with share_folder(out):
        assert not litter.exists()
        litter.write_text("half")
        with share_folder(out):
            assert litter.exists()


def test_no_file_of_the_users_is_taken_for_litter(out):
    out.mkdir()
    names = (".notes.tmp", "x.tmp", ".x.csv.tmp", f"x.{'a' * 32}.tmp")
    for name in names:
        (out / name).write_text("mine")
    with share_folder(out):
        assert all((out / name).exists() for name in names)


@pytest.mark.slow
def test_a_run_is_refused_while_another_process_works_and_not_after_it_is_killed(
    config, out, undisturbed
):
    process = harness.start(config, out, *JOBS, command="test")
    harness.wait_for_entries(process, out, 1)
    done = harness.run_here(config, out, code=1)
    assert f"in use by process {process.pid} on" in done.stderr
    harness.kill(process)
    process.communicate()
    harness.run_here(config, out)

    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.slow
def test_two_runs_share_a_cache(config, tmp_path, undisturbed):
    cache = ("--cache", tmp_path / "shared" / "cache")
    outs = [tmp_path / name for name in ("a", "b", "c")]
    running = [harness.start(config, out, *JOBS, *cache) for out in outs]
    for process in running:
        _, complaint = process.communicate(timeout=120)
        assert process.returncode == 0, complaint
        told = complaint.splitlines()
        assert all("(stage " in line for line in told), complaint
    for out in outs:
        assert harness.results(out) == harness.results(undisturbed)
    shared = harness.entries(tmp_path / "shared")
    assert shared.keys() == harness.entries(undisturbed).keys()
    assert harness.temporary_files(tmp_path) == []
