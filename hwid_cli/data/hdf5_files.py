"""Data sets of an HDF5 file, and of MATLAB's version 7.3, which is HDF5.

MATLAB stores every array transposed, which is undone here.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hwid_cli.data.array_columns import (
    TITLE_MARK,
    UNIT_MARK,
    Variables,
    check_size,
)

if TYPE_CHECKING:
    import h5py

_MATLAB_NUMBERS = {
    *(b"double", b"single", b"logical"),
    *(b"int8", b"int16", b"int32", b"int64"),
    *(b"uint8", b"uint16", b"uint32", b"uint64"),
}
_UNIT_ATTRIBUTES = ("unit", "units")
# Attributes by which counts become the quantity whose unit stands beside them: those of
# netCDF, and others that loggers write.
_SCALE_ATTRIBUTES = ("scale_factor", "scale", "gain", "slope", "lsb")
_OFFSET_ATTRIBUTES = ("add_offset", "offset", "intercept")
# Elements of a struct array that are looked at: Simulink has one for each signal.
_MOST_ELEMENTS = 1000


@contextmanager
def open_hdf5(path: Path, *, is_matlab: bool = False) -> Iterator[Variables]:
    """Open an HDF5 file.

    Parameters
    ----------
    is_matlab : bool
        Whether MATLAB wrote it: its names of members have dots.

    Yields
    ------
    mapping of str to callable
        Data sets by their paths; each reads its array, as long as the file is open.
    """
    import h5py

    variables: dict[str, Any] = {}

    def note_settings(name: str, item: Any) -> None:
        for attribute, value in item.attrs.items():
            number = np.asarray(value)
            if number.size == 1 and number.dtype.kind in "fiu":
                key = f"{name}/{attribute}" if name else attribute
                variables[key] = partial(np.float64, number.item())
                variables[key + TITLE_MARK] = partial(np.array, attribute)

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            key = name.replace("/", ".") if is_matlab else name
            if is_matlab and item.dtype == h5py.ref_dtype:
                variables.update(_elements(file, key, item))
                return
            variables[key] = partial(_from_matlab if is_matlab else _values, item)
            for attribute in item.attrs:
                if attribute.lower() in _UNIT_ATTRIBUTES:
                    variables[key + UNIT_MARK] = partial(item.attrs.get, attribute)

    with h5py.File(path, "r", locking=False) as file:
        if not is_matlab:
            note_settings("", file)
            file.visititems(note_settings)
        file.visititems(note)
        yield variables


def matlab_classes(path: Path) -> dict[str, str]:
    """Class of each object that MATLAB stored in a file of version 7.3, by its name."""
    import h5py

    with h5py.File(path, "r", locking=False) as file:
        return {
            name: item.attrs["MATLAB_class"].decode("utf-8", errors="replace")
            for name, item in file.items()
            if "MATLAB_object_decode" in item.attrs and "MATLAB_class" in item.attrs
        }


def _values(dataset: "h5py.Dataset") -> Any:
    if dataset.external or dataset.is_virtual:
        raise ValueError(
            f"{dataset.name!r} takes its values from other files, which is not followed"
        )
    check_size(dataset.name, (dataset.size or 0) * dataset.dtype.itemsize)
    values = dataset[()]
    scale = _attribute(dataset, _SCALE_ATTRIBUTES)
    if scale is None or dataset.dtype.kind not in "iu":
        return values
    # In this order by the convention of netCDF.
    return values * scale + (_attribute(dataset, _OFFSET_ATTRIBUTES) or 0.0)


def _attribute(dataset: "h5py.Dataset", names: tuple[str, ...]) -> float | None:
    """Single number that an attribute of one of these names states."""
    for attribute, value in dataset.attrs.items():
        number = np.asarray(value)
        is_number = number.size == 1 and number.dtype.kind in "fiu"
        if is_number and attribute.lower() in names:
            return float(number.item())
    return None


def _from_matlab(dataset: "h5py.Dataset") -> Any:
    """An array that MATLAB stored: objects and functions are stored as such too."""
    kind = dataset.attrs.get("MATLAB_class", b"double")
    if kind not in _MATLAB_NUMBERS or "MATLAB_object_decode" in dataset.attrs:
        return _characters(dataset) if kind == b"char" else None
    values = _values(dataset)
    if "MATLAB_empty" in dataset.attrs:
        return np.zeros(0)
    return values.T if values.dtype.names is None else values


def _elements(file: "h5py.File", key: str, item: "h5py.Dataset") -> dict[str, Any]:
    """Members of the elements of a struct array, which are stored as references."""
    import h5py

    parent, _, member = key.rpartition(".")
    found: dict[str, Any] = {}
    if not parent or not 1 <= item.size <= _MOST_ELEMENTS:
        return found
    for number, reference in enumerate(np.asarray(item[()]).ravel(), 1):
        element = file[reference] if reference else None
        if isinstance(element, h5py.Dataset) and element.dtype != h5py.ref_dtype:
            place = f"{parent}({number}).{member}" if item.size > 1 else key
            found[place] = partial(_from_matlab, element)
            if member == "values" and f"{parent.replace('.', '/')}/label" in file:
                label = file[f"{parent.replace('.', '/')}/label"]
                found[place + TITLE_MARK] = partial(_label, file, label, number)
    return found


def _label(file: "h5py.File", labels: "h5py.Dataset", number: int) -> Any:
    reference = np.asarray(labels[()]).ravel()[number - 1]
    return _from_matlab(file[reference])


def _characters(dataset: "h5py.Dataset") -> np.ndarray:
    """Text of MATLAB, a number for each character."""
    codes = np.asarray(_values(dataset)).ravel()
    if dataset.dtype.kind != "u" or "MATLAB_empty" in dataset.attrs:
        return np.array("text")
    return np.array("".join(chr(code) for code in codes if code <= 0xFFFF))
