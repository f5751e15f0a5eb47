import os
from pathlib import Path

import h5py
import pytest

from hwid_cli import __version__
from hwid_cli.errors import CacheError
from hwid_cli.files.atomic import check_format, replace_file, replaced_hdf5


def test_file_and_folders_are_made(tmp_path):
    path = tmp_path / "a" / "b" / "c.txt"
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert [entry.name for entry in path.parent.iterdir()] == ["c.txt"]


def test_new_file_is_as_open_to_others_as_the_user_wants(tmp_path):
    old_mask = os.umask(0o027)
    try:
        replace_file(tmp_path / "a", b"")
    finally:
        os.umask(old_mask)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("call", ["replace", "open"])
def test_full_disk_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch, call):
    path = tmp_path / "a.txt"
    replace_file(path, b"old")

    def fail(self, *arguments):
        raise OSError(28, "No space left on device")

    message = r"a.txt: cannot be written \(No space left on device\); .*--out$"
    with monkeypatch.context() as patched:
        patched.setattr(Path, call, fail)
        with pytest.raises(CacheError, match=message):
            replace_file(path, b"new")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


def test_folder_that_is_a_file_is_one_clear_line(tmp_path):
    (tmp_path / "results").write_text("")
    with pytest.raises(
        CacheError, match=r"x.h5: cannot be written \(.*; expected a fo"
    ):
        replace_file(tmp_path / "results" / "x.h5", b"")


def test_hdf5_file_says_what_it_is(tmp_path):
    path = tmp_path / "a.h5"
    with replaced_hdf5(path, format_name="hwid-x", version=3) as file:
        file["values"] = [1.0]
        assert not path.exists()
    with h5py.File(path, "r") as file:
        assert file.attrs["format"] == "hwid-x"
        assert file.attrs["schema_version"] == 3
        assert file.attrs["created_by"] == f"hwid {__version__}"
        check_format(file, format_name="hwid-x", version=3)
        with pytest.raises(
            ValueError, match="holds hwid-x version 3, expected hwid-x 4"
        ):
            check_format(file, format_name="hwid-x", version=4)


def test_nothing_is_written_when_the_block_raises(tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(b"old")

    def write_half():
        with replaced_hdf5(path, format_name="hwid-x", version=1) as file:
            file["values"] = [1.0]
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        write_half()
    assert path.read_bytes() == b"old"


def test_several_files_may_be_built_at_once(tmp_path):
    with (
        replaced_hdf5(tmp_path / "a.h5", format_name="x", version=1) as one,
        replaced_hdf5(tmp_path / "a.h5", format_name="x", version=1) as other,
    ):
        one["values"] = [1.0]
        assert "values" not in other
