"""Damaged files, and a process of its own that reads them.

``python -m tests.bad_input.fuzz KINDS SEED FIRST LAST FOLDER`` reads damaged file after
damaged file, of one kind after the other (``csv,mat``), under limits of memory and
time, and says what came of each. What kills
that process (the reader of HDF5 is C) is counted by the process that started it.
"""

import io
import resource
import signal
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
import scipy.io

from hwid_cli.config.load import load_experiment
from hwid_cli.data.formats import read_columns
from hwid_cli.errors import HwidError
from hwid_cli.records.experiment import Columns
from tests.bad_input.foreign_cases import WRITERS
from tests.bad_input.trial import csv_text, signals

PROJECT = Path(__file__).parents[2]
COLUMNS = Columns(input="u", output="y", time="t")
MOST_MEMORY = 3 << 30
# The process that reads foreign files has 20 of its own.
MOST_SECONDS = 30


def seeds(kind: str) -> list[bytes]:
    """Valid files that are damaged."""
    own = {"csv": _csv, "yaml": _yaml, "npz": _npz, "mat": _mat, "h5": _hdf5}
    return own[kind]() if kind in own else _foreign(kind)


def _foreign(kind):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"run.{kind}"
        WRITERS[path.suffix](path)
        return [path.read_bytes()]


def _csv():
    text = csv_text()
    decimal = text.replace(",", ";").replace(".", ",")
    return [text.encode(), decimal.encode(), text.encode("utf-16")]


def _yaml():
    return [path.read_bytes() for path in sorted((PROJECT / "configs").glob("*.yaml"))]


def _arrays():
    return dict(zip("tuy", signals(), strict=True))


def _npz():
    files = []
    for save in (np.savez, np.savez_compressed):
        file = io.BytesIO()
        save(file, **_arrays())
        files.append(file.getvalue())
    return files


def _mat():
    files = []
    nested = {"run": {"t": 1.0, "cells": np.array(["a", "b"], dtype=object)}}
    for content, options in (
        (_arrays(), {}),
        (_arrays(), {"format": "4"}),
        (_arrays(), {"do_compression": True}),
        ({**_arrays(), **nested}, {}),
    ):
        file = io.BytesIO()
        scipy.io.savemat(file, content, **options)
        files.append(file.getvalue())
    return files


def _hdf5():
    files = []
    for options in (
        {},
        {"chunks": (16,), "compression": "gzip", "shuffle": True},
        {"chunks": (16,), "fletcher32": True, "maxshape": (None,)},
    ):
        for version in ("earliest", "latest"):
            file = io.BytesIO()
            with h5py.File(file, "w", libver=version) as tree:
                tree.attrs["note"] = "a file"
                for name, values in _arrays().items():
                    tree.create_dataset(name, data=values, **options)
                tree.create_group("more/below")["words"] = ["a", "b"]
            files.append(file.getvalue())
    return files


def damage(content: bytes, rng: np.random.Generator) -> bytes:
    """The same file with one to six places spoilt."""
    spoilt = bytearray(content)
    for _ in range(rng.integers(1, 7)):
        at = int(rng.integers(0, max(len(spoilt), 1)))
        size = int(rng.choice([1, 2, 4, 8, 64]))
        kind = rng.integers(0, 7)
        if kind == 0 and spoilt:
            spoilt[at] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            spoilt[at : at + size] = rng.bytes(size)
        elif kind == 2:
            fill = b"\xff" if rng.integers(0, 2) else b"\0"
            spoilt[at : at + size] = fill * size
        elif kind == 3:
            del spoilt[at : at + size]
        elif kind == 4:
            spoilt[at:at] = spoilt[at // 2 : at // 2 + size]
        elif kind == 5:
            spoilt[at : at + 8] = (1 << int(rng.integers(0, 64))).to_bytes(8, "little")
        elif rng.integers(0, 4) == 0:
            del spoilt[at:]
    return bytes(spoilt)


def read(kind: str, path: Path) -> str:
    """What reading a file comes to: ``read``, ``refused``, or what broke."""
    try:
        if kind == "yaml":
            load_experiment(path)
        else:
            read_columns(path, COLUMNS)
    except HwidError as error:
        return "refused" if "\n" not in str(error) else "broke: two lines"
    except BaseException as error:  # noqa: BLE001, RUF100
        return f"broke: {type(error).__name__}: {error}".replace("\n", " ")
    return "read"


def main(kinds: str, seed: int, first: int, last: int, folder: Path) -> None:
    """Read damaged files number first to last - 1."""
    warnings.simplefilter("error")
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    valid = {kind: seeds(kind) for kind in kinds.split(",")}
    for number in range(first, last):
        turn, place = divmod(number, len(valid))
        kind = list(valid)[place]
        path = folder / f"run.{kind}"
        rng = np.random.default_rng([seed, turn])
        path.write_bytes(damage(valid[kind][turn % len(valid[kind])], rng))
        # Nobody handles it: the process ends, also inside of a library.
        signal.alarm(MOST_SECONDS)
        print(f"{kind}:{turn} {read(kind, path)}", flush=True)  # noqa: T201
        signal.alarm(0)


def tried(kinds: str, seed: int, count: int, folder: Path) -> tuple[Counter, list[str]]:
    """How many damaged files were read and refused, and what broke."""
    outcomes: Counter = Counter()
    broken = []
    first = 0
    while first < count:
        arguments = [kinds, str(seed), str(first), str(count), str(folder)]
        command = [sys.executable, "-m", "tests.bad_input.fuzz", *arguments]
        done = subprocess.run(
            command, cwd=PROJECT, capture_output=True, text=True, check=False
        )
        lines = done.stdout.splitlines()
        for line in lines:
            what = line.partition(" ")[2]
            outcomes[what.partition(":")[0]] += 1
            if what.startswith("broke"):
                broken.append(line)
        first += len(lines)
        if done.returncode != 0:
            assert done.returncode < 0, done.stderr
            outcomes["died"] += 1
            turn, place = divmod(first, len(kinds.split(",")))
            name = f"{kinds.split(',')[place]}:{turn}"
            broken.append(f"{name} died of signal {-done.returncode}")
            first += 1
    return outcomes, broken


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]), Path(sys.argv[5]))
