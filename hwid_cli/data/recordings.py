"""Measurement files as raw recordings, or one clear line that says why not.

A command stops at the first fault; ``hwid check`` and ``init`` survey every file.
"""

import hashlib
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from hwid_cli.data import checks
from hwid_cli.data.columns import (
    FileColumns,
    block_means,
    with_each,
)
from hwid_cli.data.formats import output_file_of, read_columns, tables_of
from hwid_cli.data.missing_samples import bridge_missing
from hwid_cli.data.recording_files import (
    FilePart,
    cut_part,
    find_files,
    kind_of,
    parts_of_files,
    parts_of_tables,
    read_plan,
    recordings_base,
    recordings_options,
    unmatched_kinds,
    without_excluded,
)
from hwid_cli.data.sampling import missing_samples, sample_uniformly
from hwid_cli.data.signal_units import (
    converted,
    reference_unit,
    signal_unit,
    time_in_seconds,
)
from hwid_cli.errors import HwidError, MeasurementError
from hwid_cli.records.experiment import (
    CalibrateOptions,
    Columns,
    Experiment,
    RecordingsOptions,
)
from hwid_cli.records.recordings import KINDS, RawRecording

_log = logging.getLogger(__name__)

# Decimal digits of a sample time after thinning: removes 3 * 0.1 = 0.30000000000000004.
_STEP_DIGITS = 12
_SIDES = ("input", "output")
# Hashed at once: most recordings are smaller, and a buffer of their own costs more time.
_HASHED_BYTES = 2**16


def read_recordings(experiment: Experiment, out: Path) -> list[RawRecording]:
    """Read and check all recordings of an experiment.

    Parameters
    ----------
    out : Path
        Folder of the results, where simulated measurements lie.

    Returns
    -------
    list of RawRecording
        Steps first, then sines, random signals and others, each in the order of
        ``find_files`` and, within a file, of its parts; all with one and the same
        sample time.

    Raises
    ------
    ConfigError, MeasurementError
        One line with file, row, value, expectation and next step.
    """
    options = recordings_options(experiment)
    paths = find_files(experiment, recordings_base(experiment, out))
    by_path = _by_path(paths, options)
    parts = [part for path in paths for part in by_path[path]]
    checks.check_names([(part.path, part.name) for part in parts])
    _warn_of_unused_kinds(parts, experiment.source, options)
    plans = {folder: read_plan(folder) for folder in {path.parent for path in paths}}
    recordings = []
    for path in paths:
        digest = recording_sha256(path, options.columns)
        columns = _read_tables(path, by_path[path], options)
        if recording_sha256(path, options.columns) != digest:
            raise MeasurementError(
                f"{path}: changed while it was read; expected a finished recording; "
                "run again when it is written"
            )
        for part in by_path[path]:
            raw = _read_part(part, columns[part.table], plans[path.parent], experiment)
            recordings.append(replace(raw, sha256=digest))
    recordings.sort(key=lambda recording: KINDS.index(recording.kind))
    checks.check_sample_times(recordings, options.sampling_tolerance)
    checks.check_units(recordings)
    # Within the tolerance they are the same clock; what follows may rely on it.
    return [
        replace(recording, sample_time_s=recordings[0].sample_time_s)
        for recording in recordings
    ]


def _by_path(
    names: Mapping[Path, str], options: RecordingsOptions
) -> dict[Path, list[FilePart]]:
    """Recordings of each file; a variable with a star stands for several tables."""
    found: dict[Path, list[FilePart]] = {path: [] for path in names}
    for part in parts_of_files(names, options):
        found[part.path].append(part)
    if "*" in (options.columns.variable or ""):
        is_only = len(names) == 1
        found = {
            path: parts_of_tables(
                parts, tables_of(path, options.columns), is_only_file=is_only
            )
            for path, parts in found.items()
        }
    return {path: without_excluded(parts, options) for path, parts in found.items()}


def _read_tables(
    path: Path, parts: Sequence[FilePart], options: RecordingsOptions
) -> dict[str, FileColumns]:
    """Columns of each table that the recordings of a file are in."""
    wanted = _as_read(options.columns)
    return {
        table: read_columns(path, replace(wanted, variable=table) if table else wanted)
        for table in dict.fromkeys(part.table for part in parts)
    }


