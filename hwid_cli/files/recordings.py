"""Measurement files as raw recordings, or one clear line that says why not."""

import glob
import hashlib
import logging
import os
import re
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.files import recording_checks as checks
from hwid_cli.files.columns import FileColumns, block_means, keep_rows
from hwid_cli.files.recording_formats import read_columns
from hwid_cli.files.recording_kinds import PLAN_NAME, kind_of, read_plan
from hwid_cli.files.sampling import sample_uniformly
from hwid_cli.records.experiment import (
    CalibrateOptions,
    Experiment,
    RecordingsOptions,
)
from hwid_cli.records.recordings import KINDS, RawRecording

_log = logging.getLogger(__name__)

REAL_DATA_VARIABLE = "HWID_REALDATA"
# Decimal digits of a sample time after thinning: removes 3 * 0.1 = 0.30000000000000004.
_STEP_DIGITS = 12


def recordings_base(experiment: Experiment, out: Path) -> Path:
    """Say which folder ``recordings.files`` is relative to.

    Parameters
    ----------
    experiment : Experiment
    out : Path
        Folder of the results.

    Returns
    -------
    Path
        ``out`` where the experiment simulates its measurements, else the folder of
        the configuration file.
    """
    return Path(out) if experiment.simulate else Path(experiment.source).parent


def find_files(experiment: Experiment, base: Path) -> list[Path]:
    """Find the files of an experiment's recordings.

    Parameters
    ----------
    experiment : Experiment
    base : Path
        Folder that the patterns are relative to, see ``recordings_base``.

    Returns
    -------
    list of Path
        In natural order (``step_2`` before ``step_10``); ``plan.csv`` and excluded
        files are left out. Empty only where ``recordings.optional`` allows it.

    Raises
    ------
    ConfigError
        If there is no ``recordings:`` section or a path names an unset variable.
    MeasurementError
        If a pattern matches no file or two files give one name.
    """
    options = _options(experiment)
    found: dict[Path, None] = {}
    barren = []
    for pattern in options.files:
        matches = _matches(pattern, experiment, base)
        found.update(dict.fromkeys(matches))
        if not matches:
            barren.append(pattern)
    paths = [path for path in found if not _is_excluded(path, options)]
    if not paths and options.optional:
        return []
    if barren or not paths:
        raise MeasurementError(missing_files_message(experiment, base))
    paths.sort(key=lambda path: (_natural(path.stem), str(path)))
    checks.check_names(paths)
    return paths


def missing_files_message(experiment: Experiment, base: Path) -> str:
    """Say in one line which files were looked for and where to put them.

    Parameters
    ----------
    experiment : Experiment
    base : Path
        As for ``find_files``.

    Returns
    -------
    str
    """
    for pattern in _options(experiment).files:
        if not _matches(pattern, experiment, base):
            break
    else:
        return (
            f"{experiment.source}: recordings.exclude leaves no file; expected at "
            "least one; make its patterns narrower"
        )
    full = os.path.normpath(base.absolute() / _readable(_expand(pattern, experiment)))
    if experiment.simulate:
        step = f"run 'hwid simulate {experiment.source}' first"
    elif REAL_DATA_VARIABLE in pattern:
        step = (
            f"put the data there, or set {REAL_DATA_VARIABLE} to the folder that "
            "holds them"
        )
    else:
        step = "put the files there or correct recordings.files"
    return (
        f"{experiment.source}: recordings.files: no file matches {pattern!r}; "
        f"expected {full}; {step}"
    )


def read_recordings(experiment: Experiment, out: Path) -> list[RawRecording]:
    """Read and check all recordings of an experiment.

    Parameters
    ----------
    experiment : Experiment
    out : Path
        Folder of the results, where simulated measurements lie.

    Returns
    -------
    list of RawRecording
        Steps first, then sines, random signals and others, each in the order of
        ``find_files``; all with one and the same sample time.

    Raises
    ------
    ConfigError, MeasurementError
        One line with file, row, value, expectation and next step.
    """
    options = _options(experiment)
    paths = find_files(experiment, recordings_base(experiment, out))
    plans = {folder: read_plan(folder) for folder in {path.parent for path in paths}}
    recordings = []
    for path in paths:
        kind = kind_of(path, options.kind, plans[path.parent])
        recordings.append(_read_recording(path, kind, experiment))
    for kind in options.kind:
        if kind not in {recording.kind for recording in recordings}:
            _log.warning(
                "%s: recordings.kind.%s: %s matches no file; its recipe is not used",
                experiment.source,
                kind,
                " or ".join(repr(pattern) for pattern in options.kind[kind]),
            )
    recordings.sort(key=lambda recording: KINDS.index(recording.kind))
    checks.check_sample_times(recordings, options.sampling_tolerance)
    # Within the tolerance they are the same clock; what follows may rely on it.
    return [
        replace(recording, sample_time_s=recordings[0].sample_time_s)
        for recording in recordings
    ]


