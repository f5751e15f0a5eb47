import hashlib
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest

from hwid_cli.errors import CacheError
from hwid_cli.records.model import Fit, Orders
from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.store import cache
from hwid_cli.store.cache import Hdf5Store
from tests.store.record_examples import assert_same, example_fit

KEY = "ab" + "0" * 62


@pytest.fixture
def store(tmp_path):
    return Hdf5Store(tmp_path / "cache")


@pytest.fixture
def entry(store, tmp_path):
    """Path of an entry that has been put."""
    store.put(KEY, example_fit())
    return tmp_path / "cache" / "ab" / f"{KEY}.h5"


def test_entry_is_one_file_in_a_folder_by_its_first_digits(entry):
    with h5py.File(entry, "r") as file:
        assert file.attrs["format"] == "hwid-cache"
        assert file.attrs["key"] == KEY
        assert file.attrs["record"] == "Fit"


def damage_half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def damage_all(path):
    path.write_bytes(b"")


def damage_noise(path):
    path.write_bytes(b"not HDF5 at all" * 100)


def damage_bytes(path):
    content = bytearray(path.read_bytes())
    content[600:3000] = bytes(2400)
    path.write_bytes(bytes(content))


def change(path, alter):
    """Change an entry as another version of the program would, checksum and all."""
    content = path.read_bytes()[:-32]
    with h5py.File(h5py.h5f.open_file_image(content, flags=1)) as file:
        alter(file)
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image + hashlib.sha256(image).digest())


def damage_status(path):
    change(path, lambda file: file["record"].attrs.__setitem__("status", "invented"))


def damage_field(path):
    change(path, lambda file: file.pop("record/poles"))


def damage_version(path):
    other = cache.SCHEMA_VERSION + 1
    change(path, lambda file: file.attrs.__setitem__("schema_version", other))


def damage_one_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (damage_half, "content and checksum do not match"),
        (damage_all, "content and checksum do not match"),
        (damage_noise, "content and checksum do not match"),
        (damage_bytes, "content and checksum do not match"),
        (damage_one_bit, "content and checksum do not match"),
        (damage_status, "status 'invented' is none of"),
        (damage_field, "poles"),
        (damage_version, "holds hwid-cache version 2, expected hwid-cache 1"),
    ],
)
def test_unusable_entry_is_reported_set_aside_and_made_again(
    store, entry, damage, reason
):
    damage(entry)
    assert store.get(KEY, Fit) is None
    (said,) = store.unusable
    assert said.startswith(f"{entry}: ")
    assert reason in said
    assert not entry.exists()
    assert entry.with_suffix(".bad").exists()
    store.put(KEY, example_fit())
    assert_same(store.get(KEY, Fit), example_fit())
    assert len(store.unusable) == 1


def test_entry_of_another_record_type_is_not_given_out(store, entry):
    assert store.get(KEY, Orders) is None
    assert "holds a Fit, no Orders" in store.unusable[0]


def test_entry_that_may_not_be_read_now_is_left_alone(store, entry, monkeypatch):
    def refuse(self):
        raise OSError(24, "Too many open files")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    assert store.get(KEY, Fit) is None
    assert "Too many open files" in store.unusable[0]
    assert entry.exists()


def test_entry_that_cannot_be_set_aside_is_reported(store, entry, monkeypatch):
    damage_noise(entry)

    def refuse(self, target):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "replace", refuse)
    assert store.get(KEY, Fit) is None
    assert "Read-only file system" in store.unusable[-1]


def test_full_disk_is_one_clear_line_and_keeps_the_old_entry(store, entry, monkeypatch):
    def fail(self, target):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", fail)
        with pytest.raises(CacheError, match=r"cannot be written \(No space left"):
            store.put(KEY, example_fit(seed=9))
    assert_same(store.get(KEY, Fit), example_fit())


def test_store_can_be_sent_to_a_worker(store, entry):
    twin = pickle.loads(pickle.dumps(store))
    assert_same(twin.get(KEY, Fit), example_fit())


PUT_FOR_EVER = """
import sys
from pathlib import Path
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.records.recordings import CalibrationLog

store = Hdf5Store(Path(sys.argv[1]))
for number in range(10**9):
    log = CalibrationLog(f"n{number}", ("cut",) * 500, number, 2, 3, 4)
    store.put(f"{number % 40:064x}", log)
    print(number, flush=True)
"""


@pytest.mark.thorough
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
@pytest.mark.parametrize(
    "pause_s",
    [0.003, *(pytest.param(one, marks=pytest.mark.slow) for one in (0.0, 0.011))],
)
def test_killing_the_writer_leaves_only_whole_entries(tmp_path, pause_s):
    process = subprocess.Popen(
        [sys.executable, "-c", PUT_FOR_EVER, str(tmp_path)],
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        # Twice round all keys, so that entries are replaced when the end comes.
        last = next(int(line) for line in process.stdout if int(line) >= 85)
        time.sleep(pause_s)
        process.kill()
    store = Hdf5Store(tmp_path)
    logs = [store.get(f"{number:064x}", CalibrationLog) for number in range(40)]
    assert all(log is not None and len(log.steps) == 500 for log in logs)
    assert logs[last % 40].first_sample >= last
    assert store.unusable == []
