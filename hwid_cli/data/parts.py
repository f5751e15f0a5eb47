"""Which stretches of a file are recordings of their own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hwid_cli.data.columns import FileColumns, keep_rows, with_each
from hwid_cli.errors import MeasurementError
from hwid_cli.records.experiment import RecordingsOptions


@dataclass(frozen=True)
class FilePart:
    """A stretch of a file that becomes a recording.

    Parameters
    ----------
    name : str
        Of the recording.
    part : str
        Name of the part; empty where the file is taken as a whole.
    first : int, [samples]
    stop : int or None, [samples]
        The sample after the last one; None for the file's end.
    """

    path: Path
    name: str
    part: str
    first: int
    stop: int | None

    @property
    def place(self) -> Path:
        """The file, for messages, with the part where there is one."""
        return Path(f"{self.path} (part {self.part})") if self.part else self.path


def parts_of_files(paths: Sequence[Path], options: RecordingsOptions) -> list[FilePart]:
    """Say which recordings the files of an experiment hold.

    Returns
    -------
    list of FilePart
        File by file; named after the part where there is one file, after file and part
        where there are several.
    """
    if not options.parts:
        last = options.last_sample
        stop = None if last is None else last + 1
        return [
            FilePart(path, path.stem, "", options.first_sample, stop) for path in paths
        ]
    return [
        FilePart(path, part if len(paths) == 1 else f"{path.stem}_{part}", part, *cut)
        for path in paths
        for part, cut in options.parts.items()
    ]


def cut_part(columns: FileColumns, part: FilePart) -> FileColumns:
    """Keep the rows of a part.

    Parameters
    ----------
    columns : FileColumns
        Of the whole file.

    Raises
    ------
    MeasurementError
        If a named part goes beyond the end of the file.
    """
    size = max(columns.input.values.size, columns.output.values.size)
    if part.part and part.stop is not None and part.stop > size:
        raise MeasurementError(
            f"{part.path}: has {size} samples; expected at least {part.stop} for "
            f"recordings.parts.{part.part}; correct that part"
        )
    selection = slice(part.first, part.stop)
    return with_each(columns, lambda column: keep_rows(column, selection))
