"""All recordings that can be read, and what is wrong with each of the others.

``read_recordings`` stops at the first fault; here every file is looked at.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from hwid_cli.data import checks
from hwid_cli.data.columns import FileColumns
from hwid_cli.data.formats import read_columns
from hwid_cli.data.kinds import kind_of, read_plan
from hwid_cli.data.parts import FilePart, cut_part, parts_of_files
from hwid_cli.data.paths import find_files, recordings_base, recordings_options
from hwid_cli.data.recordings import file_sha256, read_part
from hwid_cli.errors import HwidError
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.recordings import KINDS, RawRecording

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Survey:
    """What the files of an experiment hold.

    Parameters
    ----------
    recordings : tuple of RawRecording
        Those without a fault, in the order of ``read_recordings``.
    problems : tuple of str
        One line each.
    unusable : tuple of str
        Names of the recordings with a fault.
    jitter : dict of str to float, [-]
        Largest deviation of a step of the time column from the median one, as a share of
        it, by name; without recordings that have no time column.
    """

    recordings: tuple[RawRecording, ...]
    problems: tuple[str, ...]
    unusable: tuple[str, ...] = ()
    jitter: dict[str, float] = field(default_factory=dict)


def survey_recordings(experiment: Experiment, out: Path) -> Survey:
    """Read every recording of an experiment, and collect the faults.

    Parameters
    ----------
    out : Path
        Folder of the results, where simulated measurements lie.
    """
    problems: list[str] = []

    def find() -> list[Path]:
        return find_files(experiment, recordings_base(experiment, out))

    paths = _noting(problems, find) or []
    parts = parts_of_files(paths, recordings_options(experiment)) if paths else []
    _noting(
        problems, lambda: checks.check_names([(part.path, part.name) for part in parts])
    )
    read: list[RawRecording] = []
    jitter: dict[str, float] = {}
    for path in paths:
        own = [part for part in parts if part.path == path]
        read += _read_file(path, own, experiment, (problems, jitter))
    common = _of_one_clock(read, experiment, problems)
    common.sort(key=lambda recording: KINDS.index(recording.kind))
    good = {recording.name for recording in common}
    bad = tuple(part.name for part in parts if part.name not in good)
    return Survey(tuple(common), tuple(problems), bad, jitter)


def _read_file(
    path: Path,
    parts: list[FilePart],
    experiment: Experiment,
    notes: tuple[list[str], dict[str, float]],
) -> list[RawRecording]:
    problems, jitter = notes
    options = recordings_options(experiment)
    columns = _noting(problems, lambda: read_columns(path, options.columns))
    plan = _noting(problems, lambda: read_plan(path.parent))
    if columns is None or plan is None:
        return []
    found = []
    for part in parts:

        def read(part: FilePart = part) -> RawRecording:
            kind = kind_of(path, options.kind, plan, name=part.name)
            raw = read_part(part, columns, kind, experiment)
            return replace(raw, sha256=file_sha256(path))

        one = _noting(problems, read)
        if one is not None:
            found.append(one)
            if columns.time is not None:
                jitter[part.name] = _jitter(cut_part(columns, part))
    return found


def _jitter(columns: FileColumns) -> float:
    stamps = columns.time.values if columns.time is not None else np.zeros(0)
    steps = np.diff(stamps)
    median = float(np.median(steps))
    return float(np.max(np.abs(steps - median))) / median


def _of_one_clock(
    read: list[RawRecording], experiment: Experiment, problems: list[str]
) -> list[RawRecording]:
    """Recordings with the usual sample time; each of the others is a fault."""
    by_step = sorted(read, key=lambda one: one.sample_time_s)
    common = []
    for one in read:
        usual = by_step[len(by_step) // 2]

        def check(pair: list[RawRecording]) -> bool:
            tolerance = recordings_options(experiment).sampling_tolerance
            checks.check_sample_times(pair, tolerance)
            return True

        if _noting(problems, lambda pair=[usual, one]: check(pair)):  # type: ignore[misc]
            common.append(replace(one, sample_time_s=usual.sample_time_s))
    return common


def _noting(problems: list[str], work: Callable[[], Result]) -> Result | None:
    """Result of some work; a fault is noted once, and gives None."""
    try:
        return work()
    except HwidError as error:
        said = " ".join(str(error).split())
        if said not in problems:
            problems.append(said)
        return None
