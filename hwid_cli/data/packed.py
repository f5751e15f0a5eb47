"""Text files as they are, or packed by gzip: their names, and how they are opened."""

import gzip
from pathlib import Path, PurePath
from typing import IO, TextIO, cast

_PACKED = ".gz"


def is_packed(path: PurePath) -> bool:
    """Whether a file is packed, by its ending."""
    return path.suffix.lower() == _PACKED


def ending_of(path: PurePath) -> str:
    """Ending that says how a file is read, in lower case.

    Examples
    --------
    >>> ending_of(PurePath("run_1.CSV")), ending_of(PurePath("run_1.csv.gz"))
    ('.csv', '.csv')
    """
    return PurePath(path.stem if is_packed(path) else path.name).suffix.lower()


def stem_of(path: PurePath) -> str:
    """Name of a file without its endings.

    Examples
    --------
    >>> stem_of(PurePath("a/run_1.5.csv")), stem_of(PurePath("a/run_1.csv.gz"))
    ('run_1.5', 'run_1')
    """
    return PurePath(path.stem).stem if is_packed(path) else path.stem


def open_bytes(path: Path) -> IO[bytes]:
    """Open a file for its bytes, unpacked."""
    return cast(IO[bytes], gzip.open(path)) if is_packed(path) else path.open("rb")


def open_text(path: Path, encoding: str) -> TextIO:
    """Open a file for its text, unpacked; bytes that are none are replaced."""
    if is_packed(path):
        return gzip.open(path, "rt", encoding=encoding, errors="replace", newline="")
    return path.open(encoding=encoding, errors="replace", newline="")
