"""Disks that are full or read-only, and folders that are not there."""

import os
import subprocess
import sys

import pytest

from tests.reliability import harness


@pytest.fixture
def disk(tmp_path):
    """Mount a disk of some size; only an administrator may."""
    folder = tmp_path / "disk"
    folder.mkdir()

    def mount(options):
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            pytest.skip("may not mount a disk")
        return folder

    yield mount
    subprocess.run(["umount", str(folder)], capture_output=True, check=False)


def remount(folder, options):
    subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("size_kb", [40, 200, 400, 600])
def test_a_full_disk_is_one_line_and_the_run_goes_on_when_there_is_room(
    config, disk, undisturbed, size_kb
):
    folder = disk(f"size={size_kb}k")
    out = folder / "out"
    process = harness.start(config, out, "--jobs", "2", command="run")
    _, complaint = process.communicate(timeout=120)

    assert process.returncode == 1, complaint
    assert complaint.count("\n") == 1
    assert "No space left on device" in complaint
    harness.assert_readable(out)
    before = harness.entries(out)
    remount(folder, "size=50m")
    said = harness.finish(config, out, "--jobs", "1")
    assert harness.count_computed(said) == len(harness.entries(out)) - len(before)
    assert harness.results(out) == harness.results(undisturbed)
    assert harness.temporary_files(out) == []


@pytest.mark.slow
def test_a_read_only_disk_is_one_line_and_its_results_can_be_looked_at(
    config, disk, undisturbed
):
    folder = disk("size=50m")
    out = folder / "out"
    harness.run_here(config, out, command="run")
    remount(folder, "ro")
    done = harness.run_here(config, out, code=1)
    assert done.stderr.count("\n") == 1
    assert "Read-only file system" in done.stderr
    harness.run_here(config, out, command="report")

    remount(folder, "rw")
    harness.run_here(config, out)
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("most_bytes", [4_000, 40_000])
def test_a_quota_for_each_file_is_one_line(config, out, undisturbed, most_bytes):
    import resource

    def limit():
        # Without this the system ends the process instead of refusing to write.
        harness.signal.signal(harness.signal.SIGXFSZ, harness.signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    process = harness.start(config, out, "--jobs", "1", command="test", hear=limit)
    _, complaint = process.communicate(timeout=60)

    assert process.returncode == 1, complaint
    assert complaint.count("\n") == 1
    assert "File too large" in complaint
    assert harness.temporary_files(out) == []
    harness.run_here(config, out)
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["--out", "--cache"])
def test_a_file_in_the_place_of_a_folder_is_one_line(config, out, tmp_path, name):
    (tmp_path / "file").write_text("")
    options = [] if name == "--out" else [name, str(tmp_path / "file")]
    folder = tmp_path / "file" if name == "--out" else out
    done = harness.run_here(config, folder, *options, code=1)

    assert done.stderr.count("\n") == 1
    assert f"{tmp_path / 'file'}" in done.stderr
    assert (tmp_path / "file").read_text() == ""


@pytest.mark.slow
def test_a_folder_that_is_gone_is_one_line(config, tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    code = (
        "import os, sys; os.rmdir(os.getcwd()); "
        "from hwid_cli.cli.main import main; main(sys.argv[1:])"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    for arguments in (["run", "tiny.yaml"], ["simulate", str(config)]):
        gone.mkdir(exist_ok=True)
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            cwd=gone,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 1, done.stderr
        assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_screen_that_takes_nothing_is_one_line(config, out):
    with open("/dev/full", "w") as screen:  # noqa: PTH123
        done = subprocess.run(
            [sys.executable, "-m", "hwid_cli", "simulate", config, "--out", out],
            stdout=screen,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )

    assert done.returncode == 1
    # Behind the line that tells the stage.
    told, complaint = done.stderr.splitlines()
    assert "(stage 1 of 1)" in told
    assert "No space left on device" in complaint
