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
)
from rich.table import Column
from rich.text import Text

# Short, so that all of it stands in one line of 80 characters.
_BAR = 12
# Columns beside the text, and those of the text that are shown in any case.
_BESIDE, _FEWEST_SHOWN = 40, 24
_MINUTE, _HOUR = 60, 3600


def _as_wide_as_fits(console: Console) -> Column:
    """A column that leaves room for the bar and its counts."""
    return Column(
        no_wrap=True,
        overflow="ellipsis",
        max_width=max(console.width - _BESIDE, _FEWEST_SHOWN),
    )


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
        self._unit = unit
        console = Console(file=sys.stderr)
        self._is_shown = console.is_terminal and not is_silent
        self._bar = Progress(
            TextColumn("{task.description}", table_column=_as_wide_as_fits(console)),
            BarColumn(bar_width=_BAR),
            MofNCompleteColumn(),
            _Rate(unit),
            _Times(),
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

    @property
    def text(self) -> str:
        """What is under way and how much of it is done, in words."""
        (task,) = self._bar.tasks
        done = f": {task.completed:.0f} of {task.total:.0f} {self._unit}"
        return f"{task.description}{done if task.total else ''}"

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


class _Times(ProgressColumn):
    """What has passed and what is left, each with its word."""

    def render(self, task: Task) -> Text:
        """Write both; only what has passed where nobody knows what is left."""
        passed = f"{clock(task.elapsed or 0.0)} passed"
        if task.time_remaining is None or task.finished:
            return Text(passed)
        return Text(f"{passed}, {clock(task.time_remaining)} left")


def clock(seconds: float) -> str:
    """Write a time that runs, with its units.

    Parameters
    ----------
    seconds : float, [s]

    Examples
    --------
    >>> [clock(value) for value in (7.4, 190.0, 7260.0)]
    ['7 s', '3 min 10 s', '2 h 01 min']
    """
    whole = int(seconds)
    if whole < _MINUTE:
        return f"{whole} s"
    if whole < _HOUR:
        return f"{whole // _MINUTE} min {whole % _MINUTE:02d} s"
    return f"{whole // _HOUR} h {whole % _HOUR // _MINUTE:02d} min"
