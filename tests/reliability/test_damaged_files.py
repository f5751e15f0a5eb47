"""Files that were torn, changed or written by another version: noticed, never believed."""

import hashlib
import os
import random
import shutil

import h5py
import pytest

from tests.reliability import harness

pytestmark = pytest.mark.thorough


def cut_off(content):
    return content[: len(content) // 2]


def flip_one_bit(content):
    changed = bytearray(content)
    changed[random.Random(len(content)).randrange(len(changed))] ^= 4
    return bytes(changed)


def blank_the_end(content):
    # A page that never reached the disk.
    return content[:-512] + bytes(512)


def empty(content):
    return b""


def noise(content):
    return random.Random(3).randbytes(len(content))


# Of all kinds, the one that HDF5 does not notice is tried in every run of the tests.
DAMAGES = [
    flip_one_bit,
    *(
        pytest.param(damage, marks=pytest.mark.slow)
        for damage in (cut_off, blank_the_end, empty, noise)
    ),
]


@pytest.fixture
def run(config, undisturbed, out):
    """Copy a finished campaign, and run it again in this process."""
    shutil.copytree(undisturbed, out)

    def again(command="test", code=0):
        return harness.run_here(config, out, command=command, code=code)

    return again


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_entries_are_counted_in_one_line_and_computed_again(
    run, out, undisturbed, damage
):
    # Tasks of the stages, and linear models that are fitted at the end of a run.
    paths = sorted((out / "cache").glob("??/*.h5"))[::20]
    for path in paths:
        path.write_bytes(damage(path.read_bytes()))
    (out / "results.h5").unlink()
    done = run()

    # Beside what the stages say of themselves.
    lines = [one for one in done.stderr.splitlines() if one.startswith("hwid: ")]
    assert all("damaged" in one for one in lines)
    assert sum(int(line.split(": ")[2].split()[0]) for line in lines) == len(paths)
    assert harness.count_computed(done.stderr) == len(paths)
    assert harness.results(out) == harness.results(undisturbed)
    assert len(list(out.rglob("*.bad"))) == len(paths)


@pytest.mark.parametrize(
    "name",
    # A bit of it is flipped below.
    [pytest.param("results.h5", marks=pytest.mark.slow), "calibrated.h5"],
)
@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_results_come_back_from_the_cache(run, out, undisturbed, name, damage):
    path = out / name
    path.write_bytes(damage(path.read_bytes()))
    done = run()

    assert "Traceback" not in done.stderr
    assert harness.count_computed(done.stderr) == 0
    assert harness.results(out) == harness.results(undisturbed)
    harness.assert_readable(out)


def test_one_bit_of_a_number_that_hdf5_cannot_notice_is_not_believed(
    run, out, undisturbed
):
    path = out / "results.h5"
    content = bytearray(path.read_bytes())
    content[content.index(harness.results(undisturbed)["test/rmsd"]) + 3] ^= 1
    path.write_bytes(content)
    assert harness.results(out) != harness.results(undisturbed)
    done = run()

    assert "results.h5: cannot be read; set aside as results.h5.bad" in done.stderr
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.slow
def test_a_changed_number_in_the_results_is_not_shown(run, out):
    path = out / "results.h5"
    with h5py.File(path, "r+") as file:
        file["crossval/rmsd"][0, 0, 0, 0] = 1e-9
    done = run(command="report", code=1)

    assert done.stderr.count("\n") == 1
    assert "results.h5: cannot be read (its checksum is gone" in done.stderr


@pytest.mark.slow
def test_entries_of_another_version_are_set_aside(run, out, undisturbed):
    paths = sorted((out / "cache").glob("??/*.h5"))
    for path in paths:
        with h5py.File(h5py.h5f.open_file_image(path.read_bytes()[:-32], 1)) as file:
            file.attrs["schema_version"] = 99
            file.flush()
            image = file.id.get_file_image()
        path.write_bytes(image + hashlib.sha256(image).digest())
    (out / "results.h5").unlink()
    done = run()

    assert "18 damaged entries" in done.stderr
    assert "version 99, expected hwid-cache 1" in done.stderr
    assert harness.results(out) == harness.results(undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("time_s", [0, 2**31, 2**33])
def test_file_times_mean_nothing(run, out, undisturbed, time_s):
    for path in out.rglob("*"):
        os.utime(path, (time_s, time_s))
    (out / "results.h5").unlink()
    done = run()

    assert harness.count_computed(done.stderr) == 0
    assert "simulate: measurements from the cache" in done.stderr
    assert "calibrate: 4 recordings from the cache" in done.stderr
    assert harness.results(out) == harness.results(undisturbed)
