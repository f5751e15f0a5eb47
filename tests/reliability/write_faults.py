"""Faults at any place where the program changes a folder, one at a time.

Python reports every opening, renaming, removing and making of a folder, of whatever
library, to audit hooks; an error raised there is the error of the operation.
"""

import os
import sys
from contextlib import contextmanager
from pathlib import Path

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_CHANGES = ("os.rename", "os.mkdir", "os.remove", "os.truncate", "os.rmdir")


class _Faults:
    """The hook cannot be taken away; what it does can be changed."""

    def __init__(self):
        self.folder = None
        self.error = None
        self.left = 0
        self.seen = []

    def __call__(self, event, arguments):
        if self.folder is None or (event != "open" and event not in _CHANGES):
            return
        if event == "open" and not (arguments[2] or 0) & _WRITES:
            return
        name = arguments[0]
        if not isinstance(name, str | os.PathLike):
            return
        if not os.fspath(name).startswith(self.folder):
            return
        self.seen.append((event, Path(name).name))
        if len(self.seen) == self.left:
            raise OSError(self.error, os.strerror(self.error), os.fspath(name))


_faults = _Faults()
_installed = []


@contextmanager
def fault(folder: Path, number: int, error: int):
    """Let the change of that number below a folder fail; 0 lets none, and counts."""
    if not _installed:
        sys.addaudithook(_faults)
        _installed.append(True)
    _faults.folder, _faults.error = str(folder), error
    _faults.left, _faults.seen = number, []
    try:
        yield _faults.seen
    finally:
        _faults.folder = None