def _read_part(
    part: FilePart,
    columns: FileColumns,
    plan: Mapping[str, str],
    experiment: Experiment,
) -> RawRecording:
    """Read and check one recording, apart from what it has in common with others."""
    options = recordings_options(experiment)
    place = part.place
    kind = kind_of(part.path, options.kind, plan, name=part.name)
    columns = cut_part(columns, part)
    columns, bridged = bridge_missing(place, columns)
    checks.check_numbers(place, columns, may_miss=options.resample)
    columns, of_time = time_in_seconds(place, columns, options)
    units = [signal_unit(getattr(columns, side), side, experiment) for side in _SIDES]
    columns, step = sample_uniformly(place, columns, options)
    checks.check_clock(place, step)
    columns = with_each(columns, lambda one: block_means(one, options.average))
    checks.check_equal_lengths(
        place, columns, kind, experiment.calibrate or CalibrateOptions()
    )
    delay = max(experiment.fit.delays, default=0)
    checks.check_length(place, columns, experiment.orders, longest_delay=delay)
    checks.check_excitation(place, columns)
    checks.check_sizes(place, columns, options)
    _log.debug("%s: %s, %d samples", place, kind, columns.input.values.size)
    reference = columns.reference
    if reference is not None:
        reference = converted(
            reference, reference_unit(reference, units[1], experiment)
        )
    return RawRecording(
        name=part.name,
        input=converted(columns.input, units[0]).values * options.input_scale,
        output=converted(columns.output, units[1]).values * options.output_scale,
        sample_time_s=float(f"{step * options.average:.{_STEP_DIGITS}g}"),
        kind=kind,
        source=str(part.path),
        input_unit=units[0].unit,
        output_unit=units[1].unit,
        reference=(
            None if reference is None else reference.values * options.output_scale
        ),
        units=(*of_time, *units),
        bridged_input=_in_means(bridged.get("input", ()), options),
        bridged_output=_in_means(bridged.get("output", ()), options),
    )


def _as_read(columns: Columns) -> Columns:
    """What a simulation gave goes with the input, as a reference does."""
    if columns.simulated is None:
        return columns
    return replace(columns, reference=columns.simulated)


