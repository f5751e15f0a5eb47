"""Files that are either the old one or the whole new one, never half of either.

HDF5 files are built in memory first: h5py was seen to crash the interpreter at exit
when the disk is full.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

import h5py

from hwid_cli import __version__
from hwid_cli.errors import CacheError
from hwid_cli.files.plain_files import refuse_unless_plain

_CREATED_BY = f"hwid {__version__}"
# H5LT_FILE_IMAGE_OPEN_RW; h5py has no name for it.
_IMAGE_MAY_CHANGE = 1


def replace_file(path: Path, content: bytes, *, is_lasting: bool = False) -> None:
    """Put content into a file in one step.

    Parameters
    ----------
    path : Path
        Missing folders are made.
    is_lasting : bool
        Whether to wait until the disk has it, so that it outlives a power cut.

    Raises
    ------
    CacheError
        If the disk or the folder refuses, or what is there is no plain file; it is
        untouched then.
    """
    temporary = path.with_name(f".{path.name}.{uuid4().hex}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        refuse_unless_plain(path)
        # "x" follows no link.
        with temporary.open("xb") as file:
            file.write(content)
        if is_lasting:
            _wait_for_disk(temporary)
        temporary.replace(path)
        if is_lasting:
            # Some file systems cannot wait for a folder; the file is whole all the same.
            with suppress(OSError):
                _wait_for_disk(path.parent)
    except OSError as error:
        raise CacheError(
            f"{path}: cannot be written ({error.strerror or error}); expected a folder "
            "with free space; make room or choose another one with --out"
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _wait_for_disk(path: Path) -> None:
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


@contextmanager
def replaced_hdf5(
    path: Path,
    *,
    format_name: str,
    version: int,
    start: bytes = b"",
    checksum: Callable[[bytes], bytes] = bytes,
    is_lasting: bool = False,
) -> Iterator[h5py.File]:
    """Give an HDF5 file in memory that becomes the file on disk at the end.

    Parameters
    ----------
    format_name : str
        Root attribute ``format``.
    version : int
        Root attribute ``schema_version``.
    start : bytes
        HDF5 file to begin with; none gives an empty one.
    checksum : callable
        From the finished file's bytes to those that are written.
    is_lasting : bool
        As for ``replace_file``.

    Yields
    ------
    h5py.File
        Nothing reaches the disk if the block raises.

    Raises
    ------
    CacheError
        As for ``replace_file``.
    OSError
        If ``start`` is no HDF5 file.
    """
    with _in_memory(start) as file:
        _sign(file, format_name, version)
        yield file
        image = _image(file)
    replace_file(path, checksum(image), is_lasting=is_lasting)


def hdf5_image(
    fill: Callable[[h5py.File], None], *, format_name: str, version: int
) -> bytes:
    """Bytes of an HDF5 file that never was on a disk.

    Parameters
    ----------
    fill : callable
        Writes into the file.
    format_name : str
        Root attribute ``format``.
    version : int
        Root attribute ``schema_version``.
    """
    with _in_memory(b"") as file:
        _sign(file, format_name, version)
        fill(file)
        return _image(file)


def _sign(file: h5py.File, format_name: str, version: int) -> None:
    file.attrs["format"] = format_name
    file.attrs["schema_version"] = version
    file.attrs["created_by"] = _CREATED_BY


def _image(file: h5py.File) -> bytes:
    file.flush()
    image: bytes = file.id.get_file_image()
    return image


def _in_memory(start: bytes) -> h5py.File:
    if start:
        return h5py.File(h5py.h5f.open_file_image(start, flags=_IMAGE_MAY_CHANGE))
    # HDF5 knows open files by name, also those that exist in memory only.
    return h5py.File(uuid4().hex, "w", driver="core", backing_store=False)


def check_format(file: h5py.File, *, format_name: str, version: int) -> None:
    """Refuse a file of another format or schema version.

    Parameters
    ----------
    file : h5py.File

    Raises
    ------
    ValueError
        Saying what was found and what was expected.
    """
    found = (file.attrs.get("format"), file.attrs.get("schema_version"))
    if found != (format_name, version):
        raise ValueError(
            f"holds {found[0]} version {found[1]}, expected {format_name} {version}"
        )
