"""Arrays of an NPZ file."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from zipfile import ZipFile

import numpy as np

from hwid_cli.data.array_columns import Variables, check_size
from hwid_cli.errors import MeasurementError


@contextmanager
def open_npz(path: Path) -> Iterator[Variables]:
    """Open an NPZ file.

    Yields
    ------
    mapping of str to callable
        Each reads its array, as long as the file is open.

    Raises
    ------
    MeasurementError
        If it is no archive.
    ValueError
        If an array is too large, or two have one name.
    """
    # np.load does not close a file that it cannot read.
    with path.open("rb") as file:
        content = np.load(file, allow_pickle=False)
        if not isinstance(content, np.lib.npyio.NpzFile):
            raise MeasurementError(
                f"{path}: holds a single array; expected an archive of named arrays; "
                "save it with numpy.savez"
            )
        names = set()
        for member in ZipFile(file).infolist():
            check_size(member.filename, member.file_size)
            if member.filename in names:
                raise ValueError(f"holds {member.filename!r} twice")
            names.add(member.filename)
        yield {name: partial(content.__getitem__, name) for name in content.files}
