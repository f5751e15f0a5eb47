"""What columns a MAT, NPZ or HDF5 file offers, before anybody has named one."""

from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from hwid_cli.files.array_columns import (
    Load,
    hdf5_variables,
    mat_variables,
    npz_variables,
)
from hwid_cli.files.rehearsed_reading import rehearse
from hwid_cli.records.starter import FoundColumn


def list_array_columns(path: Path) -> tuple[FoundColumn, ...]:
    """List the columns of numbers in a MAT, NPZ or HDF5 file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    tuple of FoundColumn
        Vectors and single numbers by their names, and columns of tables by number.

    Raises
    ------
    KeyError, OSError, ValueError
        If it cannot be read.
    """
    if h5py.is_hdf5(path):
        rehearse(lambda: _list_hdf5(path))
        return _list_hdf5(path)
    if path.suffix.lower() == ".mat":
        return _list(mat_variables(path))
    with path.open("rb") as file:
        return _list(npz_variables(path, file))


def _list_hdf5(path: Path) -> tuple[FoundColumn, ...]:
    with h5py.File(path, "r") as file:
        is_mat = path.suffix.lower() == ".mat"
        return _list(hdf5_variables(file, is_transposed=is_mat))


def _list(variables: Mapping[str, Load]) -> tuple[FoundColumn, ...]:
    found = []
    for name, load in variables.items():
        values = np.asarray(load())
        if values.dtype.kind not in "fiub" or values.size == 0:
            continue
        vector = np.squeeze(values)
        if vector.ndim <= 1:
            found.append(FoundColumn(name, name, np.atleast_1d(vector).astype(float)))
        elif values.ndim == 2 and values.shape[0] > values.shape[1]:
            found += [
                FoundColumn("", number, values[:, number].astype(float), name)
                for number in range(values.shape[1])
            ]
    return tuple(found)
