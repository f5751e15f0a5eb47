"""Variables of a text file of Octave, whose ``save`` writes text unless told otherwise.

A variable is a comment with its name, one with its type, some about its size, and the
numbers. Matrices, numbers and ranges are read; members of structs count as variables.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hwid_cli.data.array_columns import check_size

_BEGIN = re.compile(rb"# (?:Created by Octave|name: )")
_ABOUT = re.compile(
    r"#\s*(name|type|rows|columns|ndims|base, limit, increment):?\s*(.*)"
)
_MATRICES = ("matrix", "float matrix", "bool matrix", "diagonal matrix")
_NUMBERS = ("scalar", "float scalar", "bool")
_RANGES = ("range", "double_range", "float_range")


def is_octave_text(path: Path) -> bool:
    """Whether Octave wrote a file as text."""
    with path.open("rb") as file:
        return _BEGIN.match(file.read(32)) is not None


def octave_variables(path: Path) -> dict[str, np.ndarray]:
    """Read matrices, numbers and ranges.

    Raises
    ------
    ValueError
        If the file is too large, two variables have one name, or numbers are missing.
    """
    check_size(path.name, path.stat().st_size)
    found: dict[str, np.ndarray] = {}
    text = path.read_text(encoding="utf-8", errors="replace")
    for name, kind, lines in _blocks(text.splitlines()):
        if kind not in (*_MATRICES, *_NUMBERS, *_RANGES):
            continue
        if name in found:
            raise ValueError(f"holds {name!r} twice")
        rows = [[float(cell) for cell in line.split()] for line in lines]
        values = np.array(rows, dtype=float)
        found[name] = _range(values.ravel()) if kind in _RANGES else values
    return found


def _blocks(lines: list[str]) -> Iterator[tuple[str, str, list[str]]]:
    """Name, type and lines of numbers of each variable."""
    name, kind, numbers = "", "", list[str]()
    for line in lines:
        about = _ABOUT.match(line)
        if about and about[1] == "name":
            if name:
                yield name, kind, numbers
            name, kind, numbers = about[2].strip(), "", []
        elif about and about[1] == "type":
            kind = about[2].strip()
        elif line.strip() and not line.startswith("#"):
            numbers.append(line)
    if name:
        yield name, kind, numbers


def _range(values: np.ndarray) -> np.ndarray:
    """Numbers from a base to a limit in equal steps."""
    base, limit, step = values[:3]
    # The small share keeps a limit that rounding pushed past the last step.
    count = int(np.floor((limit - base) / step * (1 + 1e-12))) + 1
    check_size("a range", 8 * count)
    return np.asarray(base + step * np.arange(count))
