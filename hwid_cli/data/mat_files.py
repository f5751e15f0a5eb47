"""Variables of a MAT file of any version."""

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.array_columns import (
    NAMED_MARK,
    TITLE_MARK,
    UNIT_MARK,
    Variables,
    check_size,
    member_of,
    text_of,
)
from hwid_cli.data.hdf5_files import matlab_classes, open_hdf5
from hwid_cli.data.mat_objects import object_variables
from hwid_cli.data.octave_files import is_octave_text, octave_variables

# Elements of a struct array that are looked at: Simulink has one for each signal.
_MOST_ELEMENTS = 1000
# Simulink and ControlDesk name each signal of a structure beside its numbers.
_LABELS = (("values", "label"), ("Data", "Name"))
# An iddata that was saved as a structure says its units and names beside its numbers.
_IDDATA = (
    ("Ts", "TimeUnit", UNIT_MARK),
    ("SamplingInstants", "TimeUnit", UNIT_MARK),
    ("InputData", "InputUnit", UNIT_MARK),
    ("OutputData", "OutputUnit", UNIT_MARK),
    ("InputData", "InputName", TITLE_MARK),
    ("OutputData", "OutputName", TITLE_MARK),
)
# What scipy calls every object.
_UNNAMED = "None"


@contextmanager
def open_mat(path: Path) -> Iterator[Variables]:
    """Open a MAT file.

    Yields
    ------
    mapping of str to callable
        Variables, members of structs included (``run.current``, ``run(2).current``);
        each gives its array.

    Raises
    ------
    ValueError
        If the variables are too large together, or two have one name.
    """
    import h5py
    import scipy.io

    if h5py.is_hdf5(path):
        objects = object_variables(path, matlab_classes(path))
        with open_hdf5(path, is_matlab=True) as variables:
            yield {**variables, **objects}
        return
    if is_octave_text(path):
        plain = octave_variables(path)
        yield {name: partial(plain.get, name) for name in plain}
        return
    with warnings.catch_warnings():
        # Such as two variables of one name: which one was meant?
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", f'Duplicate variable name "{_UNNAMED}"')
        content = scipy.io.loadmat(path)
    check_size("variables", sum(getattr(v, "nbytes", 0) for v in content.values()))
    has_objects = content.pop(_UNNAMED, None) is not None
    objects = object_variables(path, _classes(path) if has_objects else {})
    found: dict[str, Any] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            found.update(_with_members(name, value))
    yield {**{name: partial(found.get, name) for name in found}, **objects}


def _classes(path: Path) -> dict[str, str]:
    """Class of each object of a file of version 7."""
    try:
        from matio import whosmat
    except ImportError:
        return {"an object": "a class of MATLAB"}
    plain = ("double", "single", "logical", "char", "cell", "struct", "int", "uint")
    return {
        name: kind
        for name, (_, kind) in whosmat(str(path)).items()
        if not kind.startswith(plain)
    }


def _with_members(name: str, value: Any) -> dict[str, Any]:
    """A variable, and all that lies inside if it is a struct or an array of them."""
    found = {name: value}
    members = getattr(getattr(value, "dtype", None), "names", None) or ()
    if members and 1 < value.size <= _MOST_ELEMENTS:
        for number, element in enumerate(value.ravel(), 1):
            for member in members:
                place = f"{name}({number}).{member}"
                found.update(_with_members(place, element[member]))
    else:
        for member in members:
            found.update(_with_members(f"{name}.{member}", member_of(value, member)))
    for numbers, words in _LABELS:
        if {numbers, words} <= set(members):
            for key in [one for one in found if one.endswith(f".{numbers}")]:
                label = found.get(key.removesuffix(numbers) + words)
                if label is not None and text_of(label):
                    found[key + TITLE_MARK] = label
            found.update(_by_their_names(name, numbers, found))
    found.update(_experiments_of_iddata(name, found))
    return {**found, **_said_of_iddata(name, found)}


def _by_their_names(
    name: str, numbers: str, found: Mapping[str, Any]
) -> dict[str, Any]:
    """Elements of an array of signals under the names of these, where no two share one.

    The next file of the same layout may hold them in another order.
    """
    ends = f").{numbers}"
    keys = [one for one in found if one.startswith(f"{name}(") and one.endswith(ends)]
    labels = [text_of(found.get(key + TITLE_MARK)) for key in keys]
    named = dict(zip([f"{name}.{label}" for label in labels], keys, strict=True))
    if not all(labels) or len(named) < len(keys) or named.keys() & found.keys():
        return {}
    more: dict[str, Any] = {}
    for called, key in named.items():
        more |= {called: found[key], called + TITLE_MARK: found[key + TITLE_MARK]}
        more[key + NAMED_MARK] = True
        unit = found.get(key.removesuffix(numbers) + "Unit")
        if unit is not None:
            more[called + UNIT_MARK] = unit
    return more


def _experiments_of_iddata(name: str, found: Mapping[str, Any]) -> dict[str, Any]:
    """Several recordings in one iddata, as ``merge`` makes it, each as one of its own."""
    count = len(_cells(found.get(f"{name}.OutputData")))
    if count < 2:
        return {}
    labels = [text_of(one) for one in _cells(found.get(f"{name}.ExperimentName"))]
    if len(set(filter(None, labels))) != count:
        labels = [f"Exp{number + 1}" for number in range(count)]
    parts: dict[str, Any] = {}
    for row, label in enumerate(labels):
        place = f"{name}.{label}"
        for member in dict.fromkeys(one for pair in _IDDATA for one in pair[:2]):
            value = found.get(f"{name}.{member}")
            if len(each := _cells(value)) == count:
                value = each[row]
            if value is not None:
                parts[f"{place}.{member}"] = value
        parts.update(_said_of_iddata(place, parts))
    return parts


def _cells(value: Any) -> list[Any]:
    """What is in an array of cells; nothing where a variable is none."""
    is_array = isinstance(value, np.ndarray) and value.dtype == object
    return list(value.ravel()) if is_array else []


def _said_of_iddata(name: str, found: Mapping[str, Any]) -> dict[str, Any]:
    """Units and names of the numbers of a structure."""
    said = {}
    for numbers, words, mark in _IDDATA:
        label = found.get(f"{name}.{words}")
        if f"{name}.{numbers}" in found and label is not None and text_of(label):
            said[f"{name}.{numbers}{mark}"] = label
    return said
