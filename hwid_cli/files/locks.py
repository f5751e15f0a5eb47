"""Who works in a folder: one run at a time on results, any number on a cache.

The locks are the kernel's: it lets go of them when a process ends, however it ends, so
that none is ever left behind. The files stay; what one says is for people.
"""

import errno
import json
import logging
import os
import platform
import re
import sys
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import IO

from hwid_cli.errors import CacheError
from hwid_cli.files.plain_files import open_plain

if sys.platform != "win32":
    import fcntl

RUN_LOCK = ".hwid-run.lock"
USERS_LOCK = ".hwid-users.lock"
# Where a file system knows no locks.
_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL)
# Names of files that are being written, see ``replaced_files``.
_TEMPORARY = re.compile(r"\..+\.[0-9a-f]{32}\.tmp")
# Folders of results in which files are written; others are the user's.
WRITTEN = ("raw", "simulated", "models", "figures", "next")

_log = logging.getLogger(__name__)


def claim_folder(folder: Path) -> IO[str]:
    """Keep other runs away from a folder of results.

    Parameters
    ----------
    folder : Path
        Exists.

    Returns
    -------
    file
        The folder is free again when it is closed, or the process ends.

    Raises
    ------
    CacheError
        If another run works there, or nothing can be written there.
    """
    path = folder / RUN_LOCK
    try:
        file = open_plain(path)
    except OSError as error:
        raise CacheError(
            f"{folder}: cannot be written ({error.strerror}); expected a folder with "
            "free space; make room or choose another one with --out"
        ) from error
    if not _lock(file, is_shared=False):
        with file:
            raise CacheError(
                f"{folder}: in use by {_owner(file)}; expected one run at a time on a "
                "folder of results; wait until that one has ended or stop it, or "
                "choose another folder with --out"
            )
    _sign(file)
    return file


def share_folder(folder: Path) -> IO[str] | None:
    """Say that files are written in a folder, and remove what dead runs left there.

    Half-written files are removed where no other process says the same: then nobody
    alive can be writing them.

    Parameters
    ----------
    folder : Path
        Of results or of a cache.

    Returns
    -------
    file or None
        To be closed at the end; None where the folder cannot be written.

    Raises
    ------
    CacheError
        If the lock is no plain file.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = open_plain(folder / USERS_LOCK)
    except OSError:
        # Who really has to write says so.
        return None
    if _lock(file, is_shared=False):
        _remove_left_over(folder)
    _lock(file, is_shared=True)
    return file


def _lock(file: IO[str], *, is_shared: bool) -> bool:
    """Lock a file, or say that another process has it for itself."""
    if sys.platform == "win32":
        return True
    # Who shares waits for the moment that removing takes.
    kind = fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX | fcntl.LOCK_NB
    try:
        fcntl.flock(file, kind)
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            return False
        _log.debug("%s: no locks on this file system (%s)", file.name, error.strerror)
    return True


def _sign(file: IO[str]) -> None:
    """Write who has the lock, for whoever is refused."""
    since = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    owner = {"pid": os.getpid(), "host": platform.node(), "since": since}
    try:
        # Past the buffer, which would try again when the file is closed.
        os.ftruncate(file.fileno(), 0)
        os.write(file.fileno(), f"{json.dumps(owner)}\n".encode())
    except OSError as error:
        _log.debug("%s: cannot be written (%s)", file.name, error.strerror)


def _owner(file: IO[str]) -> str:
    try:
        file.seek(0)
        owner = json.load(file)
        return f"process {owner['pid']} on {owner['host']} since {owner['since']}"
    except (KeyError, OSError, TypeError, ValueError):
        return "another run"


def _remove_left_over(folder: Path) -> None:
    for path in _places(folder):
        if _TEMPORARY.fullmatch(path.name):
            try:
                path.unlink()
                _log.debug("%s: left by a run that was killed; removed", path)
            except OSError as error:
                _log.debug("%s: cannot be removed (%s)", path, error.strerror)


def _places(folder: Path) -> Iterator[Path]:
    """Where files are written; not all below, for it may be anybody's folder."""
    yield from folder.glob(".*.tmp")
    yield from folder.glob("[0-9a-f][0-9a-f]/.*.tmp")
    for name in WRITTEN:
        yield from (folder / name).rglob(".*.tmp")
