"""A process of its own that reads foreign binary files, with bounded time and memory.

Compiled readers (MAT, HDF5) take a file's word for much: damaged files were seen to
crash the interpreter, to keep it busy for ever, and to unpack to terabytes. One process
reads all such files of a run. It starts with the first of them, starts again after a
file has ended it, and ends with the program, which holds its input open.

It answers with lines of JSON, and with bytes that are taken for 64-bit floats: whatever
a file makes of it, text and numbers are all that comes back. Systems without
``resource`` (Windows) bound its time only; macOS bounds no address space.
"""

import atexit
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import IO, Any

import numpy as np

from hwid_cli.errors import MeasurementError

try:
    import resource
except ImportError:
    resource = None  # type: ignore[assignment]

# A file of 512 MB takes seconds.
MOST_SECONDS = 20.0
# Address space, [bytes]: half a GB of libraries; a column of the largest size as it was
# read, as 64-bit floats and with its rows; and the rest of a MAT file.
_MOST_MEMORY = 3 * 2**30
_LONGEST_LINE, _LONGEST_TEXT = 2**20, 2000
# What dies has closed its pipe a moment before it is gone, [s].
_DYING_S = 1.0

# What JSON can hold about an array, and the array.
Labelled = tuple[list[Any], np.ndarray]
# What is raised here as it was raised there.
_KINDS = {"measurement": MeasurementError, "import": ImportError}


class _CrashError(ValueError):
    """The process has ended in place of an answer."""


class IsolatedReader:
    """The process, seen from the program.

    Parameters
    ----------
    module : str
        What runs there; it hands its answers to ``serve``.
    word : str
        What it is called in messages.
    """

    def __init__(self, module: str, word: str = "its reader") -> None:
        self._module, self._word = module, word
        self._process: Any = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._lock = threading.Lock()
        atexit.register(self.end)

    def ask(
        self, request: Mapping[str, Any], *, most_seconds: float = MOST_SECONDS
    ) -> list[Labelled]:
        """Have something read.

        Parameters
        ----------
        request : mapping
            Of what JSON can hold.
        most_seconds : float, [s]

        Returns
        -------
        list of (list, ndarray of float64, shape (n,))

        Raises
        ------
        MeasurementError, ImportError
            As it was raised over there.
        ValueError
            If anything else was raised, or the process crashed or took too long.
        """
        with self._lock:
            was_used = self._process is not None
            try:
                found, end = self._exchange(request, most_seconds)
            except _CrashError:
                if not was_used:
                    raise
                # An earlier file may be the one that spoilt it; a new process tells.
                found, end = self._exchange(request, most_seconds)
        if "error" not in end:
            return found
        kind = _KINDS.get(str(end.get("kind")), ValueError)
        raise kind(str(end["error"])[:_LONGEST_TEXT])

    def end(self, grace_s: float = 0.0) -> int:
        """End the process if there is one, and give its code.

        Parameters
        ----------
        grace_s : float, [s]
            Time to end by itself.
        """
        process, self._process = self._process, None
        if process is None:
            return 0
        with suppress(subprocess.TimeoutExpired):
            process.wait(grace_s)
        process.kill()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError):
                pipe.close()
        code: int = process.wait()
        if self._folder is not None:
            self._folder.cleanup()
        return code

    def _begin(self) -> Any:
        """Start the process, with a folder of its own for temporary files.

        Libraries leave copies of damaged measurements there, and so does a process that
        is killed; they go with the folder.
        """
        with suppress(OSError):
            self._folder = tempfile.TemporaryDirectory(
                prefix="hwid-", ignore_cleanup_errors=True
            )
        name = None if self._folder is None else self._folder.name
        self._process = _start(self._module, name)
        return self._process

    def _exchange(
        self, request: Mapping[str, Any], most_seconds: float
    ) -> tuple[list[Labelled], dict[str, Any]]:
        process: Any = self._process or self._begin()
        line = json.dumps({**request, "seconds": most_seconds}).encode()
        timer = threading.Timer(most_seconds, process.kill)
        timer.daemon = True
        begin = time.monotonic()
        timer.start()
        try:
            process.stdin.write(line + b"\n")
            process.stdin.flush()
            return _hear(process.stdout)
        except (EOFError, OSError, LookupError, TypeError, ValueError):
            is_late = time.monotonic() - begin >= most_seconds
            code = self.end(_DYING_S)
            if is_late:
                said = f"{self._word} did not come back within {most_seconds:g} s"
                raise ValueError(said) from None
            name = signal.Signals(-code).name if code < 0 else f"code {code}"
            raise _CrashError(f"{self._word} crashes on it, {name}") from None
        except BaseException:
            # Interrupted in the middle of an answer.
            self.end()
            raise
        finally:
            timer.cancel()


