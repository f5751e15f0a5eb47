"""An exported model in any of the formats."""

from pathlib import Path

from hwid_cli.errors import ConfigError
from hwid_cli.export.c_drive import drive_source
from hwid_cli.export.c_source import c_source
from hwid_cli.export.fmu import write_fmu
from hwid_cli.export.json_writer import write_json
from hwid_cli.export.mat import write_mat
from hwid_cli.export.names import file_stem
from hwid_cli.files.atomic import replace_file
from hwid_cli.records.exported import Exported, ExportedSimulation


def write_exported(folder: Path, exported: Exported, file_format: str) -> list[Path]:
    """Write a model in one of the formats.

    Parameters
    ----------
    file_format : str
        ``json``, ``mat``, ``c`` or ``fmu``.

    Returns
    -------
    list of Path
        What was written, the model itself last.

    Raises
    ------
    ConfigError
        If the format cannot hold the model, or an FMU has no compiler.
    CacheError
        If a file cannot be written.
    """
    path = folder / f"{file_stem(exported.card.name)}.{file_format}"
    if file_format == "json":
        write_json(path, exported)
    elif file_format == "c":
        replace_file(path, source_of(exported).encode("ascii"))
    elif file_format == "fmu":
        write_fmu(path, exported, source_of(exported))
    elif isinstance(exported, ExportedSimulation):
        raise ConfigError(
            f"--format {file_format}: {exported.card.name} is a physics simulation; "
            "expected json, c or fmu; choose one of them"
        )
    else:
        return [write_mat(path, exported), path]
    return [path]


def source_of(exported: Exported) -> str:
    """Text of the C file of a model.

    Raises
    ------
    ConfigError
        If it holds something that C does not know.
    """
    if isinstance(exported, ExportedSimulation):
        return drive_source(exported)
    return c_source(exported)
