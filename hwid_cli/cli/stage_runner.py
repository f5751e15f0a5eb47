"""How the tasks of a stage or a command run: with its workers, its cache and a progress bar."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import click

from hwid_cli.cli.session import Session, Timer, say_damaged
from hwid_cli.cli.stopping import WORKS_ON
from hwid_cli.report.formats import counted
from hwid_cli.report.progress import StageProgress
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.tasks.runner import RunSettings, TaskDone, run_tasks
from hwid_cli.tasks.task import Task


@dataclass(frozen=True, eq=False)
class StageRunner:
    """Runs the tasks of a stage, or of a command, with the session's workers and cache.

    Parameters
    ----------
    name : str
        Of the stage, for the progress bar and ``--force``.
    parts : list
        What was done so far, filled by the runner.
    bars : list of StageProgress
        Of what is under way, filled by the runner.
    """

    session: Session
    name: str
    parts: list["_Part"] = field(default_factory=list)
    bars: list[StageProgress] = field(default_factory=list)

    @property
    def place(self) -> str:
        """The stage with its place among those of the command."""
        return f"{self.session.place(self.name)} {self.name}".lstrip()

    @property
    def doing(self) -> str:
        """What is under way, in words."""
        return self.bars[-1].text if self.bars else self.place

    @property
    def counted(self) -> str:
        """Tasks of all parts together; empty before any."""
        if not self.parts:
            return ""
        units = {one.unit for one in self.parts}
        whole = _Part(
            units.pop() if len(units) == 1 else "tasks",
            sum(one.from_cache for one in self.parts),
            sum(one.computed for one in self.parts),
        )
        return str(whole)

    @contextmanager
    def tasks(self, total: int, unit: str, *, part: str = "") -> Iterator[RunSettings]:
        """Run tasks of one kind under a progress bar, and sum up at the end.

        Parameters
        ----------
        total : int, [-]
            Tasks.
        unit : str
            What one task is, in the plural.
        part : str
            Which part of the stage, where it has several.
        """
        with self._progress(total, unit, part) as (settings, _):
            yield settings

    @contextmanager
    def rounds(
        self, unit: str
    ) -> Iterator[tuple[RunSettings, Callable[[str, int], None]]]:
        """Run tasks that come in rounds, each with a progress bar.

        Parameters
        ----------
        unit : str
            What one task is, in the plural.

        Yields
        ------
        RunSettings
        callable
            Takes what the next round does and how many tasks it has.
        """
        context = click.get_current_context(silent=True)
        told = {} if context is None else context.find_root().meta
        with self._progress(0, unit, "") as (settings, progress):

            def begin(text: str, total: int) -> None:
                told[WORKS_ON] = text
                progress.begin_round(f"{self.place}: {text}", total)

            yield settings, begin
        # Where it is stopped on the way, that is told.
        told.pop(WORKS_ON, None)

    @contextmanager
    def _progress(
        self, total: int, unit: str, part: str
    ) -> Iterator[tuple[RunSettings, StageProgress]]:
        session, timer = self.session, Timer()
        label = f"{self.name} {part}".rstrip()
        shown = f"{self.place} {part}".rstrip()
        with StageProgress(shown, total, unit, is_silent=session.is_quiet) as progress:

            def on_done(item: TaskDone) -> None:
                progress.advance(from_cache=item.from_cache)

            store = Hdf5Store(session.cache)
            is_forced = self.name in session.forced
            settings = RunSettings(store, session.workers, is_forced, on_done)
            self.bars.append(progress)
            yield settings, progress
            self.bars.pop()
        say_damaged(label, store)
        self.parts.append(_Part(unit, progress.from_cache, progress.computed))
        if part and session.is_verbose:
            session.note(f"{label}: {self.parts[-1]}, {timer}")


@dataclass(frozen=True)
class _Part:
    """Tasks of one kind that a stage has run."""

    unit: str
    from_cache: int
    computed: int

    def __str__(self) -> str:
        stored = counted(self.from_cache, self.unit.removesuffix("s"))
        return f"{stored} from the cache, {self.computed} computed"


class LinearRunner:
    """Runs the fits of linear models with the session's workers and cache.

    Parameters
    ----------
    name : str
        Of the command or stage that asks for them.
    """

    def __init__(self, session: Session, name: str) -> None:
        self._runner = StageRunner(session, name)

    def __call__(self, tasks: Sequence[Task]) -> Sequence[TaskDone]:
        """Run tasks under a progress bar."""
        with self._runner.tasks(len(tasks), "fits", part="linear models") as settings:
            return run_tasks(tasks, settings)

    @property
    def has_computed(self) -> bool:
        """Whether any fit was not in the cache."""
        return any(one.computed for one in self._runner.parts)

    @property
    def counted(self) -> str:
        """Fits of all calls; empty before any."""
        return self._runner.counted
