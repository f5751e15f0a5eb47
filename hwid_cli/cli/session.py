"""One run of the program: its experiment, its folders, and who computes."""

import logging
import shutil
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from hwid_cli.cli.options import Choices
from hwid_cli.cli.stopping import KEPT_IN
from hwid_cli.config.load import load_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.files.locks import WRITTEN, claim_folder, share_folder
from hwid_cli.files.plain_files import folders_below, refuse_linked_folders
from hwid_cli.records.experiment import Experiment
from hwid_cli.stages.own_functions import check_own_functions
from hwid_cli.stages.stage import Context
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.tasks.workers import Workers

_log = logging.getLogger(__name__)

# So long a command says nothing of its progress, [s].
_HELD_S = 5.0


@dataclass(frozen=True, eq=False)
class Session:
    """What all stages of one run share.

    Parameters
    ----------
    out : Path
        Folder of the results; exists.
    cache : Path
        Folder of what was computed before.
    forced : tuple of str
        Stages that ignore their cached results.
    arguments : tuple of str
        What a command needs to find the same experiment and folders again.
    timer : Timer
        Runs since the session was opened.
    planned : list of str
        Stages that the command works through, in their order; empty where nobody knows.
    notes : list of str
        How far the work is, as far as nobody was told yet.
    given, results : dict
        What each stage that ran worked on, and what it gave.
    """

    experiment: Experiment
    out: Path
    cache: Path
    workers: Workers
    forced: tuple[str, ...]
    is_quiet: bool
    is_verbose: bool
    arguments: tuple[str, ...]
    timer: "Timer" = field(default_factory=lambda: Timer())
    planned: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    given: dict[str, Any] = field(default_factory=dict)
    results: dict[str, Any] = field(default_factory=dict)

    def say(self, text: str) -> None:
        """Show a result to people, unless they asked for quiet."""
        self.show_notes()
        if not self.is_quiet:
            click.echo(text)

    def note(self, text: str) -> None:
        """Say how far the work is, on stderr, apart from the results.

        Held back for the first seconds: a command that fails at once says one line.
        """
        self.notes.append(text)
        if self.timer.seconds > _HELD_S:
            self.show_notes()

    def show_notes(self) -> None:
        """Show what was held back."""
        # One by one: lines of progress come from a thread of their own, which may be first.
        with suppress(IndexError):
            while True:
                text = self.notes.pop(0)
                if not self.is_quiet:
                    click.echo(text, err=True)

    def plan(self, *stages: str) -> None:
        """Add stages to those that the command works through, each once."""
        self.planned.extend(one for one in stages if one not in self.planned)

    def place(self, name: str) -> str:
        """Place of a stage among those of the command, ``stage 3 of 6``; or nothing."""
        if name not in self.planned:
            return ""
        return f"stage {self.planned.index(name) + 1} of {len(self.planned)}"

    def note_end(self, name: str, text: str, timer: "Timer") -> None:
        """Say that a stage is done, what it did, and how long that took."""
        place = self.place(name)
        self.note(f"{name}: {text}, {timer}{f' ({place})' if place else ''}")


@dataclass(frozen=True)
class Timer:
    """A running clock; as text it is the time since its start, with its unit.

    Parameters
    ----------
    start_s : float, [s]
        Reading of the system's steady clock at the start.
    """

    start_s: float = field(default_factory=time.perf_counter)

    @property
    def seconds(self) -> float:
        """Time since the start, in seconds."""
        return time.perf_counter() - self.start_s

    def __str__(self) -> str:
        return f"{self.seconds:.1f} s"


def context_of(session: Session) -> Context:
    """What stages may know of a session."""
    return Context(
        session.experiment, session.out, session.results, Hdf5Store(session.cache)
    )


def say_damaged(label: str, store: Hdf5Store) -> None:
    """Warn of the entries of a cache that could not be used, in one line.

    Parameters
    ----------
    label : str
        What has asked for them.
    store : Hdf5Store
        As it is when all of them have been asked for.
    """
    if store.unusable:
        _log.warning(
            "%s: %d damaged entries of the cache set aside, computed again "
            "(such as %s)",
            label,
            len(store.unusable),
            store.unusable[0],
        )


def open_session(choices: Choices, *stages: str, is_alone: bool = True) -> Session:
    """Read the configuration and make the folder of the results.

    Parameters
    ----------
    *stages : str
        What ``--force`` computes again.
    is_alone : bool
        Whether no other run may work in the folder meanwhile.

    Raises
    ------
    ConfigError
        If the configuration or the folder cannot be used.
    CacheError
        If another run works in the folder.
    """
    experiment = load_experiment(choices.config)
    check_own_functions(experiment, _say_nothing if choices.quiet else click.echo)
    out = choices.out or Path("results") / experiment.name
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            f"--out {out}: {error.strerror}; expected a folder that can be made and "
            "written; choose another one"
        ) from error
    cache = choices.cache or out / "cache"
    _lock(out, cache, is_alone=is_alone)
    return Session(
        experiment=experiment,
        out=out,
        cache=cache,
        workers=Workers(choices.jobs, choices.backend, choices.scheduler),
        forced=stages if choices.force else (),
        is_quiet=choices.quiet,
        is_verbose=choices.verbose,
        arguments=_arguments(choices),
    )


def _arguments(choices: Choices) -> tuple[str, ...]:
    """The configuration and the folders as they were given."""
    folders = (("--out", choices.out), ("--cache", choices.cache))
    given = [word for option, path in folders if path for word in (option, str(path))]
    return (str(choices.config), *given)


def _lock(out: Path, cache: Path, *, is_alone: bool) -> None:
    """Lock the folders until the command ends, and note where its results are kept."""
    context = click.get_current_context(silent=True)
    refuse_linked_folders(_written(out, cache))
    with ExitStack() as locks:
        if is_alone:
            locks.enter_context(claim_folder(out))
        for folder in (out, cache):
            lock = share_folder(folder)
            if lock is not None:
                locks.enter_context(lock)
        # A session outside of a command is one whose end nobody tells.
        if context is not None:
            context.call_on_close(locks.pop_all().close)
            context.find_root().meta[KEPT_IN] = cache


def _written(out: Path, cache: Path) -> Iterator[Path]:
    """Folders that are written; those that the user names may be links themselves."""
    for name in WRITTEN:
        yield from folders_below(out / name)
    yield out / "cache"
    yield from cache.glob("[0-9a-f][0-9a-f]")


def _say_nothing(_: str) -> None:
    return None


def screen_width() -> int:
    """Characters in a line of the terminal; 80 where there is none.

    Returns
    -------
    int, [characters]
    """
    return shutil.get_terminal_size((80, 24)).columns
