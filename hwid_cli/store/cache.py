"""The cache on disk: one small HDF5 file for each task, safe to kill at any moment.

``<folder>/<first two digits of the key>/<key>.h5``. Entries may be thrown away: what
cannot be read is set aside with the ending ``.bad``, counted and computed again. Runs
may share a folder: an entry appears as a whole, and two of one key hold the same.
"""

import errno
import hashlib
import logging
import stat
from pathlib import Path
from typing import TypeVar

import h5py

from hwid_cli.errors import UntrustedFunctionError
from hwid_cli.files.atomic import check_format, hdf5_image, replace_file
from hwid_cli.store.hdf5_records import read_record, write_record

Record = TypeVar("Record")

_log = logging.getLogger(__name__)

FORMAT = "hwid-cache"
SCHEMA_VERSION = 1
_CHECKSUM_BYTES = hashlib.sha256().digest_size


def pack_entry(key: str, record: object) -> bytes:
    """Turn a result into what its file will hold."""

    def fill(file: h5py.File) -> None:
        file.attrs["key"] = key
        file.attrs["record"] = type(record).__name__
        write_record(file.create_group("record"), record)

    return _with_checksum(hdf5_image(fill, format_name=FORMAT, version=SCHEMA_VERSION))


class Hdf5Store:
    """Results of tasks by key, in a folder.

    Holds no open file, so it may be sent to a worker.

    Parameters
    ----------
    folder : Path
        Made when the first entry is put.
    sets_aside : bool
        Whether entries that cannot be used are renamed; not where nothing may be
        written.

    Attributes
    ----------
    unusable : list of str
        What was wrong with each entry that was there and could not be used.
    """

    pack = staticmethod(pack_entry)

    def __init__(self, folder: Path, *, sets_aside: bool = True) -> None:
        self._folder = Path(folder)
        self._sets_aside = sets_aside
        self.unusable: list[str] = []

    def get(self, key: str, record_type: type[Record]) -> Record | None:
        """Look a result up.

        Parameters
        ----------
        record_type : type
            The dataclass that was put.

        Returns
        -------
        Record or None
            None if there is none, or none that can be read.
        """
        path = self._path(key)
        try:
            # Asked once: another run may write the entry meanwhile.
            if not stat.S_ISREG(path.stat().st_mode):
                raise OSError(errno.EINVAL, "is no plain file")
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            self._complain(path, error)
            return None
        try:
            image = h5py.h5f.open_file_image(_without_checksum(content))
            with h5py.File(image, "r") as file:
                check_format(file, format_name=FORMAT, version=SCHEMA_VERSION)
                if file.attrs.get("key") != key:
                    # A copy under another name would be another task's result.
                    raise ValueError("holds the result of another task")
                found = file.attrs.get("record")
                if found != record_type.__name__:
                    raise ValueError(f"holds a {found}, no {record_type.__name__}")
                return read_record(file["record"], record_type)
        # What h5py raises on damaged files, and records on impossible values.
        except (
            ArithmeticError,
            LookupError,
            OSError,
            RuntimeError,
            TypeError,
        ) as error:
            self._set_aside(path, error)
        except (UntrustedFunctionError, ValueError) as error:
            self._set_aside(path, error)
        return None

    def put(self, key: str, record: object) -> None:
        """Keep a result.

        Raises
        ------
        CacheError
            If it cannot be written.
        """
        self.put_packed(key, pack_entry(key, record))

    def put_packed(self, key: str, packed: bytes) -> None:
        """Keep a result that was packed, perhaps by a worker.

        Parameters
        ----------
        packed : bytes
            As ``pack`` gives it for the same key.

        Raises
        ------
        CacheError
            If it cannot be written.
        """
        replace_file(self._path(key), packed)

    def _path(self, key: str) -> Path:
        return self._folder / key[:2] / f"{key}.h5"

    def _set_aside(self, path: Path, error: Exception) -> None:
        """Rename an entry that cannot be read, so that it is not tried again."""
        self._complain(path, error)
        if not self._sets_aside:
            return
        try:
            path.replace(path.with_suffix(".bad"))
        except OSError as failure:
            self.unusable[-1] += f" (it cannot be set aside: {failure.strerror})"

    def _complain(self, path: Path, error: Exception) -> None:
        """Note why an entry cannot be used; a damaged disk has thousands of them."""
        self.unusable.append(f"{path}: {' '.join(str(error).split())}")
        _log.debug("unusable, computed again: %s", self.unusable[-1])


def count_entries(folder: Path) -> int:
    """Count the results that a cache holds.

    Returns
    -------
    int, [-]
    """
    return sum(1 for _ in Path(folder).glob("??/*.h5"))


def _with_checksum(image: bytes) -> bytes:
    """Add a checksum behind an HDF5 file; readers of HDF5 do not look there."""
    return image + hashlib.sha256(image).digest()


def _without_checksum(content: bytes) -> bytes:
    """Take the checksum off; HDF5 crashes the interpreter on some damaged files."""
    image = content[:-_CHECKSUM_BYTES]
    if hashlib.sha256(image).digest() != content[-_CHECKSUM_BYTES:]:
        raise ValueError("content and checksum do not match")
    return image
