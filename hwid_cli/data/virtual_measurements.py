"""Virtual measurements as raw files, written as a measuring computer would.

``raw/<name>.csv`` has the columns time, input and output, the shorter ones ending in
blank cells. ``raw/plan.csv`` says how each was made, and ``raw/simulate.json`` which
simulation made which bytes, so that a second run can tell that nothing changed.
"""

import hashlib
import json
import logging
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from hwid_cli import __version__
from hwid_cli.data.recording_files import PLAN_NAME
from hwid_cli.errors import CacheError
from hwid_cli.files.atomic import replace_file
from hwid_cli.files.csv_tables import write_table_csv
from hwid_cli.records.machines import VirtualMeasurement

RAW_FOLDER = "raw"
RAW_COLUMNS = ("time_s", "current_A", "displacement_m")
_MANIFEST_NAME = "simulate.json"
_FORMAT = "hwid-raw"
_SCHEMA_VERSION = 1
# Digits of a time stamp: more than any clock has, fewer than rounding errors show in.
_TIME_DIGITS = 12

_log = logging.getLogger(__name__)


def write_virtual_measurements(
    out: Path,
    measurements: Sequence[VirtualMeasurement],
    plan_rows: Sequence[Mapping[str, Any]] | None = None,
    key: str = "",
) -> list[Path]:
    """Write virtual measurements and their plan below a folder.

    Files of an earlier simulation that this one does not make are removed, unless
    somebody changed them since.

    Parameters
    ----------
    out : Path
        Folder of the results; the files go to ``out/raw``.
    plan_rows : sequence of mapping, optional
        Rows of ``plan.csv`` in the order of the measurements; by default what each
        measurement says in ``plan``. Name and kind are put in front.
    key : str
        Hash of everything that the simulation depends on.

    Returns
    -------
    list of Path
        The measurements' files, in their order.

    Raises
    ------
    CacheError
        If a file cannot be written.
    """
    folder = Path(out) / RAW_FOLDER
    rows = [m.plan for m in measurements] if plan_rows is None else plan_rows
    old_files = _read_manifest(folder).get("files", {})
    paths = []
    for measurement in measurements:
        path = folder / f"{measurement.name}.csv"
        times = [round(time, _TIME_DIGITS) for time in measurement.time_s.tolist()]
        columns = (times, measurement.input.tolist(), measurement.output.tolist())
        write_table_csv(path, RAW_COLUMNS, zip_longest(*columns))
        paths.append(path)
    _write_plan(folder / PLAN_NAME, measurements, rows)
    written = [*paths, folder / PLAN_NAME]
    _remove_left_over(folder, old_files, {path.name for path in written})
    manifest = {
        "format": _FORMAT,
        "schema_version": _SCHEMA_VERSION,
        "created_by": f"hwid {__version__}",
        "key": key,
        "files": {path.name: _sha256(path) for path in written},
    }
    text = json.dumps(manifest, indent=1) + "\n"
    replace_file(folder / _MANIFEST_NAME, text.encode())
    return paths


def read_virtual_key(out: Path) -> str | None:
    """Read which simulation made the files below a folder.

    Parameters
    ----------
    out : Path
        Folder of the results.

    Returns
    -------
    str or None
        None if there are none, or one of them is missing or was changed.
    """
    folder = Path(out) / RAW_FOLDER
    manifest = _read_manifest(folder)
    for name, digest in manifest.get("files", {}).items():
        if _sha256(folder / name) != digest:
            return None
    return manifest.get("key")


def _write_plan(
    path: Path,
    measurements: Sequence[VirtualMeasurement],
    plan_rows: Sequence[Mapping[str, Any]],
) -> None:
    rows = [
        {"name": measurement.name, "kind": measurement.kind, **row}
        for measurement, row in zip(measurements, plan_rows, strict=True)
    ]
    header = list(dict.fromkeys(column for row in rows for column in row))
    write_table_csv(path, header, ([row.get(c) for c in header] for row in rows))


def _read_manifest(folder: Path) -> dict[str, Any]:
    """What an earlier simulation wrote; empty if that cannot be told."""
    try:
        content = json.loads((folder / _MANIFEST_NAME).read_text(encoding="utf-8"))
    except (OSError, RecursionError, ValueError):
        return {}
    is_known = (
        isinstance(content, dict)
        and content.get("format") == _FORMAT
        and content.get("schema_version") == _SCHEMA_VERSION
    )
    files = content.get("files") if is_known else None
    # A file may say anything: only plain names of files lie in this folder.
    if not isinstance(files, dict) or any(name != Path(name).name for name in files):
        return {}
    return content


def _remove_left_over(folder: Path, old_files: Mapping[str, str], kept: set) -> None:
    """Remove what only an earlier simulation made; it would be read as measured."""
    for name, digest in old_files.items():
        path = folder / name
        if name in kept or not path.is_file():
            continue
        if _sha256(path) != digest:
            _log.warning("%s: changed since it was simulated; not removed", path)
            continue
        try:
            path.unlink()
        except OSError as error:
            raise CacheError(
                f"{path}: cannot be removed ({error.strerror}); expected a folder that "
                "may be written; remove the file or choose another folder with --out"
            ) from error


def _sha256(path: Path) -> str | None:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None
