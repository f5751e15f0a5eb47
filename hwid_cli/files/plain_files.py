"""Files that are written where they seem to lie: no links, pipes or devices.

Whoever can make a link in a folder of results could otherwise have a file elsewhere
replaced. Folders that the user names may be links; what lies below them may not.
"""

import os
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO

from hwid_cli.errors import CacheError

# Absent on Windows, where links need rights of their own.
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_NO_WAITING = getattr(os, "O_NONBLOCK", 0)
_KINDS = (
    (stat.S_ISLNK, "a link"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
)


def open_plain(path: Path) -> IO[str]:
    """Open a file of the program's own to read and change it; make it where it lacks.

    Raises
    ------
    CacheError
        If it is no plain file, or one with another name elsewhere (a hard link).
    OSError
        If it cannot be opened.
    """
    refuse_unless_plain(path)
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | _NO_LINK | _NO_WAITING
    number = os.open(path, flags, 0o666)
    found = os.fstat(number)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(number)
        raise _refusal(path, "a file with a second name (a hard link)")
    return os.fdopen(number, "r+", encoding="utf-8")


def refuse_unless_plain(path: Path) -> None:
    """Refuse to write where there is something else than a plain file.

    Raises
    ------
    CacheError
        Saying what is there.
    """
    try:
        mode = path.lstat().st_mode
    except OSError:
        # Absent, or what opening it will complain of.
        return
    # A folder cannot be replaced by a file, which the system says itself.
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        kinds = (word for is_kind, word in _KINDS if is_kind(mode))
        raise _refusal(path, next(kinds, "a device"))


def refuse_linked_folders(folders: Iterable[Path]) -> None:
    """Refuse links in the place of folders that are written.

    Parameters
    ----------
    folders : iterable of Path
        That exist or not.

    Raises
    ------
    CacheError
        Naming the first link.
    """
    for folder in folders:
        if folder.is_symlink():
            raise _refusal(folder, "a link", "a folder")


def folders_below(folder: Path) -> Iterator[Path]:
    """A folder and all below it, links among them, which are not followed."""
    yield folder
    for place, folders, _ in os.walk(folder):
        yield from (Path(place) / name for name in folders)


def _refusal(path: Path, found: str, expected: str = "a plain file") -> CacheError:
    return CacheError(
        f"{path}: is {found}; expected {expected}, or nothing; what a link leads to is "
        "not written; remove it, or choose another place with --out or --cache"
    )
