"""What a stage is: one record that run, check, report, --force and the commands read.

A stage is a module of this room with one ``STAGE``; ``table.STAGES`` is the only list.
How a stage is brought up to date, whatever it is, is in ``cli/driver.py``: what it needs
first, then its work is chosen, its key compared with that of what is stored, and only
where they differ it computes, stores, and writes its files.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from hwid_cli.records.check import FitCost, StagePlan
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.recordings import CalibrationLog, Recording
from hwid_cli.report.table import Block
from hwid_cli.store.result_files import Provenance, read_stage_key, results_file
from hwid_cli.store.stage_records import read_stage_record, write_stage_record
from hwid_cli.tasks.cache import MemoryStore, Store
from hwid_cli.tasks.runner import RunSettings


@dataclass(frozen=True, eq=False)
class Context:
    """What a stage may know of the run that it is part of.

    Parameters
    ----------
    out : Path
        Folder of the results.
    results : mapping of str to object
        What the stages before it gave, by their names.
    store : Store
        What was computed before.
    """

    experiment: Experiment
    out: Path
    results: Mapping[str, Any]
    store: Store = field(default_factory=MemoryStore)


class Runner(Protocol):
    """Runs tasks under a progress bar; whoever has one decides where they run."""

    def tasks(
        self, total: int, unit: str, *, part: str = ""
    ) -> AbstractContextManager[RunSettings]:
        """Run so many tasks of one kind; unit is what one is, in the plural."""

    def rounds(
        self, unit: str
    ) -> AbstractContextManager[tuple[RunSettings, Callable[[str, int], None]]]:
        """Run tasks that come in rounds; the callable begins one, with its number."""


@dataclass(frozen=True, eq=False)
class Storage:
    """How the results of a stage lie on disk.

    Parameters
    ----------
    file : str
        Below the folder of the results.
    key : callable
        From the folder of the results to the key of what is stored, None without it.
    read : callable
        From the path of the file to the results.
    write : callable
        Takes the path, what was chosen, the results and where they come from.
    is_hdf5 : bool
        Whether where they come from is stored beside them.
    """

    file: str
    key: Callable[[Path], str | None]
    read: Callable[[Path], Any]
    write: Callable[[Path, Any, Any, Provenance], None]
    is_hdf5: bool = True


def in_results(
    stage: str,
    read: Callable[[Path], Any],
    write: Callable[[Path, Any, Any, Provenance], None],
) -> Storage:
    """Storage as the results of most stages have it: in HDF5, beside their key."""
    return Storage(results_file(stage), partial(_stored_key, stage), read, write)


def as_record(stage: str, record_type: type) -> Storage:
    """Storage of a stage whose results are one record."""
    return in_results(
        stage,
        lambda path: read_stage_record(path, stage, record_type),
        lambda path, given, result, origin: write_stage_record(
            path, stage, result, origin
        ),
    )


def _stored_key(stage: str, out: Path) -> str | None:
    return read_stage_key(out / results_file(stage), stage)


@dataclass(frozen=True, eq=False)
class Planning:
    """What ``hwid check`` knows when it asks a stage what it would do.

    Parameters
    ----------
    recordings : tuple of Recording
        Calibrated; at least one.
    store : Store
        What was computed before.
    workers : int, [-]
        Processes that share the work.
    logs : tuple of CalibrationLog
        In the order of the recordings.
    reading_seconds : float, [s]
        What it took to read and calibrate them.
    may_time : bool
        Whether a stage may run some of its work to time it.
    """

    experiment: Experiment
    recordings: tuple[Recording, ...]
    cost: FitCost
    store: Store
    workers: int = 1
    logs: tuple[CalibrationLog, ...] = ()
    reading_seconds: float = 0.0
    may_time: bool = False


def _nothing(*_: Any) -> tuple[Any, ...]:
    return ()


def _write_nothing(*_: Any) -> None:
    return None


def _require_nothing(_: Experiment) -> None:
    return None


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage of an experiment.

    Parameters
    ----------
    name : str
        The command, the section of the configuration, the group in ``results.h5``.
    needs : tuple of str
        Stages that must have run.
    needs_where_named : tuple of str
        Stages that must have run where the configuration has their section.
    needs_for : callable
        From an ``Experiment`` to more stages that must have run, for what it asks.
    sections : tuple of str
        Sections of the configuration that its results depend on, besides those of the
        stages before it.
    choose : callable
        From a ``Context`` to what the stage works on: a record with ``recordings``.
        Refuses a configuration that asks for what cannot be.
    require : callable
        Refuses an ``Experiment`` without what the stage needs, before anything runs.
    key : callable or None
        From what was chosen to the key of the results; None where they are not stored.
    compute : callable
        From what was chosen and a ``Runner`` to the results.
    storage : Storage or None
    summary : callable
        From what was chosen, the results and whether they were stored, to what is said
        at the end; empty where the runner has said it.
    write_files : callable
        Writes the tables and figures beside the stored results: takes the folder, what
        was chosen, the results, where they come from (None where they are not stored)
        and whether they are new.
    tables : callable
        From a ``Context`` and the results to the tables and paragraphs that the screen
        shows.
    is_shown_in_run : bool
        Whether ``hwid run`` shows them too.
    shows_before : tuple of str
        Stages whose tables the command shows above its own.
    files : tuple of str
        What it writes, for the last line on the screen; those that are there are named.
    warnings : callable
        From a ``Context`` and what was chosen to sentences for people.
    plan : callable
        From a ``Planning`` to what the stage would do, for ``hwid check``.
    """

    name: str
    choose: Callable[[Context], Any]
    compute: Callable[[Any, Runner], Any]
    key: Callable[[Any], str] | None = None
    storage: Storage | None = None
    needs: tuple[str, ...] = ()
    needs_where_named: tuple[str, ...] = ()
    needs_for: Callable[[Experiment], tuple[str, ...]] = _nothing
    sections: tuple[str, ...] = ()
    summary: Callable[[Any, Any, bool], str] = lambda given, result, is_stored: ""
    write_files: Callable[[Path, Any, Any, Provenance | None, bool], None] = (
        _write_nothing
    )
    tables: Callable[[Context, Any], Sequence[Block]] = _nothing
    is_shown_in_run: bool = True
    shows_before: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    warnings: Callable[[Context, Any], Sequence[str]] = _nothing
    require: Callable[[Experiment], Any] = _require_nothing
    plan: Callable[[Planning], Sequence[StagePlan]] = _nothing
