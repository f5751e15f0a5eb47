"""Being stopped by Ctrl-C, ``kill`` or a terminal that closes: soon, and with one line.

Everything on disk is whole at any moment, so that a process may simply end. It first
tries to unwind, which stops the workers; where that takes too long it ends at once.
"""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

import click

Handler = Callable[[int, FrameType | None], None]

# Where a command tells in which folder its finished results are kept.
KEPT_IN = "hwid_cli.kept_in"
# Time to unwind, [s]; the promise is that the process has ended after two seconds.
GRACE_S = 0.8
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
# Exit code of a process that a signal ended, as shells count it: this plus the signal.
_BY_SIGNAL = 128


class Stopped(Exception):
    """The program was told to stop.

    Parameters
    ----------
    number : int
        Of the signal.
    sentence : str
        What is kept, and how to go on.
    """

    def __init__(self, number: int, sentence: str) -> None:
        super().__init__(sentence)
        self.number = number
        self.sentence = sentence

    @property
    def exit_code(self) -> int:
        """What the process ends with."""
        return _BY_SIGNAL + self.number


@contextmanager
def stop_signals(context: click.Context) -> Iterator[None]:
    """Let signals stop what runs inside.

    Parameters
    ----------
    context : click.Context
        Of the command; tells where its results are kept.

    Raises
    ------
    Stopped
        After a signal, whatever came of it on its way up.
    """
    seen: list[int] = []
    said: list[str] = []

    def end() -> None:
        _end(seen[0], said or [_sentence(context, seen[0])])

    def stop(number: int, _: FrameType | None) -> None:
        seen.append(number)
        if len(seen) > 1:
            # Somebody is in a hurry.
            end()
        timer = threading.Timer(GRACE_S, end)
        timer.daemon = True
        timer.start()
        raise KeyboardInterrupt

    before = _listen(stop)
    try:
        yield
    except BaseException as error:
        # An interrupted import or solver may end with an error of its own.
        if not seen and not isinstance(error, KeyboardInterrupt):
            raise
        number = seen[0] if seen else signal.SIGINT
        said.append("")
        raise Stopped(number, _sentence(context, number)) from None
    finally:
        for number, handler in before.items():
            # Once stopped there is nothing left to stop but the end of the program.
            signal.signal(number, signal.SIG_IGN if seen else handler)


def _listen(stop: Handler) -> dict[int, Any]:
    """Install a handler where a signal is not ignored, as it is after ``nohup``."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    # None is a handler that another library has installed in C.
    deaf = (signal.SIG_IGN, None)
    heard = [one for one in numbers if signal.getsignal(one) not in deaf]
    return {number: signal.signal(number, stop) for number in heard}


def _end(number: int, sentences: list[str]) -> None:
    """End the process and its workers without unwinding."""
    with suppress(Exception):
        # An empty one has been said already.
        sys.stderr.write("".join(f"hwid: {one}\n" for one in sentences if one))
        sys.stderr.flush()
    for worker in multiprocessing.active_children():
        with suppress(OSError, AttributeError):
            worker.kill()
    os._exit(_BY_SIGNAL + number)


def _sentence(context: click.Context, number: int) -> str:
    """What is kept, and how to go on."""
    folder = context.find_root().meta.get(KEPT_IN)
    how = "" if number == signal.SIGINT else f" by {signal.Signals(number).name}"
    kept = "nothing was begun" if folder is None else _kept(folder)
    return f"interrupted{how}; {kept}; run the same command again to go on"


def _kept(folder: Path) -> str:
    from hwid_cli.files.hdf5_store import count_entries

    return f"{count_entries(folder)} finished results are kept in {folder}"