def _read_recording(path: Path, kind: str, experiment: Experiment) -> RawRecording:
    options = _options(experiment)
    columns = read_columns(path, options.columns)
    last = None if options.last_sample is None else options.last_sample + 1
    columns = _select(columns, slice(options.first_sample, last))
    checks.check_numbers(path, columns)
    columns, step = sample_uniformly(path, columns, options)
    columns = _averaged(columns, options.average)
    checks.check_equal_lengths(
        path, columns, kind, experiment.calibrate or CalibrateOptions()
    )
    checks.check_length(path, columns, experiment.orders)
    checks.check_excitation(path, columns)
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    _log.debug("%s: %s, %d samples", path, kind, columns.input.values.size)
    return RawRecording(
        name=path.stem,
        input=columns.input.values * options.input_scale,
        output=columns.output.values * options.output_scale,
        sample_time_s=float(f"{step * options.average:.{_STEP_DIGITS}g}"),
        kind=kind,
        source=str(path),
        sha256=digest,
        input_unit=options.input_unit,
        output_unit=options.output_unit,
    )


def _select(columns: FileColumns, selection: slice) -> FileColumns:
    return FileColumns(
        keep_rows(columns.input, selection),
        keep_rows(columns.output, selection),
        None if columns.time is None else keep_rows(columns.time, selection),
    )


def _averaged(columns: FileColumns, n: int) -> FileColumns:
    return FileColumns(
        block_means(columns.input, n),
        block_means(columns.output, n),
        None if columns.time is None else block_means(columns.time, n),
    )


def _options(experiment: Experiment) -> RecordingsOptions:
    if experiment.recordings is None:
        raise ConfigError(
            f"{experiment.source}: recordings: missing; expected which files hold the "
            "measurements; add the section (configs/README.md explains it)"
        )
    return experiment.recordings


def _matches(pattern: str, experiment: Experiment, base: Path) -> list[Path]:
    """Files that a pattern or a plain name stands for, the plan left out."""
    expanded = _expand(pattern, experiment)
    # Path.glob refuses absolute patterns.
    found = glob.glob(expanded, root_dir=base, recursive=True)  # noqa: PTH207
    plain = _readable(expanded)
    if not found and (base / plain).is_file():
        found = [plain]
    paths = [_short(base / match) for match in found]
    return [path for path in paths if path.is_file() and path.name != PLAN_NAME]


def _is_excluded(path: Path, options: RecordingsOptions) -> bool:
    return any(
        fnmatchcase(path.stem, pattern) or fnmatchcase(path.name, pattern)
        for pattern in options.exclude
    )


def _expand(pattern: str, experiment: Experiment) -> str:
    """Put the values of ``${NAME}`` into a path."""

    def value(match: re.Match[str]) -> str:
        name = match.group(1)
        if name in os.environ:
            return glob.escape(os.environ[name])
        if name == REAL_DATA_VARIABLE:
            project = Path(experiment.source).absolute().parent.parent
            return glob.escape(str(project.parent / "shared" / "realdata"))
        raise ConfigError(
            f"{experiment.source}: recordings.files: {pattern!r} names the environment "
            f"variable {name}, which is not set; set it or write the path out"
        )

    return re.sub(r"\$\{(\w+)\}", value, pattern)


def _readable(pattern: str) -> str:
    """Undo ``glob.escape``, for people to read."""
    return re.sub(r"\[([*?[])\]", r"\1", pattern)


def _short(path: Path) -> Path:
    """Drop ``folder/..`` from a path where it names the same file without."""
    short = Path(os.path.normpath(path))
    return short if short.exists() and short.samefile(path) else path


def _natural(name: str) -> list[tuple[int, int, str]]:
    """Key that sorts numbers in names by value."""
    parts = re.split(r"(\d+)", name)
    return [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in parts if p]