def _start(module: str, temporary: str | None) -> "subprocess.Popen[bytes]":
    """Start the process: it imports from where this one does, and nowhere else."""
    folders = os.pathsep.join(os.path.abspath(one) for one in sys.path)  # noqa: PTH100
    # Threads of linear algebra would take address space, and have nothing to do.
    alone = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    # Where tempfile looks on the systems there are.
    names = ("TMPDIR", "TEMP", "TMP")
    own = {} if temporary is None else dict.fromkeys(names, temporary)
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **alone, **own, "PYTHONPATH": folders},
    )


def _hear(replies: IO[bytes]) -> tuple[list[Labelled], dict[str, Any]]:
    """Arrays with their labels, and the last line."""
    found: list[Labelled] = []
    while True:
        line = replies.readline(_LONGEST_LINE)
        if not line:
            raise EOFError
        said = dict(json.loads(line))
        if "label" not in said:
            return found, said
        if 8 * said["size"] > _MOST_MEMORY:
            raise ValueError("no reader can hold so much")
        values = np.empty(said["size"])
        if replies.readinto(values.view(np.uint8)) < values.nbytes:  # type: ignore[attr-defined]
            raise EOFError
        found.append((said["label"], values))


def serve(
    answer: Callable[[dict[str, Any]], Iterable[Labelled]],
    *,
    most_memory: int | None = _MOST_MEMORY,
) -> None:
    """Answer requests until there are no more: the life of the process.

    Parameters
    ----------
    answer : callable
        From a request to its arrays, which are sent one by one.
    most_memory : int or None, [bytes]
        Of address space; None for no bound.
    """
    # Ctrl-C reaches the whole group of processes, and nobody reads a traceback.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    if resource is not None:
        if most_memory is not None:
            _bound("RLIMIT_AS", most_memory)
        _bound("RLIMIT_CORE", 0)
    replies = os.fdopen(os.dup(1), "wb")
    # What a library prints is no answer.
    os.dup2(2, 1)
    for line in sys.stdin.buffer:
        request = json.loads(line)
        _set_alarm(math.ceil(request["seconds"]) + 1)
        end: dict[str, Any] = {}
        try:
            for label, values in answer(request):
                numbers = np.ascontiguousarray(values, np.float64)
                _say(replies, {"label": label, "size": numbers.size})
                replies.write(numbers.data)
        except MemoryError:
            bound = "" if most_memory is None else f" than {most_memory // 2**30} GB"
            end = {"error": f"needs more{bound} of memory"}
        except Exception as error:
            # Readers of foreign formats raise whatever their parser stumbles on.
            end = {"error": str(error) or type(error).__name__}
            end["kind"] = next((n for n in _KINDS if isinstance(error, _KINDS[n])), "")
        _say(replies, end)
        replies.flush()
        _set_alarm(0)


def _say(replies: IO[bytes], content: dict[str, Any]) -> None:
    replies.write(json.dumps(content).encode() + b"\n")


def _set_alarm(seconds: int) -> None:
    """End the process after some time, which the program does unless it was killed."""
    if hasattr(signal, "alarm"):
        signal.alarm(seconds)


def _bound(name: str, most: int) -> None:
    kind = getattr(resource, name)
    hard = resource.getrlimit(kind)[1]
    if hard != resource.RLIM_INFINITY:
        most = min(most, hard)
    # A system may know a bound and not set it.
    with suppress(OSError, ValueError):
        resource.setrlimit(kind, (most, hard))
