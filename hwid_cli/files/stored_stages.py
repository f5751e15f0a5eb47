"""Which stages have left results: absent ones are told from ones that are damaged."""

from pathlib import Path

import h5py

from hwid_cli.files.seals import unsealed


def has_left_results(path: Path, stage: str) -> bool:
    """Whether a stage has left results, be they readable or not.

    Parameters
    ----------
    path : Path
        ``calibrated.h5`` for ``calibrate``, else ``results.h5``.
    stage : str

    Returns
    -------
    bool
        False only where the file, or the stage in it, is surely absent. A file that
        cannot be opened counts as results: reading them says what is wrong with it.
    """
    if not path.exists():
        return False
    if not path.is_file():
        return True
    try:
        unsealed(path.read_bytes())
        with h5py.File(path, "r") as file:
            return stage == "calibrate" or "format" not in file.attrs or stage in file
    except (KeyError, OSError, RuntimeError, ValueError):
        return True
