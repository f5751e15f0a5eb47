"""Loops that a first fit needs later, compiled by a second process while it begins.

Nearly all of a first fit's time is numba's, which compiles one function at a time in each
process. The second process begins with what the fit needs last, and the two meet in the
middle: the fit finds on the disk what the other has left there, and compiles what is not
there yet. The other ends with the fit at the latest, and nothing depends on it.
"""

import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from numba import types

from hwid_cli.compiled import HAS_LOCKS
from hwid_cli.model.derivative_rows import local_sums
from hwid_cli.model.linear_block import block_output
from hwid_cli.model.maps.bends import add_bends, squared_bends_after
from hwid_cli.model.maps.piecewise_linear import (
    columns_of_segments,
    piecewise_linear,
    piecewise_linear_jacobian,
    piecewise_linear_value,
)
from hwid_cli.model.maps.positions import settled_break_points, thinned_break_points
from hwid_cli.model.normal_equations import combined, scaled_equations

# How far the second process stands back, [-]: it only takes what nobody else wants.
_NICER = 19
_FLOAT, _INT, _BOOL = types.float64, types.int64, types.boolean
_VECTOR, _PLACES, _TABLE = _FLOAT[::1], _INT[::1], _FLOAT[:, ::1]
# Parameters of maps are held fixed, and parts of normal equations are views.
_FIXED = types.Array(_FLOAT, 1, "C", readonly=True)
_PART_OF_VECTOR, _PART_OF_TABLE = _FLOAT[:], _FLOAT[:, :]
# A fit with piecewise linear maps calls the first of them while it looks for linear blocks,
# two seconds of compiling after its begin, and the others after all else, the last one
# first: so the two processes are seldom at the same loop.
BESIDE: tuple[tuple[Any, tuple[Any, ...]], ...] = (
    (block_output, (_VECTOR, _VECTOR, _VECTOR, _INT, _VECTOR, _BOOL)),
    (
        piecewise_linear_jacobian,
        (_VECTOR, _FIXED, types.Tuple((_VECTOR, _PLACES)), _BOOL, _TABLE, _INT),
    ),
    (piecewise_linear, (_VECTOR, _FIXED, _FIXED)),
    (combined, (_TABLE, _TABLE, _INT)),
    (columns_of_segments, (_FIXED, _FIXED)),
    (thinned_break_points, (_FIXED, _FIXED, _VECTOR, _INT)),
    (squared_bends_after, (_FIXED, _FIXED, _FIXED, _FIXED)),
    (settled_break_points, (_FIXED, _VECTOR, _FLOAT, _FLOAT)),
    (
        add_bends,
        (_FIXED, _FIXED, _BOOL, _FLOAT, _PART_OF_TABLE, _PART_OF_VECTOR, _INT),
    ),
    (local_sums, (_PLACES, _TABLE, _TABLE, _INT)),
    (piecewise_linear_value, (_VECTOR, _FIXED, _FIXED)),
    (scaled_equations, (_PART_OF_TABLE, _PART_OF_VECTOR, _FLOAT)),
)


@contextmanager
def loops_compiled_beside(kinds: tuple[str, ...]) -> Iterator[None]:
    """Have a second process compile while a fit runs, if it is the first fit.

    Parameters
    ----------
    kinds : tuple of str
        Of the maps that are fitted; others than piecewise linear ones need few loops.
    """
    process = None
    if "piecewise_linear" in kinds and _is_first_fit() and _may_start_another():
        process = _started()
    try:
        yield
    finally:
        if process is not None:
            process.kill()
            process.wait()


@cache
def _is_first_fit() -> bool:
    """Whether the largest of the other process's loops is kept nowhere; asked once in a process."""
    # Without numba's compiler they are plain functions.
    stats = getattr(add_bends, "stats", None)
    return stats is not None and not any(Path(stats.cache_path).glob("*.add_bends-*"))


def _may_start_another() -> bool:
    """Whether a core waits, both may write, and this program is Python itself."""
    is_worker = multiprocessing.parent_process() is not None
    is_python = Path(sys.executable or "").name.startswith("python")
    return HAS_LOCKS and _cores() > 1 and is_python and not is_worker


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _started() -> "subprocess.Popen[bytes] | None":
    """Start the process, which imports from where this one does."""
    folders = os.pathsep.join(os.path.abspath(one) for one in sys.path)  # noqa: PTH100
    # Threads of linear algebra have nothing to do.
    alone = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    nothing = subprocess.DEVNULL
    try:
        return subprocess.Popen(
            [sys.executable, "-P", "-m", __name__],
            stdin=nothing,
            stdout=nothing,
            stderr=nothing,
            env={**os.environ, **alone, "PYTHONPATH": folders},
        )
    except OSError:
        # No process to be had: the fit compiles everything itself.
        return None


def compile_them() -> None:
    """Compile the loops that the fit leaves to this process."""
    for function, signature in BESIDE:
        function.compile(signature)


if __name__ == "__main__":
    # Where no core waits after all, the fit goes first.
    os.nice(_NICER)
    compile_them()
