"""Which reader serves which kind of measurement file."""

from collections.abc import Callable
from pathlib import Path

from hwid_cli.data.array_files import (
    read_h5_columns,
    read_mat_columns,
    read_npz_columns,
)
from hwid_cli.data.columns import FileColumns
from hwid_cli.data.csv_files import read_csv_columns
from hwid_cli.errors import MeasurementError
from hwid_cli.files.messages import escaped
from hwid_cli.records.experiment import Columns

READERS: dict[str, Callable[[Path, Columns], FileColumns]] = {
    ".csv": read_csv_columns,
    ".mat": read_mat_columns,
    ".npz": read_npz_columns,
    ".h5": read_h5_columns,
}


def read_columns(path: Path, columns: Columns) -> FileColumns:
    """Read the columns of a measurement file by its ending.

    Parameters
    ----------
    columns : Columns
        Where they are in the file.

    Raises
    ------
    MeasurementError
        If the format is unknown, or the file is empty, damaged or lacks a column.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeasurementError(
            f"{path}: has the ending {path.suffix!r}; expected one of "
            f"{', '.join(READERS)}; convert the file or leave it out"
        )
    try:
        if path.stat().st_size == 0:
            raise MeasurementError(
                f"{path}: is empty; expected a measurement; export it again or leave "
                "the file out"
            )
        return reader(path, columns)
    except MeasurementError:
        raise
    except Exception as error:
        # The readers of foreign formats raise whatever their parser stumbles on.
        said = escaped(" ".join(str(error).split())[:120]) or type(error).__name__
        raise MeasurementError(
            f"{path}: cannot be read ({said}); expected a readable {path.suffix} file; "
            "export it again or leave it out"
        ) from error