def _in_means(places: tuple[int, ...], options: RecordingsOptions) -> tuple[int, ...]:
    """Samples that bridged ones went into; after resampling nobody can say."""
    if options.resample:
        return ()
    return tuple(sorted({place // options.average for place in places}))


def check_unchanged(digests: Mapping[str, str], columns: Columns) -> None:
    """Refuse recordings that are no longer what was read.

    Parameters
    ----------
    digests : mapping of str to str
        SHA-256 by file.
    columns : Columns
        With the file that the output is in.

    Raises
    ------
    MeasurementError
        If a file has changed or is gone.
    """
    for name, digest in digests.items():
        if recording_sha256(Path(name), columns) != digest:
            raise MeasurementError(
                f"{name}: changed while this run used it; expected the recording as it "
                "was read at the start; results of this stage are not stored; run again "
                "(what was computed is kept for the earlier recording)"
            )


def recording_sha256(path: Path, columns: Columns) -> str:
    """Hash of a recording: that of its file, or of the files of its input and output.

    Raises
    ------
    MeasurementError
        If a file cannot be read.
    """
    digest = file_sha256(path)
    if columns.output_file is None:
        return digest
    other = file_sha256(output_file_of(path, columns.output_file))
    return hashlib.sha256((digest + other).encode()).hexdigest()


def file_sha256(path: Path) -> str:
    """Hash of a file's bytes, hexadecimal.

    Raises
    ------
    MeasurementError
        If the file cannot be read.
    """
    try:
        digest = hashlib.sha256()
        with path.open("rb", buffering=0) as file:
            while block := file.read(_HASHED_BYTES):
                digest.update(block)
        return digest.hexdigest()
    except OSError as error:
        raise MeasurementError(
            f"{path}: cannot be read ({error.strerror}); expected a recording that "
            "stays where it is during the run; put it back and run again"
        ) from error


def _warn_of_unused_kinds(
    parts: Sequence[FilePart], source: str, options: RecordingsOptions
) -> None:
    """Say which patterns are on no recording: those that were meant have another recipe."""
    for kind, pattern in unmatched_kinds(parts, options.kind):
        if any(fnmatchcase(pattern, one) for one in options.exclude):
            # What was left out later is still listed there.
            continue
        _log.warning(
            "%s: recordings.kind.%s: %r matches no recording; expected a pattern on a "
            "recording's name, such as %r",
            source,
            kind,
            pattern,
            parts[0].name,
        )


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
    missing : dict of str to int, [samples]
        Samples that a time column ticks for and the file does not hold, by name.
    sample_times_s : dict of str to float, [s]
        Of all recordings that could be read, those with another clock included, by name.
    """

    recordings: tuple[RawRecording, ...]
    problems: tuple[str, ...]
    unusable: tuple[str, ...] = ()
    jitter: dict[str, float] = field(default_factory=dict)
    missing: dict[str, int] = field(default_factory=dict)
    sample_times_s: dict[str, float] = field(default_factory=dict)


def survey_recordings(experiment: Experiment, out: Path) -> Survey:
    """Read every recording of an experiment, and collect the faults.

    Parameters
    ----------
    out : Path
        Folder of the results, where simulated measurements lie.
    """
    options = recordings_options(experiment)
    problems: list[str] = []
    paths: dict[Path, str] = {}
    by_path: dict[Path, list[FilePart]] = {}
    with _noting(problems):
        paths = find_files(experiment, recordings_base(experiment, out))
    with _noting(problems):
        by_path = _by_path(paths, options)
    parts = [part for path in paths for part in by_path.get(path, [])]
    with _noting(problems):
        checks.check_names([(part.path, part.name) for part in parts])
    if parts:
        _warn_of_unused_kinds(parts, experiment.source, options)
    read: list[RawRecording] = []
    short: list[checks.ShortRecordingError] = []
    jitter: dict[str, float] = {}
    missing: dict[str, int] = {}
    for path, own in by_path.items():
        columns = plan = None
        with _noting(problems):
            columns = _read_tables(path, own, options)
        with _noting(problems):
            plan = read_plan(path.parent)
        if columns is None or plan is None:
            continue
        for part in own:
            with _noting(problems, short):
                table = columns[part.table]
                raw = _read_part(part, table, plan, experiment)
                digest = recording_sha256(path, options.columns)
                read.append(replace(raw, sha256=digest))
                if (time := cut_part(table, part).time) is not None:
                    stamps = time.values[np.isfinite(time.values)]
                    missing[part.name] = missing_samples(stamps)
                    jitter[part.name] = _jitter(stamps, has_gaps=missing[part.name] > 0)
    if short:
        problems.append(checks.short_recordings_line(short))
    common = _of_one_clock(read, experiment, problems)
    common.sort(key=lambda recording: KINDS.index(recording.kind))
    good = {recording.name for recording in common}
    bad = tuple(part.name for part in parts if part.name not in good)
    sample_times_s = {one.name: one.sample_time_s for one in read}
    return Survey(tuple(common), tuple(problems), bad, jitter, missing, sample_times_s)


def _jitter(stamps: np.ndarray, *, has_gaps: bool) -> float:
    """Largest deviation of a step from the median one, as a share of it."""
    steps = np.diff(stamps)
    steps = steps / float(np.median(steps))
    # Over a gap, from so many steps as are in there.
    ticks = np.maximum(np.round(steps), 1.0) if has_gaps else 1.0
    return float(np.max(np.abs(steps - ticks)))


def _of_one_clock(
    read: list[RawRecording], experiment: Experiment, problems: list[str]
) -> list[RawRecording]:
    """Recordings with the usual sample time; each of the others is a fault."""
    if not read:
        return []
    usual, common = checks.usual_clock(read), []
    for one in read:
        with _noting(problems):
            tolerance = recordings_options(experiment).sampling_tolerance
            checks.check_sample_time(one, usual, tolerance)
            checks.check_units([usual, one])
            common.append(replace(one, sample_time_s=usual.sample_time_s))
    return common


@contextmanager
def _noting(
    problems: list[str], short: list[checks.ShortRecordingError] | None = None
) -> Iterator[None]:
    """Note a fault once, and go on behind what raised it; short recordings apart."""
    try:
        yield
    except HwidError as error:
        if short is not None and isinstance(error, checks.ShortRecordingError):
            short.append(error)
            return
        said = " ".join(str(error).split())
        if said not in problems:
            problems.append(said)
