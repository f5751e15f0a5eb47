"""Which files of a folder may be measurements, and the columns that they hold."""

from pathlib import Path

from hwid_cli.data.array_files import list_array_columns
from hwid_cli.data.csv_files import list_csv_columns
from hwid_cli.data.formats import READERS
from hwid_cli.data.kinds import PLAN_NAME
from hwid_cli.errors import ConfigError
from hwid_cli.records.starter import FoundColumn, FoundFile

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
            f"({', '.join(READERS)}); correct the path"
        )
    paths = _candidates(folder, "*") or _candidates(folder, "**/*")
    if not paths:
        raise ConfigError(
            f"{folder}: holds no measurement file; expected some of "
            f"{', '.join('*' + ending for ending in READERS)}; put the files there, or "
            "convert them"
        )
    return tuple(_listed(path, folder) for path in paths)


def _candidates(folder: Path, pattern: str) -> list[Path]:
    return sorted(
        path
        for path in folder.glob(pattern)
        if path.suffix.lower() in READERS
        and path.name != PLAN_NAME
        and not path.name.startswith(_SYSTEM_NAMES)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        and path.is_file()
    )


def _listed(path: Path, folder: Path) -> FoundFile:
    name = path.relative_to(folder).as_posix()
    try:
        columns: tuple[FoundColumn, ...] = (
            list_csv_columns(path)
            if path.suffix.lower() == ".csv"
            else list_array_columns(path)
        )
    # The readers of foreign formats raise whatever their parser stumbles on.
    except Exception as error:
        said = " ".join(str(error).split())[:120] or type(error).__name__
        return FoundFile(name, problem=said)
    return FoundFile(name, columns, "" if columns else "no column of numbers")
