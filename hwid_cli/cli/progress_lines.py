"""Progress in a log file: a line at intervals while a stage works.

A terminal shows a bar instead (``hwid_cli/report/progress.py``).
"""

import sys
import threading
from collections.abc import Callable
from types import TracebackType

from hwid_cli.cli.session import Session, Timer
from hwid_cli.report.progress import clock

# A log file gets a line so often, [s].
EVERY_S = 30.0


class ProgressLines:
    """Says at intervals what a session works on, where no terminal shows a bar.

    A thread, because a single task may take much longer than an interval.

    Parameters
    ----------
    about : callable
        What is being done, as text.
    every_s : float, [s]
    """

    def __init__(
        self, session: Session, about: Callable[[], str], *, every_s: float = EVERY_S
    ) -> None:
        self._session, self._about, self._every_s = session, about, every_s
        self._timer, self._is_over = Timer(), threading.Event()
        self._thread = threading.Thread(target=self._tell, daemon=True)
        self._is_shown = not session.is_quiet and not sys.stderr.isatty()

    def __enter__(self) -> "ProgressLines":
        """Begin to wait."""
        if self._is_shown:
            self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Say no more."""
        self._is_over.set()
        if self._is_shown:
            self._thread.join()

    def _tell(self) -> None:
        while not self._is_over.wait(self._every_s):
            passed = clock(self._timer.seconds)
            self._session.note(f"{self._about()}, {passed} passed")
