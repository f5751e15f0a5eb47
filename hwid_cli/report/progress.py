"""Progress of a long stage: a bar with rate and time left, nothing without a terminal."""

import sys
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text


class StageProgress:
    """Counts what is done and shows it on a terminal.

    Parameters
    ----------
    total : int, [-]
        Tasks that are to come.
    unit : str
        What one task is, in the plural.
    is_silent : bool
        True never shows anything.

    Attributes
    ----------
    from_cache, computed : int, [-]
        Tasks that were answered from the cache, and others.
    """

    def __init__(self, stage: str, total: int, unit: str, *, is_silent: bool) -> None:
        self.from_cache = 0
        self.computed = 0
        self._computed_before = 0
        console = Console(file=sys.stderr)
        self._is_shown = console.is_terminal and not is_silent
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            _Rate(unit),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
            disable=not self._is_shown,
            transient=True,
        )
        self._task = self._bar.add_task(stage, total=total, computed=0)

    def __enter__(self) -> "StageProgress":
        """Show the bar."""
        if self._is_shown:
            self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Take the bar away."""
        # Stopping a bar that was never shown prints an empty line in some versions.
        if self._is_shown:
            self._bar.stop()

    def begin_round(self, stage: str, total: int) -> None:
        """Start the bar anew for another round of tasks; what was counted stays.

        Parameters
        ----------
        total : int, [-]
            Tasks of this round.
        """
        self._computed_before = self.computed
        # A bar that was never shown has no clock to set back.
        self._bar.reset(
            self._task,
            start=self._is_shown,
            total=total,
            description=stage,
            computed=0,
        )

    def advance(self, *, from_cache: bool) -> None:
        """Count one more task.

        Parameters
        ----------
        from_cache : bool
            Whether nothing had to be computed for it.
        """
        if from_cache:
            self.from_cache += 1
        else:
            self.computed += 1
        in_round = self.computed - self._computed_before
        self._bar.update(self._task, advance=1, computed=in_round)


class _Rate(ProgressColumn):
    """Computed tasks per second."""

    def __init__(self, unit: str) -> None:
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        """Write the rate; empty until there is one."""
        if not task.elapsed or not task.fields["computed"]:
            return Text("")
        return Text(f"{task.fields['computed'] / task.elapsed:.1f} {self._unit}/s")
