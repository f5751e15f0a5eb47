"""Variables of a MAT file of any version."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from hwid_cli.data.array_columns import Variables, check_size, member_of
from hwid_cli.data.hdf5_files import open_hdf5


@contextmanager
def open_mat(path: Path) -> Iterator[Variables]:
    """Open a MAT file.

    Yields
    ------
    mapping of str to callable
        Variables, members of structs included (``run.current``); each gives its array.

    Raises
    ------
    ValueError
        If the variables are too large together, or two have one name.
    """
    import h5py
    import scipy.io

    if h5py.is_hdf5(path):
        with open_hdf5(path, is_matlab=True) as variables:
            yield variables
        return
    with warnings.catch_warnings():
        # Such as two variables of one name: which one was meant?
        warnings.simplefilter("error")
        content = scipy.io.loadmat(path)
    check_size("variables", sum(getattr(v, "nbytes", 0) for v in content.values()))
    found: dict[str, Any] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            found.update(_with_members(name, value))
    yield {name: partial(found.get, name) for name in found}


def _with_members(name: str, value: Any) -> dict[str, Any]:
    """A variable, and all that lies inside if it is a struct."""
    found = {name: value}
    for member in getattr(getattr(value, "dtype", None), "names", None) or ():
        found.update(_with_members(f"{name}.{member}", member_of(value, member)))
    return found
