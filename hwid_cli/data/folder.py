"""A folder of measurements that nobody has described: its files, and how to read them.

For ``hwid init``.
"""

import glob
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from hwid_cli.data.column_roles import (
    TimeGuess,
    guess_signals,
    guess_time,
    long_columns,
    meaning_of,
    unit_of_column,
)
from hwid_cli.data.formats import SUFFIXES, list_columns, reader_of
from hwid_cli.data.recording_files import PLAN_NAME
from hwid_cli.errors import ConfigError, MeasurementError
from hwid_cli.records.starter import FolderLayout, FoundColumn, FoundFile, Role

# What spreadsheets and systems leave beside data.
_SYSTEM_NAMES = ("~$", "._", "Thumbs", "desktop")


def list_measurements(folder: Path) -> tuple[FoundFile, ...]:
    """List the files of a folder that may be measurements, with their columns.

    Parameters
    ----------
    folder : Path
        Its own files, or, where there are none, those of all folders below. Hidden
        files, files of the system and ``plan.csv`` are left out.

    Returns
    -------
    tuple of FoundFile
        By name.

    Raises
    ------
    ConfigError
        If it is no folder, or holds no such file.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ConfigError(
            f"{folder}: is no folder; expected one that holds measurement files "
            f"({', '.join(SUFFIXES)}); correct the path"
        )
    paths = _candidates(folder, "*") or _candidates(folder, "**/*")
    if not paths:
        raise ConfigError(
            f"{folder}: holds no measurement file; expected some of "
            f"{', '.join('*' + ending for ending in SUFFIXES)}; put the files there, or "
            "convert them"
        )
    return tuple(_listed(path, folder) for path in paths)


def _candidates(folder: Path, pattern: str) -> list[Path]:
    return sorted(
        path
        for path in folder.glob(pattern)
        if path.suffix.lower() in SUFFIXES
        and path.name != PLAN_NAME
        and not path.name.startswith(_SYSTEM_NAMES)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and path.is_file()
    )


def _listed(path: Path, folder: Path) -> FoundFile:
    name = path.relative_to(folder).as_posix()
    try:
        columns = list_columns(path)
    # The readers of foreign formats raise whatever their parser stumbles on.
    except Exception as error:
        said = " ".join(str(error).split())[:120] or type(error).__name__
        return FoundFile(name, problem=said)
    return FoundFile(name, columns, "" if columns else "no column of numbers")


# Where nothing tells the time, [s]: wrong, and said to be.
UNKNOWN_SAMPLE_TIME_S = 1.0


def guess_layout(files: Sequence[FoundFile]) -> FolderLayout:
    """Guess how the files of a folder are read.

    Returns
    -------
    FolderLayout
        Of the largest set of files with the same columns.

    Raises
    ------
    MeasurementError
        If no file holds an input and an output.
    """
    alike = _alike(files)
    if not alike:
        first = files[0]
        said = first.problem or "holds no two columns of the same table"
        raise MeasurementError(
            f"{first.name}: {said}; expected a file with an input and an output; "
            "export it again, or write a configuration by hand (configs/README.md)"
        )
    typical = alike[0]
    long_ones = _table(typical)
    scalars = [one for one in typical.columns if one.values.size == 1]
    time = guess_time([*long_ones, *scalars])
    try:
        input_, output, reference, reasons, notes = guess_signals(long_ones)
    except MeasurementError as error:
        raise MeasurementError(
            f"{typical.name}: {error}; name the columns in a configuration by hand "
            "(configs/README.md)"
        ) from error
    keys = [column.place for column in (input_, output)]
    if time.role is not None:
        keys.append((input_.variable, time.role.key))
    alike = [one for one in files if _has(one, keys, alike[0])]
    sample_time_s = time.sample_time_s
    if time.role is None and sample_time_s is None:
        sample_time_s = UNKNOWN_SAMPLE_TIME_S
    return FolderLayout(
        patterns=_patterns(alike, files),
        input=_role(input_, "input", reasons["input"]),
        output=_role(output, "output", reasons["output"]),
        time=time.role,
        reference=(
            None if reference is None else _role(reference, "output", "by its name")
        ),
        variable=input_.variable,
        sample_time_s=sample_time_s,
        clock_reason=time.reason,
        resample=time.resample,
        notes=(*notes, *_notes(alike, files, time)),
    )


def _alike(files: Sequence[FoundFile]) -> list[FoundFile]:
    """The largest set of files with the same columns."""
    sets: dict[tuple[object, ...], list[FoundFile]] = {}
    for one in files:
        table = _table(one)
        if len(table) > 1:
            ending = PurePosixPath(one.name).suffix.lower()
            places = (ending, *(column.place for column in table))
            sets.setdefault(places, []).append(one)
    # The first of the largest ones: names in order make the choice repeatable.
    return max(sets.values(), key=len, default=[])


def _has(
    file: FoundFile, keys: Sequence[tuple[str | None, str | int]], typical: FoundFile
) -> bool:
    """Whether a file has the chosen columns, whatever else it has."""
    ending, usual = (PurePosixPath(one.name).suffix for one in (file, typical))
    places = {column.place for column in long_columns(file.columns)}
    return ending.lower() == usual.lower() and places >= set(keys)


def _table(file: FoundFile) -> list[FoundColumn]:
    """Long columns that belong together: one table, or vectors of one length.

    Columns of a text file may end early and stay together.
    """
    columns = long_columns(file.columns)
    if reader_of(Path(file.name)).is_one_table:
        return columns
    sets: dict[tuple[str | None, int], list[FoundColumn]] = {}
    for one in columns:
        sets.setdefault((one.variable, one.values.size), []).append(one)
    usable = [found for found in sets.values() if len(found) > 1]

    def worth(found: list[FoundColumn]) -> tuple[bool, int]:
        roles = {meaning_of(one.title).role for one in found}
        return {"input", "output"} <= roles, len(found)

    return max(usable, key=worth, default=[])


def _role(column: FoundColumn, side: str, reason: str) -> Role:
    return Role(column.key, column.title, unit_of_column(column, side), reason)


def _patterns(
    alike: Sequence[FoundFile], files: Sequence[FoundFile]
) -> tuple[str, ...]:
    """One pattern where it finds these files and no others, else their names."""
    endings = {PurePosixPath(one.name).suffix for one in alike}
    others = {PurePosixPath(one.name).suffix for one in files if one not in alike}
    if len(alike) > 1 and not endings & others:
        below = "**/" if any("/" in one.name for one in alike) else ""
        return tuple(f"{below}*{ending}" for ending in sorted(endings))
    return tuple(glob.escape(one.name) for one in alike)


def _notes(
    alike: Sequence[FoundFile], files: Sequence[FoundFile], time: TimeGuess
) -> list[str]:
    notes = []
    left = [one for one in files if one not in alike]
    if left:
        shown = ", ".join(
            f"{one.name} ({one.problem or 'other columns'})" for one in left[:5]
        )
        more = f" and {len(left) - 5} more" if len(left) > 5 else ""
        notes.append(f"files left out: {shown}{more}")
    if time.role is None and time.sample_time_s is None:
        notes.append(
            "THE SAMPLE TIME IS NOT KNOWN: 1 s stands for it; correct sample_time_s "
            "before you look at any number in seconds or hertz"
        )
    return notes
