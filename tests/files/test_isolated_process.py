"""The process that reads foreign files: its crashes, its end, and what it may send."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import pytest
import scipy.io

from hwid_cli.data import formats
from hwid_cli.data.formats import Reader, list_columns, read_columns
from hwid_cli.errors import MeasurementError
from hwid_cli.files.isolated_process import IsolatedReader
from hwid_cli.records.experiment import Columns

COLUMNS = Columns(input="u", output="y", time="t")
ARRAYS = {name: np.arange(5.0) for name in "tuy"}
# Longer than any process of a test takes to end, [s].
MOST_SECONDS = 20.0


@pytest.fixture
def good(tmp_path):
    np.savez(tmp_path / "good.npz", **ARRAYS)
    return tmp_path / "good.npz"


@pytest.fixture
def crashing(tmp_path):
    """Complex by its flags without such data: scipy was seen to crash on it."""
    path = tmp_path / "crash.mat"
    scipy.io.savemat(path, ARRAYS)
    content = bytearray(path.read_bytes())
    content[145] |= 0x08
    path.write_bytes(content)
    return path


@pytest.fixture
def endless(tmp_path):
    """A file that keeps its reader waiting."""
    os.mkfifo(tmp_path / "endless.npz")
    return tmp_path / "endless.npz"


def request(path):
    columns = {"time": "t", "input": "u", "output": "y"}
    roles = list(columns)
    return {"folder": "", "path": str(path), "columns": columns, "roles": roles}


def process_of(reader):
    return reader._process.pid


def is_there(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def assert_ends(pid):
    limit = time.monotonic() + MOST_SECONDS
    while is_there(pid):
        assert time.monotonic() < limit
        time.sleep(0.02)


def test_one_process_reads_all_files(good):
    read_columns(good, COLUMNS)
    first = process_of(formats._ISOLATED)
    found = read_columns(good, COLUMNS)

    assert process_of(formats._ISOLATED) == first != os.getpid()
    np.testing.assert_array_equal(found.output.values, ARRAYS["y"])


@pytest.mark.thorough
def test_a_crash_of_the_reader_is_a_message_and_the_next_file_is_read(good, crashing):
    with pytest.raises(
        MeasurementError,
        match=r"crash.mat: cannot be read \(its reader crashes on it, SIG\w+\); "
        "expected a readable .mat file; export it again",
    ):
        read_columns(crashing, COLUMNS)
    with pytest.raises(ValueError, match="crashes on it"):
        list_columns(crashing)

    assert read_columns(good, COLUMNS).input.values.size == 5


@pytest.mark.thorough
def test_a_process_that_an_earlier_file_has_spoilt_is_replaced(good):
    read_columns(good, COLUMNS)
    os.kill(process_of(formats._ISOLATED), signal.SIGKILL)

    assert read_columns(good, COLUMNS).input.values.size == 5


@pytest.mark.thorough
def test_a_reader_that_does_not_come_back_is_stopped(good, endless):
    reader = IsolatedReader("hwid_cli.data.formats")
    reader.ask(request(good))
    pid = process_of(reader)
    with pytest.raises(ValueError, match=r"did not come back within 0\.3 s"):
        reader.ask(request(endless), most_seconds=0.3)

    assert not is_there(pid)
    # Three columns, each with its rows.
    assert len(reader.ask(request(good))) == 6
    reader.end()


@pytest.fixture
def unfinished(tmp_path):
    """A measurement whose recorder was switched off, cut in its first blocks."""
    asammdf = pytest.importorskip("asammdf")
    path = tmp_path / "run.mf4"
    file = asammdf.MDF(version="4.10")
    clock = np.arange(5.0)
    file.append([asammdf.Signal(clock, clock, name=name) for name in "uy"])
    file.save(path)
    file.close()
    content = bytearray(path.read_bytes())
    content[:8] = b"UnFinMF "
    content[60] |= 1
    path.write_bytes(content[:360])
    return path


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Where temporary files go in this test."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.thorough
def test_no_copy_of_a_damaged_measurement_stays_behind(
    unfinished, temporary, monkeypatch
):
    reader = IsolatedReader("hwid_cli.data.formats")
    monkeypatch.setattr(formats, "_ISOLATED", reader)
    with pytest.raises(MeasurementError, match=r"run\.mf4: cannot be read"):
        read_columns(unfinished, COLUMNS)

    # The library has made a copy, in the folder of the process that goes with it.
    (folder,) = temporary.iterdir()
    assert [one.name[12:] for one in folder.glob("*.mf4")] == ["_run.mf4"]
    reader.end()
    assert list(temporary.iterdir()) == []


@pytest.mark.thorough
def test_nothing_stays_behind_of_a_reader_that_was_stopped(
    good, endless, temporary, monkeypatch
):
    reader = IsolatedReader("hwid_cli.data.formats")
    reader.ask(request(good))
    assert len(list(temporary.iterdir())) == 1
    with pytest.raises(ValueError, match="did not come back within"):
        reader.ask(request(endless), most_seconds=1.0)
    assert list(temporary.iterdir()) == []


@pytest.mark.thorough
def test_files_are_read_where_there_is_no_room_for_temporary_ones(
    good, tmp_path, monkeypatch
):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    reader = IsolatedReader("hwid_cli.data.formats")

    assert len(reader.ask(request(good))) == 6
    reader.end()


def test_a_process_that_sends_something_else_is_not_believed():
    # Prints text and ends well.
    reader = IsolatedReader("this")
    with pytest.raises(ValueError, match="its reader crashes on it, code"):
        reader.ask({})


def test_arrays_come_back_bit_by_bit(tmp_path):
    bits = np.array([0, 1 << 63, 1, 0x7FF0 << 48, 0x7FF8DEADBEEF0001], np.uint64)
    values = bits.view(np.float64)
    np.savez(tmp_path / "bits.npz", u=values, y=values)
    found = read_columns(tmp_path / "bits.npz", Columns(input="u", output="y"))

    np.testing.assert_array_equal(found.output.values.view(np.uint64), bits)


def test_messages_name_the_path_as_it_was_given(good, tmp_path, monkeypatch):
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        monkeypatch.chdir(folder)
        np.savez("run.npz", **{**ARRAYS, name: ARRAYS["y"]})
        path = formats.Path("run.npz")

        assert read_columns(path, Columns(input="u", output=name)).time is None
        with pytest.raises(MeasurementError, match=r"^run.npz: has no variable 'x'"):
            read_columns(path, Columns(input="x", output="y"))


# Reads a file, then waits, for input or for a file without an end.
PROGRAM = """
import json, sys
from hwid_cli.files.isolated_process import IsolatedReader
reader = IsolatedReader("hwid_cli.data.formats")
reader.ask(json.loads(sys.argv[1]))
print(reader._process.pid, flush=True)
if len(sys.argv) > 2:
    reader.ask(json.loads(sys.argv[2]), most_seconds=1.0)
input()
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, marks=pytest.mark.slow),
        signal.SIGKILL,
    ],
)
@pytest.mark.parametrize(
    "is_busy",
    [False, pytest.param(True, marks=pytest.mark.slow)],
    ids=["idle", "busy"],
)
def test_the_process_ends_with_the_program(good, endless, number, is_busy):
    asked = [json.dumps(request(one)) for one in (good, endless)[: 1 + is_busy]]
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *asked],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as process:
        pid = int(process.stdout.readline())
        assert is_there(pid)
        # It may have begun to wait for the file, or not yet.
        time.sleep(0.1)
        process.send_signal(number)
        process.wait(MOST_SECONDS)

    assert_ends(pid)


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    def read(path, columns, roles=()):
        import a_library_that_nobody_has

        return a_library_that_nobody_has.read(path, columns)

    reader = Reader((".odd",), read, lambda path: read(path, None), needs="oddlib")
    monkeypatch.setattr(formats, "READERS", (reader,))
    (tmp_path / "run.odd").write_text("odd")

    for attempt in (lambda path: read_columns(path, COLUMNS), list_columns):
        with pytest.raises(
            MeasurementError, match=r"run.odd: is read by oddlib, .*pip"
        ):
            attempt(tmp_path / "run.odd")
