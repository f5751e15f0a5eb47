"""Being stopped by Ctrl-C, ``kill`` or a terminal that closes: soon, and with one line.

Everything on disk is whole at any moment, so that a process may simply end. It first
tries to unwind, which stops the workers; where that takes too long it ends at once.
"""

import _thread
import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

# As it is now: while a user's own function runs, it is another one.
from os import _exit
from pathlib import Path
from types import FrameType
from typing import Any

import click

Handler = Callable[[int, FrameType | None], None]

# Where a command tells in which folder its finished results are kept.
KEPT_IN = "hwid_cli.kept_in"
# Where a command tells what it works on, with what it has found until then.
WORKS_ON = "hwid_cli.works_on"
# Time to unwind, [s]; the promise is that the process has ended after two seconds.
GRACE_S = 0.8
# After a stop that was lost it is tried again, [s].
_AGAIN_S = 0.01
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


class _Interrupt(KeyboardInterrupt):
    """Unwinds the program; Python takes note of KeyboardInterrupt itself at the end."""


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
    stopping = _Stopping(context)
    before, hook = _listen(stopping.on_signal), sys.unraisablehook
    sys.unraisablehook = stopping.on_lost
    try:
        yield
    except BaseException as error:
        # An interrupted import or solver may end with an error of its own.
        if stopping.signal is None and not isinstance(error, KeyboardInterrupt):
            raise
        stopping.is_said = True
        came: int = stopping.signal or signal.SIGINT
        raise Stopped(came, _sentence(context, came)) from None
    finally:
        is_over = stopping.signal is not None
        for number, handler in before.items():
            # Once stopped there is nothing left to stop but the end of the program.
            signal.signal(number, signal.SIG_IGN if is_over else handler)
        if not is_over:
            sys.unraisablehook = hook


class _Stopping:
    """Which signal came, and what became of it; handlers need a memory."""

    def __init__(self, context: click.Context) -> None:
        self.signal: signal.Signals | None = None
        self.is_said = False
        self._context = context
        self._is_lost = False

    def on_signal(self, number: int, _: FrameType | None) -> None:
        """Unwind the program; end it at a second signal, or when that takes long."""
        if self.signal is not None and not self._is_lost:
            # Somebody is in a hurry.
            self._end()
        if self.signal is None:
            self.signal = signal.Signals(number)
            timer = threading.Timer(GRACE_S, self._end)
            timer.daemon = True
            timer.start()
        self._is_lost = False
        raise _Interrupt

    def on_lost(self, problem: Any) -> None:
        """Unwind once more: Python forgets what is raised while it frees an object."""
        if not issubclass(problem.exc_type, _Interrupt):
            sys.__unraisablehook__(problem)
        elif self.signal is not None and not self._is_lost:
            self._is_lost = True
            # Not from here: what is raised before this function has returned is lost too.
            again = threading.Timer(_AGAIN_S, _thread.interrupt_main, (self.signal,))
            again.daemon = True
            again.start()

    def _end(self) -> None:
        """End the process and its workers without unwinding."""
        number = self.signal or signal.SIGTERM
        with suppress(Exception):
            if not self.is_said:
                sys.stderr.write(f"hwid: {_sentence(self._context, number)}\n")
            sys.stderr.flush()
        for worker in multiprocessing.active_children():
            with suppress(OSError, AttributeError):
                worker.kill()
        _exit(_BY_SIGNAL + number)


def _listen(stop: Handler) -> dict[int, Any]:
    """Install a handler where a signal is not ignored, as it is after ``nohup``."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    # None is a handler that another library has installed in C.
    deaf = (signal.SIG_IGN, None)
    heard = [one for one in numbers if signal.getsignal(one) not in deaf]
    return {number: signal.signal(number, stop) for number in heard}


def _sentence(context: click.Context, number: int) -> str:
    """What is kept, and how to go on."""
    told = context.find_root().meta
    folder, doing = told.get(KEPT_IN), told.get(WORKS_ON)
    how = "" if number == signal.SIGINT else f" by {signal.Signals(number).name}"
    kept = "nothing was begun" if folder is None else _kept(folder)
    came_to = f"; it had come to: {doing}" if doing else ""
    return f"interrupted{how}; {kept}; run the same command again to go on{came_to}"


def _kept(folder: Path) -> str:
    from hwid_cli.store.cache import count_entries

    return f"{count_entries(folder)} finished results are kept in {folder}"
