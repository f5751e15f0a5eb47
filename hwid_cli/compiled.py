"""Compiled loops, kept on disk for as long as no source that they are made from changes.

numba keeps what it compiled and compiles anew where the file of the function itself has
changed. It does not look at the loops that a function calls or at the constants that it
reads, both of which are built into it. Here the folder of a module's loops is named after
a checksum of all sources that the module imports, directly or not: after a change there
is nothing to be found, and older folders are removed.
"""

import atexit
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryFile, mkdtemp
from typing import Any, TypeVar

from numba import config, njit
from numba.core.caching import FunctionCache
from numba.core.options import DefaultOptions

from hwid_cli.sources import PACKAGE, checksum_of_files, sources_behind

if sys.platform != "win32":
    import fcntl

HAS_LOCKS = sys.platform != "win32"

_Function = TypeVar("_Function", bound=Callable[..., Any])

# Entries for C, which nothing calls, take a twentieth of the time to compile.
_ALWAYS: dict[str, Any] = {"no_cfunc_wrapper": True}
_BOTH: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    # Without entries for Python and C they compile a fifth faster.
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
_COUNTS = hasattr(DefaultOptions, "_nrt")
# Options of functions that only other compiled functions call. Those that make no arrays
# need not count who holds one: twice to five times as fast. One that makes an array after
# all does not compile.
INNER = {**_BOTH, "_nrt": False} if _COUNTS else _BOTH
# Those that make arrays; said of each, or they would do as the one that calls them.
MAKING = {**_BOTH, "_nrt": True} if _COUNTS else _BOTH


class _Kept(FunctionCache):
    """Compiled forms of a function on the disk, which one process at a time adds to.

    numba numbers the forms of a function. Two processes that keep two forms at the same
    moment would give both the same number, and later ones would run the wrong one.
    """

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a form; numba calls it so."""
        with one_writer(Path(self.cache_path)):
            super().save_overload(sig, data)


@contextmanager
def one_writer(folder: Path) -> Iterator[None]:
    """Wait until no other process writes to a folder, where the system has locks.

    Parameters
    ----------
    folder : Path
        Made where it is missing.
    """
    with ExitStack() as stack:
        if sys.platform != "win32":
            # A disk without locks is written to as numba does it, without.
            with suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)
                file = stack.enter_context((folder / "lock").open("ab"))
                fcntl.flock(file, fcntl.LOCK_EX)
        yield


def compiled(**options: Any) -> Callable[[_Function], _Function]:
    """Decorate a function of this package that numba compiles at its first call.

    Parameters
    ----------
    **options : Any
        Options of ``numba.njit`` but ``cache``.

    Returns
    -------
    callable
        Decorator.
    """

    def compile_later(function: _Function) -> _Function:
        source = Path(function.__code__.co_filename)
        # numba asks for the folder here and now; other people's functions keep theirs.
        before = vars(config)["CACHE_DIR"]
        vars(config)["CACHE_DIR"] = str(folder_of_loops(source))
        try:
            loop = njit(**{**_ALWAYS, **options})(function)
            # Without numba's compiler it is the function as it was.
            if loop is not function:
                # As njit(cache=True) does it.
                vars(loop)["_cache"] = _Kept(function)
            return loop
        finally:
            vars(config)["CACHE_DIR"] = before

    return compile_later


@cache
def folder_of_loops(source: Path) -> Path:
    """Name the folder of a module's compiled loops, and remove the ones before it.

    Parameters
    ----------
    source : Path
        File of a module of this package.

    Returns
    -------
    Path
        Folder that is made where it is missing.
    """
    checksum = checksum_of_files(sources_behind(source))
    name = ".".join(source.relative_to(PACKAGE).with_suffix("").parts)
    folder = _place() / f"{name}-{checksum[:16]}"
    if not folder.exists():
        for before in folder.parent.glob(f"{name}-*"):
            shutil.rmtree(before, ignore_errors=True)
    return folder


@cache
def _place() -> Path:
    """Folder of all compiled loops: the package's own, the user's, or one that goes."""
    mine = f"{PACKAGE.name}-{sha256(str(PACKAGE).encode()).hexdigest()[:16]}"
    if given := vars(config)["CACHE_DIR"]:
        return Path(given) / mine
    user = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()
    for folder in (PACKAGE / "__pycache__" / "loops", user / "numba" / mine):
        if _may_be_made(folder):
            return folder
    # Workers inherit it; it goes with the process that made it.
    passing = os.environ["NUMBA_CACHE_DIR"] = mkdtemp(prefix="hwid_loops_")
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return Path(passing) / mine


def _may_be_made(folder: Path) -> bool:
    """Whether a folder may be written, or made where it is missing."""
    there = next(one for one in (folder, *folder.parents) if one.exists())
    try:
        # As numba tries it: rights alone do not say whether a disk takes a file.
        TemporaryFile(dir=there).close()
    except OSError:
        return False
    return True
