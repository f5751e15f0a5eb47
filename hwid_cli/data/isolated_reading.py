"""Reading a foreign binary file in a copy of the process first.

The library of HDF5 is C and takes a file's word for much: about one in 5000 damaged files
was seen to crash the interpreter, or to keep it busy for ever. A fork costs
milliseconds; it reads the file and ends, and only where it ends well is the file read
here.
"""

import faulthandler
import os
import signal
import time
import warnings
from collections.abc import Callable
from contextlib import suppress

# A file of 512 MB takes seconds.
MOST_SECONDS = 20.0
_FIRST_NAP_S, _LONGEST_NAP_S = 0.001, 0.05


def rehearse(read: Callable[[], object], *, most_seconds: float = MOST_SECONDS) -> None:
    """Try in a copy of this process whether a call comes back at all.

    Parameters
    ----------
    read : callable
        What it gives or raises does not matter here.
    most_seconds : float, [s]

    Raises
    ------
    ValueError
        If the call crashed or did not come back in time. Systems without ``fork`` go
        without the rehearsal.
    """
    if not hasattr(os, "fork"):
        return
    with warnings.catch_warnings():
        # Newer Pythons warn of threads; the copy uses none and only reads a file.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _read_and_end(read)
    try:
        status = _wait(child, most_seconds)
    except BaseException:
        _end(child)
        raise
    if status is None:
        _end(child)
        raise ValueError(f"its reader did not come back within {most_seconds:g} s")
    if os.WIFSIGNALED(status):
        name = signal.Signals(os.WTERMSIG(status)).name
        raise ValueError(f"its reader crashes on it, {name}")


def _read_and_end(read: Callable[[], object]) -> None:
    """Life of the copy: no clean-up of what belongs to the original."""
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        faulthandler.disable()
        read()
    except BaseException:  # noqa: BLE001, S110, RUF100
        # The original meets it too, and says it in words.
        pass
    finally:
        os._exit(0)


def _wait(child: int, most_seconds: float) -> int | None:
    end, nap = time.monotonic() + most_seconds, _FIRST_NAP_S
    while time.monotonic() < end:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return status
        time.sleep(nap)
        nap = min(2 * nap, _LONGEST_NAP_S)
    return None


def _end(child: int) -> None:
    with suppress(ProcessLookupError, ChildProcessError):
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
