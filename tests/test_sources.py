"""Checksums of sources: what is derived from them may stay only as long as they do."""

import shutil

import pytest

from hwid_cli.sources import PACKAGE, checksum_of_folder


@pytest.fixture
def copied(tmp_path):
    def copy(name):
        left_out = shutil.ignore_patterns("__pycache__")
        return shutil.copytree(PACKAGE / "report", tmp_path / name, ignore=left_out)

    return copy


def test_copied_sources_have_the_same_checksum(copied):
    assert checksum_of_folder(copied("a")) == checksum_of_folder(PACKAGE / "report")


@pytest.mark.parametrize(
    "file", ["templates/report.html", "templates/report.js", "sections/crossval.py"]
)
def test_a_changed_file_gives_another_checksum(copied, file):
    folder = copied("a")
    with (folder / file).open("a") as source:
        source.write("\n")

    assert checksum_of_folder(folder) != checksum_of_folder(PACKAGE / "report")


def test_a_file_under_another_name_gives_another_checksum(copied):
    folder = copied("a")
    (folder / "page.py").rename(folder / "sheet.py")

    assert checksum_of_folder(folder) != checksum_of_folder(PACKAGE / "report")


def test_what_python_compiled_does_not_count(copied):
    folder = copied("a")
    (folder / "__pycache__").mkdir()
    (folder / "__pycache__" / "page.cpython-311.pyc").write_bytes(b"anything")

    assert checksum_of_folder(folder) == checksum_of_folder(PACKAGE / "report")
