"""Measurement files as raw recordings, or one clear line that says why not."""

import hashlib
import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from hwid_cli.errors import MeasurementError
from hwid_cli.files import recording_checks as checks
from hwid_cli.files.columns import FileColumns, block_means, with_each
from hwid_cli.files.recording_formats import read_columns
from hwid_cli.files.recording_kinds import kind_of, read_plan
from hwid_cli.files.recording_parts import FilePart, cut_part, parts_of_files
from hwid_cli.files.recording_paths import (
    find_files,
    recordings_base,
    recordings_options,
)
from hwid_cli.files.sampling import sample_uniformly
from hwid_cli.records.experiment import (
    CalibrateOptions,
    Experiment,
    RecordingsOptions,
)
from hwid_cli.records.recordings import KINDS, RawRecording

_log = logging.getLogger(__name__)

# Decimal digits of a sample time after thinning: removes 3 * 0.1 = 0.30000000000000004.
_STEP_DIGITS = 12


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
        ``find_files`` and, within a file, of its parts; all with one and the same
        sample time.

    Raises
    ------
    ConfigError, MeasurementError
        One line with file, row, value, expectation and next step.
    """
    options = recordings_options(experiment)
    paths = find_files(experiment, recordings_base(experiment, out))
    parts = parts_of_files(paths, options)
    checks.check_names([(part.path, part.name) for part in parts])
    plans = {folder: read_plan(folder) for folder in {path.parent for path in paths}}
    recordings = []
    for path in paths:
        digest = file_sha256(path)
        columns = read_columns(path, options.columns)
        if file_sha256(path) != digest:
            raise MeasurementError(
                f"{path}: changed while it was read; expected a finished recording; "
                "run again when it is written"
            )
        for part in parts:
            if part.path == path:
                kind = kind_of(path, options.kind, plans[path.parent], name=part.name)
                raw = read_part(part, columns, kind, experiment)
                recordings.append(replace(raw, sha256=digest))
    _warn_of_unused_kinds(recordings, experiment.source, options)
    recordings.sort(key=lambda recording: KINDS.index(recording.kind))
    checks.check_sample_times(recordings, options.sampling_tolerance)
    # Within the tolerance they are the same clock; what follows may rely on it.
    return [
        replace(recording, sample_time_s=recordings[0].sample_time_s)
        for recording in recordings
    ]


def read_part(
    part: FilePart, columns: FileColumns, kind: str, experiment: Experiment
) -> RawRecording:
    """Read and check one recording, apart from what it has in common with others.

    Parameters
    ----------
    part : FilePart
        Stretch of the file.
    columns : FileColumns
        Of the whole file.
    kind : str
    experiment : Experiment

    Returns
    -------
    RawRecording
        Without the hash of its file.

    Raises
    ------
    MeasurementError
        For the first fault.
    """
    options = recordings_options(experiment)
    place = part.place
    columns = cut_part(columns, part)
    checks.check_numbers(place, columns)
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
    return RawRecording(
        name=part.name,
        input=columns.input.values * options.input_scale,
        output=columns.output.values * options.output_scale,
        sample_time_s=float(f"{step * options.average:.{_STEP_DIGITS}g}"),
        kind=kind,
        source=str(part.path),
        input_unit=options.input_unit,
        output_unit=options.output_unit,
        reference=(
            None if reference is None else reference.values * options.output_scale
        ),
    )


def check_unchanged(digests: Mapping[str, str]) -> None:
    """Refuse recordings that are no longer what was read.

    Parameters
    ----------
    digests : mapping of str to str
        SHA-256 by file.

    Raises
    ------
    MeasurementError
        If a file has changed or is gone.
    """
    for name, digest in digests.items():
        if file_sha256(Path(name)) != digest:
            raise MeasurementError(
                f"{name}: changed while this run used it; expected the recording as it "
                "was read at the start; results of this stage are not stored; run again "
                "(what was computed is kept for the earlier recording)"
            )


def file_sha256(path: Path) -> str:
    """Hash of a file's bytes, hexadecimal.

    Parameters
    ----------
    path : Path

    Returns
    -------
    str

    Raises
    ------
    MeasurementError
        If the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise MeasurementError(
            f"{path}: cannot be read ({error.strerror}); expected a recording that "
            "stays where it is during the run; put it back and run again"
        ) from error


def _warn_of_unused_kinds(
    recordings: list[RawRecording], source: str, options: RecordingsOptions
) -> None:
    for kind in options.kind:
        if kind not in {recording.kind for recording in recordings}:
            _log.warning(
                "%s: recordings.kind.%s: %s matches no file; its recipe is not used",
                source,
                kind,
                " or ".join(repr(pattern) for pattern in options.kind[kind]),
            )
